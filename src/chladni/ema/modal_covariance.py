"""Covariance of identified poles, residues and shapes, due to noise.

The weighted least-squares problem is w(H - Φ(p) x_c) over all channels c. The poles p are common;
each channel has its residues x_c. Cov δp is the inverse of the Gauss-Newton matrix with the
residues eliminated. δx_c = D_c δp + (ΦᵀW²Φ)⁻¹ΦᵀW e_c, D_c = dx_c/dp (Golub and Pereyra 1973;
Pintelon and Schoukens 2012, System Identification, section 9.12). Therefore C = local + root rootᵀ.
The root has one column per real unknown of the poles. No matrix of all residues is formed.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import solve_triangular

from ..arrays import OneScreen
from .condensed_lines import affordable
from .pole_fitting import (
    PoleData,
    basis,
    channel_blocks,
    linear,
    normal_matrices,
    orthonormal,
    turned,
)

_RIDGE = 1e-12  # of the orthonormal basis, as the fit has it
_SINGULAR = 1e-12  # of the largest: directions of the poles that the data do not know


@dataclass(frozen=True, eq=False, repr=False)
class ModalCovariance(OneScreen):
    """δp_r = L_r z, δR_rc = S_rc z + e_rc, z of unit covariance, over real and imaginary part."""

    pole: np.ndarray  # (r, 2, m) L, roots: Cov(p_i, p_j) = L_i L_jᵀ [rad/s]
    shared: np.ndarray  # (r, n_c, 2, m) S: effect of the uncertain poles on all residues together
    local: np.ndarray  # (r, n_c, 2, 2) Cov e: effect of a channel's own noise on its residue

    def sel(self, modes: np.ndarray | slice) -> Self:
        """Some of the modes."""
        return replace(
            self, pole=self.pole[modes], shared=self.shared[modes], local=self.local[modes]
        )

    def of_mode(self, r: int) -> tuple[np.ndarray, np.ndarray]:
        """(root (2 + 2 n_c, m), local (2 n_c, 2 n_c) by its blocks) of pole and residues."""
        root = np.concatenate([self.pole[r][None], self.shared[r]])
        return root.reshape(-1, root.shape[-1]), self.local[r]


def modal_covariance(data: PoleData, p: np.ndarray, x: np.ndarray, noise: float) -> ModalCovariance:
    """Compute the covariance of all modes.

    Parameters
    ----------
    p, x : (r,), (2 r + 2, n_c)   the fit
    noise : χ² by degree of freedom
    """
    s, w = affordable(data.s, data.w, p)
    data = replace(
        data, s=s, y=np.zeros(w.shape, complex), w=w
    )  # of samples the noise alone counts
    A = linear(data.s, p, data.q)
    n, r, n_c = A.shape[1], len(p), x.shape[1]
    Q, R = orthonormal(data, np.concatenate([A, basis(data.s, p, data.q, 2)], axis=1))
    R1, R12, R2 = R[:n, :n], R[:n, n:], R[n:, n:]
    inverse = solve_triangular(R1, np.eye(n))[: 2 * r]
    H = np.zeros((2 * r, 2 * r))
    local, slope = np.empty((r, n_c, 2, 2)), np.empty((n_c, 2 * r, 2 * r))
    for at in channel_blocks(n_c, Q.shape[1]):
        G, _ = normal_matrices(Q, data, at)
        G[:, range(n), range(n)] += _RIDGE
        tied = np.linalg.solve(G[:, :n, :n], G[:, :n, n:])
        S = R2.T @ (G[:, n:, n:] - G[:, n:, :n] @ tied) @ R2
        K = inverse @ (R12 + tied @ R2)
        T = turned(x[: 2 * r, at].T)
        slope[at] = -np.einsum("cikm,ckma->cika", K.reshape(*K.shape[:2], r, 2), T).reshape(K.shape)
        H += np.einsum("ckma,ckmln,clnb->kalb", T, S.reshape(len(T), r, 2, r, 2), T,
                       optimize=True).reshape(2 * r, 2 * r)  # fmt: skip
        C = inverse @ np.linalg.solve(G[:, :n, :n], inverse.T)
        local[:, at] = np.einsum("ckikj->kcij", C.reshape(len(C), r, 2, r, 2))
    root = _inverse_root(H)
    shared = (slope @ root).reshape(n_c, r, 2, 2 * r).transpose(1, 0, 2, 3)
    scale = np.sqrt(noise)
    return ModalCovariance(scale * root.reshape(r, 2, 2 * r), scale * shared, noise * local)


def _inverse_root(H: np.ndarray) -> np.ndarray:
    """L with L Lᵀ = H⁻¹; unobservable directions are left out."""
    if not len(H):
        return H
    d = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    value, vector = np.linalg.eigh(d[:, None] * H * d)
    keep = np.where(value > _SINGULAR * value[-1], 1 / np.sqrt(np.maximum(value, 1e-300)), 0.0)
    return d[:, None] * vector * keep
