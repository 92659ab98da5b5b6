"""Held-out evidence on an effect: log predictive densities of data that a fit did not see.

Two tests compare an effect with calibration alone.  Both sides include the learned model error:

- the data held out: p(held | fitted) = p(held, fitted) / p(fitted), a ratio of evidences about the
  existing fit;
- folds of the fitted data, one sensor or one block of lines at a time, predicted from the rest. Let
  residuals r have the covariance C.  Given all others, r_b has the precision P = (C⁻¹)_bb and the
  mean r_b - P⁻¹ (C⁻¹ r)_b (Rasmussen and Williams 2006, Gaussian Processes, eq. 5.12).  The
  parameters are linear about their fit.

Data that are insensitive to the effect have equal predictions with and without it, so they do not
count.
"""

from dataclasses import dataclass

import numpy as np

from ..reduced.reduced_model import Reduced, evaluate
from .hypothesis_fit import HypothesisFit, UpdatingProblem, over_scales
from .likelihood import Responses
from .linear_model import LinearModel
from .map_fit import prior_residuals, unknowns
from .pole_data import Poles
from .scan import baseline

BLOCKS = 8  # of neighbouring lines


@dataclass(frozen=True)
class HeldOutEvidence:
    """Gains in 2 ln predictive density over calibration alone; positive speaks for the effect.

    Attributes
    ----------
    held_out : of the data held out; None where nothing was
    sensors, lines : sums over folds of the fitted data; None for natural frequencies
    """

    held_out: float | None = None
    sensors: float | None = None
    lines: float | None = None

    @property
    def votes(self) -> dict[str, float]:
        """Gain of each test that was made, by its name in words."""
        every = {
            "the data held out": self.held_out,
            "sensors predicted from the others": self.sensors,
            "lines predicted from the others": self.lines,
        }
        return {what: gain for what, gain in every.items() if gain is not None}


def held_out_evidence(
    problem: UpdatingProblem, unseen: np.ndarray, null: HypothesisFit, hypothesis: HypothesisFit,
    about: Reduced | None = None,
) -> HeldOutEvidence:  # fmt: skip
    """Evidence of held-out data for a hypothesis over the null.

    Parameters
    ----------
    unseen : samples held out, in the shape of ``problem.data.use``
    null : without the effects that are tested
    about : the model whose state errors of form spread from; that of ``null`` unless it is given
    """
    added = [e for e in hypothesis.effects if e not in null.effects]
    held = None
    if unseen.any():
        data = null.data.rebased(about or null.model)
        assert isinstance(data, (Responses, Poles))
        both = data.using(data.use | unseen)
        held = _news(problem, null, both) - _news(problem, hypothesis, both)
    if not isinstance(null.data, Responses) or null.data.error is None:
        return HeldOutEvidence(held)
    by_line = _folds_of_lines(null.data)
    by_sensor = _folds_of_sensors(null.data)
    gains = [
        predictive(problem, hypothesis, folds) - predictive(problem, null, folds)
        for folds in (by_sensor, by_line)
    ]
    faults = all(e.channels for e in added)  # they change no other channel
    sensors = None if added and faults else gains[0]
    return HeldOutEvidence(held, sensors, gains[1])


def _news(problem: UpdatingProblem, hypothesis: HypothesisFit, both: Responses | Poles) -> float:
    """-2 ln p(held out | fitted), the parameters linear about their fit, up to a constant.

    ``both`` are the fitted data and those held out.
    """
    data = hypothesis.data
    assert isinstance(data, (Responses, Poles))
    both = both.rebased(hypothesis.model)
    return _evidence(problem, hypothesis, both) - _evidence(problem, hypothesis, data)


def _evidence(
    problem: UpdatingProblem, hypothesis: HypothesisFit, data: Responses | Poles
) -> float:
    """-2 ln evidence of some data, the parameters linear about the existing fit."""
    fit = hypothesis.fit
    state = evaluate(hypothesis.model, fit.effects, fit.x)
    r, J = data.scaled(state, True)
    r0, J0 = prior_residuals(fit.effects, problem.mass_measurement, fit.x, state)
    if isinstance(data, Poles):
        return over_scales(data, state, r0, J0)
    if data.error is not None:
        return LinearModel(data.error, J, J0).learned(r, r0).neg2_log_evidence
    A, g = J.T @ J + J0.T @ J0, J.T @ r + J0.T @ r0
    cost = r @ r + r0 @ r0 - g @ np.linalg.solve(A, g)
    widths = 2 * np.log(data.std()[data.use]).sum()
    return float(cost + np.linalg.slogdet(A)[1] + widths)


def _folds_of_lines(data: Responses) -> np.ndarray:
    """Block of neighbouring lines of each sample (n,), real and imaginary part together."""
    lines = np.flatnonzero(data.use.any(axis=1))
    block = np.full(len(data.use), -1)
    for k, part in enumerate(np.array_split(lines, min(BLOCKS, len(lines)))):
        block[part] = k
    return _of_samples(data, np.broadcast_to(block[:, None], data.use.shape))


def _folds_of_sensors(data: Responses) -> np.ndarray:
    """Output of each sample (n,)."""
    return _of_samples(data, np.broadcast_to(np.arange(data.use.shape[1]), data.use.shape))


def _of_samples(data: Responses, fold: np.ndarray) -> np.ndarray:
    """Folds (n_f, n_out) in the order of the residuals."""
    one = np.repeat(fold[data.use], data.values.shape[2])
    return np.concatenate([one, one])


def predictive(problem: UpdatingProblem, hypothesis: HypothesisFit, folds: np.ndarray) -> float:
    """2 ln predictive density of every fold given all others, summed, up to a constant."""
    fit = hypothesis.fit
    about = baseline(
        hypothesis.model, fit.effects, hypothesis.data, problem.mass_measurement, fit.x
    )
    mean = np.array([p.mean for p in unknowns(fit.effects)])
    r, B = about.residual - about.slopes @ (fit.x - mean), about.Z.T  # C⁻¹ = I - B Bᵀ
    z = r - B @ (B.T @ r)
    total = 0.0
    for k in np.unique(folds):
        inside = np.flatnonzero(folds == k)
        P = np.eye(len(inside)) - B[inside] @ B[inside].T
        total += float(np.linalg.slogdet(P)[1] - z[inside] @ np.linalg.solve(P, z[inside]))
    return total
