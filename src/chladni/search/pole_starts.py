"""Starting points of a fit of poles, whose assignment makes many local optima.

The effect's prior is sampled at Sobol points, and the best distinct ones start a simplex search
(Nelder and Mead 1965, Comput. J. 7, 308-313).  It uses no slope, because the assignment jumps.  A
prior that hardly moves the modes has one optimum, so the number of points follows from its reach.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..errors import ModelError
from ..inference.hypothesis_fit import SCALES, UpdatingProblem, neg2_log_mixture
from ..inference.pole_data import Poles
from ..reduced.reduced_model import Reduced, evaluate

DRAWS, OF_A_CELL = 4096, 64  # points at most, and in a cell of the prior (:func:`cells`)
WALKED = 16  # distinct points at most from which a simplex search starts
ENDS = 4  # minima of an effect at most
APART = 0.25  # of the prior sd, in one parameter at least: points that count as distinct
WIDE = 0.03  # standard deviation of ln f in the comparison of the Sobol points
STEPS = 250  # evaluations of one simplex search


def squared_prior(effect: Effect, x: np.ndarray) -> float:
    """((x - μ)/σ)² over the effect's parameters."""
    mean, sd = _moments(effect)
    return float((((x - mean) / sd) ** 2).sum())


def _moments(effect: Effect) -> np.ndarray:
    """Mean and standard deviation of the effect's priors (2, n_p)."""
    return np.array([(p.mean, p.sd) for p in effect.parameters]).reshape(-1, 2).T


def draws(effect: Effect, count: int) -> np.ndarray:
    """Sobol points of an effect's prior (count, n_p); count is a power of two."""
    from scipy.stats import norm, qmc

    u = qmc.Sobol(len(effect.parameters), seed=1).random(count)
    mean, sd = _moments(effect)
    return mean + sd * norm.ppf(np.clip(u, 1e-3, 1 - 1e-3))


def cells(problem: UpdatingProblem, model: Reduced, effects: Sequence[Effect]) -> float:
    """Π max(1, s_k / WIDE): regions of the last effect's prior with a pairing of their own.

    s_k are the singular values of ∂ln f/∂x times the prior sd, rms over the poles.
    """
    effect, data = effects[-1], problem.data
    assert isinstance(data, Poles)
    (mean, sd), n = _moments(effect), len(effect.parameters)
    x = np.concatenate([problem.begun(effects[:-1]), mean])
    try:
        state = evaluate(model, effects, x)
    except ModelError:
        return np.inf
    _, J = replace(data.rebased(model), scale=WIDE).scaled(state, True)
    own = J[:, -n:] * sd
    s = np.linalg.svd(own / np.sqrt(len(own)), compute_uv=False)
    return float(np.prod(np.maximum(s, 1.0)))


def global_starts(problem: UpdatingProblem, effect: Effect) -> list[np.ndarray]:
    """The lowest distinct minima of -2 ln posterior over the effect's own parameters.

    Calibration parameters stay at their prior mean.  Base effects that this effect makes
    superfluous are left out.
    """
    data = problem.data
    assert isinstance(data, Poles)
    kept = problem.without(effect)
    idle = problem.begun(kept)
    mean, sd = _moments(effect)
    model = problem.reduced.model.split_for(effect, mean)
    seen = data.rebased(model)

    def cost(x: np.ndarray, scales: np.ndarray) -> float:
        try:
            state = evaluate(model, [*kept, effect], np.concatenate([idle, x]), False)
        except ModelError:
            return np.inf
        prior = squared_prior(effect, x)
        return prior + min(neg2_log_mixture(replace(seen, scale=s), state) for s in scales)

    number = cells(problem, model, [*kept, effect])
    count = 2 ** int(np.ceil(np.log2(min(DRAWS, OF_A_CELL * number))))
    points = np.vstack([effect.starts(), draws(effect, count)])
    rough = np.array([cost(x, np.array([WIDE])) for x in points])
    chosen = _distinct(points / sd, rough, int(min(WALKED, ENDS * number)))
    return _valleys(lambda x: cost(x, SCALES[::6]), points[chosen], sd)


def _distinct(points: np.ndarray, cost: np.ndarray, most: int) -> list[int]:
    """Rows of the cheapest points that lie apart."""
    out: list[int] = []
    for k in np.argsort(cost):
        if not np.isfinite(cost[k]) or len(out) == most:
            break
        if all(np.abs(points[k] - points[j]).max() > APART for j in out):
            out.append(int(k))
    return out


def _valleys(
    cost: Callable[[np.ndarray], float], starts: np.ndarray, sd: np.ndarray
) -> list[np.ndarray]:
    """Distinct ends of the simplex searches, lowest cost first."""
    from scipy.optimize import minimize

    options = {"maxfev": STEPS, "xatol": 1e-3, "fatol": 1e-2}
    ends = [minimize(cost, x, method="Nelder-Mead", options=options) for x in starts]
    where = np.array([end.x for end in ends]).reshape(len(ends), -1)
    return [where[k] for k in _distinct(where / sd, np.array([e.fun for e in ends]), ENDS)]
