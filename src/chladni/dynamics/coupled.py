"""Receptance of modes that damping couples: dashpots, loss factors, modal damping, all at once."""

import numpy as np
import scipy.sparse as sp

from .frf import Residual
from .modes import ModalModel


def coupled_receptance(
    modal: ModalModel,
    phi_out: np.ndarray,
    phi_in: np.ndarray,
    frequency: np.ndarray,
    *,
    V: sp.csr_array | None = None,
    loss: sp.csr_array | None = None,
    residual: Residual | None = None,
) -> np.ndarray:
    """H(ω) = φ_o [Λ (1 + 2 i ζ) - ω² I + i ω ΦᵀVΦ + i ΦᵀK_lossΦ]⁻¹ φ_iᵀ + R(ω).

    Structural modal damping 2 ζ_r; without V and loss this is plain superposition.

    Parameters
    ----------
    phi_out, phi_in : (n_out, r), (n_in, r)   rows of Φ or combinations [1/√kg]
    frequency : (n_f,)                        [Hz]
    V, loss : (n, n) sparse, optional         [N s/m], imaginary stiffness [N/m]

    Returns
    -------
    (n_f, n_out, n_in) complex [m/N]
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)[:, None, None]
    lam, eye = (2 * np.pi * modal.frequency) ** 2, np.eye(len(modal))
    Z = np.diag(lam * (1 + 2j * modal.damping)) - omega**2 * eye
    for factor, A in ((1j * omega, V), (1j, loss)):
        if A is not None and A.nnz:
            Z = Z + factor * (modal.shapes.T @ (A @ modal.shapes))
    H = phi_out @ np.linalg.solve(Z, np.broadcast_to(phi_in.T, (len(omega), *phi_in.T.shape)))
    return H if residual is None else H + residual.at(1j * omega[:, 0, 0])
