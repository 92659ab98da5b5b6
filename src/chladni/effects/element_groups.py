"""The shells and beams of a structure, collected in groups and split by powers of thickness.

The stiffness of a shell is E (t A + t³ B); its mass is ρ t m. The element matrices of A, B and m
are projected group by group. Any smooth field of thickness, modulus or density is then one weight
for each group, and the reduced model does not return to elements.

For a beam, t is the wall of a thin tube. Its area and shear areas, I1, I2, I12 and J are
proportional to t. Hence its stiffness is E t A and its mass ρ t m exactly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..arrays import alike
from ..dynamics.reduction import Basis
from ..fem import beam, shell
from ..fem.assemble import Structure
from ..fem.shell_section import section_arrays
from ..geometry.beam_lines import member_beams
from ..model.assembly import Assembly, picked
from ..model.properties import BeamSection
from .shell_components import component_matrices, thickness_split


@dataclass(frozen=True, eq=False)
class ElementGroups:
    """Element matrices of all shells, then of all member beams, and their groups.

    Fasteners are not included; errors of fasteners belong to the effects of joints. A beam uses the
    rows of its two ends; the other twelve are zero.

    Attributes
    ----------
    linear, cubic : (m, 24, 24)   stiffness that grows with t and with t³ [N/m]
    mass : (m, 24, 24)            [kg]
    nodes : (m, 4)                rows of points; of a beam the second end thrice
    group : (m,)                  group of each element
    centre : (g, 3)               area-weighted centre of each group [m]
    area, weight : (g,)           [m²] (of a beam: length times the root of A), [kg]
    part : (g,)                   position of the group's part
    """

    structure: Structure
    linear: np.ndarray
    cubic: np.ndarray
    mass: np.ndarray
    nodes: np.ndarray
    group: np.ndarray
    centre: np.ndarray
    area: np.ndarray
    weight: np.ndarray
    part: np.ndarray

    def __len__(self) -> int:
        return len(self.area)

    @cached_property
    def sheet(self) -> np.ndarray:
        """Mask (g,) of the groups of shells, which come first."""
        n = self.group[: len(self.structure.assembly.shells)].max(initial=-1) + 1
        return np.arange(len(self)) < n

    @cached_property
    def connected(self) -> np.ndarray:
        """Index (g,) of the connected sheet, or set of beams, of each group; they share grids."""
        assembly, parts = self.structure.assembly, self.part[self.group]
        nodes = self.nodes.copy()
        nodes[len(assembly.shells) :] += len(assembly.points)  # beams do not connect sheets
        touch = sp.coo_array(
            (np.ones(4 * len(parts)), (np.repeat(parts, 4), nodes.ravel())),
            shape=(len(assembly.parts), 2 * len(assembly.points)),
        ).tocsr()
        return np.asarray(connected_components(touch @ touch.T, directed=False)[1][self.part])

    def components(self) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
        """``linear`` and ``cubic`` for each component of the plane stiffness; beams go with Q66.

        They come one at a time, because all of them together would double the memory of a large
        model.
        """
        m = len(self.structure.assembly.shells)
        for name, pair in component_matrices(self.structure.assembly):
            beams = [A[m:] if name == "Q66" else 0 * A[m:] for A in (self.linear, self.cubic)]
            A, B = (_stacked(*both) for both in zip(pair, beams, strict=True))
            yield name, (A, B)

    def project(
        self, kinds: Sequence[np.ndarray], basis: Basis, last: int | None = None
    ) -> list[np.ndarray]:
        """Φᵀ A_g W of every group g (n_groups, r, last), for each kind of element matrices.

        W are the ``last`` columns of Φ; by default all of them.
        """
        r = basis.shape[1]
        k = r if last is None else last
        out = [np.empty((len(self), r, k)) for _ in kinds]
        for g, place in enumerate(self._places):
            V = place.motion(basis)
            for stack, matrices in zip(out, kinds, strict=True):
                own = V.T @ place.forces(matrices, V[:, r - k :])
                stack[g] = own if k < r else (own + own.T) / 2
        return out

    def inertia_of_motion(self, basis: Basis, motion: np.ndarray) -> np.ndarray:
        """Φᵀ m_g R (n_groups, r, k) of each group g, for a motion R (6 n_points, k) of points."""
        of_each = [
            place.motion(basis).T @ place.forces(self.mass, motion[place.dofs])
            for place in self._places
        ]
        return np.array(of_each).reshape(len(self), basis.shape[1], motion.shape[1])

    @cached_property
    def _places(self) -> list["_Place"]:
        """The elements and dofs of every group."""
        dofs = (6 * self.nodes[:, :, None] + np.arange(6)).reshape(len(self.nodes), 24)
        return [_Place.of(on, dofs[on], self.structure.T) for on in alike(self.group)]


@dataclass(frozen=True, eq=False)
class _Place:
    """Elements of one group and the motion of their points, without the rest of the structure.

    Attributes
    ----------
    elements : (m,) int
    dofs : (p,) int       motions of their points, 6 a point
    at : (m, 24) int      of each element among these
    sum : (p, 24 m)       of the forces of all elements
    T : (p, k), free : (k,)   the motions by these free dofs of the structure
    """

    elements: np.ndarray
    dofs: np.ndarray
    at: np.ndarray
    sum: sp.csr_array
    T: sp.csr_array
    free: np.ndarray

    @classmethod
    def of(cls, elements: np.ndarray, dofs: np.ndarray, T: sp.csr_array) -> Self:
        """Collect elements with these dofs (m, 24)."""
        mine, at = np.unique(dofs, return_inverse=True)
        at = at.reshape(dofs.shape)
        entries = (np.ones(at.size), (at.ravel(), np.arange(at.size)))
        total = sp.csr_array(entries, shape=(len(mine), at.size))
        rows = T[mine]
        free, column = np.unique(rows.indices, return_inverse=True)
        narrow = sp.csr_array((rows.data, column, rows.indptr), shape=(len(mine), len(free)))
        return cls(elements, mine, at, total, narrow, free)

    def motion(self, basis: Basis) -> np.ndarray:
        """T Φ (p, r)."""
        return self.T @ basis.at(self.free)

    def forces(self, matrices: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Σ_e A_e W_e on the motions of the points (p, k)."""
        each = matrices[self.elements] @ motion[self.at]
        return self.sum @ each.reshape(-1, motion.shape[1])


