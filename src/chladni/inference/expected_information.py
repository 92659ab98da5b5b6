"""Expected information of a measurement about which of several hypotheses is true.

Hypothesis j has the probability p_j and predicts the data y of a measurement, in units of the
noise, as N(μ_j, I + F_j F_jᵀ).  The columns of F_j are what is not known under it: parameters and
errors of form, as the earlier data left them.  The expected information is the mutual information
of the data and the hypothesis (Lindley 1956, Ann. Math. Stat. 27, 986-1005; for the choice between
models Box and Hill 1967, Technometrics 9, 57-71):

I = Σ_j p_j E[ln p(j | y) - ln p_j | j]   [nat].

All densities depend on y through t = Bᵀ(y - μ_0) alone, B = [F_0, F_1, ..., μ_1 - μ_0, ...], and on
the Gram matrix G = BᵀB.  The Gram matrix of several measurements with independent noise is the sum
of theirs, so that a set of measurements costs no more than one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy.linalg as sl
from scipy.special import logsumexp

DRAWS = 256  # of the data of a measurement, under each hypothesis
SEED = 20261127


@dataclass(frozen=True, eq=False)
class Columns:
    """Places of the hypotheses in the columns of B.

    Attributes
    ----------
    sizes : number of columns of each F_j
    """

    sizes: tuple[int, ...]

    @cached_property
    def factors(self) -> tuple[slice, ...]:
        """Columns of each F_j."""
        ends = np.cumsum((0, *self.sizes))
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    @property
    def count(self) -> int:
        """Number of columns of B."""
        return sum(self.sizes) + len(self.sizes) - 1

    def shift(self, j: int) -> np.ndarray:
        """Coefficients of μ_j - μ_0 in the columns of B (count,)."""
        out = np.zeros(self.count)
        if j:
            out[sum(self.sizes) + j - 1] = 1.0
        return out

    def gram(self, factors: Sequence[np.ndarray], means: Sequence[np.ndarray]) -> np.ndarray:
        """G of one measurement from F_j (n, k_j) and μ_j (n,), in units of the noise."""
        B = np.column_stack([*factors, *(m - means[0] for m in means[1:])])
        return np.asarray(B.T @ B)


@dataclass(frozen=True, eq=False)
class Rivals:
    """Hypotheses of which one is true.

    Attributes
    ----------
    columns : their places in B
    probability : (m,) p_j
    """

    columns: Columns
    probability: np.ndarray

    def log_density(self, G: np.ndarray, t: np.ndarray) -> np.ndarray:
        """ln p(y | j) up to a constant common to all j (m, n), from t (count, n).

        With Δ = y - μ_j: -½ |Δ|² - ½ ln det(I + FᵀF) + ½ Δᵀ F (I + FᵀF)⁻¹ Fᵀ Δ (Woodbury).
        """
        out = np.empty((len(self.probability), t.shape[1]))
        for j, at in enumerate(self.columns.factors):
            e = self.columns.shift(j)
            L = np.linalg.cholesky(np.eye(at.stop - at.start) + G[at, at])
            seen = sl.solve_triangular(L, t[at] - (G[at] @ e)[:, None], lower=True)
            det = np.log(np.diag(L)).sum()
            out[j] = e @ t - e @ G @ e / 2 - det + (seen**2).sum(axis=0) / 2
        return out

    def posterior(self, G: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Probability of each hypothesis given the data (m, n)."""
        log = self.log_density(G, t) + np.log(self.probability)[:, None]
        return np.asarray(np.exp(log - logsumexp(log, axis=0)))

    def drawn(self, G: np.ndarray, j: int, known: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """T (count, n) of data under hypothesis j.

        Parameters
        ----------
        known, noise : (count, n) standard normal, for what is unknown of the object and for noise
        """
        at = self.columns.factors[j]
        mean = (G @ self.columns.shift(j))[:, None]
        return mean + G[:, at] @ known[at] + root(G) @ noise

    def forecast(self, G: np.ndarray, draws: int = DRAWS) -> "Forecast":
        """Expect the outcome of a measurement with this Gram matrix."""
        z = np.random.default_rng(SEED).standard_normal((2, self.columns.count, draws))
        p = self.probability
        each = np.stack([self.posterior(G, self.drawn(G, j, *z)) for j in range(len(p))])
        own = each[np.arange(len(p)), np.arange(len(p))]  # (m, draws): of the true one
        gain = np.log(np.maximum(own, 1e-300)) - np.log(p)[:, None]
        return Forecast(float(p @ gain.mean(axis=1)), p, each)


@dataclass(frozen=True, eq=False)
class Forecast:
    """Outcomes that are expected of a measurement.

    Attributes
    ----------
    information : [nat]
    probability : (m,) of each hypothesis before it
    posterior : (m, m, n) of draw n under the true hypothesis (first): that of each (second)
    """

    information: float
    probability: np.ndarray
    posterior: np.ndarray

    def settled(self, odds: float) -> float:
        """Probability that the true hypothesis gets these odds against all others together."""
        own = self.posterior[np.arange(len(self.probability)), np.arange(len(self.probability))]
        return float(self.probability @ (own >= odds / (1 + odds)).mean(axis=1))

    def misled(self, odds: float) -> float:
        """Probability that a wrong hypothesis gets these odds."""
        wrong = self.posterior >= odds / (1 + odds)
        wrong[np.arange(len(self.probability)), np.arange(len(self.probability))] = False
        return float(self.probability @ wrong.any(axis=1).mean(axis=1))


def root(G: np.ndarray) -> np.ndarray:
    """R with R Rᵀ = G, of a matrix that may be singular."""
    lam, U = np.linalg.eigh(G)
    return np.asarray(U * np.sqrt(np.maximum(lam, 0.0)))


def chosen(
    rivals: Rivals, grams: np.ndarray, cost: np.ndarray, count: int, known: np.ndarray | None = None
) -> list[int]:
    """Choose measurements one after the other, each with the most information for its cost.

    Parameters
    ----------
    grams : (c, d, d) of each candidate
    cost : (c,) of each; inf excludes it
    known : (d, d) of measurements that are made in any case
    """
    total = np.zeros(grams.shape[1:]) if known is None else known
    out: list[int] = []
    for _ in range(min(count, int(np.isfinite(cost).sum()))):
        now = rivals.forecast(total).information
        gain = np.array([
            -np.inf if k in out or not np.isfinite(c)
            else (rivals.forecast(total + G).information - now) / c
            for k, (G, c) in enumerate(zip(grams, cost, strict=True))
        ])  # fmt: skip
        best = int(np.argmax(gain))
        if not gain[best] > 0:
            break
        out.append(best)
        total = total + grams[best]
    return out
