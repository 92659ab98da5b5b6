"""What a membrane force in sheets adds to their stiffness: K_g = ∫ ∂u/∂a · N_ab ∂u/∂b dA.

The same force pulls every component of u back, so that K_g = L ⊗ 1 with L a symmetric matrix of one
row a point whose rows sum to zero: translations cost exactly nothing, and L is a net of springs
-L_ij between points (Zienkiewicz and Taylor 2000, The Finite Element Method 2, 4.6 and 11.3; the
terms of motions in the sheet are small beside its own stiffness there).

Where the force does not vanish at the rim somebody holds it there. Were these pulls fixed in space,
to turn the sheet as a whole would cost C = Σ_ij -L_ij (d² 1 - d dᵀ), d the way from i to j; they
are taken to turn with it instead, as those of a frame do round a sheet.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from .assemble import Structure
from .energy import rigid_motions
from .shell_membrane import SLOPES as QUAD_SLOPES
from .sparse_assembly import congruence
from .triangle import SLOPES as TRIANGLE_SLOPES

TURNS = 1e-6  # of the dearest turn: what costs less is free by itself


@dataclass(frozen=True, eq=False)
class MembraneForce:
    """A force field over some shells, by what it does.

    Attributes
    ----------
    net : (n, n) csr     L over the points of the assembly, per unit of force [-]
    turning : (3, 3)     C, what turns of the whole would cost [m²]
    """

    net: sp.csr_array
    turning: np.ndarray

    @property
    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 2) that are tied, and -L_ij of each pair (k,)."""
        upper = sp.coo_array(sp.triu(self.net, 1))
        return np.column_stack([upper.row, upper.col]), -upper.data


def membrane_force(assembly: Assembly, shells: np.ndarray, tensor: np.ndarray) -> MembraneForce:
    """The force P F P in some shells, P the projection on the sheet.

    Parameters
    ----------
    shells : (k,) int      rows of ``assembly.shells``
    tensor : (3, 3)        F in the basic frame: e eᵀ is a unit force along e, 1 one all round
    """
    n = len(assembly.points)
    entries = zip(*_entries(assembly, shells, tensor), strict=True)
    row, column, value = (np.concatenate(c) for c in entries)
    net = sp.csr_array((value, (row, column)), shape=(n, n))
    net.sum_duplicates()
    made = MembraneForce(net, np.zeros((3, 3)))
    (i, j), k = made.springs[0].T, made.springs[1]
    d = assembly.points[j] - assembly.points[i]
    cost = (k * (d**2).sum(axis=1)).sum() * np.eye(3) - np.einsum("k,ka,kb->ab", k, d, d)
    return MembraneForce(net, cost)


def _entries(
    assembly: Assembly, shells: np.ndarray, tensor: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(i, j, ∫ ∇N_i F ∇N_j dA) of quadrilaterals, then of triangles."""
    triangle = assembly.shells.triangle[shells]
    for some, slopes, weight in (
        (shells[~triangle], QUAD_SLOPES, 1.0), (shells[triangle], TRIANGLE_SLOPES[None, :, :3], 0.5)
    ):  # fmt: skip
        nodes = assembly.shells.nodes[some, : slopes.shape[2]]
        J = slopes @ assembly.points[nodes][:, None]  # (m, g, 2, 3): the surface's own base
        metric = J @ J.swapaxes(2, 3)
        grad = slopes.swapaxes(1, 2) @ np.linalg.solve(metric, J)  # ∇N in the sheet (m, g, k, 3)
        dA = weight * np.sqrt(np.linalg.det(metric))
        K = np.einsum("mg,mgia,ab,mgjb->mij", dA, grad, tensor, grad, optimize=True)
        k = nodes.shape[1]
        yield np.repeat(nodes, k, axis=1).ravel(), np.tile(nodes, k).ravel(), K.ravel()


def geometric_stiffness(
    built: Structure, force: MembraneForce
) -> tuple[sp.csr_array, sp.csr_array]:
    """K_g (n, n) of a unit force, and rows b (k, n) with K_g - Σ bᵀ b idle in every turn.

    With R the turns, K_g - K_g R (Rᵀ K_g R)⁻¹ Rᵀ K_g. Where the sheet is held at its rim b is
    nothing: ∫ ∂w/∂a dA is that of w round the rim.
    """
    translations = sp.csr_array(np.diag([1.0, 1, 1, 0, 0, 0]))
    K = sp.csr_array(sp.kron(force.net, translations))
    KR = K @ rigid_motions(built.assembly)[:, 3:]
    cost, axes = np.linalg.eigh(force.turning)
    kept = cost > TURNS * cost.max()
    rows = (KR @ (axes[:, kept] / np.sqrt(cost[kept]))).T
    return congruence(built.T, K), sp.csr_array(sp.csr_array(rows) @ built.T)
