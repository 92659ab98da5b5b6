"""Measurements that would keep explanations from being tied, before anything is measured."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..case import Case
from ..case.sensor_places import sensor_masses
from ..dynamics.modes import rigid_modes
from ..effects.registry import family
from ..errors import ArgumentError, FileError
from ..fem.measured_dofs import MeasuredDofs
from ..inference.expected_information import Rivals
from ..inference.result import NextMeasurement
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..search.measurement_forecasts import COSTS
from ..search.next_measurement import (
    ADVISED,
    ODDS,
    FurtherPlaces,
    Outlook,
    advised,
    with_common_candidates,
)
from ..search.question import Question
from ..search.simulated_test import FirstTest, first_tests
from .frf import layout_places
from .loaded_model import DeckModels, Model, as_model, model_in_si, opened
from .place_words import further_places

MODES = 12  # elastic modes in the band of a planned test
BELOW, ABOVE = 0.7, 1.05  # times the first and the last of them


@dataclass(frozen=True, eq=False)
class PlannedTests:
    """Articles with each effect in turn, as the planned test would see them.

    Attributes
    ----------
    question : the planned test
    tests : of the articles
    odds : that settle an explanation
    """

    question: Question
    tests: tuple[FirstTest, ...]
    odds: float = ODDS

    @property
    def open(self) -> tuple[FirstTest, ...]:
        """Tests that settle no explanation."""
        return tuple(t for t in self.tests if not t.settled(self.odds))

    @property
    def unsettled(self) -> tuple[FirstTest, ...]:
        """Tests that do not settle the concealed effect: open ones, and wrong ones."""
        return tuple(t for t in self.tests if not (t.right and t.settled(self.odds)))

    def outlooks(self, kinds: Collection[str] = tuple(COSTS)) -> tuple[Outlook, ...]:
        """Forecasts for the unsettled tests, with the candidates that all of them have.

        After a wrong answer all explanations are even, as before the test.
        """
        every = []
        for t in self.unsettled:
            found = t.forecasts(kinds)
            if t.settled(self.odds):
                n = len(t.names)
                found = replace(found, rivals=Rivals(np.full(n, 1 / n)))
            every.append(found)
        return with_common_candidates(every)

    def advised(
        self, count: int = ADVISED, without: Sequence[str] = ()
    ) -> tuple[NextMeasurement, ...]:
        """The best further measurements over the articles that the planned test does not settle."""
        if not self.unsettled:
            return ()
        return advised(self.outlooks(), count, self.odds, without)


def before_any_test(
    source: str | Path | Model | DeckModels | Case, effects: Sequence[str],
    sensors: Path | Any = None,
    *, top: float | None = None, articles: int = 1, seed: int = 0, odds: float = ODDS,
    units: str | None = None, allow: Sequence[str] = (), progress: Progress = silent,
    further: FurtherPlaces | None = None,
) -> PlannedTests:  # fmt: skip
    """Test articles with each of the effects on a planned layout, and fit all effects to each.

    Parameters
    ----------
    source : a deck or a case
    effects : names, two and more
    sensors : a plan of :func:`chladni.plan`, a table of sensors, or a plan.json; default those of
        the case
    top : highest frequency [Hz]; default the band of the case, else the first ``MODES`` modes
    articles : with each effect
    further : where further sensors may be; default by [plan] of the case
    """
    if len(set(effects)) < 2:
        raise FileError("--effects needs two and more effects, as weld-missing,adhesive-stiffness")
    for name in effects:
        family(name)
    progress("reading the model", 0.0)
    found = opened(source, units, allow)
    case = found if isinstance(found, Case) else None
    model = as_model(case, "next") if case else model_in_si(found, "next")[0]
    outputs, inputs = _places(model, case, sensors)
    if inputs.base.any():
        raise FileError(f"{model.source}: the forecast is made for a force, not for a moving base")
    band = _band(model, case, top)
    question = Question(
        model.assembly,
        outputs,
        inputs,
        band=band,
        hangers=case.setup.hangers if case else (),
        sensor_masses=sensor_masses(model.assembly, outputs, inputs),
        further=further_places(case) if case and not further else further,
    )
    with one_blas_thread():
        tests = first_tests(question, effects, articles, seed=seed, progress=progress)
        return PlannedTests(question, tuple(tests), odds)


def _places(
    model: Model, case: Case | None, sensors: Path | Any
) -> tuple[MeasuredDofs, MeasuredDofs]:
    """Outputs and inputs of the planned test."""
    if isinstance(sensors, Path):
        return layout_places(model, sensors)
    if sensors is None:
        if case is None or not len(case.outputs.labels) or not len(case.inputs.labels):
            raise FileError(
                f"{model.source}: there are no sensors; give --sensors, a number, a table of "
                "sensors or a plan.json"
            )
        return case.outputs, case.inputs
    if not hasattr(sensors, "layout"):
        raise ArgumentError(
            f"sensors is {sensors!r}; give a plan of chladni.plan, or the path of a table of "
            "sensors or of a plan.json"
        )
    return (
        _mounted(sensors, sensors.layout, sensors.settings.mass),
        _mounted(sensors, sensors.together[:1], 0.0),
    )


def _mounted(made: Any, at: np.ndarray, mass: float) -> MeasuredDofs:
    """Mounts of a plan as measured or driven dofs."""
    m = made.mounts
    grids = np.where(made.places.is_grid[m.place[at]], m.ids[at], 0)
    labels, each = tuple(m.labels[k] for k in at), np.ones(len(at))
    return MeasuredDofs(labels, grids, m.points[at], m.directions[at], 0 * each, mass * each)


def _band(model: Model, case: Case | None, top: float | None) -> tuple[float, float]:
    """Frequencies that are compared [Hz]."""
    if case is not None and case.band is not None:
        low, high = case.band
        return low, top or high
    modal = model.normal_modes(MODES + 6)
    f = modal.frequency[~rigid_modes(modal)]
    high = top or ABOVE * float(f[:MODES][-1])
    if high <= f[0]:
        raise FileError(f"--top {high:g}: the first elastic mode is at {f[0]:.4g} Hz")
    return BELOW * float(f[0]), float(high)
