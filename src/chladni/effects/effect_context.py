"""The inputs of effects before any fit: shells, beams, their grids and the test."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..arrays import alike
from ..fem.locate import Share
from ..geometry.beam_lines import lines
from ..geometry.facets import point_normals, tangents, unit
from ..geometry.sampling import farthest_point_sample
from ..geometry.solid_faces import skin
from ..model.assembly import Assembly
from .element_groups import ElementGroups
from .identified_damping import IdentifiedDamping

SAME = 0.95  # cosine from which directions across two beams of one grid count as one


@dataclass(frozen=True, eq=False)
class Setup:
    """The test, as effects see it."""

    sensors: tuple[Share, ...]  # (grid id, weight) pairs of each output
    hangers: tuple[int, ...]  # grid ids
    weight: float  # of the structure [kg]
    f_max: float  # highest frequency of interest [Hz]
    # (grid id, weight) pairs of each force, and its direction
    drives: tuple[tuple[Share, tuple[float, float, float]], ...] = ()
    damping: IdentifiedDamping | None = None  # where responses are compared

    @property
    def stiffness(self) -> float:
        """Spring [N/m] on which a tenth of the mass resonates at a third of ``f_max``."""
        return 0.1 * self.weight * (2 * np.pi * self.f_max / 3) ** 2


@dataclass(frozen=True, eq=False)
class ElementGrids:
    """Grids of shells and beams that are possible places of an effect, each with a direction.

    A grid of shells is listed once, with the normal of the surface. Solids without shells and beams
    have their outer faces for shells. A grid of beams is listed once for every direction across a
    beam that ends there.
    """

    grids: np.ndarray  # (k,) ids
    normal: np.ndarray  # (k, 3) of the surface, or across the beam, unit length
    point: np.ndarray  # (k, 3) [m]
    rows: sp.csr_array  # (k, n) translation along the normal
    line: np.ndarray  # (k,) number of the line of beams it lies on, -1 on shells
    along: np.ndarray  # (k, 3) of that line, unit length; zero on shells

    def __len__(self) -> int:
        return len(self.grids)

    def position(self, grid: int, towards: np.ndarray | None = None) -> int:
        """Position of a grid: the first of several, or the one closest to a direction."""
        at = np.flatnonzero(self.grids == grid)
        if towards is None:
            return int(at[0])
        return int(at[np.argmax(np.abs(self.normal[at] @ towards))])

    def only(self, chosen: np.ndarray) -> Self:
        """A selection of the grids."""
        return type(self)(**{name: value[chosen] for name, value in vars(self).items()})

    def spread(self, most: int) -> np.ndarray:
        """Positions of a sample of distant grids, with all directions of each.

        The sample has at most ``most`` grids, or half as many if grids have several directions.
        """
        grids, first = np.unique(self.grids, return_index=True)
        several = len(grids) < len(self.grids)
        some = farthest_point_sample(self.point[first], most // 2 if several else most)
        order = [np.flatnonzero(self.grids == g) for g in grids[some]]
        return np.concatenate([np.zeros(0, int), *order])


def surface(assembly: Assembly) -> np.ndarray:
    """Shells as cells (m, 4); outer faces of the solids, where these are all that there is."""
    if len(assembly.shells) or len(assembly.beams):
        return assembly.shells.nodes
    faces = [skin(s.nodes, s.part)[0] for s in assembly.solids if len(s)]
    return np.concatenate([assembly.shells.nodes, *faces]).astype(int)


def element_grids(groups: ElementGroups) -> ElementGrids:
    """All grids of a surface that can move along its normal, and of beams that can move across."""
    assembly = groups.structure.assembly
    normal = point_normals(assembly.points, surface(assembly))
    on_shells = np.flatnonzero(normal.any(axis=1))
    none = np.full(len(on_shells), -1), np.zeros((len(on_shells), 3))
    on_beams, *of_beams = _across_beams(groups)
    at = np.concatenate([on_shells, on_beams])
    ways, line, along = (
        np.concatenate(pair) for pair in zip((normal[on_shells], *none), of_beams, strict=True)
    )
    rows = groups.structure.along(assembly.ids[at], ways)
    moving = np.flatnonzero(np.diff(rows.indptr) > 0)
    found = ElementGrids(assembly.ids[at], ways, assembly.points[at], rows, line, along)
    return found.only(moving)


def _across_beams(
    groups: ElementGroups,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points on beams only, direction across, line, and tangent: (k,), (k, 3), (k,), (k, 3)."""
    assembly = groups.structure.assembly
    points, shells = assembly.points, len(assembly.shells)
    nodes = groups.nodes[shells:, :2]
    line, tangent = lines(points, nodes), unit(points[nodes[:, 1]] - points[nodes[:, 0]])
    taken = set(assembly.shells.nodes.ravel().tolist())
    found: list[tuple[int, np.ndarray, int, np.ndarray]] = []
    ends, beam = nodes.ravel(), np.repeat(np.arange(len(nodes)), 2)
    for at in alike(ends):
        row, has = int(ends[at[0]]), list[np.ndarray]()
        for k in beam[at] if row not in taken else []:
            for d in tangents(tangent[k]):
                if all(abs(d @ other) < SAME for other in has):
                    has.append(d)
                    found.append((row, d, int(line[k]), tangent[k]))
    if not found:
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros(0, int), np.zeros((0, 3))
    row_of, across, line_of, along = (np.array(c) for c in zip(*found, strict=True))
    return row_of, across, line_of, along


@dataclass(frozen=True, eq=False)
class EffectContext:
    """The structure and its test, as every effect sees them."""

    groups: ElementGroups  # shells and beams
    grids: ElementGrids  # all of them
    places: ElementGrids  # a sample of them, tried if a place is unknown
    setup: Setup  # of the test
    # modes of the deck up to the highest spectral line: (r,) [Hz], (n, r)
    frequency: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def translations(self, grids: Sequence[int]) -> sp.csr_array:
        """Rows of all three translations of each grid (3k, n)."""
        ids = np.repeat(np.asarray(grids), 3)
        return self.groups.structure.along(ids, np.tile(np.eye(3), (len(grids), 1)))

    def rotations(self, grids: Sequence[int] | np.ndarray) -> sp.csr_array:
        """Rows of all three rotations of each grid (3k, n), zero at a grid of solids alone."""
        ids = np.repeat(np.asarray(grids), 3)
        axes = np.tile(np.eye(3), (len(grids), 1))
        return self.groups.structure.along(ids, axes, turning=True)

    def at_shares(self, shares: Sequence[Share]) -> sp.csr_array:
        """Rows (3k, n) of all three translations of places given as weighted grids."""
        each = (sum(w * self.translations([grid]) for grid, w in share) for share in shares)
        return sp.csr_array(sp.vstack(list(each)))
