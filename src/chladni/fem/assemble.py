"""From an assembly to the matrices of its free degrees of freedom.

Every point has six motions in the basic frame, u = T q with q the free dofs. T contains the
displacement frames, rigid elements and constraint equations. It leaves out supports and dofs
without stiffness. An element matrix A over any points adds Tᵀ A T.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..dofs import rows as label_rows
from ..dynamics.system import System
from ..errors import LabelError, ModelError
from ..model.assembly import Assembly, picked
from ..results import ShownBriefly
from . import shell
from .negative_springs import refuse_unstable
from .shell_section import SectionArrays, section_arrays
from .sparse_assembly import (
    EVERY,
    INERTIA,
    TRANSLATIONS,
    accumulate,
    blocks,
    congruence,
    narrowed,
)

EMPTY = 1e-8  # of the stiffest direction of a point: Nastran's EPZERO of AUTOSPC
PIECE = 1024  # elements whose matrices are in memory at a time


@dataclass(frozen=True, eq=False, repr=False)
class Structure(ShownBriefly):
    """The assembled matrices and the transformation from the free dofs to the motion of points."""

    assembly: Assembly
    T: sp.csr_array  # (6 n_points, n_free) csr: motion of every point in the basic frame, u = T q
    system: System  # M, V, K over the free dofs; K real
    # (n_free, n_free) csr: imaginary part of the stiffness from materials' damping [N/m]
    loss: sp.csr_array

    def scatter(self, matrices: np.ndarray, nodes: np.ndarray) -> sp.csr_array:
        """Tᵀ A T of element matrices A: (n_free, n_free).

        Parameters
        ----------
        matrices : (m, 6k, 6k)      basic frame, nodal order ux uy uz rx ry rz
        nodes : (m, k) int          rows of points
        """
        return congruence(self.T, blocks(matrices, nodes, len(self.assembly.points)))

    def contribution(self, elements: Assembly) -> tuple[sp.csr_array, sp.csr_array]:
        """Tᵀ K T and Tᵀ M T of elements over the same points: what they add to the system.

        Parameters
        ----------
        elements : an assembly of these alone, as :func:`.energy.only` makes it

        Raises
        ------
        ModelError
            If it has other points.
        """
        if len(elements.points) != len(self.assembly.points):
            raise ModelError(
                f"the elements are over {len(elements.points)} points, the structure over "
                f"{len(self.assembly.points)}"
            )
        M, _, K, _ = over_all_motions(elements)
        return congruence(self.T, K), congruence(self.T, M)

    def rows(self, dofs: np.ndarray) -> sp.csr_array:
        """Motion at (point id, component 1-6) in the point's displacement frame: (k, n_free)."""
        dofs = np.asarray(dofs, dtype=np.int64)
        at, component = self.assembly.rows(dofs[:, 0]), dofs[:, 1] - 1
        if np.any(bad := (component < 0) | (component > 5)):
            raise LabelError(f"no component {dofs[bad][0, 1]} at a grid; there are 1 to 6")
        axes = np.eye(3)[component % 3]
        if self.assembly.axes is not None:
            axes = self.assembly.axes[at, component % 3]
        return self._directions(6 * at + 3 * (component // 3), axes)

    def along(self, ids: np.ndarray, directions: np.ndarray, turning: bool = False) -> sp.csr_array:
        """Translation of the points with these ids along directions (k, 3) of the basic frame.

        Their rotation about the directions where ``turning``.
        """
        first = 6 * self.assembly.rows(ids) + (3 if turning else 0)
        return self._directions(first, np.asarray(directions, float))

    def hysteretic(self) -> System:
        """The system with the complex stiffness K (1 + i g) + i K_loss."""
        s, g = self.system, self.assembly.structural_damping
        return System(s.M, s.V, sp.csr_array(s.K * (1 + 1j * g) + 1j * self.loss), s.dofs)

    def _directions(self, first: np.ndarray, axes: np.ndarray) -> sp.csr_array:
        k = len(first)
        columns = (first[:, None] + np.arange(3)).ravel()
        pick = sp.csr_array(
            (axes.ravel(), (np.repeat(np.arange(k), 3), columns)), shape=(k, self.T.shape[0])
        )
        pick.eliminate_zeros()
        return sp.csr_array(pick @ self.T)


def structure(assembly: Assembly, *, residual_bending: bool = True) -> Structure:
    """Assemble M, V, K of all families and reduce them to the free dofs.

    Parameters
    ----------
    residual_bending : bool
        MacNeal's residual bending flexibility in shells (agreement with Nastran).

    Raises
    ------
    ModelError
        If no degree of freedom is left free, or a spring of negative stiffness makes it unstable.
    """
    M, V, K, loss = over_all_motions(assembly, residual_bending)
    T, dofs = _transformation(assembly)
    held = _held(assembly, dofs)
    T, dofs = sp.csr_array(T[:, ~held]), dofs[~held]
    K = congruence(T, K)  # one after the other: K of all motions is freed first
    M = congruence(T, M)
    idle = _without_stiffness(K, M, dofs, assembly.auto_spc)
    kept = np.flatnonzero(~idle)
    if not len(kept):
        why = "the supports hold all" if held.all() else "no element stiffens those that are free"
        raise ModelError(f"no degree of freedom is left: {why}")
    if idle.any():
        K, M, T, dofs = K[kept][:, kept], M[kept][:, kept], sp.csr_array(T[:, kept]), dofs[kept]
    refuse_unstable(assembly, K, dofs)
    labels = np.column_stack([assembly.ids[dofs[:, 0]], dofs[:, 1]])
    K, M, T = map(narrowed, (K, M, T))
    system = System(M, congruence(T, V), K, labels)
    return Structure(assembly, T, system, congruence(T, loss))


def mass_over_all_motions(assembly: Assembly) -> sp.csr_array:
    """M of all elements over the 6 n motions of points, basic frame."""
    return over_all_motions(assembly, stiff=False)[0]


def over_all_motions(
    assembly: Assembly, residual_bending: bool = True, *, stiff: bool = True
) -> list[sp.csr_array]:
    """M, V, K and the imaginary K of all elements over the 6 n motions of points, basic frame.

    Without ``stiff`` shells, which are most elements, give M alone.
    """
    n = 6 * len(assembly.points)
    total = [sp.csr_array((n, n)) for _ in range(4)]
    for M, V, K, loss in _each_family(assembly, residual_bending, stiff):
        for k, A in enumerate((M, V, K, loss)):
            if A is not None and A.nnz:
                total[k] = A if not total[k].nnz else sp.csr_array(total[k] + A)
    return total


Matrices = tuple[sp.csr_array | None, ...]


def _each_family(assembly: Assembly, residual_bending: bool, stiff: bool) -> Iterator[Matrices]:
    """(M, V, K, loss) of each family that has members."""
    n = len(assembly.points)
    for which in (~assembly.shells.curved, assembly.shells.curved):
        if which.any():
            some = assembly.shells if which.all() else picked(assembly.shells, which)
            yield _shells(replace(assembly, shells=some), residual_bending, stiff)
    for group in assembly.solids:
        if len(group):
            yield _solids(replace(assembly, solids=(group,)))
    if len(assembly.beams):
        from . import beam

        nodes, K_e, M_e = beam.stiffness_and_mass(assembly)
        loss = _lossy(beam.loss_factors(assembly), K_e, nodes, n)
        yield blocks(M_e, nodes, n), None, blocks(K_e, nodes, n), loss
    lumps = ("springs", "dampers", "scalar_masses", "bushes", "masses", "rotors")
    if any(len(getattr(assembly, name)) for name in lumps):
        from . import spring

        K, V, M, loss = spring.matrices(assembly)
        yield M, V, K, loss


def _lossy(eta: np.ndarray, K: np.ndarray, nodes: np.ndarray, n: int) -> sp.csr_array | None:
    """Σ η_e K_e of the elements whose material has losses; None if there are no such elements."""
    at = np.flatnonzero(eta)
    return blocks(eta[at, None, None] * K[at], nodes[at], n) if len(at) else None


def _shells(assembly: Assembly, residual_bending: bool, stiff: bool) -> Matrices:
    """Matrices of shells, computed in pieces; the mass is lumped unless ``coupled_mass``."""
    geo = shell.geometry(assembly.points, assembly.shells)
    sections = section_arrays(assembly, geo, residual_bending=residual_bending)
    kinds = 1 + stiff * (1 + bool(sections.loss.any()))  # of matrices
    parts = _pieces(assembly, geo, sections, kinds)
    inertia = EVERY if geo.offset.any() else INERTIA
    found = accumulate(geo.nodes, len(assembly.points), parts, (inertia, EVERY, EVERY)[:kinds])
    M, K, loss = (*found, None, None)[:3]
    return M, None, K, loss


def _pieces(
    assembly: Assembly, geo: shell.ShellGeometry, sections: SectionArrays, kinds: int
) -> Iterator[tuple[slice, tuple[np.ndarray, ...]]]:
    """(rows, (M[, K[, loss K]])) of each piece."""
    for start in range(0, len(geo), PIECE):
        rows = slice(start, start + PIECE)
        part, s, t = geo[rows], sections[rows], assembly.shells.thickness[rows]
        made = [shell.mass(part, t, s.rho, s.nsm, coupled=assembly.coupled_mass)]
        if kinds > 1:
            made.append(shell.stiffness(part, t, **s.stiffness))
        if kinds > 2:
            made.append(s.loss[:, None, None] * made[1])
        yield rows, tuple(made)


def _solids(assembly: Assembly) -> Matrices:
    """Matrices of one group of solids, computed in pieces."""
    from . import solid

    (group,), (eta,) = assembly.solids, solid.loss_factors(assembly)

    def pieces() -> Iterator[tuple[slice, tuple[np.ndarray, ...]]]:
        for start in range(0, len(group), PIECE):
            rows = slice(start, start + PIECE)
            part = replace(assembly, solids=(picked(group, rows),))
            ((_, K, M),) = solid.stiffness_and_mass(part)
            yield rows, (M, K, eta[rows, None, None] * K)[:kinds]

    kinds = 3 if eta.any() else 2
    found = accumulate(group.nodes, len(assembly.points), pieces(), (TRANSLATIONS,) * kinds)
    return found[0], None, found[1], found[2] if eta.any() else None


def _transformation(assembly: Assembly) -> tuple[sp.csr_array, np.ndarray]:
    """T (6n, independent) and the (row of point, component 1-6) of its columns."""
    n = len(assembly.points)
    if assembly.rigid:
        from . import rigid

        T, independent = rigid.transformation(assembly)
        T, at = sp.csr_array(T), np.asarray(independent)
    else:
        T, at = frames(assembly), np.arange(6 * n)
    return T, np.column_stack([at // 6, at % 6 + 1])


def supported(assembly: Assembly) -> tuple[sp.csr_array, np.ndarray]:
    """Unit motions of all points (6n, k), one for each support, with (row, component) (k, 2).

    Points that a rigid element ties to a support move with it.
    """
    T, dofs = _transformation(assembly)
    held = _held(replace(assembly, scalar_points=None), dofs)
    return sp.csr_array(T[:, held]), dofs[held]


def idle_motions(built: Structure) -> tuple[sp.csr_array, np.ndarray]:
    """Unit motions of all points (6n, k) of dofs left out as without stiffness, and their rows.

    The rows (k,) count six dofs a point, in displacement frames.
    """
    T, dofs = _transformation(built.assembly)
    labels = np.column_stack([built.assembly.ids[dofs[:, 0]], dofs[:, 1]])
    idle = (label_rows(labels, built.system.dofs) < 0) & ~_held(built.assembly, dofs)
    return sp.csr_array(T[:, idle]), (6 * dofs[:, 0] + dofs[:, 1] - 1)[idle]


def frames(assembly: Assembly) -> sp.csr_array:
    """u_basic = T q with q counted in each point's displacement frame: csr (6n, 6n)."""
    n = len(assembly.points)
    if assembly.axes is None:
        return sp.csr_array(sp.eye_array(6 * n, format="csr"))
    turn = np.repeat(assembly.axes.swapaxes(1, 2), 2, axis=0)
    T = sp.csr_array(sp.bsr_array((turn, np.arange(2 * n), np.arange(2 * n + 1))).tocsr())
    T.eliminate_zeros()
    return T


def _held(assembly: Assembly, dofs: np.ndarray) -> np.ndarray:
    """Mask of supports, and of all components of scalar points except the first."""
    held = np.zeros((len(assembly.points), 6), bool)
    held[assembly.supports[:, 0], assembly.supports[:, 1] - 1] = True
    if assembly.scalar_points is not None:
        held[assembly.scalar_points, 1:] = True
    return held[dofs[:, 0], dofs[:, 1] - 1]


def _without_stiffness(
    K: sp.csr_array, M: sp.csr_array, dofs: np.ndarray, auto_spc: bool
) -> np.ndarray:
    """Mask of dofs without stiffness and mass; with ``auto_spc``, of all dofs without stiffness.

    AUTOSPC tests the three translations and the three rotations of a point. If a direction of their
    3 x 3 stiffness is softer than ``EMPTY`` times the stiffest, it removes the dof nearest to it.
    """
    stiff = K.diagonal()
    if not auto_spc:
        return (stiff == 0) & (M.diagonal() == 0)
    triple = 2 * dofs[:, 0] + (dofs[:, 1] > 3)
    _, triple = np.unique(triple, return_inverse=True)
    D = _diagonal_blocks(K, dofs, triple)
    idle = np.zeros((len(D), 3), bool)
    weak = _suspects(D)
    idle[weak] = _idle(D[weak])
    return idle[triple, (dofs[:, 1] - 1) % 3]


def _diagonal_blocks(K: sp.csr_array, dofs: np.ndarray, triple: np.ndarray) -> np.ndarray:
    """Stiffness among the dofs of each triple (k, 3, 3), zero for absent dofs."""
    D = np.zeros((triple[-1] + 1 if len(triple) else 0, 3, 3))
    component = (dofs[:, 1] - 1) % 3
    for shift in range(3):
        diagonal = K.diagonal(shift)
        i = np.flatnonzero(triple[: len(triple) - shift] == triple[shift:])
        D[triple[i], component[i], component[i + shift]] = diagonal[i]
        D[triple[i], component[i + shift], component[i]] = diagonal[i]
    return D


def _suspects(D: np.ndarray) -> np.ndarray:
    """Triples with a small determinant in comparison with their cubed norm."""
    scale = np.linalg.norm(D, axis=(1, 2))
    return np.flatnonzero(np.abs(np.linalg.det(D)) <= 10 * EMPTY * scale**3)


def _idle(D: np.ndarray) -> np.ndarray:
    """(k, 3) bool: for each direction of D (k, 3, 3) without stiffness, the nearest component.

    A negative stiffness is a stiffness.
    """
    value, vector = np.linalg.eigh(D)
    least = EMPTY * np.abs(value).max(axis=1)
    idle, every = np.zeros((len(D), 3), bool), np.arange(len(D))
    for r in range(3):
        soft = np.abs(value[:, r]) <= least
        nearest = np.argmax(np.where(idle, -1, np.abs(vector[:, :, r])), axis=1)
        idle[every[soft], nearest[soft]] = True
    return idle
