"""Problems of an environment from a case folder or deck."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from chladni.arguments import settings_of
from chladni.case import Case, load_case
from chladni.effects.effect import Effect, Parameter
from chladni.errors import FileError, ShapeError
from chladni.inference.likelihood import Responses
from chladni.reduced.reduced_model import State, evaluate
from chladni.search.next_measurement import Outlook, with_common_candidates
from chladni.workflows.before_any_test import before_any_test
from chladni.workflows.given_case import Source
from chladni.workflows.loaded_model import is_case, model_in_si, opened
from chladni.workflows.place_words import allowed_places
from chladni.workflows.question_of_case import prepared
from chladni_planning import (
    Linearised,
    PlanSettings,
    find_sensor_candidates,
    motion,
    mounts_at,
    openings,
    plan,
    seen_at,
    target_modes,
    with_places_of,
)

from .calibration_questions import CalibrationQuestion
from .catalogue_choices import CatalogueChoices, catalogue_choices
from .small_specimens import ModalSpecimen

REACH = 2.0  # bounds of a calibration environment, in prior standard deviations


def specimen(
    case: Source, modes: int, *, candidates: int = 300, units: str | None = None, **places: Any
) -> ModalSpecimen:
    """Flat, reachable places found on the mesh and the first flexible modes along their normals.

    The choice of a shaker place also needs two properties, which are included.  They are a free
    line to the place and the clearances of the mesh (:mod:`chladni_planning.rattle`).

    Parameters
    ----------
    case : folder with a case.toml, that file, a bare deck, a loaded model or an Assembly
    modes : int          target modes, fewer if the model has fewer
    candidates : int     largest number of places
    units : str          unit system of a bare deck; default the one that its materials show, which
                         the notes name
    places : ``regions``, ``fixed``, ``forbidden``, ``cost`` of :class:`PlanSettings`; without them
             those of [plan] of the case
    """
    given = opened(case, units)
    settings = with_places_of(given, settings_of(PlanSettings, PlanSettings(modes=modes), places))
    model, said = model_in_si(given, "plan")
    rules = settings.rules(model.assembly, model.seen)
    found = find_sensor_candidates(model.assembly, candidates, unit=model.unit, rules=rules)
    target, _, _ = target_modes(model.structure, settings)
    mounts, moving = mounts_at(found), motion(model.structure, target)
    labels, seen = mounts.labels[: len(found)], model.seen
    gaps = openings(model.assembly, moving)
    return ModalSpecimen(
        found.points,
        seen_at(found, mounts, moving)[: len(found)],
        target.frequency,
        target.damping,
        labels,
        outline=seen.points[seen.outline()],
        access=found.straight,
        gap_shapes=gaps.motion,
        clearance=gaps.clearance,
        fixed=found.fixed != "",
        cost=found.cost,
        notes=(said, *model.notes) if said else model.notes,
    )


def outlooks(
    case: Source,
    effects: tuple[str, ...],
    *,
    sensors: Any = None,
    units: str | None = None,
    regions: Sequence[str] = (),
    fixed: Sequence[str] = (),
    forbidden: Sequence[str] = (),
    **words: Any,
) -> tuple[Outlook, ...]:
    """Outlooks of a planned test, with candidates at allowed places.

    Parameters
    ----------
    sensors : number, plan or file of the planned test; default those of the case
    words : of :func:`chladni.workflows.before_any_test.before_any_test`
    """
    given = opened(case, units)
    places = PlanSettings(regions=regions, fixed=fixed, forbidden=forbidden, draws=0)
    settings = with_places_of(given, places)
    model, _ = model_in_si(given, "next")
    if isinstance(sensors, int):
        modes = max(1, 4 * sensors // 5)
        sensors = plan(model, replace(settings, sensors=sensors, modes=modes))
    elif isinstance(sensors, str):
        sensors = Path(sensors)
    source = given if isinstance(given, Case) else model
    rules = settings.rules(model.assembly, model.seen)
    further = allowed_places(model.assembly, rules)
    tests = before_any_test(source, effects, sensors, further=further, **words).open
    if not tests:
        raise ShapeError("the planned test leaves nothing open; give fewer sensors")
    return with_common_candidates([t.forecasts() for t in tests])


class Recorded:
    """A case with FRFs, prepared for updating: residuals over x/sd of its calibration parameters.

    Attributes
    ----------
    names : tuple of str      parameters, as "E of inner"
    effects : tuple of Effect
    score : Responses         the compared data, damping equalised
    """

    def __init__(self, case: Source) -> None:
        self.prepared = prepared(_with_recording(case))
        problem = self.prepared.problem
        score = self.prepared.score
        if not isinstance(score, Responses):
            raise FileError(f"{case}: these environments compare FRFs; the case has none that can")
        self.score = score
        self.effects: tuple[Effect, ...] = tuple(
            e for e in problem.base if not any(e is n for n in problem.nuisance)
        )
        pairs = [(e, p) for e in self.effects for p in e.parameters]
        self.names = tuple(_name(e, p) for e, p in pairs)
        self.mean = np.array([p.mean for _, p in pairs])
        self.sd = np.array([p.sd for _, p in pairs])

    def state(self, theta: np.ndarray, gradient: bool = False) -> State:
        """The reduced model at x = mean + sd θ."""
        model = self.prepared.problem.reduced.model
        return evaluate(model, self.effects, self.mean + self.sd * theta, gradient)

    @property
    def held(self) -> np.ndarray:
        """Held-out samples of ``score`` on which a gain is reported (n_f, n_out) bool."""
        return self.prepared.held.reporting

    @cached_property
    def catalogue(self) -> CatalogueChoices:
        """Effects that the search of a diagnosis would try on this case; it takes some seconds."""
        return catalogue_choices(self.prepared)

    def linearised(self, effects: bool = False) -> Linearised:
        """Fitted and held-out residuals and their slopes at the prior mean.

        With ``effects``, effects of the catalogue follow the calibration parameters, and the fitted
        residuals allow for errors of the model's form.
        """
        if effects:
            return self.catalogue.linearised(self.score, self.held, len(self.names))
        state = self.state(np.zeros(len(self.sd)), True)
        r, J = self.score.residual(state, True)
        h, H = self.score.only(self.held).residual(state, True)
        return Linearised(r, J * self.sd, h, H * self.sd)

    def calibration(self) -> CalibrationQuestion:
        """The fitted lines and channels; bounds at two prior standard deviations."""
        lines = np.flatnonzero(self.score.use.any(axis=1))
        outputs = np.flatnonzero(self.score.use.any(axis=0))

        def fitted(values: np.ndarray) -> np.ndarray:
            return values[np.ix_(lines, outputs)].reshape(len(lines), -1)

        def predict(x: np.ndarray) -> np.ndarray:
            return fitted(self.score.model(self.state(REACH * np.asarray(x, float))))

        frequency = self.score.s.imag[lines] / (2 * np.pi)
        return CalibrationQuestion(self.names, frequency, predict, fitted(self.score.values))


def _with_recording(source: Source) -> Case:
    """The case at a path, or one that was loaded; FileError for whatever holds no recording."""
    if isinstance(source, str | Path) and (is_case(Path(source)) or not Path(source).exists()):
        source = load_case(source)
    if not isinstance(source, Case):
        what = source if isinstance(source, str | Path) else f"this {type(source).__name__}"
        raise FileError(
            f"{what} holds no recording; give the folder of a case, as chladni init writes it"
        )
    return source


def _name(effect: Effect, parameter: Parameter) -> str:
    return f"{parameter.name}, {effect.text}" if effect.text else parameter.name
