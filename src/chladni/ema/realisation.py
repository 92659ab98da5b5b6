"""An identified model as a first-order system, residual terms turned into modes (inflation).

Gilbert (1963), SIAM J. Control 1, 128-151 (one block per pole and rank of its residue);
Echaniz Granado (2015), section 5.1, eqs. 6-8 (pseudo-rigid and high pole; mobility and acceleration
by C A, D = C B).
"""

import numpy as np
from scipy.linalg import block_diag

from ..dynamics.frf import Quantity
from ..dynamics.statespace import StateSpace
from ..errors import AccuracyError, LabelError
from .identification import DERIVATIVES, Identified

_FAR = 100.0  # the added poles lie that factor outside the band: they change it by 1e-4
_ZETA = 1e-3  # of the added poles: they settle, and turn the band by 2e-5 rad


def realised(
    identified: Identified, quantity: Quantity = "receptance", rank: float = 1e-6
) -> StateSpace:
    """Build real A, B, C, D of an identified model, in any quantity.

    L/s² becomes a mode a hundred times below the band, U one a hundred times above it. A velocity
    or acceleration output is C A or C A² of the displacement output. C B = 2 Re Σ R would be a jump
    of the displacement, which no mass permits. Noise in the residues causes it; the high pole
    compensates it.

    Parameters
    ----------
    rank : singular values of a residue below this share of its largest are left out
    """
    if quantity not in ("receptance", "mobility", "accelerance"):
        raise LabelError(f"no state space of {quantity!r}; receptance, mobility or accelerance")
    poles, residues = _inflated(identified)
    blocks, inputs, outputs = [], [], []
    for p, R in zip(poles, residues, strict=True):
        U, S, Vh = np.linalg.svd(R)
        for k in np.flatnonzero(rank * S[0] < S):
            blocks.append(np.array([[p.real, p.imag], [-p.imag, p.real]]))
            outputs.append(2 * S[k] * np.stack([U[:, k].real, U[:, k].imag], axis=1))
            inputs.append(np.stack([Vh[k].real, -Vh[k].imag]))
    A, B, C = block_diag(*blocks), np.vstack(inputs), np.hstack(outputs)
    D = np.zeros((len(C), B.shape[1]))
    for _ in range(DERIVATIVES[quantity]):
        C, D = C @ A, C @ B
    return StateSpace(A, B, C, D, identified.outputs, identified.inputs, quantity)


def _inflated(identified: Identified) -> tuple[np.ndarray, np.ndarray]:
    """Poles and receptance residues with the residual terms as two modes more."""
    low = 2 * np.pi * identified.band[0] / _FAR
    high = 2 * np.pi * identified.band[1] * _FAR
    added = np.array([low, high]) * (-_ZETA + 1j * np.sqrt(1 - _ZETA**2))
    constants = np.stack([identified.lower, identified.upper * high**2])
    extra = constants / (2j * added.imag)[:, None, None]
    extra[1] -= identified.residues.real.sum(axis=0) + extra.real.sum(axis=0)
    poles = np.concatenate([identified.poles, added])
    residues = np.concatenate([identified.residues, extra])
    alive = np.abs(residues).max(axis=(1, 2)) > 0
    if not alive.any():
        raise AccuracyError("the identified model has neither modes nor residual terms")
    return poles[alive], residues[alive]
