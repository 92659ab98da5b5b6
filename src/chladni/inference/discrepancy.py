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
from typing import Protocol, Self

import numpy as np
import scipy.linalg as sl

from ..reduced.reduced_model import State

MEDIAN = 0.01  # of δ before it is learned
REACH = 1.5  # modes up to this many times the highest line take part
RIGID = 0.02  # of the highest line: below it a mode counts as rigid and is known
MOST_PAIRS = 2000  # pairs of modes, or samples, that are decomposed
CUT = 0.02  # variances below this share of the noise, at the largest δ, are left out
USUAL, BENT = 0.015, 3.0  # δ at which, and how often, terms of second order are counted
WRAPS = 0.4  # relative deviation of H from which its phase may wrap


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


class Lines(Protocol):
    """Responses on lines s, as :class:`.likelihood.Responses`."""

    @property
    def values(self) -> np.ndarray:
        """H (n_f, n_out, n_in)."""

    @property
    def s(self) -> np.ndarray:
        """(n_f,) [rad/s]."""

    @property
    def use(self) -> np.ndarray:
        """Lines and channels in use (n_f, n_out)."""

    @property
    def power(self) -> int:
        """Power of s by which the receptance is multiplied."""

    def modal(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """φ_o, φ_i and D."""

    def model(self, state: State) -> np.ndarray:
        """H of the model."""

    def std(self) -> np.ndarray:
        """Standard deviation of log10 H."""

    def wrong(self, state: State) -> np.ndarray | float:
        """E|d ln H|² of what sensors show wrongly by themselves."""

    def only(self, use: np.ndarray) -> Self:
        """Others in use."""

    def stacked(self, z: np.ndarray) -> np.ndarray:
        """Columns of residuals (n, k) of complex deviations over their spread (k, n_f, ...)."""


@dataclass(frozen=True, eq=False)
class Form:
    """The modes of a reference state in which the form of the model may change.

    Attributes
    ----------
    rows : (k, m)      of Φ⁻¹, the reference modes that take part
    lam : (k,)         their ω² [rad²/s²]
    """

    rows: np.ndarray
    lam: np.ndarray

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
    """Covariance C = I + δ² U diag(s) Uᵀ of whitened residuals.

    Attributes
    ----------
    U : (n, k)       orthonormal
    s : (k,)         variance along each column for δ = 1
    delta : float    standard deviation of the diagonal of G
    prior : FormPrior   of δ
    """

    U: np.ndarray
    s: np.ndarray
    delta: float = MEDIAN
    prior: FormPrior = FORMULATIONS

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

    def log_det(self) -> float:
        """Ln det C."""
        return float(np.log1p(self.delta**2 * self.s).sum())


def discrepancy(data: Lines, state: State) -> Discrepancy:
    """How errors of modal stiffness and mass at a state spread over the whitened residual.

    The smaller of W Wᵀ and Wᵀ W is decomposed; the latter over the ``MOST_PAIRS``
    strongest pairs.
    """
    W = columns(data, state, form(state, float(data.s.imag.max())))
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


def curvature(data: Lines, state: State) -> np.ndarray:
    """Standard deviation of log10 H beyond what is linear in G (n_f, n_out, n_in).

    For H = H_0 (1 + z) with z of variance σ², ln(1 + z) = z - z²/2. Near a zero of H, where σ is
    large, the logarithm is curved, and beyond σ = 0.4 its phase may wrap. The remaining part of the
    exact response to G is similar along lines and counts ``BENT`` times.
    """
    every = data.only(np.ones(data.use.shape, bool))
    var = (columns(every, state, form(state, float(data.s.imag.max()))) ** 2).sum(axis=1)
    sd = every.std() * np.log(10) * USUAL
    sigma2 = sd**2 * var.reshape(2, *data.values.shape).sum(axis=0) + data.wrong(state)
    return BENT * sigma2 / (2 * np.log(10)) * (1 + (sigma2 / WRAPS**2) ** 2)


def columns(data: Lines, state: State, about: Form) -> np.ndarray:
    """∂r/∂G and ∂r/∂G' of pairs of modes, times the standard deviation at δ = 1 (n, 2 pairs).

    dH = -s^k a_oᵀ (Λ^½ dG Λ^½ + s² dG') a_i with a = T D φ, T the reference modes' share in those
    of the state.
    """
    i, j = about.pairs.T
    phi_o, phi_i, d = data.modal(state)
    H, sd = data.model(state), data.std()
    T = about.rows @ state.vectors
    a_o = state.between(data.s, d, phi_o, T).transpose(2, 0, 1)
    a_i = state.between(data.s, d, T, phi_i).transpose(1, 0, 2)
    a_o = a_o * (data.s**data.power)[:, None]
    std = np.where(i == j, 0.5, np.sqrt(0.5))  # half, for i = j counts twice below
    root = np.sqrt(about.lam[i] * about.lam[j])
    out = np.empty((2, len(i), *H.shape), complex)
    for p in range(len(phi_i)):
        both = a_o[i] * a_i[j, :, p, None] + a_o[j] * a_i[i, :, p, None]
        both *= -std[:, None, None]
        out[0, ..., p] = root[:, None, None] * both
        out[1, ..., p] = data.s[:, None] ** 2 * both
    out /= H * sd * np.log(10)
    return data.stacked(out.reshape(2 * len(i), *H.shape))
