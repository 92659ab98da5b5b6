"""A structure with movable supports: motions of its clamps are additional dofs.

u = T q + N g: g moves supports, as rigid clamps or along their lines. N is the motion
of the points that they hold. A matrix A of elements becomes [T N]ᵀ A [T N]. The static
response of the structure to a motion of a clamp is then -K_qq⁻¹ K_qg (constraint modes; Craig and
Bampton 1968, AIAA Journal 6, 1313-1319).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..dynamics.system import System
from ..model.assembly import Assembly, Average, Equation, RigidBody
from .assemble import Structure, over_all_motions, supported
from .energy import rigid_motions
from .sparse_assembly import congruence


@dataclass(frozen=True, eq=False)
class Clamp:
    """Supports of points that elements connect, treated as one rigid body."""

    grids: np.ndarray  # (k,) int: ids of the points
    held: np.ndarray  # (k, 6) bool: components of each that it holds
    centre: np.ndarray  # (3,) mean of the points [m]


def clamps(assembly: Assembly) -> tuple[Clamp, ...]:
    """The clamps of a structure, in the order of their first grids.

    A point belongs to a clamp if a translation is held and elements or rigid bodies end there. A
    component that is held at every point, as the rotation about z of a flat model, is not a clamp.
    """
    n = len(assembly.points)
    touching = _elements(assembly)
    on = np.zeros(n, bool)
    on[touching.indices] = True
    held = np.zeros((n, 6), bool)
    held[assembly.supports[:, 0], assembly.supports[:, 1] - 1] = True
    held &= on[:, None]
    held[:, held[on].all(axis=0)] = False
    rows = np.flatnonzero(held[:, :3].any(axis=1))
    if not len(rows):
        return ()
    mine = sp.csr_array(touching[:, rows])
    _, which = connected_components(mine.T @ mine, directed=False)
    return tuple(
        Clamp(assembly.ids[at], held[at], assembly.points[at].mean(axis=0))
        for at in (rows[which == k] for k in range(which.max() + 1))
    )


def _elements(assembly: Assembly) -> sp.csr_array:
    """Incidence of points on each element, spring or rigid body (elements, points)."""
    springs = [each.nodes[(each.nodes >= 0).all(axis=1)]
               for each in (assembly.bushes, assembly.springs)]  # fmt: skip
    solids = (s.nodes for s in assembly.solids)
    tables = [assembly.shells.nodes, assembly.beams.nodes, *springs, *solids]
    each = [nodes for table in tables for nodes in table.tolist()]
    for body in assembly.rigid:
        if isinstance(body, RigidBody):
            each.append([body.independent, *body.dependent])
        elif isinstance(body, Average):
            each.append([body.reference, *(row for row, _, _ in body.terms)])
        elif isinstance(body, Equation):
            each.append(list(body.nodes))
    ends = np.cumsum([0, *map(len, each)])
    at = np.array([row for nodes in each for row in nodes], np.int64)
    return sp.csr_array((np.ones(len(at)), at, ends), shape=(len(each), len(assembly.points)))


@dataclass(frozen=True, eq=False)
class Supports:
    """The supports of a structure, and the forces of some motions on them.

    Attributes
    ----------
    motions : (6 n_points, k)   unit motion of each support
    dofs : (k, 2)               row of its point, component 1-6
    force : (k, r)              on it, of each motion of the structure
    """

    motions: sp.csr_array
    dofs: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, built: Structure, shapes: np.ndarray) -> Self:
        """The supports of a structure that moves by ``shapes`` (n, r)."""
        motions, dofs = supported(built.assembly)
        _, _, K, _ = over_all_motions(built.assembly)
        return cls(motions, dofs, motions.T @ (K @ (built.T @ shapes)))

    def directions(self, assembly: Assembly) -> np.ndarray:
        """Unit vector (k, 3) along or about which each support holds, in the basic frame."""
        at, component = self.dofs[:, 0], self.dofs[:, 1] - 1
        if assembly.axes is None:
            return np.asarray(np.eye(3)[component % 3])
        return np.asarray(assembly.axes[at, component % 3])


def rigid_moves(assembly: Assembly, supports: Supports, held_by: tuple[Clamp, ...]) -> np.ndarray:
    """Motion (k, 6 clamps) of each support when a clamp translates or rotates."""
    at, component = supports.dofs[:, 0], supports.dofs[:, 1] - 1
    axes = supports.directions(assembly)
    triple = (3 * (component // 3))[:, None] + np.arange(3)
    columns = []
    for clamp in held_by:
        of_clamp = np.zeros((len(assembly.points), 6), bool)
        of_clamp[assembly.rows(clamp.grids)] = clamp.held
        about = replace(assembly, points=assembly.points - clamp.centre)
        R = rigid_motions(about).reshape(-1, 6, 6)[at[:, None], triple]
        columns.append(np.where(of_clamp[at, component, None], np.einsum("ka,kaj->kj", axes, R), 0))
    return np.hstack(columns)


@dataclass(frozen=True, eq=False)
class Release:
    """Motions of supports that become degrees of freedom, and springs on them.

    Attributes
    ----------
    motions : (6 n_points, p)   of all points, by a unit of each
    labels : (p, 2) int         grid and component that stand for it
    springs : (p,)              as good as rigid [N/m, N m/rad]
    """

    motions: sp.csr_array
    labels: np.ndarray
    springs: np.ndarray

    def of(self, built: Structure) -> Structure:
        """The structure with these degrees of freedom after its own."""
        T = sp.csr_array(sp.hstack([built.T, self.motions]))
        M, V, K, loss = over_all_motions(built.assembly)
        dofs = np.concatenate([built.system.dofs, self.labels])
        springs = np.zeros(len(dofs))
        springs[len(built.system.dofs) :] = self.springs
        K_held = sp.csr_array(congruence(T, K) + sp.diags_array(springs))
        system = System(congruence(T, M), congruence(T, V), K_held, dofs)
        return replace(built, T=T, system=system, loss=congruence(T, loss))
