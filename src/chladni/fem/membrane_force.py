"""What a membrane force in sheets adds to their stiffness: K_g = ∫ ∂u/∂a · N_ab ∂u/∂b dA.

The same force pulls every component of u back, so that K_g = L ⊗ 1 with L a symmetric matrix of one
row a point whose rows sum to zero: translations cost exactly nothing, and L is a net of springs
-L_ij between points (Zienkiewicz and Taylor 2000, The Finite Element Method 2, 4.6 and 11.3; the
terms of motions in the sheet are small beside its own stiffness there).

Where the force does not vanish at the rim somebody holds it there. Were these pulls fixed in space,
to turn the sheet as a whole would cost; they are taken to turn with some grids at the rim instead,
as those of a frame do round a sheet: with θ the mean turn of these, the springs of the net feel
u_i - u_j - θ × (x_i - x_j). What is held at its rim has no such θ.
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
    """A force field over some shells, by what it does; all per unit of force.

    Attributes
    ----------
    net : (n, n) csr        L over the points of the assembly [-]
    moments : (6 n, 3) csr  K_g R, what turns of the whole do to motions of points [m]
    turning : (3, 3)        C = Rᵀ K_g R, what they cost [m²]
    """

    net: sp.csr_array
    moments: sp.csr_array
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
    """The assembly with a point that moves and turns as the mean of others, and its row."""
    grown, at = with_points(assembly, assembly.points[rows].mean(axis=0)[None])
    terms = tuple((int(r), (1, 2, 3), 1.0) for r in rows)
    mean = Average(next_id(assembly), int(at[0]), (1, 2, 3, 4, 5, 6), terms)
    return replace(grown, rigid=(*grown.rigid, mean)), int(at[0])


def geometric_stiffness(built: Structure, force: MembraneForce, rim: np.ndarray) -> sp.csr_array:
    """(1 - R B)ᵀ K_g (1 - R B) over the free motions, θ = B u the mean turn of the points ``rim``.

    No rigid motion costs anything, and what pulls everywhere has no negative stiffness.
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
