"""Responses of an article with attached couplings, and the distance between two responses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .article_modes import ArticleModes
from .mesh_transfer import MeshTransfer

LINES_AT_ONCE = 64
Law = Callable[[np.ndarray], np.ndarray]  # complex (n_f,) of s (n_f,) [rad/s]


@dataclass(frozen=True, eq=False)
class Coupling:
    """A coupling on the article with the force -D(s) q under its motion q = W u."""

    rows: np.ndarray  # (k,) int: of the article's points
    weights: np.ndarray  # (n, k, 3) q from the translations of these points
    # (n_f,) -> (n_f, n, n) dynamic stiffness D at s [rad/s]
    stiffness: Callable[[np.ndarray], np.ndarray]


def seen(modes: ArticleModes, foot: MeshTransfer, directions: np.ndarray) -> np.ndarray:
    """Mode shapes (k, r) at places along directions."""
    motion = np.einsum("kc,kcir->kir", foot.weights, modes.at(foot.rows))
    return np.einsum("kir,ki->kr", motion, directions)


def accelerance(
    modes: ArticleModes,
    phi_out: np.ndarray,
    phi_in: np.ndarray,
    zeta: np.ndarray,
    frequency: np.ndarray,
    couplings: Sequence[Coupling] = (),
    law: Law | None = None,
) -> np.ndarray:
    """H = s² Φ_o [s² + 2ζω_r s + ω_r² + e(s)L + Σ BᵀD(s)B]⁻¹ Φ_iᵀ, line by line (n_f, n_out, n_in).

    Parameters
    ----------
    phi_out, phi_in : (n_out, r), (n_in, r)
    zeta : (r,)
    law : e(s) of the parts with losses; i where it is not given
    """
    s = 2j * np.pi * frequency
    w = 2 * np.pi * modes.frequency
    d = s[:, None] ** 2 + 2 * zeta * w * s[:, None] + w**2
    tied = [(np.einsum("nki,kir->nr", c.weights, modes.at(c.rows)), c.stiffness) for c in couplings]
    if not tied and not modes.loss.any():
        return (phi_out / d[:, None, :]) @ phi_in.T * s[:, None, None] ** 2
    out = []
    for k in range(0, len(s), LINES_AT_ONCE):
        part = slice(k, k + LINES_AT_ONCE)
        e = np.full(len(s[part]), 1j) if law is None else law(s[part])
        Z = d[part, :, None] * np.eye(len(w)) + e[:, None, None] * modes.loss
        for B, stiffness in tied:
            Z = Z + np.einsum("nr,fnm,mq->frq", B, stiffness(s[part]), B, optimize=True)
        out.append(
            phi_out @ np.linalg.solve(Z, np.broadcast_to(phi_in.T, (len(Z), *phi_in.T.shape)))
        )
    return np.concatenate(out) * s[:, None, None] ** 2
