"""Modes of the reduced model."""

import numpy as np
import scipy.linalg as sl

from ..errors import ModelError

SEEN = 0.1  # rounding of the highest λ [rad²/s²] above which soft modes need another solver
FLEXIBLE, ROUNDING = 1e-9, 1e-12  # of the highest λ: flexible modes lie above; size of rounding


def real_modes(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """λ (m,) and φ (m, m) of K φ = λ M φ; a :class:`ModelError` says that an effect is wrong."""
    try:
        lam, phi = sl.eigh(K, M, driver="gvd", check_finite=True)
    except (sl.LinAlgError, ValueError) as error:
        raise ModelError(f"an effect left no positive mass: {error}") from error
    if lam[0] < -max(1e-6 * float(np.median(lam[flexible(lam)])), ROUNDING * lam[-1]):
        raise ModelError(f"an effect left negative stiffness: {lam[0]:.2e} rad²/s²")
    rounding = np.finfo(float).eps * float(lam[-1])
    if rounding > SEEN:
        return _softest_first(K, M, 1e7 * rounding)
    return lam, phi


def flexible(lam: np.ndarray) -> np.ndarray:
    """Mask (m,) of the modes that are not rigid."""
    return np.asarray(lam > FLEXIBLE * lam[-1])


def _softest_first(K: np.ndarray, M: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """λ and φ where a part is so stiff that its rounding would spoil soft modes.

    The problem M φ = μ (K + σM) φ with μ = 1 / (λ + σ) has the softest modes at the largest μ, and
    rounding is relative to these.
    """
    mu, phi = sl.eigh(M, K + shift * M, driver="gvd")
    mu, phi = mu[::-1], phi[:, ::-1]
    return 1 / mu - shift, phi / np.sqrt(np.einsum("ij,ij->j", phi, M @ phi))
