"""Geometric stiffness of a membrane force in sheets, K_g = ∫ ∂u/∂a · N_ab ∂u/∂b dA.

The force acts on every component of u in the same way, so that K_g = L ⊗ 1. L is symmetric, with
one row for each point, and its rows sum to zero: translations cost no energy. L is a net of springs
-L_ij between points (Zienkiewicz and Taylor 2000, The Finite Element Method 2, 4.6 and 11.3). The
terms of motions in the plane are small in comparison with the plane stiffness of the sheet.

A force that does not vanish at the rim is held there. Forces fixed in space would resist a rigid
rotation of the sheet. Instead they rotate with some grids at the rim, as in a frame round a sheet.
With θ the mean rotation of these grids, the springs of the net take u_i - u_j - θ × (x_i - x_j). A
sheet with supports at its rim has no such θ.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, Average
from .assemble import Structure
from .average import average_rows
from .energy import rigid_motions
from .shell_membrane import SLOPES as QUAD_SLOPES
from .sparse_assembly import congruence
from .triangle import SLOPES as TRIANGLE_SLOPES

NOTHING = 1e-12  # of the largest entry: rounding


@dataclass(frozen=True, eq=False)
class MembraneForce:
    """Operators of a force field over some shells, all per unit of force."""

    net: sp.csr_array  # (n, n) csr: L over the points of the assembly [-]
    # (6 n, 3) csr: K_g R, loads on the points in rigid rotations R of the whole [m]
    moments: sp.csr_array
    turning: np.ndarray  # (3, 3) C = Rᵀ K_g R, twice the energy of these rotations [m²]

    @property
    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of points (k, 2), and the stiffness -L_ij of each pair (k,)."""
        upper = sp.coo_array(sp.triu(self.net, 1))
        return np.column_stack([upper.row, upper.col]), -upper.data


def membrane_force(assembly: Assembly, shells: np.ndarray, tensor: np.ndarray) -> MembraneForce:
    """The force P F P in some shells, P the projection on the sheet.

    Parameters
    ----------
    shells : (k,) int      rows of ``assembly.shells``
    tensor : (3, 3)        F in the basic frame: e eᵀ is a unit force along e, 1 a biaxial one
    """
    n = len(assembly.points)
    entries = zip(*_entries(assembly, shells, tensor), strict=True)
    row, column, value = (np.concatenate(c) for c in entries)
    net = sp.csr_array((value, (row, column)), shape=(n, n))
    R = rigid_motions(assembly)[:, 3:]
    KR = _over_motions(net) @ R
    KR[np.abs(KR) < NOTHING * np.abs(KR).max(initial=0.0)] = 0.0
    return MembraneForce(net, sp.csr_array(KR), R.T @ KR)


def _over_motions(net: sp.csr_array) -> sp.csr_array:
    """L ⊗ 1 over the six motions of every point."""
    return sp.csr_array(sp.kron(net, sp.csr_array(np.diag([1.0, 1, 1, 0, 0, 0]))))


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


def with_mean(assembly: Assembly, rows: np.ndarray) -> tuple[Assembly, int]:
    """Add a point that translates and rotates as the mean of others; return also its row."""
    grown, at = with_points(assembly, assembly.points[rows].mean(axis=0)[None])
    terms = tuple((int(r), (1, 2, 3), 1.0) for r in rows)
    mean = Average(next_id(assembly), int(at[0]), (1, 2, 3, 4, 5, 6), terms)
    return replace(grown, rigid=(*grown.rigid, mean)), int(at[0])


def geometric_stiffness(built: Structure, force: MembraneForce, rim: np.ndarray) -> sp.csr_array:
    """(1 - R B)ᵀ K_g (1 - R B) over the free dofs, θ = B u the mean rotation of points ``rim``.

    Rigid motions cost no energy, and a force in tension everywhere is positive semidefinite.
    """
    bare = replace(built.assembly, axes=None, rigid=())
    grown, at = with_mean(bare, rim)
    mean = average_rows(grown, np.array([0]))
    where = (mean.dof[mean.row] - 6 * at, mean.on)
    B = sp.csr_array((mean.factor, where), shape=(6, 6 * len(grown.points)))
    B = B[3:, : built.T.shape[0]]
    KRB = force.moments @ B
    K = _over_motions(force.net) - KRB - KRB.T + B.T @ sp.csr_array(force.turning) @ B
    return congruence(built.T, sp.csr_array(K))
