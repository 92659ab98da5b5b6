"""Strings of adhesive along an edge, and their line between two sheets."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..model.assembly import Assembly, Average
from .joints import solid_parts
from .sheet_pairs import SheetPairs

SHORTEST = 8  # solids of a string
CLOSED = 6.0  # pitches between its ends, below which a line is closed


@dataclass(frozen=True, eq=False)
class HemLine(SheetPairs):
    """A line through the solids of a string, in order; ``along`` are its tangents.

    Attributes
    ----------
    name : of the part
    sheets : names of the sheets
    share : (k,)             tributary length of each solid [m]
    s : (k,)                 arc length [m]
    length : float           total, the gap between the ends of a closed line included [m]
    closed : bool
    """

    name: str
    sheets: tuple[str, ...]
    share: np.ndarray
    s: np.ndarray
    length: float
    closed: bool

    def from_place(self, s0: float) -> np.ndarray:
        """Signed arc length (k,) from a place of the line, by the shorter way if closed [m]."""
        d = self.s - s0
        return d - self.length * np.round(d / self.length) if self.closed else d


def hem_lines(assembly: Assembly) -> list[HemLine]:
    """The lines of all parts of adhesive that form strings between two sheets."""
    out = []
    for group, rows in solid_parts(assembly, soft=True):
        chains = list(_chains(assembly.solids[group].nodes[rows]))
        if chains and all(len(chain) > 1 for chain in chains) and len(rows) >= SHORTEST:
            middle = assembly.points[assembly.solids[group].nodes[rows]].mean(axis=1)
            order = rows[_joined(middle, chains)]
            if (line := _line(assembly, group, order)) is not None:
                out.append(line)
    return out


def _chains(nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Rows of hexahedra from end to end of each string; none if they branch."""
    m = len(nodes)
    at, column = np.unique(nodes, return_inverse=True)
    where = (np.repeat(np.arange(m), nodes.shape[1]), column.ravel())
    touch = sp.csr_array((np.ones(nodes.size), where), shape=(m, len(at)))
    shared = sp.coo_array(touch @ touch.T)
    face = (shared.data >= 4) & (shared.row != shared.col)
    graph = sp.csr_array((np.ones(face.sum()), (shared.row[face], shared.col[face])), shape=(m, m))
    degree = np.diff(graph.indptr)
    if (degree > 2).any():
        return
    piece = connected_components(graph, directed=False)[1]
    for p in range(piece.max() + 1):
        mine = np.flatnonzero(piece == p)
        ends = mine[degree[mine] < 2]
        here, seen = int(ends[0] if len(ends) else mine[0]), [-1]
        while here >= 0:
            seen.append(here)
            next_ones = graph.indices[graph.indptr[here] : graph.indptr[here + 1]]
            here = next((int(j) for j in next_ones if j not in seen[-2:-1] and j != seen[1]), -1)
        yield np.array(seen[1:])


def _joined(middle: np.ndarray, chains: list[np.ndarray]) -> np.ndarray:
    """Join chains: each starts at the end nearest to the end of the previous one."""
    left = sorted(chains, key=len)
    line = list(left.pop())
    while left:
        gaps = [
            (float(np.linalg.norm(middle[chain[end]] - middle[line[-1]])), k, end)
            for k, chain in enumerate(left)
            for end in (0, -1)
        ]
        _, k, end = min(gaps)
        chain = left.pop(k)
        line += list(chain if end == 0 else chain[::-1])
    return np.array(line)


def _line(assembly: Assembly, group: int, rows: np.ndarray) -> HemLine | None:
    """The line through ordered solids, or None unless each is attached to two sheets."""
    solids = assembly.solids[group]
    middle = assembly.points[solids.nodes[rows]].mean(axis=1)
    step = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    pitch, gap = float(np.median(step)), float(np.linalg.norm(middle[-1] - middle[0]))
    closed = gap < CLOSED * pitch
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    carriers, part = _carriers(assembly), _part_of(assembly)
    sides = tuple(_sides(part, carriers, nodes) for nodes in solids.nodes[rows])
    if any(len(a) < 3 or len(b) < 3 for a, b in sides):
        return None
    s = np.concatenate([[0.0], np.cumsum(step)])
    name = assembly.parts[int(solids.part[rows[0]])].name
    parts = np.unique(np.concatenate([part[np.concatenate(side)] for side in sides]))
    sheets = tuple(assembly.parts[int(p)].name for p in parts)
    share = np.minimum(np.gradient(s), 2 * pitch)
    length = float(s[-1]) + gap * closed
    return HemLine(middle, along, sides, name, sheets, share, s, length, closed)


def _carriers(assembly: Assembly) -> dict[int, np.ndarray]:
    """{row of an averaged point: rows of the points in its mean}."""
    return {
        mean.reference: np.array([row for row, _, _ in mean.terms])
        for mean in assembly.rigid
        if isinstance(mean, Average)
    }


def _part_of(assembly: Assembly) -> np.ndarray:
    """Position of a part of shells at each point (n,), -1 without shells."""
    out = np.full(len(assembly.points), -1)
    out[assembly.shells.nodes.ravel()] = np.repeat(assembly.shells.part, 4)
    return out


def _sides(
    part: np.ndarray, carriers: dict[int, np.ndarray], nodes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the grids to which a solid is attached, in its first and in its second part."""
    rows = np.unique(np.concatenate([carriers.get(int(n), np.array([n])) for n in nodes]))
    mine = part[rows]
    known = np.unique(mine[mine >= 0])
    none = np.zeros(0, int)
    if len(known) != 2:
        return none, none
    return rows[mine == known[0]], rows[mine == known[1]]
