"""Spread of nominally equal articles, from the differences between their tests alone.

Article a has θ_a = μ + δ_a, δ_a ~ N(0, τ_g²) for each group g of parameters.  All tests share the
error f of the model's form: y_a = f + J θ_a + n_a.  Contrasts c with Σ c_a = 0 and |c| = 1 lose f
and μ.  They leave z = Σ c_a y_a = J φ + n with φ ~ N(0, τ²).  A - 1 orthonormal contrasts are
independent draws of this.  Their marginal likelihood gives τ: empirical Bayes, or restricted
maximum likelihood (Patterson and Thompson 1971, Biometrika 58, 545-554).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

LARGEST = 3.0  # prior standard deviations: τ is not looked for beyond
STARTS = (0.03, 0.3, 1.0)  # of τ, in prior standard deviations
NOTHING = 1e-3  # prior standard deviations: no spread
RISE = 3.841458820694124  # of -2 ln likelihood at the ends of an interval: chi2.ppf(0.95, 1)
KNOWN = -1  # group of parameters whose standard deviation is known


@dataclass(frozen=True, eq=False)
class UnitSpread:
    """Spread of each group, and the place of each article about the mean of all."""

    # tau, low: (g,) most likely spread, and the lower end of its 95 % interval
    tau: np.ndarray
    low: np.ndarray
    high: np.ndarray  # (g,) the upper end; inf where the tests do not bound it
    away: np.ndarray  # (A, p) θ_a less their mean, shrunk by τ
    # (p, p) of each of these, with τ at its upper end: an uncertain τ narrows nothing
    covariance: np.ndarray


def unit_spread(J: np.ndarray, y: np.ndarray, group: np.ndarray, sd: np.ndarray) -> UnitSpread:
    """Estimate the spread of articles whose tests are linear in their parameters.

    Parameters
    ----------
    J : (n, p)       whitened slopes of a test
    y : (A, n)       whitened tests, A > 1
    group : (p,)     number of the group of each parameter; ``KNOWN``: its spread is ``sd``
    sd : (p,)        prior standard deviation
    """
    from scipy.optimize import brentq, minimize

    c = sl.helmert(len(y))
    F, g = J.T @ J, c @ (y @ J)
    count = int(group.max(initial=KNOWN)) + 1
    scale = np.array([sd[group == k].max() for k in range(count)])

    def spread(v: np.ndarray) -> np.ndarray:
        return np.where(group == KNOWN, sd, np.append(v * scale, 0.0)[group])

    def cost(v: np.ndarray) -> float:
        """-2 ln likelihood of τ = v * scale: Σ_k ln det D - |D^-½ S g_k|², D = I + S F S."""
        S = spread(v)
        L = np.linalg.cholesky(np.eye(len(S)) + S[:, None] * F * S)
        return float(
            2 * len(g) * np.log(np.diag(L)).sum()
            - (sl.solve_triangular(L, (g * S).T, lower=True) ** 2).sum()
        )

    found = [minimize(cost, np.full(count, v), bounds=[(0.0, LARGEST)] * count) for v in STARTS]
    best = min(found, key=lambda f: float(f.fun)).x
    best[best < NOTHING] = 0.0
    low, high = np.zeros(count), np.full(count, np.inf)
    for k in range(count):

        def above(v: float, k: int = k) -> float:
            """Profile of the cost at τ_k, all other groups at their best, above its limit."""
            limits = [(0.0, LARGEST) if j != k else (v, v) for j in range(count)]
            return float(minimize(cost, np.clip(best, *np.transpose(limits)), bounds=limits).fun
                         - cost(best) - RISE)  # fmt: skip

        if best[k] > 0 and above(0.0) > 0:
            low[k] = brentq(above, 0.0, best[k], xtol=1e-2 * best[k])
        if above(LARGEST) > 0:
            high[k] = brentq(above, best[k], LARGEST, xtol=1e-2 * max(best[k], 1e-2))
    Q = _posterior(F, spread(best))
    wide = _posterior(F, spread(np.minimum(high, LARGEST)))
    return UnitSpread(
        best * scale, low * scale, high * scale, c.T @ (g @ Q), (1 - 1 / len(y)) * wide
    )


def _posterior(F: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Covariance (F + S⁻²)⁻¹ of φ; S may be zero."""
    D = np.eye(len(S)) + S[:, None] * F * S
    return np.asarray(S[:, None] * np.linalg.inv(D) * S)
