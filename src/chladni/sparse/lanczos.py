"""Block Lanczos with full orthogonalisation in the mass inner product.

The operator is A⁻¹M with A = K - σM; its largest eigenvalues θ = 1/(λ - σ) belong to the lowest λ.
Grimes, Lewis and Simon 1994 (SIAM J. Matrix Anal. 15, 228), without their selective reduction. The
block recurrence orthogonalises up to rounding; one pass over the basis removes the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, cholesky, eigh, solve_triangular

_DROP = 1e-13  # of the operator's norm, below which a direction is not new
_THIN = 1e-5  # of it, below which rounding requires a second orthogonalisation of a column
_UNEVEN = 1e-2  # ratio of columns of a block, whose square is lost in digits of the Gram matrix


@dataclass(frozen=True, eq=False)
class Ritz:
    """Approximate eigenpairs, best first."""

    theta: np.ndarray  # (m,) Ritz values of A⁻¹M, decreasing
    error: np.ndarray  # (m,) |A⁻¹M x - θ x|_M / θ from the recurrence
    basis: np.ndarray  # (n, m) M-orthonormal Q
    weights: np.ndarray  # (m, m) S; the vectors are Q S

    def vectors(self, k: int) -> np.ndarray:
        """The first k Ritz vectors (n, k), M-orthonormal."""
        return np.asfortranarray(self.basis @ self.weights[:, :k])


def block_lanczos(
    solve: Callable[[np.ndarray], np.ndarray],
    M: sp.csr_array,
    k: int,
    *,
    block: int = 12,
    locked: np.ndarray | None = None,
    tolerance: float = 1e-8,
    largest_basis: int | None = None,
    seed: int = 0,
) -> Ritz:
    """The k largest θ of A⁻¹M x = θ x, and the other Ritz values of the basis.

    Parameters
    ----------
    solve : (n, b) -> (n, b)     applies A⁻¹, A positive definite
    M : (n, n)                   positive semidefinite
    locked : (n, l), optional    M-orthonormal vectors already found, kept out of the basis
    tolerance : float            on ``Ritz.error`` of the first k
    largest_basis : int          limit without convergence (the caller checks ``error``)
    """
    n = M.shape[0]
    run = _Run(M, locked, min(n, largest_basis or max(6 * k, 200)) + block)
    rng = np.random.default_rng(seed)
    run.start(solve(M @ rng.standard_normal((n, block))))
    look = 2 * k  # size of the basis at which Ritz values are computed next
    while True:
        run.step(solve)
        full = run.size + block > run.capacity or run.size >= n
        if full or run.size >= look:
            ritz = run.ritz()
            worst = ritz.error[:k].max() if len(ritz.error) >= k else np.inf
            if full or worst < tolerance:
                return ritz
            look = run.size + block * _blocks_ahead(worst / tolerance)
        if run.exhausted:
            run.start(solve(M @ rng.standard_normal((n, block))))
            if run.exhausted:
                return run.ritz()


def _blocks_ahead(excess: float) -> int:
    """Number of blocks until the next check; a block rarely improves by more than two digits."""
    return max(1, int(np.log10(min(excess, 1e8)) / 2))


class _Run:
    """The growing basis; Q in Fortran order so that its products are plain BLAS-3."""

    def __init__(self, M: sp.csr_array, locked: np.ndarray | None, capacity: int) -> None:
        self.M, self.locked, self.capacity = M, locked, capacity
        self.Q = np.empty((M.shape[0], capacity), order="F")
        self.H = np.zeros((capacity, capacity))
        self.size, self.norm = 0, 0.0
        self.last = self.before = slice(0, 0)  # columns of the last two blocks
        self.MQ = np.empty((M.shape[0], 0))  # M times the last block
        self.coupling = np.zeros((0, 0))  # R of the last step: W = Q_next R

    @property
    def exhausted(self) -> bool:
        """True if there is no new direction: the basis is invariant."""
        return self.last.stop - self.last.start == 0

    def start(self, X: np.ndarray) -> None:
        """Start a new block without coupling to the previous ones."""
        X = np.asfortranarray(X)
        X /= np.sqrt(np.maximum(np.einsum("ij,ij->j", X, self.M @ X), 1e-300))
        X, MX = self._swept(*self._swept(X, self.M @ X))
        self._append(X, MX, 1.0)
        self.coupling = np.zeros((self.last.stop - self.last.start, 0))
        self.before = slice(0, 0)

    def step(self, solve: Callable[[np.ndarray], np.ndarray]) -> None:
        """W = A⁻¹M Q_j - Q_j A_j - Q_{j-1} R_{j-1}ᵀ = Q_{j+1} R_j."""
        j, W = self.last, np.asfortranarray(solve(self.MQ))
        alpha = self.MQ.T @ W
        W -= self.Q[:, j] @ alpha
        if self.coupling.size:
            W -= self.Q[:, self.before] @ self.coupling.T
        self.H[j, j] = (alpha + alpha.T) / 2
        self.norm = max(self.norm, np.abs(alpha).max())
        W, MW = self._swept(W, self.M @ W)
        self.before = j
        self._append(W, MW, self.norm)
        self.H[self.last, j], self.H[j, self.last] = self.coupling, self.coupling.T

    def _swept(self, W: np.ndarray, MW: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """W - Q Qᵀ M W, with M W computed again unless the correction was rounding."""
        kept = [self.Q[:, : self.size], *([] if self.locked is None else [self.locked])]
        change = 0.0
        for Q in kept:
            C = Q.T @ MW
            W = blas.dgemm(-1.0, Q, C, beta=1.0, c=W, overwrite_c=True)  # in place
            change = max(change, np.abs(C).max(initial=0.0))
        size = np.sqrt(np.abs(np.einsum("ij,ij->j", W, MW)).min(initial=np.inf))
        return W, MW if change < 1e-11 * size else self.M @ W

    def _append(self, W: np.ndarray, MW: np.ndarray, norm: float) -> None:
        """Append Q with Q R = W and QᵀMQ = I; columns without new directions are left out."""
        w, V = eigh(_symmetric(W.T @ MW))
        keep = w > (_DROP * norm) ** 2
        scale = np.sqrt(w[keep])
        T, R = V[:, keep] / scale, (V[:, keep] * scale).T
        Q, MQ = blas.dgemm(1.0, W, T), MW @ T  # Q in Fortran order
        thin = np.any(scale < _THIN * norm)
        uneven = np.any(scale < _UNEVEN * scale.max(initial=0.0))
        for _ in range(3 if thin or uneven else 0):
            Q, MQ = self._swept(Q, self.M @ Q) if thin else (Q, self.M @ Q)
            G = _symmetric(Q.T @ MQ)
            L = cholesky(G, lower=True)
            Q, MQ = (np.asfortranarray(solve_triangular(L, Y.T, lower=True).T) for Y in (Q, MQ))
            R = L.T @ R
            if np.abs(G - np.eye(len(G))).max() < 1e-6:
                break
        self.last = slice(self.size, self.size + Q.shape[1])
        self.Q[:, self.last], self.MQ, self.coupling = Q, MQ, R
        self.size += Q.shape[1]

    def ritz(self) -> Ritz:
        """Eigenpairs of H over all blocks except the last, whose row gives the error."""
        m = self.last.start
        theta, S = eigh(self.H[:m, :m])
        theta, S = theta[::-1], S[:, ::-1]
        rest = np.linalg.norm(self.coupling @ S[self.before], axis=0) if self.coupling.size else 0.0
        error = rest / np.maximum(np.abs(theta), 1e-300) + np.zeros(m)
        return Ritz(theta, error, self.Q[:, :m], S)


def _symmetric(G: np.ndarray) -> np.ndarray:
    return (G + G.T) / 2
