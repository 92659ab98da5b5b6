"""Frequencies of the test beside those of every deck, by full models."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..dynamics.modes import ModalModel
from ..ema.correlation import mac
from ..ema.mode_pairing import pair
from ..fem.modelled import Modelled
from .likelihood import Poles
from .question import Prepared, Question
from .result import FrequencyError, FrequencyRow
from .written_scores import seen

FIRST = 8  # paired frequencies over which the rms is reported
BEYOND = 2.0  # times the highest frequency of the test: as far as a partner is looked for


def frequency_rows(
    question: Question,
    prepared: Prepared,
    stages: Sequence[tuple[str, Modelled]],
    real: np.ndarray | None = None,
) -> tuple[FrequencyRow, ...]:
    """Identified frequencies beside those of every stage ("before", "calibrated", "after")."""
    test, shapes = _test_modes(prepared)
    if not len(test):
        return ()
    low, high = 0.02 * float(test.min()), BEYOND * float(test.max())
    rows = [FrequencyRow(float(f)) for f in test]
    for name, model in stages:
        modes = model.up_to(high)
        modes = modes.sel(modes.frequency > low)
        at, value = _paired(question, prepared, model, modes, test, shapes, real)
        for k, row in enumerate(rows):
            found: dict[str, Any] = {f"{name}_hz": None, f"mac_{name}": None}
            if at[k] >= 0:
                found[f"{name}_hz"] = float(modes.frequency[at[k]])
                found[f"mac_{name}"] = None if np.isnan(value[k]) else float(value[k])
            rows[k] = replace(row, **found)
    return tuple(rows)


def _test_modes(prepared: Prepared) -> tuple[np.ndarray, np.ndarray | None]:
    """Frequencies of the test and, where there are sensors enough, shapes (n_out, n)."""
    if isinstance(prepared.score, Poles):
        return prepared.score.frequency, None
    found = prepared.identified
    assert found is not None
    low, high = found.band
    keep = (found.frequency >= low) & (found.frequency <= high) & (found.damping < 0.05)
    keep &= found.relative_delta_chi2 > 3.0
    if found.residues.shape[1] < 4:
        return found.frequency[keep], None
    every = found.residues[keep]
    strongest = np.linalg.norm(every, axis=1).argmax(axis=1)
    residues = every[np.arange(len(every)), :, strongest]
    turn = np.exp(-0.5j * np.angle((residues**2).sum(axis=1)))
    return found.frequency[keep], (residues * turn[:, None]).real.T


def _paired(
    question: Question, prepared: Prepared, model: Modelled, modes: ModalModel,
    test: np.ndarray, shapes: np.ndarray | None, real: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Model mode of every test mode (-1: none) and their MAC (n,)."""
    n = len(test)
    at, value = np.full(n, -1), np.full(n, np.nan)
    if shapes is not None:
        phi = question.outputs.rows(model.structure) @ modes.shapes
        pairs = pair(modes.frequency, test, mac(phi, shapes))
        at[pairs.test], value[pairs.test] = pairs.model, pairs.mac
        return at, value
    if not isinstance(prepared.score, Poles):
        pairs = pair(modes.frequency, test)
        at[pairs.test] = pairs.model
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


def rms(pairs: Sequence[tuple[float | None, float]], first: int = FIRST) -> float | None:
    """Root mean square of ln(model/test) over the first paired frequencies, in per cent."""
    both = [(model, test) for model, test in pairs if model][:first]
    if not both:
        return None
    d = np.log([model / test for model, test in both])
    return float(100 * np.sqrt(np.mean(d**2)))
