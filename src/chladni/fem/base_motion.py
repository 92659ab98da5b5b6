"""Base excitation: all supports move together; the relative motion and its load.

With u = T q + R b ξ every point follows the base rigidly and moves by q relative to it. The free
dofs obey M q'' + V q' + K q = -Tᵀ M_full R b ξ''. An output with rigid motion d has
X/ξ = d - s² r (K + s V + s² M)⁻¹ Tᵀ M_full R b. This is exact and needs no large mass. Source:
Craig and Kurdila (2006), Fundamentals of Structural Dynamics, section 9.5. Connections to ground
become connections to the base.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from .assemble import Structure, mass_over_all_motions
from .energy import rigid_motions
from .solve import inertia_load


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Unit translations b of all supports along directions."""

    whole: np.ndarray  # (6 n_points, k) R b, rigid motion of every point in the basic frame [-]
    free: np.ndarray  # (n_free, k) the same over the free dofs
    force: np.ndarray  # (n_free, k) Tᵀ M_full R b [kg]; a unit acceleration has the load minus this

    def extended_to(self, built: Structure) -> "BaseMotion":
        """Extend to a structure with additional dofs, whose motion is relative to the base too."""
        more = built.T.shape[1] - len(self.free)
        force = built.T.T @ (mass_over_all_motions(built.assembly) @ self.whole)
        return BaseMotion(self.whole, np.pad(self.free, ((0, more), (0, 0))), np.asarray(force))

    def moved_with_base(self, rows: sp.csr_array) -> np.ndarray:
        """Motion (m, k) of rows (m, n) in the rigid motion of the base."""
        return np.asarray(rows @ self.free[: rows.shape[1]])


def base_motion(built: Structure, directions: np.ndarray) -> BaseMotion:
    """Motion of the supports along each of these unit vectors (k, 3) of the basic frame."""
    b, assembly = np.asarray(directions, float).T, built.assembly
    whole = rigid_motions(assembly)[:, :3] @ b
    at, component = assembly.rows(built.system.dofs[:, 0]), built.system.dofs[:, 1] - 1
    axes = np.broadcast_to(np.eye(3), (len(assembly.points), 3, 3))
    if assembly.axes is not None:
        axes = assembly.axes
    moves = component < 3
    if assembly.scalar_points is not None:
        moves &= ~np.isin(at, assembly.scalar_points)
    ways = np.where(moves[:, None], axes[at, component % 3], 0.0)
    return BaseMotion(whole, ways @ b, np.asarray(built.T.T @ inertia_load(assembly, b)))
