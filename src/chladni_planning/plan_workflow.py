"""Where to put sensors and shakers, and which lines to measure."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from chladni.arguments import checked, settings_of
from chladni.case import Case
from chladni.parallel import one_blas_thread
from chladni.progress import Progress, silent
from chladni.units import Units
from chladni.workflows.given_case import Source
from chladni.workflows.loaded_model import DeckModels, Model, model_in_si, opened
from chladni.workflows.place_words import stated_places

from .separated_plan import separated_plan
from .whole_plan import Plan, PlanSettings, plan_test


@checked
@one_blas_thread()
def plan(
    source: Source,
    settings: PlanSettings | None = None,
    *,
    units: str | Units | None = None,
    allow: Sequence[str] = (),
    progress: Progress = silent,
    **words: Any,
) -> Plan:
    """Place sensors by effective independence and exchange; choose shaker, cords and lines.

    Parameters
    ----------
    source : a model, a case, an Assembly, or the path of a deck or case
    settings : how many sensors, modes, shakers, ...; default 30 sensors
    units : of a deck given by its path; without it the system that its materials show, which a
        note of the plan names
    allow : cards of the deck at a path to leave out although they carry stiffness
    words : fields of :class:`PlanSettings` by name, as ``sensors=20``

    Raises
    ------
    ArgumentError, FileError, LabelError, ModelError
        If there is no such file or setting, the deck is wrong, several unit systems fit it, or it
        has too few places for the sensors.
    """
    found = opened(source, units, allow)
    chosen = with_places_of(found, settings_of(PlanSettings, settings, words))
    model, said = model_in_si(found, "plan")
    built, unit = model.structure, model.unit

    def planned(settings: PlanSettings, stage: Progress) -> Plan:
        return plan_test(model.assembly, settings, built=built, unit=unit, progress=stage)

    if chosen.separate:
        made = separated_plan(model, chosen, planned, progress)
    else:
        made = planned(chosen, progress)
    return replace(made, origin=model, notes=(said,) if said else ())


def with_places_of(source: Case | Model | DeckModels, settings: PlanSettings) -> PlanSettings:
    """Settings with the places that [plan] of a case states, where they state none."""
    if not isinstance(source, Case):
        return settings
    stated = {n: words for n, words in stated_places(source).items() if not getattr(settings, n)}
    return settings_of(PlanSettings, settings, stated)
