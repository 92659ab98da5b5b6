"""Receptance of modes coupled by damping: dashpots, loss factors and modal damping together."""

import numpy as np
import scipy.sparse as sp

from .frf import Residual
from .modes import ModalModel

_ENTRIES = 2_000_000  # of the matrices in memory at a time


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
    structural :                              2 i ζ Λ instead of the viscous modal term

    Returns
    -------
    (n_f, n_out, n_in) complex [m/N]
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    w_r = 2 * np.pi * modal.frequency
    c = 2j * modal.damping * (w_r**2 if structural else w_r)
    d = w_r**2 - omega[:, None] ** 2 + (1 if structural else omega[:, None]) * c
    tied = {
        power: modal.shapes.T @ (A @ modal.shapes)
        for power, A in enumerate((loss, V))
        if A is not None and A.nnz
    }
    H = _solved(d, tied, omega, phi_out, phi_in.T)
    return H if residual is None else H + residual.at(1j * omega)


def _solved(
    d: np.ndarray,
    tied: dict[int, np.ndarray],
    omega: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
) -> np.ndarray:
    """L [diag(d) + i Σ ω^p A_p]⁻¹ R line by line; ``tied`` is {p: A_p}."""
    if not tied:
        return (left / d[:, None, :]) @ right
    r, out = d.shape[1], []
    step = max(1, _ENTRIES // max(r * r, 1))
    for k in range(0, len(omega), step):
        w = omega[k : k + step, None, None]
        Z = d[k : k + step, :, None] * np.eye(r) + sum(1j * w**p * A for p, A in tied.items())
        out.append(left @ np.linalg.solve(Z, np.broadcast_to(right, (len(w), *right.shape))))
    return np.concatenate(out)
