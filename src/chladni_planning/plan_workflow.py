"""Where to put sensors and shakers, and which lines to measure."""

from dataclasses import replace
from pathlib import Path

from chladni.case import Case
from chladni.parallel import one_blas_thread
from chladni.progress import Progress, silent
from chladni.units import Units
from chladni.workflows.loaded_model import DeckModels, Model, as_model

from .whole_plan import Plan, PlanSettings, plan_test


@one_blas_thread()
def plan(
    source: Case | Model | DeckModels | str | Path,
    settings: PlanSettings | None = None,
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> Plan:
    """Place sensors by effective independence and exchange; choose shaker, cords and lines.

    Parameters
    ----------
    source : a model, a case, or the path of a deck or case
    settings : how many sensors, modes, shakers, ...; default 30 sensors
    units : of a deck given by its path

    Raises
    ------
    FileError, ModelError
        If there is no such file, the deck is wrong, or it has too few places for the sensors.
    """
    model = as_model(source, "plan", units)
    built, settings = model.structure, settings or PlanSettings()
    found = plan_test(model.assembly, settings, built=built, unit=model.unit, progress=progress)
    return replace(found, origin=model)
