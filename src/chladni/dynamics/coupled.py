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
    structural: bool = False,
) -> np.ndarray:
    """H(ω) = φ_o [Λ + 2 i ω ζ Ω - ω² I + i ω ΦᵀVΦ + i ΦᵀK_lossΦ]⁻¹ φ_iᵀ + R(ω), Λ = Ω².

    Without V and loss this is plain superposition.

    Parameters
    ----------
    phi_out, phi_in : (n_out, r), (n_in, r)   rows of Φ or combinations [1/√kg]
    frequency : (n_f,)                        [Hz]
    V, loss : (n, n) sparse, optional         [N s/m], imaginary stiffness [N/m]
    structural :                              2 i ζ Λ in place of the viscous modal term

    Returns
    -------
    (n_f, n_out, n_in) complex [m/N]
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)[:, None, None]
    w_r, eye = 2 * np.pi * modal.frequency, np.eye(len(modal))
    modal_loss = np.diag(2j * modal.damping * (w_r**2 if structural else w_r))
    Z = np.diag(w_r**2) - omega**2 * eye + (1 if structural else omega) * modal_loss
    for factor, A in ((1j * omega, V), (1j, loss)):
        if A is not None and A.nnz:
            Z = Z + factor * (modal.shapes.T @ (A @ modal.shapes))
    H = phi_out @ np.linalg.solve(Z, np.broadcast_to(phi_in.T, (len(omega), *phi_in.T.shape)))
    return H if residual is None else H + residual.at(1j * omega[:, 0, 0])
