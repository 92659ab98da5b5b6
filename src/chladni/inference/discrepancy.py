"""Model-form error as a part of the model: modal stiffness and mass are random about their values.

K = Λ^½ (I + G) Λ^½ and M = I + G' in the modes of a state.  G and G' are symmetric with independent
entries of mean zero and variance δ² (1 + [i=j])/2 (Soize 2000, Prob. Eng. Mech. 15, 277-294, to
first order).  The responses depend on G linearly, log10 H = log10 H_0 + J vec(G), so the whitened
residual has the covariance C = I + δ² W Wᵀ.  One decomposition W Wᵀ = U diag(s) Uᵀ serves every δ:

ln det C = Σ ln(1 + δ² s),   C⁻¹ = I - U diag(δ² s / (1 + δ² s)) Uᵀ.

Without such a term parameters go wrong with confidence (Brynjarsdottir and O'Hagan 2014, Inverse
Problems 30, 114007).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.linalg as sl

from ..reduced.reduced_model import State

MEDIAN = 0.01  # of δ before it is learned
REACH = 1.5  # modes up to this many times the highest line take part
RIGID = 0.02  # of the highest line: below it a mode counts as rigid and is known
MOST_PAIRS = 2000  # pairs of modes, or samples, that are decomposed
CUT = 0.02  # variances below this share of the noise, at the largest δ, are left out


@dataclass(frozen=True)
class FormPrior:
    """Log-normal prior of δ, and the values over which an evidence is integrated."""

    median: float
    log_sd: float
    least: float
    count: int

    @property
    def grid(self) -> np.ndarray:
        """Values of δ, evenly in their logarithm."""
        return np.geomspace(self.least, 0.16, self.count)

    def neg2_log(self, delta: np.ndarray | float) -> np.ndarray:
        """-2 ln of the density of ln δ."""
        z = (np.log(delta) - np.log(self.median)) / self.log_sd
        return z**2 + np.log(2 * np.pi * self.log_sd**2)

    def drawn(self, rng: np.random.Generator) -> float:
        """One δ."""
        return float(self.median * np.exp(self.log_sd * rng.normal()))


FORMULATIONS = FormPrior(0.01, 0.7, 0.0008, 16)  # two of one sheet differ by 0.3 to 4 %
LEARNED = FormPrior(0.0016, 1.0, 0.0002, 20)  # of 42 tuning articles without an effect: 0.04-0.6 %


@dataclass(frozen=True, eq=False)
class Form:
    """The modes of a reference state in which the form of the model may change."""

    rows: np.ndarray  # (k, m) of Φ⁻¹, the reference modes that take part
    lam: np.ndarray  # (k,) their ω² [rad²/s²]

    @property
    def pairs(self) -> np.ndarray:
        """Pairs i <= j of the modes that take part (n_pairs, 2)."""
        return np.stack(np.triu_indices(len(self.lam)), axis=1)


def form(state: State, f_max: float) -> Form:
    """The flexible modes up to ``REACH`` times the highest line [rad/s]."""
    omega = np.sqrt(np.maximum(state.lam, 0))
    modes = np.flatnonzero((omega > RIGID * f_max) & (omega < REACH * f_max))
    return Form(np.linalg.inv(state.vectors)[modes], state.lam[modes])


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Covariance C = I + δ² U diag(s) Uᵀ of whitened residuals."""

    U: np.ndarray  # (n, k), orthonormal
    s: np.ndarray  # (k,) variance along each column for δ = 1
    delta: float = MEDIAN  # standard deviation of the diagonal of G
    prior: FormPrior = FORMULATIONS  # of δ

    def with_delta(self, delta: float) -> Self:
        """A copy with the error scaled to ``delta``."""
        return replace(self, delta=delta)

    def share(self, delta: float | None = None) -> np.ndarray:
        """δ² s / (1 + δ² s) (k,), the share of the variance along each column due to the error."""
        v = (self.delta if delta is None else delta) ** 2 * self.s
        return np.asarray(v / (1 + v))

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """C^-½ r of residuals or of columns of slopes (n, ...)."""
        less = 1 - np.sqrt(1 - self.share())
        return r - (self.U * less) @ (self.U.T @ r)


def discrepancy(W: np.ndarray) -> Discrepancy:
    """C of errors that spread over the whitened residual along the columns of W (n, k) for δ = 1.

    The smaller of W Wᵀ and Wᵀ W is decomposed; the latter over the ``MOST_PAIRS``
    strongest pairs.
    """
    if not W.size:  # no flexible mode of the model is near what was measured
        return Discrepancy(np.zeros((len(W), 0)), np.zeros(0))
    within = len(W) <= min(W.shape[1], MOST_PAIRS)
    if not within and W.shape[1] > MOST_PAIRS:
        W = W[:, np.argsort(-(W**2).sum(axis=0))[:MOST_PAIRS]]
    gram = W @ W.T if within else W.T @ W
    s, U = sl.eigh(gram, overwrite_a=True, check_finite=False, driver="evd")
    kept = s > CUT / FORMULATIONS.grid[-1] ** 2
    s, U = s[kept], U[:, kept]
    return Discrepancy(np.ascontiguousarray(U if within else W @ (U / np.sqrt(s))), s)
