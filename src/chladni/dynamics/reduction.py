"""Galerkin bases that can carry the operators a search will try.

A basis of normal modes alone is blind to point springs, joints and stiff patches; static responses
to loads at those places (attachment modes) are added and everything is made M-orthonormal with a
relative cut.
Craig and Kurdila (2006), Fundamentals of Structural Dynamics, ch. 17.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from ..dofs import label
from ..errors import ModelError
from ..sparse.factor import Factor, factorise
from ..sparse.multifrontal import NotDefinite
from .system import System

CUT = 1e-5  # relative length below which a vector adds nothing to a basis


def orthonormal(
    M: sp.csr_array, blocks: Sequence[np.ndarray], cut: float = CUT, kept: int = 0
) -> np.ndarray:
    """Φ with ΦᵀMΦ = I that spans the blocks, in their order (n, r).

    A vector whose M-norm falls below ``cut`` of what it was, once the earlier ones are taken out
    of it, is dropped.  The first ``kept`` columns are M-orthonormal already and stay as they are.
    """
    basis = blocks[0][:, :kept]
    rest = [blocks[0][:, kept:], *blocks[1:]]
    for block in (b for b in rest if b.shape[1]):
        V = block / np.sqrt(np.maximum(np.einsum("ij,ij->j", block, M @ block), 1e-300))
        for _ in range(2):
            V = V - basis @ (basis.T @ (M @ V))
        w, U = np.linalg.eigh(V.T @ (M @ V))
        keep = w > cut**2
        V = V @ (U[:, keep] / np.sqrt(w[keep]))
        for _ in range(2):
            V = V - basis @ (basis.T @ (M @ V))
        basis = np.hstack([basis, V])
    return basis


def shifted(system: System, hertz: float, points: np.ndarray | None = None) -> Factor:
    """Factor of K + (2π f)² M, positive definite for a free structure too.

    The dofs of a node are kept together: to cut between them takes forty times as long to order.

    Raises
    ------
    ModelError
        If something can move without stiffness and without mass; the sentence says what.
    """
    A = sp.csc_array(system.K + (2 * np.pi * hertz) ** 2 * system.M)
    try:
        return factorise(A, points, nodes=system.dofs[:, 0])
    except NotDefinite as error:
        point, component = system.dofs[error.row].tolist()
        raise ModelError(
            f"{label(point, component)} can move without stiffness and without mass, as a chain of "
            "bars without torsional inertia can turn; hold it or give it inertia"
        ) from error


def attachments(factor: Factor, rows: sp.csr_array) -> np.ndarray:
    """Static responses (K + σM)⁻¹ Bᵀ to unit loads along the rows of B (n, k)."""
    return factor.solve(rows.toarray().T)
