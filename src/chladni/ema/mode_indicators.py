"""Where modes are, read off the responses before anything is fitted.

Williams, Crowley and Vold (1985), IMAC III, 66-70 (MIF); Shih, Tsuei, Allemang and Brown (1988),
Mech. Syst. Signal Process. 2(4), 367-377 (CMIF).
"""

import numpy as np

from ..dynamics.frf import FRF
from .identification import DERIVATIVES


def cmif(frf: FRF) -> np.ndarray:
    """Singular values of H at every line (n_f, min(n_out, n_in)): peaks are modes."""
    return np.linalg.svd(np.nan_to_num(frf.values), compute_uv=False)


def mif(frf: FRF) -> np.ndarray:
    """1 - Σ |in phase| |H| / Σ |H|² over channels (n_f,): 1 where all channels move in quadrature.

    In phase with the force is the real part of receptance and accelerance, the imaginary part of
    mobility.
    """
    H = np.nan_to_num(frf.values)
    phase = H.imag if DERIVATIVES[frf.quantity] % 2 else H.real
    size = np.abs(H)
    whole = np.maximum((size**2).sum(axis=(1, 2)), 1e-300)
    return 1 - (np.abs(phase) * size).sum(axis=(1, 2)) / whole
