"""Expected information of a measurement about which of several hypotheses is true.

Hypothesis j has the probability p_j and predicts the data y of a measurement, in units of the
noise, as N(μ_j, I + F_j F_jᵀ).  The columns of F_j are what is not known under it: parameters and
errors of form, as the earlier data left them.  The expected information is the mutual information
of the data and the hypothesis (Lindley 1956, Ann. Math. Stat. 27, 986-1005; for the choice between
models Box and Hill 1967, Technometrics 9, 57-71):

I = Σ_j p_j E[ln p(j | y) - ln p_j | j]   [nat].
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from scipy.special import entr, logsumexp

from ..results import ShownBriefly

DRAWS = 256  # of the data of a measurement, under each hypothesis
SEED = 20261127
UNSEEN = 1e-3  # of the noise: variance of predictions that tells nothing
FAINT = np.log1p(UNSEEN) / 2  # [nat] of data that move by no more than that
SETTLED = 0.01  # of the entropy: no further measurement is chosen below it


@dataclass(frozen=True, eq=False, repr=False)
class Predicted(ShownBriefly):
    """Data of a measurement as each hypothesis predicts them, in units of the noise."""

    mean: np.ndarray  # (m, n) μ_j
    factors: tuple[np.ndarray, ...]  # (n, k_j) F_j of each hypothesis

    def __add__(self, other: "Predicted") -> "Predicted":
        """Both measurements, of independent noise."""
        each = zip(self.factors, other.factors, strict=True)
        return Predicted(np.hstack([self.mean, other.mean]), tuple(np.vstack(F) for F in each))

    @property
    def short(self) -> "Predicted":
        """Nearly the same information in fewer data.

        All densities depend on y - μ_0 through its part in the span of F_j and μ_j - μ_0.  The
        directions of least variance are left out, ``UNSEEN`` of the noise in all.
        """
        B = np.column_stack([*self.factors, (self.mean[1:] - self.mean[0]).T])
        if len(B) > B.shape[1]:
            B = np.asarray(np.linalg.qr(B, mode="r"))
        lam, U = np.linalg.eigh(B @ B.T)
        B = U[:, np.cumsum(np.maximum(lam, 0.0)) > UNSEEN].T @ B
        *factors, apart = np.split(B, np.cumsum([F.shape[1] for F in self.factors]), axis=1)
        return Predicted(np.vstack([np.zeros(len(B)), apart.T]), tuple(factors))

    def after(self, made: "Predicted", y: np.ndarray) -> "Predicted":
        """Predict these data after others, which share their unknowns, have shown y (n,)."""
        means, factors = [], []
        for mean, F, known, G in zip(self.mean, self.factors, made.mean, made.factors, strict=True):
            lam, U = np.linalg.eigh(G.T @ G)
            L = U / np.sqrt(1 + np.maximum(lam, 0.0))  # L Lᵀ = (I + GᵀG)⁻¹
            means.append(mean + F @ (L @ (L.T @ (G.T @ (y - known)))))
            factors.append(F @ L)
        return Predicted(np.array(means).reshape(self.mean.shape), tuple(factors))


def nothing(like: Predicted) -> Predicted:
    """No data at all."""
    return Predicted(like.mean[:, :0], tuple(F[:0] for F in like.factors))


@dataclass(frozen=True, eq=False)
class Rivals:
    """Hypotheses of which one is true."""

    probability: np.ndarray  # (m,) p_j

    @property
    def entropy(self) -> float:
        """-Σ p ln p [nat], the most that a measurement tells."""
        return float(entr(self.probability).sum())

    def log_density(self, seen: Predicted, y: np.ndarray) -> np.ndarray:
        """ln p(y | j) up to a constant common to all j (m, n_draws), of data y (n, n_draws)."""
        out = np.empty((len(self.probability), y.shape[1]))
        for j, (mean, F) in enumerate(zip(seen.mean, seen.factors, strict=True)):
            L = np.linalg.cholesky(np.eye(len(F)) + F @ F.T)
            z = sl.solve_triangular(L, y - mean[:, None], lower=True)
            out[j] = -np.log(np.diag(L)).sum() - (z**2).sum(axis=0) / 2
        return out

    def posterior(self, seen: Predicted, y: np.ndarray) -> np.ndarray:
        """Probability of each hypothesis given the data (m, n_draws)."""
        log = self.log_density(seen, y) + np.log(self.probability)[:, None]
        return np.asarray(np.exp(log - logsumexp(log, axis=0)))

    def forecast(self, seen: Predicted, draws: int = DRAWS) -> "Forecast":
        """Expect the outcome of a measurement."""
        rng, p = np.random.default_rng(SEED), self.probability
        noise = rng.standard_normal((seen.mean.shape[1], draws))
        known = rng.standard_normal((max(F.shape[1] for F in seen.factors), draws))
        each = np.hstack([
            mean[:, None] + F @ known[: F.shape[1]] + noise
            for mean, F in zip(seen.mean, seen.factors, strict=True)
        ])  # fmt: skip
        posterior = self.posterior(seen, each).reshape(len(p), len(p), draws).swapaxes(0, 1)
        own = np.einsum("jjn->jn", posterior)  # (m, draws): of the true one
        gain = np.log(np.maximum(own, 1e-300)) - np.log(p)[:, None]
        return Forecast(float(p @ gain.mean(axis=1)), p, posterior)


@dataclass(frozen=True, eq=False)
class Forecast:
    """Outcomes that are expected of a measurement."""

    information: float  # [nat]
    probability: np.ndarray  # (m,) of each hypothesis before it
    # (m, m, n) of draw n under the true hypothesis (first): that of each (second)
    posterior: np.ndarray

    def settled(self, odds: float) -> float:
        """Probability that the true hypothesis gets these odds against all others together."""
        own = np.einsum("jjn->jn", self.posterior)
        return float(self.probability @ (own >= odds / (1 + odds)).mean(axis=1))

    def misled(self, odds: float) -> float:
        """Probability that a wrong hypothesis gets these odds."""
        wrong = self.posterior >= odds / (1 + odds)
        np.einsum("jjn->jn", wrong)[:] = False
        return float(self.probability @ wrong.any(axis=1).mean(axis=1))


@dataclass(frozen=True, eq=False)
class OpenQuantity:
    """A quantity x = x_0 + a z + rest of one explanation, z ~ N(0, I) as its data left it."""

    name: str  # in words
    along: np.ndarray  # (k,) a
    rest: float  # variance that no measurement sees

    def variance(self, seen: Predicted) -> float:
        """Var x after data of factor F: rest + a (I + FᵀF)⁻¹ aᵀ."""
        (F,) = seen.factors
        return self.rest + float(
            self.along @ np.linalg.solve(np.eye(F.shape[1]) + F.T @ F, self.along)
        )

    def narrowed(self, seen: Predicted) -> float:
        """Standard deviation after the data over that before."""
        return float(np.sqrt(self.variance(seen) / (self.rest + self.along @ self.along)))


def chosen(
    information: Callable[[Sequence[int]], float], cost: np.ndarray, count: int, most: float,
    first: Sequence[int] = (),
) -> list[int]:  # fmt: skip
    """Choose measurements one after the other, each with the most information for its cost.

    One that tells no more than data that hide in their noise is not chosen.

    Parameters
    ----------
    information : [nat] of some measurements together, by their positions
    cost : (c,) of each; inf excludes it
    most : the most information that there is
    first : chosen before, and first of the list
    """
    out = list(first)
    now = information(out) if out else 0.0
    left = [int(k) for k in np.flatnonzero(np.isfinite(cost)) if k not in out]
    while len(out) < count and left and now <= (1 - SETTLED) * most:
        after = np.array([information([*out, k]) for k in left])
        best = int(np.argmax((after - now) / cost[left]))
        if not after[best] - now > FAINT:
            break
        now = float(after[best])
        out.append(left.pop(best))
    return out
