"""Model-form error as a part of the model: modal stiffness and mass are random about their values.

K = Λ^½ (I + G) Λ^½ and M = I + G' in the modes of a state, G and G' symmetric with independent
entries of mean zero and variance δ² (1 + [i=j])/2 (Soize 2000, Prob. Eng. Mech. 15, 277-294, to
first order).  The responses depend on G linearly, log10 H = log10 H_0 + J vec(G), so the whitened
residual has the covariance C = I + δ² W Wᵀ.  One decomposition W Wᵀ = U diag(s) Uᵀ serves every δ:

ln det C = Σ ln(1 + δ² s),   C⁻¹ = I - U diag(δ² s / (1 + δ² s)) Uᵀ.

Without such a term parameters go wrong with confidence (Brynjarsdottir and O'Hagan 2014, Inverse
Problems 30, 114007).
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np
import scipy.linalg as sl

from .reduced import State

if TYPE_CHECKING:
    from .likelihood import Responses

MEDIAN, LOG_SD = 0.01, 0.7  # prior of δ: two formulations of one sheet differ by 0.3 to 4 %
GRID = np.geomspace(0.0008, 0.16, 16)  # values of δ over which an evidence is integrated
REACH = 1.5  # modes up to this many times the highest line take part
RIGID = 0.02  # of the highest line: below it a mode counts as rigid and is known
MOST = 2000  # pairs of modes, or samples, that are decomposed
CUT = 0.02  # variances below this share of the noise, at the largest δ, are left out
WRAPS = 0.4  # relative deviation of H from which its phase may wrap
BLOCK = 500  # pairs whose columns are held at once


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Covariance C = I + δ² U diag(s) Uᵀ of whitened residuals.

    Attributes
    ----------
    U : (n, k)       orthonormal
    s : (k,)         variance along each column for δ = 1
    delta : float    standard deviation of the diagonal of G
    """

    U: np.ndarray
    s: np.ndarray
    delta: float = MEDIAN

    def with_delta(self, delta: float) -> Self:
        """The same shapes of error, larger or smaller."""
        return replace(self, delta=delta)

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """C^-½ r of residuals or of columns of slopes (n, ...)."""
        less = 1 - 1 / np.sqrt(1 + self.delta**2 * self.s)
        return np.asarray(r - (self.U * less) @ (self.U.T @ r))

    def log_det(self) -> float:
        """Ln det C."""
        return float(np.log1p(self.delta**2 * self.s).sum())


def prior(delta: np.ndarray | float) -> np.ndarray:
    """-2 ln of the prior density of ln δ."""
    z = (np.log(delta) - np.log(MEDIAN)) / LOG_SD
    return np.asarray(z**2 + np.log(2 * np.pi * LOG_SD**2))


def discrepancy(data: "Responses", state: State) -> Discrepancy:
    """How errors of modal stiffness and mass at a state spread over the whitened residual.

    The smaller of W Wᵀ and Wᵀ W is decomposed; the latter over the ``MOST`` strongest pairs.
    """
    top = float(np.abs(data.s.imag).max())
    pairs = mode_pairs(state, top)
    n = 2 * int(data.use.sum()) * data.values.shape[2]
    if n <= MOST:
        gram = np.zeros((n, n))
        for at in range(0, len(pairs), BLOCK):
            W = columns(data, state, pairs[at : at + BLOCK])
            gram += W @ W.T
        s, U = sl.eigh(gram, overwrite_a=True, check_finite=False, driver="evd")
    else:
        W = np.concatenate(
            [columns(data, state, pairs[at : at + BLOCK]) for at in range(0, len(pairs), BLOCK)],
            axis=1,
        )
        W = W[:, np.argsort(-(W**2).sum(axis=0))[:MOST]]
        s, V = sl.eigh(W.T @ W, overwrite_a=True, check_finite=False, driver="evd")
        U = W @ (V / np.sqrt(np.maximum(s, 1e-300)))
    kept = s > CUT / GRID[-1] ** 2
    return Discrepancy(np.ascontiguousarray(U[:, kept]), s[kept])


