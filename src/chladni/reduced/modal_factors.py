"""Factors on the stiffness of modes: K becomes GᵀKG, which stays positive.

G = I + Φ W ΦᵀM changes only motions in the modes Φ of the deck, W = Λ^-½ e^{L/2} Λ^½ - I. The
derivative of e^{L/2} is that of a function of a matrix, by divided differences (Daleckii and Krein;
Higham 2008, Functions of Matrices, 3.11).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..effects.effect import ModalFactor, of
from .effect_dofs import Acting
from .matrix_slopes import MatrixSlopes

TOUCHED = 1e-12  # coordinate of a vector of the basis in a mode; less is rounding
CLOSE = 1e-9  # distance of two logarithms within which a divided difference is a derivative


@dataclass(frozen=True, eq=False)
class ModalFactors:
    """All factors on one set of modes."""

    rows: sp.csr_array  # (k, n) ΦᵀM
    W: np.ndarray  # (k, k)
    slopes: dict[int, np.ndarray]  # ∂W/∂x (k, k), by the position of the parameter

    def multiply(
        self, U: np.ndarray, V: np.ndarray, K: np.ndarray, dK: MatrixSlopes
    ) -> MatrixSlopes:
        """Make GᵀKG of K (m, m) in place; return its slopes from ∂K.

        U (r, k) are the modes over a basis, V (k, r) its coordinates in them.
        """
        a, b = _touched(U.T), _touched(V)  # the modes are among the vectors of most bases
        U, WV = U[a], self.W @ V[:, b]

        def G(z: np.ndarray) -> np.ndarray:
            z = z.copy()
            z[a] += U @ (WV @ z[b])
            return z

        def G_transposed(z: np.ndarray) -> np.ndarray:
            z[..., b, :] += WV.T @ (U.T @ z[..., a, :])
            return z

        out = dK.transformed(G, G_transposed)
        half = G_transposed(K[:, a] @ U)
        for p, dW in self.slopes.items():
            out.add_half(p, half, b, dW @ V[:, b])
        K[:, b] += (K[:, a] @ U) @ WV
        G_transposed(K)
        return out


def _touched(rows: np.ndarray) -> np.ndarray:
    """Columns that some row (k, m) has an entry in."""
    return np.flatnonzero(np.abs(rows).max(axis=0, initial=0.0) > TOUCHED)


def modal_factors(acting: Acting) -> list[ModalFactors]:
    """The factors of all effects, those on one set of modes as one."""
    sets: dict[int, list[tuple[slice, ModalFactor]]] = {}
    for _, at, terms in acting:
        for term in of(ModalFactor, terms):
            sets.setdefault(id(term.rows), []).append((at, term))
    return [_together(terms) for terms in sets.values()]


def _together(terms: list[tuple[slice, ModalFactor]]) -> ModalFactors:
    """e^{L/2} of the sum L of some logarithms, and its slopes."""
    _, first = terms[0]
    ratio = first.omega / first.omega[:, None]
    d, V = np.linalg.eigh(sum(term.log for _, term in terms))
    root, gap = np.exp(d / 2), d - d[:, None]
    close = np.abs(gap) < CLOSE
    divided = root[:, None] * np.where(close, 0.5, np.expm1(gap / 2) / np.where(close, 1.0, gap))
    slopes = {
        at.start + p: ratio * (V @ (divided * (V.T @ dL @ V)) @ V.T)
        for at, term in terms
        for p, dL in enumerate(term.gradient)
    }
    W = ratio * ((V * root) @ V.T) - np.eye(len(d))
    return ModalFactors(first.rows, W, slopes)
