"""Member beams of a structure, and the lines that they form.

A short bar between two spiders or from sheet to sheet, or a few bars in a row, connects sheets as a
screw or a spot weld does. These bars are fasteners, and effects of joints cover their errors. All
other beams are members.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..arrays import alike
from ..model.assembly import Assembly, Average, RigidBody
from .cells import components
from .facets import cell_areas, unit

MOST_BARS = 3  # of a fastener
STRAIGHT = 0.85  # cosine between two beams from which they form one line


def connected_rows(nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Rows (k,) of each set of elements that share nodes (m, n)."""
    at, column = np.unique(nodes, return_inverse=True)
    corners = column.reshape(nodes.shape)
    piece = components(corners, len(at))[corners[:, 0]]
    yield from sorted(alike(piece), key=lambda rows: int(rows[0]))


def fastener_bars(assembly: Assembly) -> list[np.ndarray]:
    """Rows (k,) of each isolated chain of bars whose ends lead RBE2 or RBE3, or bridge sheets.

    A chain that ends on a grid of a shell bridges sheets if its ends are corners of no common
    shell, as those of a stiffener are. They are also nearer to each other than the shells are wide.
    """
    nodes = assembly.beams.nodes
    if not len(nodes) or not len(assembly.shells):
        return []
    held = {r.independent if isinstance(r, RigidBody) else r.reference
            for r in assembly.rigid if isinstance(r, RigidBody | Average)}  # fmt: skip
    sheets, out = _ShellsAtPoints.of(assembly), []
    for piece in connected_rows(nodes):
        if len(piece) > MOST_BARS:
            continue
        points, count = np.unique(nodes[piece], return_counts=True)
        ends = points[count == 1]
        bare = [end for end in ends.tolist() if end not in held]
        if not bare or sheets.bridged(assembly.points, ends, bare):
            out.append(piece)
    return out


@dataclass(frozen=True, eq=False)
class _ShellsAtPoints:
    """Shells at each point: which (n, m), and the mean root of their area (n,) [m], 0 without."""

    at: sp.csr_array
    width: np.ndarray

    @classmethod
    def of(cls, assembly: Assembly) -> Self:
        """Collect the shells of an assembly."""
        cells, n = assembly.shells.nodes, len(assembly.points)
        of = np.repeat(np.arange(len(cells)), cells.shape[1])
        at = sp.csr_array((np.ones(cells.size), (cells.ravel(), of)), shape=(n, len(cells)))
        total, count = at @ np.sqrt(cell_areas(assembly.points, cells)), at.sum(axis=1)
        return cls(at, total / np.maximum(count, 1))

    def bridged(self, points: np.ndarray, ends: np.ndarray, bare: Sequence[int]) -> bool:
        """True if two ends are near each other on different shells; ``bare`` have no spider."""
        if len(ends) != 2 or not (self.width[bare] > 0).all():
            return False
        a, b = ends.tolist()
        near = np.linalg.norm(points[a] - points[b]) < self.width[ends].max()
        return bool(near and not self.at[[a]].multiply(self.at[[b]]).nnz)


def member_beams(assembly: Assembly) -> np.ndarray:
    """Rows (k,) of the beams in parts without fasteners."""
    part = assembly.beams.part
    fasteners = [part[piece] for piece in fastener_bars(assembly)]
    taken = np.concatenate(fasteners) if fasteners else np.zeros(0, int)
    return np.flatnonzero(~np.isin(part, taken))


def lines(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Number of the line of every beam (m,): a line continues where two meet nearly straight.

    >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0]])
    >>> lines(corner, np.array([[0, 1], [1, 2], [2, 3]])).tolist()
    [0, 0, 1]
    """
    m = len(nodes)
    axis = unit(points[nodes[:, 1]] - points[nodes[:, 0]])
    ends = nodes.T.ravel()  # of beam k % m
    away = np.concatenate([axis, -axis])  # from the end into the beam
    met = [np.zeros((0, 2), dtype=int)]
    for at in alike(ends):
        i, j = np.nonzero(np.triu(away[at] @ away[at].T < -STRAIGHT, 1))
        met.append(np.column_stack([at[i] % m, at[j] % m]))
    return components(np.concatenate(met), m)
