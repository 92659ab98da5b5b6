"""Static solutions of structures with a motion that has neither stiffness nor mass."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..sparse.factor import factorise
from ..sparse.multifrontal import NotDefinite
from .system import System

_STIFFENED = 1e-13  # of K_ii, added where a motion has neither stiffness nor mass
_DRIVEN = 1e-3  # of the work of a load, done on that addition, from which it drives such a motion


def stiffened(K: sp.csr_array) -> sp.csr_array:
    """K + ε diag K: holds a motion without stiffness and mass, and keeps the digits of all others.

    Nastran's MECHFIX also holds such massless mechanisms: a bar that spins about its axis between
    two points without inertia.
    """
    return sp.csr_array(K + _STIFFENED * sp.diags_array(K.diagonal()))


def static_solver(system: System, sigma: float) -> Callable[[np.ndarray], np.ndarray]:
    """X = (K - σM)⁻¹ B for columns B (n, k), σ < 0; massless mechanisms are held.

    Raises
    ------
    ModelError
        If a part is not connected, or a column of B drives a motion without resistance.
    """
    K, M, nodes = sp.csr_array(system.elastic), system.M, system.dofs[:, 0]
    try:
        return factorise(K - sigma * M, nodes=nodes).solve
    except NotDefinite:
        held = stiffened(K)
        factor = factorise(held - sigma * M, nodes=nodes)

    def solve(B: np.ndarray) -> np.ndarray:
        X = factor.solve(B)
        extra = np.einsum("nk,nk->k", X, (held - K) @ X)
        work = np.abs(np.einsum("nk,nk->k", X, B))
        if np.any(extra > _DRIVEN * work):
            raise ModelError(
                "a load drives a motion that has neither stiffness nor mass, for example the "
                "rotation of a bar without inertia about its axis; hold it or give it inertia"
            )
        return X

    return solve
