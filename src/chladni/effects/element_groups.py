"""The shells and beams of a structure, collected in groups and split by powers of thickness.

The stiffness of a shell is E (t A + t³ B); its mass is ρ t m. The element matrices of A, B and m
are projected group by group. Any smooth field of thickness, modulus or density is then one weight
for each group, and the reduced model does not return to elements.

For a beam, t is the wall of a thin tube. Its area and shear areas, I1, I2, I12 and J are
proportional to t. Hence its stiffness is E t A and its mass ρ t m exactly.

Transverse shear in series with residual bending, S = (Z_s + Z_r)⁻¹, is neither linear nor cubic in
t. It is split into S Z_s S and S Z_r S: with the powers t and t³ for these two, the value *and* the
first derivative are exact.
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
from ..fem.shell import ShellGeometry
from ..fem.shell_section import SectionArrays, section_arrays
from ..geometry.beam_lines import member_beams
from ..model.assembly import Assembly, picked
from ..model.properties import BeamSection

COMPONENTS = {"Q11": ((0, 0),), "Q22": ((1, 1),), "Q12": ((0, 1), (1, 0)), "Q66": ((2, 2),)}

Pair = tuple[np.ndarray, np.ndarray]


def thickness_split(
    assembly: Assembly, geo: ShellGeometry, arrays: SectionArrays | None = None
) -> Pair:
    """(A, B) with K = A + B and ∂K/∂ln t = A + 3 B (m, 24, 24) each [N/m]."""
    arrays = section_arrays(assembly, geo) if arrays is None else arrays
    t, reference = assembly.shells.thickness, arrays.Qm
    thin, residual = _shear_split(arrays)
    linear = shell.stiffness(geo, t, Qm=arrays.Qm, S=thin, drill=arrays.drill, reference=reference)
    return linear, shell.stiffness(geo, t, Qb=arrays.Qb, S=residual, reference=reference)


def component_matrices(assembly: Assembly) -> Iterator[tuple[str, Pair]]:
    """(A, B) as above for each component k: ∂K/∂ln Q_k = A_k + B_k, Σ_k A_k + B_k = K.

    Shear flexibility of the material and the drilling stiffness are assigned to Q66.
    """
    geo = shell.geometry(assembly.points, assembly.shells)
    arrays = section_arrays(assembly, geo)
    t, reference = assembly.shells.thickness, arrays.Qm
    thin, _ = _shear_split(arrays)
    for name, entries in COMPONENTS.items():
        Qm, Qb = _entries(arrays.Qm, entries), _entries(arrays.Qb, entries)
        own = name == "Q66"
        linear = shell.stiffness(
            geo, t, Qm=Qm, S=thin if own else None, drill=arrays.drill if own else None,
            reference=reference,
        )  # fmt: skip
        residual = arrays.shear_by_bending(geo, Qb)
        yield name, (linear, shell.stiffness(geo, t, Qb=Qb, S=residual, reference=reference))


def shear_matrices(assembly: Assembly, rows: np.ndarray) -> np.ndarray:
    """γᵀ S Z_s S γ and γᵀ S Z_r S γ of some shells (2, m, 24, 24), which grow with t and t³."""
    shells = picked(assembly.shells, rows)
    geo = shell.geometry(assembly.points, shells)
    arrays = section_arrays(replace(assembly, shells=shells), geo)
    return np.stack([
        shell.stiffness(geo, shells.thickness, S=S, reference=arrays.Qm)
        for S in _shear_split(arrays)
    ])  # fmt: skip


def _shear_split(arrays: SectionArrays) -> Pair:
    """S Z_s S and S Z_r S (m, 2, 2)."""
    S, Z = arrays.S, arrays.shear_flexibility
    thin = S @ Z @ S
    return thin, S - thin


def _entries(Q: np.ndarray, entries: tuple[tuple[int, int], ...]) -> np.ndarray:
    out = np.zeros_like(Q)
    for i, j in entries:
        out[:, i, j] = Q[:, i, j]
    return out


@dataclass(frozen=True, eq=False)
class ElementGroups:
    """Element matrices of all shells, then of all member beams, and their groups.

    Fasteners are not included; errors of fasteners belong to the effects of joints. A beam uses the
    rows of its two ends; the other twelve are zero.
    """

    structure: Structure
    linear: np.ndarray  # (m, 24, 24) stiffness that grows with t and with t³ [N/m]
    cubic: np.ndarray  # (m, 24, 24) stiffness that grows with t and with t³ [N/m]
    mass: np.ndarray  # (m, 24, 24) [kg]
    nodes: np.ndarray  # (m, 4) rows of points; of a beam the second end thrice
    group: np.ndarray  # (m,) group of each element
    centre: np.ndarray  # (g, 3) area-weighted centre of each group [m]
    area: np.ndarray  # (g,) [m²] (of a beam: length times the root of A), [kg]
    weight: np.ndarray  # (g,) [m²] (of a beam: length times the root of A), [kg]
    part: np.ndarray  # (g,) position of the group's part
    each: "_Each"  # of the elements
    whole: Self | None = None  # the groups, some of which were divided into these

    def __len__(self) -> int:
        return len(self.area)

    @property
    def undivided(self) -> "ElementGroups":
        """The groups before any of them was divided."""
        return self if self.whole is None else self.whole

    @cached_property
    def first(self) -> np.ndarray:
        """One element of each group (g,)."""
        return np.unique(self.group, return_index=True)[1]

    def divided(self, of: np.ndarray) -> "ElementGroups":
        """The groups divided where their elements have different labels ``of`` (m,)."""
        both = np.unique(np.stack([self.group, of]), axis=1, return_inverse=True)[1].ravel()
        made = _collected(self.structure, (self.linear, self.cubic, self.mass), self.nodes,
                          self.each, both)  # fmt: skip
        return replace(made, whole=self.undivided)

    def finer(self, near: np.ndarray, edge: float) -> "ElementGroups":
        """The groups, those of a mask (g,) divided into pieces of an edge length [m]."""
        of = np.zeros(len(self.group), dtype=int)
        for g in np.flatnonzero(near):
            own = np.flatnonzero(self.group == g)
            pieces = _pieces(own, self.each, int(np.ceil(self.area[g] / edge**2)))
            for k, piece in enumerate(pieces):
                of[piece] = k
        return self.divided(of)

    @cached_property
    def dofs(self) -> np.ndarray:
        """Rows (m, 6 nodes) of the motion of all points that each element moves with."""
        m, n = self.nodes.shape
        return (6 * self.nodes[:, :, None] + np.arange(6)).reshape(m, 6 * n)

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
            (np.ones(nodes.size), (np.repeat(parts, nodes.shape[1]), nodes.ravel())),
            shape=(len(assembly.parts), 2 * len(assembly.points)),
        ).tocsr()
        return np.asarray(connected_components(touch @ touch.T, directed=False)[1][self.part])

    def components(
        self, axis: np.ndarray | None = None
    ) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
        """``linear`` and ``cubic`` for each component of the plane stiffness; beams go with Q66.

        Axis 1 of the components is that of the deck, or the projection of ``axis`` (3,).

        They come one at a time, because all of them together would double the memory of a large
        model.
        """
        made = self.structure.assembly
        m = len(made.shells)
        if axis is not None:
            along = np.broadcast_to(axis, made.shells.axis.shape)
            made = replace(made, shells=replace(made.shells, axis=along))
        for name, pair in component_matrices(made):
            beams = [A[m:] if name == "Q66" else 0 * A[m:] for A in (self.linear, self.cubic)]
            A, B = (_stacked(*both) for both in zip(pair, beams, strict=True))
            yield name, (A, B)

    def project(
        self, kinds: Sequence[np.ndarray], basis: Basis, last: int | None = None,
        groups: Sequence[int] | None = None,
    ) -> list[np.ndarray]:  # fmt: skip
        """Φᵀ A_g W of some groups g (n_groups, r, last), for each kind of element matrices.

        W are the ``last`` columns of Φ; by default all of them, of all groups.
        """
        r, some = basis.shape[1], range(len(self)) if groups is None else groups
        k = r if last is None else last
        out = [np.empty((len(some), r, k)) for _ in kinds]
        for row, g in enumerate(some):
            place = self._place(g)
            V = place.motion(basis)
            for stack, matrices in zip(out, kinds, strict=True):
                own = V.T @ place.forces(matrices, V[:, r - k :])
                stack[row] = own if k < r else (own + own.T) / 2
        return out

    def inertia_of_motion(self, basis: Basis, motion: np.ndarray) -> np.ndarray:
        """Φᵀ m_g R (n_groups, r, k) of each group g, for a motion R (6 n_points, k) of points."""
        of_each = [
            place.motion(basis).T @ place.forces(self.mass, motion[place.dofs])
            for place in map(self._place, range(len(self)))
        ]
        return np.array(of_each).reshape(len(self), basis.shape[1], motion.shape[1])

    def _place(self, g: int) -> "_Place":
        """The elements and dofs of a group."""
        if g not in self._places:
            on = self._elements[g]
            self._places[g] = _Place.of(on, self.dofs[on], self.structure.T)
        return self._places[g]

    @cached_property
    def _places(self) -> dict[int, "_Place"]:
        return {}

    @cached_property
    def _elements(self) -> list[np.ndarray]:
        return alike(self.group)


@dataclass(frozen=True, eq=False)
class _Place:
    """Elements of one group and the motion of their points, without the rest of the structure."""

    elements: np.ndarray  # (m,) int
    dofs: np.ndarray  # (p,) int motions of their points, 6 a point
    at: np.ndarray  # (m, 24) int of each element among these
    sum: sp.csr_array  # (p, 24 m) of the forces of all elements
    T: sp.csr_array  # (p, k), free : (k,) the motions by these free dofs of the structure
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
        wanted = max(1, round(most * share[p]))
        for piece in _pieces(np.flatnonzero(part == p), _Each(centre, area, part), wanted):
            out[piece] = count
            count += 1
    return out


def _pieces(on: np.ndarray, each: "_Each", wanted: int) -> list[np.ndarray]:
    """Divide some elements into pieces: the largest is halved until there are so many."""
    pieces = [on]
    while len(pieces) < min(wanted, len(on)):
        k = int(np.argmax([each.area[piece].sum() * (len(piece) > 1) for piece in pieces]))
        pieces += _halves(pieces.pop(k), each.centre)
    return pieces


def _halves(piece: np.ndarray, centre: np.ndarray) -> list[np.ndarray]:
    axis = int(np.argmax(np.ptp(centre[piece], axis=0)))
    order = piece[np.argsort(centre[piece, axis], kind="stable")]
    return [order[: len(order) // 2], order[len(order) // 2 :]]


def element_groups(structure: Structure, most: int = 64) -> ElementGroups:
    """Collect the shells and the beams of a structure, each in about ``most`` groups.

    Transverse shear with residual bending flexibility grows with a power of t between one and
    three. Its matrix is split so that value and first derivative are exact.
    """
    shells = _shells(structure.assembly)
    beams = _beams(structure.assembly, shells.nodes.shape[1])
    linear, cubic, mass, nodes, *each = (
        _stacked(*pair) for pair in zip(shells, beams, strict=True)
    )
    first = group_of_shells(shells.centre, shells.part, shells.area, most)
    second = group_of_shells(beams.centre, beams.part, beams.area, most)
    group = np.concatenate([first, second + first.max(initial=-1) + 1])
    return _collected(structure, (linear, cubic, mass), nodes, _Each(*each), group)


def _collected(
    structure: Structure, matrices: tuple[np.ndarray, np.ndarray, np.ndarray], nodes: np.ndarray,
    each: "_Each", group: np.ndarray,
) -> ElementGroups:  # fmt: skip
    """Elements in their groups; linear, cubic and mass are the ``matrices``."""
    n = group.max(initial=-1) + 1
    extent = np.bincount(group, each.area, minlength=n)
    middle = np.stack(
        [np.bincount(group, each.area * x, minlength=n) / extent for x in each.centre.T], axis=1
    )
    weight = matrices[2][:, ::6, ::6].sum(axis=(1, 2))  # of a unit translation along x
    part = np.zeros(n, dtype=int)
    part[group] = each.part
    return ElementGroups(
        structure, *matrices, nodes, group, middle, extent,
        np.bincount(group, weight, minlength=n), part, each,
    )  # fmt: skip


def _stacked(of_shells: np.ndarray, of_beams: np.ndarray) -> np.ndarray:
    """Stack both kinds; without beams the large matrices of the shells are not copied."""
    return np.concatenate([of_shells, of_beams]) if len(of_beams) else of_shells


class _Each(NamedTuple):
    """Centres (m, 3) [m], areas (m,) [m²] and parts (m,) of elements."""

    centre: np.ndarray
    area: np.ndarray
    part: np.ndarray


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
    shells, none = assembly.shells, np.zeros((0, 24, 24))
    if not len(shells):  # nor perhaps any part
        return _Elements(
            none, none, none, shells.nodes, np.zeros((0, 3)), none[:, 0, 0], shells.part
        )
    geo = shell.geometry(assembly.points, shells)
    arrays = section_arrays(assembly, geo)
    linear, cubic = thickness_split(assembly, geo, arrays)
    mass = shell.mass(geo, shells.thickness, arrays.rho, arrays.nsm, assembly.coupled_mass)
    centre = assembly.points[shells.nodes].mean(axis=1)
    return _Elements(linear, cubic, mass, geo.nodes, centre, geo.area, shells.part)


def _beams(assembly: Assembly, k: int) -> _Elements:
    """Member beams, of k nodes as the shells, without their non-structural mass.

    It stays in the rest of the model.
    """
    beams = picked(assembly.beams, member_beams(assembly))
    plain = tuple(
        replace(part, section=part.section.structural)
        if isinstance(part.section, BeamSection) else part
        for part in assembly.parts
    )  # fmt: skip
    beams = replace(beams, nonstructural=np.zeros(len(beams)))
    alone = replace(assembly.with_parts(plain), beams=beams)
    nodes, K, M = beam.stiffness_and_mass(alone)
    K, M = (np.pad(A, ((0, 0), *2 * [(0, 6 * (k - 2))])) for A in (K, M))
    ends = assembly.points[nodes]
    areas = np.array([getattr(p.section, "area", 0.0) for p in plain])[beams.part]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return _Elements(
        K, np.zeros_like(K), M, nodes[:, [0, *[1] * (k - 1)]], ends.mean(axis=1),
        length * np.sqrt(areas), beams.part,
    )  # fmt: skip