def group_of_shells(
    centre: np.ndarray, part: np.ndarray, area: np.ndarray, most: int = 64
) -> np.ndarray:
    """Group of each shell (m,): the largest piece of a part is halved along its longest side.

    The number of groups of a part is proportional to its area; no group contains two parts.
    """
    out = np.full(len(part), -1)
    share = np.bincount(part, area) / area.sum()
    count = 0
    for p in np.unique(part):
        pieces = [np.flatnonzero(part == p)]
        wanted = min(max(1, round(most * share[p])), len(pieces[0]))
        while len(pieces) < wanted:
            k = int(np.argmax([area[piece].sum() * (len(piece) > 1) for piece in pieces]))
            pieces += _halves(pieces.pop(k), centre)
        for piece in pieces:
            out[piece] = count
            count += 1
    return out


def _halves(piece: np.ndarray, centre: np.ndarray) -> list[np.ndarray]:
    axis = int(np.argmax(np.ptp(centre[piece], axis=0)))
    order = piece[np.argsort(centre[piece, axis], kind="stable")]
    return [order[: len(order) // 2], order[len(order) // 2 :]]


def element_groups(structure: Structure, most: int = 64) -> ElementGroups:
    """Collect the shells and the beams of a structure, each in about ``most`` groups.

    Transverse shear with residual bending flexibility grows with a power of t between one and
    three. Its matrix is split so that value and first derivative are exact.
    """
    shells, beams = _shells(structure.assembly), _beams(structure.assembly)
    linear, cubic, mass, nodes, centre, area, of = (
        _stacked(*pair) for pair in zip(shells, beams, strict=True)
    )
    first = group_of_shells(shells.centre, shells.part, shells.area, most)
    second = group_of_shells(beams.centre, beams.part, beams.area, most)
    group = np.concatenate([first, second + first.max(initial=-1) + 1])
    n = group.max(initial=-1) + 1
    extent = np.bincount(group, area, minlength=n)
    middle = np.stack(
        [np.bincount(group, area * centre[:, k], minlength=n) / extent for k in range(3)], axis=1
    )
    weight = np.einsum("eij,i,j->e", mass, _along_x(), _along_x())
    part = np.zeros(n, dtype=int)
    part[group] = of
    return ElementGroups(
        structure, linear, cubic, mass, nodes, group, middle, extent,
        np.bincount(group, weight, minlength=n), part,
    )  # fmt: skip


def _stacked(of_shells: np.ndarray, of_beams: np.ndarray) -> np.ndarray:
    """Stack both kinds; without beams the large matrices of the shells are not copied."""
    return np.concatenate([of_shells, of_beams]) if len(of_beams) else of_shells


class _Elements(NamedTuple):
    """Matrices (m, 24, 24), nodes (m, 4), centres (m, 3), areas and parts (m,) of one kind."""

    linear: np.ndarray
    cubic: np.ndarray
    mass: np.ndarray
    nodes: np.ndarray
    centre: np.ndarray
    area: np.ndarray
    part: np.ndarray


def _shells(assembly: Assembly) -> _Elements:
    shells = assembly.shells
    geo = shell.geometry(assembly.points, shells)
    arrays = section_arrays(assembly, geo)
    linear, cubic = thickness_split(assembly, geo, arrays)
    mass = shell.mass(geo, shells.thickness, arrays.rho, arrays.nsm, assembly.coupled_mass)
    centre = assembly.points[shells.nodes].mean(axis=1)
    return _Elements(linear, cubic, mass, shells.nodes, centre, geo.area, shells.part)


def _beams(assembly: Assembly) -> _Elements:
    """Member beams without their non-structural mass, which stays in the rest of the model."""
    beams = picked(assembly.beams, member_beams(assembly))
    plain = tuple(
        part.with_section(nonstructural=0.0, nonstructural_inertia=0.0)
        if isinstance(part.section, BeamSection) else part
        for part in assembly.parts
    )  # fmt: skip
    alone = replace(assembly.with_parts(plain), beams=beams)
    nodes, K, M = beam.stiffness_and_mass(alone)
    K, M = (np.pad(A, ((0, 0), (0, 12), (0, 12))) for A in (K, M))
    ends = assembly.points[nodes]
    areas = np.array([getattr(p.section, "area", 0.0) for p in plain])[beams.part]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return _Elements(
        K, np.zeros_like(K), M, nodes[:, [0, 1, 1, 1]], ends.mean(axis=1),
        length * np.sqrt(areas), beams.part,
    )  # fmt: skip


def _along_x() -> np.ndarray:
    """Unit rigid translation of an element's 24 dofs."""
    return np.tile([1.0, 0, 0, 0, 0, 0], 4)
