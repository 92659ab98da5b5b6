"""Refinement of a structure, every shell split in four and every beam in two, to find mesh error.

New nodes of shells lie on the smooth surface through the old ones, and on the deck's own facets at
folds (:mod:`.smooth_sides`). A shell with nodes on its edges has its own surface x = Σ N_i x_i for
them, and its quarters have nodes on their edges too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..model.added_points import with_points
from ..model.assembly import Assembly, Shells, concatenated, picked
from .beam_lines import member_beams
from .smooth_sides import bulges, shell_edges
from .solid_shapes import SURFACES, ShapeFamily, with_middles

SAME_AXES = 1e-6  # of unit vectors: frames of neighbours that count as equal for supports


def refined(assembly: Assembly) -> Assembly:
    """Halve every shell of the assembly in both directions, and every member beam.

    Everything else is unchanged. A component held at both ends of a side is held between them. Old
    points keep their rows and ids; new ones follow with new ids. A beam along a side of a shell
    uses the point in its middle.
    """
    halved, middle = _finer_shells(assembly)
    return _finer_beams(halved, middle)


Middles = tuple[np.ndarray, np.ndarray]  # pairs of points (k, 2), row of the point between (k,)


def _finer_shells(assembly: Assembly) -> tuple[Assembly, Middles]:
    shells = assembly.shells
    if not len(shells):
        return assembly, (np.zeros((0, 2), int), np.zeros(0, int))
    edges, of = shell_edges(shells.nodes)
    own = shells.middle >= 0
    between = np.full(len(edges), -1)
    between[of[own]] = shells.middle[own]
    rise = bulges(assembly.points, shells.nodes, edges, of)
    rise[of[shells.curved]] = 0.0  # a side of theirs without a node is straight
    new = np.flatnonzero(between < 0)
    grown, between[new] = _added(assembly, assembly.points[edges[new]].mean(axis=1) + rise[new],
                                 edges[new])  # fmt: skip
    quads = np.flatnonzero(~shells.triangle)
    centre = np.full(len(shells), -1)
    middle = assembly.points[shells.nodes[quads]].mean(axis=1) + rise[of[quads]].sum(axis=1) / 2
    kinds = [
        _Curved.of(assembly, at)
        for at in (
            np.flatnonzero(shells.curved & ~shells.triangle),
            np.flatnonzero(shells.curved & shells.triangle),
        )
    ]
    middle[np.isin(quads, kinds[0].at)] = kinds[0].places(np.zeros((1, 3)))[:, 0]  # else Coons
    ends = np.concatenate([shells.nodes, np.where(own, shells.middle, shells.nodes)], axis=1)
    grown, centre[quads] = _added(grown, middle, ends[quads])
    held = np.flatnonzero(np.isin(np.arange(len(edges)), of[own]))
    quarter, halves = np.full((len(edges), 2), -1), []
    for k in (0, 1):  # on the parabola through both corners and the node between
        near, node, far = edges[held, k], between[held], edges[held, 1 - k]
        X = assembly.points
        places = 0.375 * X[near] + 0.75 * X[node] - 0.125 * X[far]
        halves.append(np.column_stack([near, node]))
        grown, quarter[held, k] = _added(grown, places, halves[k])
    inner = np.full((len(shells), 4), -1)
    for kind in kinds:
        places = kind.places(kind.inner)
        count = places.shape[1]
        grown, rows = _added(grown, places.reshape(-1, 3), np.repeat(ends[kind.at], count, axis=0))
        inner[kind.at, :count] = rows.reshape(-1, count)

    def near_corner(shell: np.ndarray, side: int, corner: int) -> np.ndarray:
        """Rows of the nodes on the halves of sides that end at a corner, -1 for straight ones."""
        edge, at_first = of[shell, side], edges[of[shell, side], 0] == shells.nodes[shell, corner]
        return np.where(own[shell, side], np.where(at_first, *quarter[edge].T), -1)

    pairs = np.concatenate([edges, *halves])
    rows = np.concatenate([between, quarter[held, 0], quarter[held, 1]])
    return replace(grown, shells=_split(shells, between[of], centre, near_corner, inner)), (
        pairs,
        rows,
    )


def _added(assembly: Assembly, places: np.ndarray, ends: np.ndarray) -> tuple[Assembly, np.ndarray]:
    """Points between ``ends`` (k, m), held where all of these are; the assembly and their rows."""
    grown, rows = with_points(assembly, places)
    return _held_between(grown, rows, ends), rows


@dataclass(frozen=True, eq=False)
class _Curved:
    """Shells of one kind with nodes on their edges."""

    at: np.ndarray  # (m,) int, rows of the shells
    X: np.ndarray  # (m, k, 3) of all nodes, those of straight edges too
    family: ShapeFamily

    @classmethod
    def of(cls, assembly: Assembly, at: np.ndarray) -> Self:
        shells = assembly.shells
        corners = 3 if shells.triangle[at].any() else 4
        nodes = shells.nodes[at, :corners]
        middle = np.where(shells.middle[at, :corners] < 0, nodes, shells.middle[at, :corners])
        ring = tuple((e, (e + 1) % corners) for e in range(corners))
        X, _ = with_middles(assembly.points[np.concatenate([nodes, middle], axis=1)], ring)
        return cls(at, X, SURFACES[2 * corners])

    @property
    def inner(self) -> np.ndarray:
        """Natural coordinates of the nodes on the edges between the four pieces."""
        corners = self.X.shape[1] // 2
        sides = np.asarray(self.family.nodes)[corners:]
        other = np.zeros(3) if corners == 4 else np.roll(sides, 1, axis=0)
        return np.asarray((sides + other) / 2)

    def places(self, xi: np.ndarray) -> np.ndarray:
        """Places (m, k, 3) at natural coordinates (k, 3)."""
        return np.stack([self.family.values(x) @ self.X for x in xi], axis=1)


def _held_between(assembly: Assembly, new: np.ndarray, ends: np.ndarray) -> Assembly:
    """Hold points ``new`` (k,) in the components held at all of their ends (k, m), in that frame.

    A clamped edge stays clamped between its old points.
    """
    held = np.zeros((len(assembly.points), 6), bool)
    held[assembly.supports[:, 0], assembly.supports[:, 1] - 1] = True
    all_of = held[ends].all(axis=1)
    if not all_of.any():
        return assembly
    axes = assembly.axes
    if axes is not None:
        alike = np.abs(axes[ends] - axes[ends[:, :1]]).max(axis=(1, 2, 3)) < SAME_AXES
        all_of &= alike[:, None]
        axes = axes.copy()
        axes[new[all_of.any(axis=1)]] = axes[ends[all_of.any(axis=1), 0]]
    k, component = np.nonzero(all_of)
    more = np.column_stack([new[k], component + 1])
    return replace(assembly, axes=axes, supports=np.concatenate([assembly.supports, more]))


def _finer_beams(assembly: Assembly, sides: Middles) -> Assembly:
    """Replace each member by two beams; ``sides`` are those of the halved shells."""
    beams, members = assembly.beams, member_beams(assembly)
    if not len(members):
        return assembly
    ends, (pairs, rows) = np.sort(beams.nodes[members], axis=1), sides
    known = dict(zip(map(tuple, np.sort(pairs, axis=1).tolist()), rows.tolist(), strict=True))
    middle = np.array([known.get(pair, -1) for pair in map(tuple, ends.tolist())])
    own, at = np.unique(ends[middle < 0], axis=0, return_inverse=True)
    grown, rows = with_points(assembly, assembly.points[own].mean(axis=1))
    middle[middle < 0] = np.asarray(rows)[at.ravel()]
    others = picked(beams, np.setdiff1d(np.arange(len(beams)), members))
    free = np.zeros((len(members), 6), bool)
    halves = []
    for end in (0, 1):
        half = picked(beams, members)
        nodes, offset, pins = half.nodes.copy(), half.offset.copy(), half.pins.copy()
        nodes[:, 1 - end], pins[:, 1 - end] = middle, free
        offset[:, 1 - end] = half.offset.mean(axis=1)
        ids = half.ids + end * int(beams.ids.max())
        halves.append(replace(half, ids=ids, nodes=nodes, offset=offset, pins=pins))
    return replace(grown, beams=concatenated(others, *halves))


def parents(shells: Shells) -> np.ndarray:
    """Parent shell of every shell of the refined mesh (4 m,)."""
    quad, tri = np.flatnonzero(~shells.triangle), np.flatnonzero(shells.triangle)
    return np.concatenate([np.tile(quad, 4), np.tile(tri, 4)])


def _split(
    shells: Shells, side: np.ndarray, centre: np.ndarray,
    near: Callable[[np.ndarray, int, int], np.ndarray], inner: np.ndarray,
) -> Shells:  # fmt: skip
    """Replace each shell by four; ``side``, ``centre`` and ``inner`` are rows of points.

    ``near`` gives the nodes on the halves of sides. The inner edges of a quadrilateral lead from
    its sides to its centre, those of a triangle from each side to the one before.
    """
    c, t = shells.nodes, shells.thickness
    tri = np.flatnonzero(shells.triangle)
    quad = np.flatnonzero(~shells.triangle)
    mid = centre
    t_side = (t + np.roll(t, -1, axis=1)) / 2
    t_side[tri, 2] = (t[tri, 2] + t[tri, 0]) / 2
    t_mid = t.mean(axis=1)
    pieces = []
    for k in range(4):
        j = (k - 1) % 4
        nodes = np.stack([c[quad, k], side[quad, k], mid[quad], side[quad, j]], axis=1)
        thick = np.stack([t[quad, k], t_side[quad, k], t_mid[quad], t_side[quad, j]], axis=1)
        own = (near(quad, k, k), inner[quad, k], inner[quad, j], near(quad, j, k))
        pieces.append((nodes, thick, np.stack(own, axis=1)))
    for k in range(3):
        j = (k - 1) % 3
        nodes = np.stack([c[tri, k], side[tri, k], side[tri, j], side[tri, j]], axis=1)
        thick = np.stack([t[tri, k], t_side[tri, k], t_side[tri, j], t_side[tri, j]], axis=1)
        own = (near(tri, k, k), inner[tri, k], near(tri, j, k), np.full(len(tri), -1))
        pieces.append((nodes, thick, np.stack(own, axis=1)))
    nodes = np.stack([side[tri, 0], side[tri, 1], side[tri, 2], side[tri, 2]], axis=1)
    thick = np.stack([t_side[tri, 0], t_side[tri, 1], t_side[tri, 2], t_side[tri, 2]], axis=1)
    pieces.append((nodes, thick, inner[tri][:, [1, 2, 0, 3]]))
    at = parents(shells)
    return Shells(
        1 + np.arange(len(at)),
        np.concatenate([nodes for nodes, _, _ in pieces]),
        shells.part[at],
        np.concatenate([thick for _, thick, _ in pieces]),
        shells.axis[at],
        shells.offset[at],
        np.concatenate([own for _, _, own in pieces]),
        nonstructural=shells.nonstructural[at],
    )
