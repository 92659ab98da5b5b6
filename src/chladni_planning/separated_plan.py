"""Plans whose sensors tell explanations apart: some serve for that, the others see the modes."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from chladni.errors import FileError, ShapeError
from chladni.progress import Progress, within
from chladni.search.next_measurement import (
    ADVISED,
    FILE,
    FurtherPlaces,
    Outlook,
    outcomes,
    read_outlook,
)
from chladni.workflows.before_any_test import PlannedTests, before_any_test
from chladni.workflows.loaded_model import Model
from chladni.workflows.place_words import (
    SAME_PLACE,
    PlaceRules,
    allowed_places,
    labels_not_allowed,
)

from .layouts.separation import separating_layout
from .plan_summary import durations
from .whole_plan import Plan, PlanSettings, Separation

Planned = Callable[[PlanSettings, Progress], Plan]


def separated_plan(
    model: Model, settings: PlanSettings, planned: Planned, progress: Progress
) -> Plan:
    """Plan with sensors that tell the explanations of the settings apart.

    Parameters
    ----------
    planned : makes the plan of some settings
    """
    rules = settings.rules(model.assembly, model.seen)
    left, folder = settings.sensors - len(rules.fixed.labels), _folder(settings.separate)
    if folder is not None:
        known = _of_diagnosis(model, rules, folder)
        separation = Separation(known.names, str(folder))
        return _with_sensors([known], separation, settings, min(ADVISED, left), planned, progress)
    names = effects_named(settings.separate)
    if len(names) < 2:
        raise FileError(
            f"--separate {', '.join(names)}: this is no folder of a diagnosis; give one, or two "
            "and more effects, as weld-missing,adhesive-stiffness"
        )
    most = min(ADVISED, left - (left > 1))
    n = max(1, settings.sensors - most)
    fewer = replace(settings, sensors=n, modes=settings.modes and min(settings.modes, n))
    first = planned(fewer, within(progress, 0.0, 0.3))
    before = _tested(model, names, first, within(progress, 0.3, 0.6))
    separation = Separation(names, before=before)
    if not before.unsettled:
        made = planned(settings, within(progress, 0.6, 1.0))
        return replace(made, separation=separation)
    outlooks = before.outlooks(("sensor",))
    stage = within(progress, 0.6, 0.8)
    made = _with_sensors(outlooks, separation, settings, most, planned, stage)
    assert made.separation is not None
    after = _tested(model, names, made, within(progress, 0.8, 1.0))
    return replace(made, separation=replace(made.separation, after=after))


def effects_named(separate: str | Path | Sequence[str]) -> tuple[str, ...]:
    """Names of effects in a list, or in a text with commas.

    >>> effects_named("crack, point-mass")
    ('crack', 'point-mass')
    """
    each = str(separate).split(",") if isinstance(separate, str | Path) else separate
    return tuple(dict.fromkeys(word.strip() for word in each if word.strip()))


def _folder(separate: str | Path | Sequence[str]) -> Path | None:
    """The folder of a diagnosis; None for effects."""
    if not isinstance(separate, str | Path) or not Path(separate).is_dir():
        return None
    return Path(separate)


def _of_diagnosis(model: Model, rules: PlaceRules, folder: Path) -> Outlook:
    """Sensors at allowed places as candidates, under the open explanations of a diagnosis."""
    known = read_outlook(folder)
    if known.unknown is not None:
        raise FileError(f"{folder}: nothing is tied there, so no sensor can separate anything")
    sensors = known.without(("drive", "mass", "band", "weighing"))
    for c in sensors.candidates:
        id = c.label.partition(":")[0]
        here = model.assembly.points[model.assembly.ids == (int(id) if id.isdecimal() else -1)]
        there = len(here) and np.allclose(here, c.point_m or np.nan, atol=SAME_PLACE)
        if not there:
            raise FileError(
                f"{folder} is a diagnosis of another mesh than {model.source}, which has no grid "
                f"at the place of its {c.label}"
            )
    labels = [c.label for c in sensors.candidates]
    if not (found := sensors.without(labels_not_allowed(model.assembly, rules, labels))).seen:
        raise FileError(f"{folder / FILE}: none of its sensors is at an allowed place")
    return found


def _with_sensors(
    outlooks: Sequence[Outlook], separation: Separation, settings: PlanSettings, most: int,
    planned: Planned, progress: Progress,
) -> Plan:  # fmt: skip
    """Plan with at most so many sensors that separate among those for modes."""
    if most < 1:
        raise ShapeError(f"all {settings.sensors} sensors are fixed: none is left to separate")
    kept, apart = separating_layout(outlooks, most, spacing=settings.spacing)
    steps = outcomes(outlooks, kept)
    labels = tuple(m.label for m in steps)
    made = planned(replace(settings, fixed=(*settings.fixed, *labels)), progress)
    return replace(
        made, settings=replace(made.settings, fixed=settings.fixed),
        separation=replace(separation, labels=labels, apart=apart, steps=steps),
    )  # fmt: skip


def _tested(model: Model, names: Sequence[str], made: Plan, progress: Progress) -> PlannedTests:
    """Articles with each effect, tested on a plan; further sensors are at places of the plan."""
    at = made.places
    further = allowed_places(model.assembly, made.rules)
    if at.is_grid.any():
        own = at.is_grid & (at.fixed == "")
        further = FurtherPlaces(at.ids[own], at.cost[own], further.fixed.first(0))
    top = durations(made).band_hz[1]
    return before_any_test(model, names, made, top=top, further=further, progress=progress)
