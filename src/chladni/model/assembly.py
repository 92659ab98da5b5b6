"""The structure as data: points, elements by family, joints, masses and supports (SI).

All data are arrays over one family, because a body-in-white has a hundred thousand shells. Nodes
are *rows* of ``points`` (0-based), never ids; ``ids`` gives the user's number of each row. All
vectors and places are in the basic frame. ``axes`` holds the displacement frames of the points
(Nastran's CD) as rows of unit vectors; None: all are basic.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from ..arrays import OneScreen
from ..errors import LabelError, ModelError, named
from .properties import Part


def _none(*shape: int) -> np.ndarray:
    return np.zeros((0, *shape))


def _no_rows(*shape: int) -> np.ndarray:
    return np.zeros((0, *shape), dtype=np.int64)


@dataclass(frozen=True, eq=False, repr=False)
class Shells(OneScreen):
    """Four- and three-node shells; a triangle repeats its third node."""

    ids: np.ndarray = field(default_factory=_no_rows)  # (n,) int
    nodes: np.ndarray = field(default_factory=lambda: _no_rows(4))  # (n, 4) int: rows of points
    part: np.ndarray = field(default_factory=_no_rows)  # (n,) int: position in ``Assembly.parts``
    thickness: np.ndarray = field(default_factory=lambda: _none(4))  # (n, 4) at the corners [m]
    # (n, 3) direction whose projection is material axis 1
    axis: np.ndarray = field(default_factory=lambda: _none(3))
    # (n,) of the mid-surface along the element normal [m]
    offset: np.ndarray = field(default_factory=_none)
    # (n, 4) int: rows of the nodes on the edges, from that of corners 1 and 2 on; -1: none
    middle: np.ndarray = field(default_factory=lambda: _no_rows(4))
    # (n,) mass beyond that of the section (NSM) [kg/m²]
    nonstructural: np.ndarray = field(default_factory=_none)

    def __post_init__(self) -> None:
        if len(self.middle) != len(self.nodes):
            object.__setattr__(self, "middle", np.full(np.shape(self.nodes), -1))
        if len(self.nonstructural) != len(self.nodes):
            object.__setattr__(self, "nonstructural", np.zeros(len(self.nodes)))

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def curved(self) -> np.ndarray:
        """(n,) bool, True where the shell has nodes on its edges."""
        return np.asarray((self.middle >= 0).any(axis=1))

    @property
    def triangle(self) -> np.ndarray:
        """(n,) bool, True where the shell has three nodes."""
        return self.nodes[:, 2] == self.nodes[:, 3]


@dataclass(frozen=True, eq=False)
class Solids:
    """Solids of one kind: hexahedra (8 or 20 nodes), wedges (6, 15), pyramids (5, 13), tetrahedra.

    A row holds the corners, then the nodes on the edges (``EDGES`` of geometry.solid_shapes). An
    element that lacks one of them repeats the first end of that edge.
    """

    ids: np.ndarray
    nodes: np.ndarray
    part: np.ndarray

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Beams:
    """Two-node bars, beams and rods.

    Attributes
    ----------
    ids, part : (n,) int
    nodes : (n, 2) int
    up : (n, 3)           orientation vector v of plane 1 (zero for rods)
    offset : (n, 2, 3)    of the ends from their nodes [m]
    pins : (n, 2, 6) bool element dofs released at each end
    nonstructural : (n,)  mass beyond that of the section (NSM) [kg/m]
    """

    ids: np.ndarray = field(default_factory=_no_rows)
    nodes: np.ndarray = field(default_factory=lambda: _no_rows(2))
    part: np.ndarray = field(default_factory=_no_rows)
    up: np.ndarray = field(default_factory=lambda: _none(3))
    offset: np.ndarray = field(default_factory=lambda: _none(2, 3))
    pins: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 6), bool))
    nonstructural: np.ndarray = field(default_factory=_none)

    def __post_init__(self) -> None:
        if len(self.nonstructural) != len(self.nodes):
            object.__setattr__(self, "nonstructural", np.zeros(len(self.nodes)))

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Scalars:
    """Scalar springs, dampers or masses between two dofs, value (c_a q_a - c_b q_b)."""

    ids: np.ndarray = field(default_factory=_no_rows)  # (n,) int
    # (n, 2) int: rows of points; -1: ground
    nodes: np.ndarray = field(default_factory=lambda: _no_rows(2))
    component: np.ndarray = field(default_factory=lambda: _no_rows(2))  # (n, 2) int: 1-6
    value: np.ndarray = field(default_factory=_none)  # (n,) [N/m], [N s/m] or [kg]
    damping: np.ndarray = field(default_factory=_none)  # (n,) loss factor (springs)

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Bushes:
    """Six-component springs with dampers (CBUSH), each in its own frame."""

    ids: np.ndarray = field(default_factory=_no_rows)  # (n,) int
    # (n, 2) int: rows of points; second -1: ground
    nodes: np.ndarray = field(default_factory=lambda: _no_rows(2))
    # (n, 3, 3) rows are the unit vectors of the element frame
    frame: np.ndarray = field(default_factory=lambda: _none(3, 3))
    # (n, 3) of the spring, with rigid arms from both nodes [m]
    place: np.ndarray = field(default_factory=lambda: _none(3))
    # stiffness, viscous, loss: (n, 6) [N/m, N m/rad], [N s/m], [-]
    stiffness: np.ndarray = field(default_factory=lambda: _none(6))
    viscous: np.ndarray = field(default_factory=lambda: _none(6))
    loss: np.ndarray = field(default_factory=lambda: _none(6))

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Masses:
    """Concentrated masses: 6 x 6 at each node in the basic frame, offset included [SI]."""

    ids: np.ndarray = field(default_factory=_no_rows)
    node: np.ndarray = field(default_factory=_no_rows)
    matrix: np.ndarray = field(default_factory=lambda: _none(6, 6))

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class RigidBody:
    """RBE2, RBAR and similar: dependent dofs follow the independent point as a rigid body.

    ``independent`` is one row with all six dofs; ``components[k]`` are the dofs (1-6) of
    ``dependent[k]`` that follow.
    """

    id: int
    independent: int
    dependent: tuple[int, ...]
    components: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class Average:
    """RBE3: the reference point moves as the weighted mean of the others.

    ``terms`` are (row, components, weight). ``moved`` are optional (row, component) pairs that are
    dependent instead of the reference (Nastran's UM).
    """

    id: int
    reference: int
    components: tuple[int, ...]
    terms: tuple[tuple[int, tuple[int, ...], float], ...]
    moved: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, eq=False)
class Equation:
    """Multi-point constraint Σ a_k q_k = 0; the first term is the dependent one."""

    id: int
    nodes: tuple[int, ...]
    components: tuple[int, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Assembly(OneScreen):
    """The complete structure.

    Attributes
    ----------
    ids : (n,) int            the user's ids of the points, increasing
    points : (n, 3)           places in the basic frame [m]
    parts : tuple of Part
    axes : (n, 3, 3) or None  displacement frames, rows are unit vectors
    scalar_points : (n,) bool True where a point has one dof only (SPOINT)
    supports : (k, 2) int     (row of points, component 1-6) held at zero
    coupled_mass : bool       consistent mass (True) or lumped (False), if the element has both
    structural_damping : float  loss factor of the whole structure (PARAM,G)
    auto_spc : bool           hold dofs without stiffness (AUTOSPC)
    k6rot : float or None     Nastran's drilling stiffness (PARAM,K6ROT); None: 0.1 G t of the field
                              (meshes made here)
    """

    ids: np.ndarray
    points: np.ndarray
    parts: tuple[Part, ...]
    shells: Shells = field(default_factory=Shells)
    solids: tuple[Solids, ...] = ()
    beams: Beams = field(default_factory=Beams)
    springs: Scalars = field(default_factory=Scalars)
    dampers: Scalars = field(default_factory=Scalars)
    scalar_masses: Scalars = field(default_factory=Scalars)
    bushes: Bushes = field(default_factory=Bushes)
    masses: Masses = field(default_factory=Masses)
    rigid: tuple[RigidBody | Average | Equation, ...] = ()
    supports: np.ndarray = field(default_factory=lambda: _no_rows(2))
    axes: np.ndarray | None = None
    scalar_points: np.ndarray | None = None
    coupled_mass: bool = True
    structural_damping: float = 0.0
    auto_spc: bool = True
    k6rot: float | None = None

    def rows(self, ids: np.ndarray | list[int] | tuple[int, ...]) -> np.ndarray:
        """Rows of the points with these ids.

        Raises
        ------
        LabelError
            If a grid does not exist; the message names it.
        """
        ids = np.asarray(ids, dtype=np.int64)
        at = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
        if np.any(missing := self.ids[at] != ids):
            raise LabelError(
                f"no grid {named(ids[missing].tolist(), 3)}; the deck has {len(self.ids)} grids, "
                f"{self.ids[0]} to {self.ids[-1]}"
            )
        return at

    def part(self, name: str | int) -> int:
        """Position of the part with this name or property id.

        Raises
        ------
        LabelError
            If there is no such part, or more than one.
        """
        found = [k for k, p in enumerate(self.parts) if name in (p.name, p.id, str(p.id))]
        if len(found) != 1:
            known = ", ".join(f"{p.name} ({p.id})" for p in self.parts)
            raise LabelError(f"{len(found) or 'no'} part {name!r}; there are {known}")
        return found[0]

    def with_parts(self, parts: tuple[Part, ...]) -> Self:
        """Replace the properties of all parts; raise ``ModelError`` for another number of parts."""
        if len(parts) != len(self.parts):
            raise ModelError(f"{len(parts)} parts given, the assembly has {len(self.parts)}")
        return replace(self, parts=parts)

    def thickness(self) -> np.ndarray:
        """Mean thickness of every shell (n,) [m]."""
        return self.shells.thickness.mean(axis=1)


def appended(family: Any, **columns: Any) -> Any:
    """Add members to a family of elements; a column that is not given is zero.

    Shells that are added have no nodes on their edges.
    """
    n = len(columns["ids"])
    none = {k: np.zeros((n, *old.shape[1:]), old.dtype) for k, old in vars(family).items()}
    if "middle" in none:
        none["middle"] -= 1
    return concatenated(family, replace(family, **{**none, **columns}))


def concatenated(*families: Any) -> Any:
    """Members of several families of one kind, in order."""
    first, *_ = families
    names = vars(first)
    return replace(first, **{k: np.concatenate([vars(f)[k] for f in families]) for k in names})


def picked(family: Any, which: np.ndarray | slice) -> Any:
    """Select members of a family of elements by rows, a mask or a slice."""
    return replace(family, **{name: value[which] for name, value in vars(family).items()})
