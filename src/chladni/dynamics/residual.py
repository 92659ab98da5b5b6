"""Residual vectors: the static response to a load outside the span of the kept modes."""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from .massless import static_solver
from .modes import ModalModel
from .system import System

_NEAR_STATIC = 1e-6  # of the highest λ kept: the shift that makes a free structure solvable
_ROUNDING = 1e-18  # of the energy in the modes: less is rounding, and the modes are complete
_BEYOND = 1e8  # times the highest λ kept: a residual vector above it has practically no mass


def with_residual_vectors(system: System, modal: ModalModel, load: np.ndarray) -> ModalModel:
    """The modes and R = (K + ε M)⁻¹ (P - M Φ Φᵀ P) made orthogonal, as modes above them.

    Rayleigh-Ritz in span(R) gives vectors with unit mass, orthogonal to Φ and to each other in M
    and K. With them the response to P is exact at low frequencies (Rose, Using residual vectors in
    MSC/NASTRAN dynamic analysis, 1991; Dickens, Nakagawa and Wittbrodt 1997).

    Parameters
    ----------
    load : (n, k)   P, real load patterns over the free dofs
    """
    phi, K, M = modal.shapes, system.elastic, system.M
    top = float((2 * np.pi * modal.frequency[-1]) ** 2) or 1.0
    solve = static_solver(system, -_NEAR_STATIC * top)
    R = solve(load - M @ (phi @ (phi.T @ load)))
    R = R - phi @ (phi.T @ (M @ R))
    lam = (2 * np.pi * modal.frequency) ** 2
    represented = ((phi.T @ load) ** 2 / (lam + _NEAR_STATIC * top)[:, None]).sum(axis=0)
    energy = np.einsum("nk,nk->k", R, K @ R)
    lam, R = _ritz(R[:, energy > _ROUNDING * represented], K, M, top)
    return replace(
        modal,
        frequency=np.concatenate([modal.frequency, np.sqrt(lam) / (2 * np.pi)]),
        damping=np.concatenate([modal.damping, np.zeros(len(lam))]),
        shapes=np.concatenate([phi, R], axis=1),
    )


def _ritz(R: np.ndarray, K: np.ndarray, M: np.ndarray, top: float) -> tuple[np.ndarray, np.ndarray]:
    """(λ increasing, vectors of unit mass) of span(R), without vectors of negligible mass."""
    if not R.shape[1]:
        return np.zeros(0), R
    R = R / np.sqrt(np.einsum("nk,nk->k", R, K @ R))
    stiff, turn = eigh(R.T @ (K @ R))
    R = R @ (turn[:, stiff > 1e-10] / np.sqrt(stiff[stiff > 1e-10]))  # unit strain energy
    slow, turn = eigh(R.T @ (M @ R))  # 1/λ
    kept = slow > 1 / (_BEYOND * top)
    lam = 1 / slow[kept]
    return lam[::-1], np.asarray((R @ turn[:, kept] * np.sqrt(lam))[:, ::-1])
