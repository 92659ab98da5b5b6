"""Frequencies of the test and of every deck, by full models."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..dynamics.modes import ModalModel
from ..fem.modelled import Modelled
from ..inference.pole_data import Poles
from ..inference.result import FrequencyError, FrequencyRow
from .measured_modes import MeasuredModes
from .question import Prepared, Question
from .written_scores import seen


def frequency_rows(
    question: Question,
    prepared: Prepared,
    test: MeasuredModes,
    stages: Sequence[tuple[str, Modelled]],
    real: np.ndarray | None = None,
) -> tuple[FrequencyRow, ...]:
    """Identified frequencies and those of every stage ("before", "calibrated", "after")."""
    if not len(test.frequency):
        return ()
    known = np.full(len(test.frequency), np.nan) if test.damping is None else test.damping
    damping = [None if np.isnan(zeta) else float(zeta) for zeta in known]
    both = zip(test.frequency.tolist(), damping, strict=True)
    rows = [FrequencyRow(f, damping=zeta) for f, zeta in both]
    for name, model in stages:
        modes = test.near(model)
        at, value = _paired(question, prepared, model, modes, test, real)
        for k, row in enumerate(rows):
            found: dict[str, Any] = {f"{name}_hz": None, f"mac_{name}": None}
            if at[k] >= 0:
                found[f"{name}_hz"] = float(modes.frequency[at[k]])
                found[f"mac_{name}"] = None if np.isnan(value[k]) else float(value[k])
            rows[k] = replace(row, **found)
    return tuple(rows)


def _paired(
    question: Question, prepared: Prepared, model: Modelled, modes: ModalModel,
    test: MeasuredModes, real: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Model mode of every test mode (-1: none) and their MAC (n,)."""
    n = len(test.frequency)
    at, value = np.full(n, -1), np.full(n, np.nan)
    if not isinstance(prepared.score, Poles) or test.shapes is not None:
        pairs = test.pairs(question.outputs, model, modes)
        at[pairs.test], value[pairs.test] = pairs.model, pairs.mac
        return at, value
    only = Modelled(model.structure, modes, model.band)
    score, state = seen(question, prepared.score, only, prepared.problem.setup.f_max)
    assert isinstance(score, Poles)
    _, mode = score.forced(state, np.ones(n, bool) if real is None else real)
    return mode, value


def frequency_error(rows: Sequence[FrequencyRow]) -> FrequencyError:
    """Root mean square of ln(model/test) of every deck, in per cent."""
    return FrequencyError(
        *(
            rms([(getattr(r, f"{name}_hz"), r.test_hz) for r in rows])
            for name in ("before", "calibrated", "after")
        )
    )


def rms(pairs: Sequence[tuple[float | None, float]]) -> float | None:
    """Root mean square of ln(model/test) over all paired frequencies, in per cent."""
    both = [(model, test) for model, test in pairs if model]
    if not both:
        return None
    d = np.log([model / test for model, test in both])
    return float(100 * np.sqrt(np.mean(d**2)))