def curvature(data: "Responses", state: State, delta: float) -> np.ndarray:
    """Standard deviation of log10 H beyond what is linear in G (n_f, n_out, n_in).

    For H = H_0 (1 + z), z of variance σ², ln(1 + z) = z - z²/2: near a zero of H, where σ is no
    longer small, the logarithm is bent, and beyond σ = 0.4 its phase may wrap.
    """
    every = replace(data, use=np.ones(data.use.shape, bool))
    pairs = mode_pairs(state, float(np.abs(data.s.imag).max()))
    var = np.zeros(2 * data.values.size)
    for at in range(0, len(pairs), BLOCK):
        var += (columns(every, state, pairs[at : at + BLOCK]) ** 2).sum(axis=1)
    sd = every.spread() * np.log(10) * delta
    sigma2 = sd**2 * var.reshape(2, *data.values.shape).sum(axis=0)
    return np.asarray(sigma2 / (2 * np.log(10)) * (1 + (sigma2 / WRAPS**2) ** 2))


def mode_pairs(state: State, top: float) -> np.ndarray:
    """Pairs i <= j of flexible modes up to ``REACH`` times the highest line [rad/s] (k, 2)."""
    omega = np.sqrt(np.maximum(state.lam, 0))
    modes = np.flatnonzero((omega > RIGID * top) & (omega < REACH * top))
    i, j = np.triu_indices(len(modes))
    return np.stack([modes[i], modes[j]], axis=1)


def columns(data: "Responses", state: State, pairs: np.ndarray) -> np.ndarray:
    """∂r/∂G and ∂r/∂G' of pairs of modes, times the standard deviation at δ = 1 (n, 2 k).

    dH = -s^k φ_o D (√(λ_i λ_j) dG + s² dG') D φ_i, and its mirror image.
    """
    i, j = pairs.T
    phi_o, phi_i, d = data.modal(state)
    H, sd = data.model(state), data.spread()
    s2 = data.s[:, None] ** 2
    both = d[:, i] * d[:, j] * data.s[:, None] ** data.power
    std = np.where(i == j, 0.5, np.sqrt(0.5))  # half, for i = j counts twice below
    over = [both * np.sqrt(np.maximum(state.lam[i] * state.lam[j], 0)), both * s2]
    out = np.empty((2, len(pairs), *H.shape), complex)
    for p in range(len(phi_i)):
        shape = (phi_o[:, i] * phi_i[p, j] + phi_o[:, j] * phi_i[p, i]) * std
        for q, spectrum in enumerate(over):
            out[q, ..., p] = -np.einsum("fk,ok->kfo", spectrum, shape)
    out /= H * sd * np.log(10)
    z = out[:, :, data.use].reshape(2 * len(pairs), -1).T
    return np.concatenate([z.real, z.imag])


@dataclass(frozen=True, eq=False)
class Learned:
    """Evidence over all δ, and which δ the data prefer.

    Attributes
    ----------
    S : float                -2 ln evidence, δ integrated out
    delta : float            its most probable value
    """

    S: float
    delta: float


def learned(
    error: Discrepancy, r: np.ndarray, J: np.ndarray, r0: np.ndarray, J0: np.ndarray
) -> Learned:
    """Integrate δ out of the evidence of a model linearised at its fit.

    Parameters
    ----------
    r, J : (n,), (n, n_p)      residuals of the data and slopes, not yet whitened by C
    r0, J0 : (m,), (m, n_p)    those of the priors and the scales
    """
    u, V = error.U.T @ r, error.U.T @ J
    A0, g0, c0 = J.T @ J + J0.T @ J0, J.T @ r + J0.T @ r0, float(r @ r + r0 @ r0)
    S = np.empty(len(GRID))
    for k, delta in enumerate(GRID):
        v = delta**2 * error.s
        w = v / (1 + v)
        A, g = A0 - (V.T * w) @ V, g0 - V.T @ (w * u)
        L = np.linalg.cholesky(A)
        cost = c0 - w @ u**2 - float((sl.solve_triangular(L, g, lower=True) ** 2).sum())
        S[k] = cost + 2 * np.log(np.diag(L)).sum() + np.log1p(v).sum() + prior(delta)
    width = np.log(GRID[1] / GRID[0])
    best = int(np.argmin(S))
    total = S[best] - 2 * np.log(np.exp(-(S - S[best]) / 2).sum() * width)
    return Learned(float(total), _peak(S, best))


def _peak(S: np.ndarray, best: int) -> float:
    """Where the parabola through the best three values has its foot."""
    if not 0 < best < len(S) - 1:
        return float(GRID[best])
    a, b, c = S[best - 1 : best + 2]
    shift = 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
    return float(GRID[best] * (GRID[1] / GRID[0]) ** np.clip(shift, -1, 1))
