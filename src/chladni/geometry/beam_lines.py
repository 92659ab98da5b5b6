"""Member beams of a structure, and the lines that they form.

A short bar between two spiders, or a few bars in a row, connects sheets as a screw does. These bars
are fasteners, and effects of joints cover their errors. All other beams are members.
"""

from collections.abc import Iterator

import numpy as np

from ..arrays import alike
from ..model.assembly import Assembly, Average, RigidBody
from .cells import components
from .facets import unit

MOST_BARS = 3  # of a fastener
STRAIGHT = 0.85  # cosine between two beams from which they form one line


def connected_rows(nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Rows (k,) of each set of elements that share nodes (m, n)."""
    at, column = np.unique(nodes, return_inverse=True)
    corners = column.reshape(nodes.shape)
    piece = components(corners, len(at))[corners[:, 0]]
    yield from sorted(alike(piece), key=lambda rows: int(rows[0]))


def fastener_bars(assembly: Assembly) -> list[np.ndarray]:
    """Rows (k,) of each isolated chain of bars whose ends lead RBE2 or RBE3."""
    nodes = assembly.beams.nodes
    if not len(nodes) or not len(assembly.shells):
        return []
    held = {r.independent if isinstance(r, RigidBody) else r.reference
            for r in assembly.rigid if isinstance(r, RigidBody | Average)}  # fmt: skip
    out = []
    for piece in connected_rows(nodes):
        ends, count = np.unique(nodes[piece], return_counts=True)
        if len(piece) <= MOST_BARS and held.issuperset(ends[count == 1].tolist()):
            out.append(piece)
    return out


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
