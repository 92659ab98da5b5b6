"""Refinement of a structure, every shell split in four and every beam in two, to find mesh error.

New nodes of shells lie on the smooth surface through the old ones, and on the deck's own facets at
folds (:mod:`.smooth_sides`).
"""

from dataclasses import replace

import numpy as np

from ..errors import ModelError
from ..model.added_points import with_points
from ..model.assembly import Assembly, Shells, concatenated, picked
from .beam_lines import member_beams
from .smooth_sides import bulges, shell_edges

SAME_AXES = 1e-6  # of unit vectors: frames of neighbours that count as equal for supports


def refined(assembly: Assembly) -> Assembly:
    """Halve every shell of the assembly in both directions, and every member beam.

    Everything else is unchanged. A component held at both ends of a side is held between them. Old
    points keep their rows and ids; new ones follow with new ids. A beam along a side of a shell
    uses the new point of that side.

    Raises
    ------
    ModelError
        If a shell has nodes on its edges, which its halves would lack.
    """
    if assembly.shells.curved.any():
        shell = assembly.shells.ids[np.argmax(assembly.shells.curved)]
        raise ModelError(f"shell {shell} has nodes on its edges; only shells without are halved")
    halved, middle = _finer_shells(assembly)
    return _finer_beams(halved, middle)


Middles = tuple[np.ndarray, int]  # sides of shells (k, 2) with a new point, row of the first point


def _finer_shells(assembly: Assembly) -> tuple[Assembly, Middles]:
    shells = assembly.shells
    if not len(shells):
        return assembly, (np.zeros((0, 2), int), 0)
    tri = shells.triangle
    edges, of = shell_edges(shells.nodes)
    rise = bulges(assembly.points, shells.nodes, edges, of)
    n, m = len(assembly.points), len(edges)
    quads = shells.nodes[~tri]
    middle = assembly.points[edges].mean(axis=1) + rise
    centre = assembly.points[quads].mean(axis=1) + rise[of[~tri]].sum(axis=1) / 2  # Coons
    points = np.concatenate([assembly.points, middle, centre])
    grown, _ = with_points(assembly, points[n:])
    grown = _held_between(grown, np.arange(n, n + m), edges)
    grown = _held_between(grown, np.arange(n + m, len(points)), quads)
    return replace(grown, shells=_split(shells, of + n, n + m)), (edges, n)


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
    ends, (edges, first) = np.sort(beams.nodes[members], axis=1), sides
    known = {pair: first + k for k, pair in enumerate(map(tuple, edges.tolist()))}
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


def _split(shells: Shells, side: np.ndarray, centre: int) -> Shells:
    """Replace each shell by four; ``side`` and ``centre`` are rows of the new points."""
    c, t = shells.nodes, shells.thickness
    tri = np.flatnonzero(shells.triangle)
    quad = np.flatnonzero(~shells.triangle)
    mid = np.zeros(len(c), int)
    mid[quad] = centre + np.arange(len(quad))
    t_side = (t + np.roll(t, -1, axis=1)) / 2
    t_side[tri, 2] = (t[tri, 2] + t[tri, 0]) / 2
    t_mid = t.mean(axis=1)
    pieces = []
    for k in range(4):
        j = (k - 1) % 4
        nodes = np.stack([c[quad, k], side[quad, k], mid[quad], side[quad, j]], axis=1)
        thick = np.stack([t[quad, k], t_side[quad, k], t_mid[quad], t_side[quad, j]], axis=1)
        pieces.append((nodes, thick))
    for k in range(3):
        j = (k - 1) % 3
        nodes = np.stack([c[tri, k], side[tri, k], side[tri, j], side[tri, j]], axis=1)
        thick = np.stack([t[tri, k], t_side[tri, k], t_side[tri, j], t_side[tri, j]], axis=1)
        pieces.append((nodes, thick))
    nodes = np.stack([side[tri, 0], side[tri, 1], side[tri, 2], side[tri, 2]], axis=1)
    thick = np.stack([t_side[tri, 0], t_side[tri, 1], t_side[tri, 2], t_side[tri, 2]], axis=1)
    pieces.append((nodes, thick))
    at = parents(shells)
    return Shells(
        1 + np.arange(len(at)),
        np.concatenate([nodes for nodes, _ in pieces]),
        shells.part[at],
        np.concatenate([thick for _, thick in pieces]),
        shells.axis[at],
        shells.offset[at],
        nonstructural=shells.nonstructural[at],
    )
