"""The beams of a structure that are members of it, and the lines along which they run.

A short bar between two spiders, or bars in a row, hold sheets together as a screw does: they are
fasteners, and what may be wrong with them is asked of joints. All other beams are members.
"""

from collections.abc import Iterator

import numpy as np

from ..arrays import alike
from ..model.assembly import Assembly, Average, RigidBody
from .cells import components
from .facets import unit

MOST_BARS = 3  # of a fastener
STRAIGHT = 0.85  # cosine between two beams that go on along one line


def connected_rows(nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Rows (k,) of elements that hang together by their nodes (m, n)."""
    at, column = np.unique(nodes, return_inverse=True)
    corners = column.reshape(nodes.shape)
    piece = components(corners, len(at))[corners[:, 0]]
    yield from sorted(alike(piece), key=lambda rows: int(rows[0]))


def fastener_bars(assembly: Assembly) -> list[np.ndarray]:
    """Rows (k,) of bars by themselves between sheets whose ends are those of spiders or means."""
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
    """Rows (k,) of the beams whose part has no fastener."""
    part = assembly.beams.part
    fasteners = [part[piece] for piece in fastener_bars(assembly)]
    taken = np.concatenate(fasteners) if fasteners else np.zeros(0, int)
    return np.flatnonzero(~np.isin(part, taken))


def lines(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Number of the line every beam (m, 2) lies on (m,): it goes on where two meet nearly straight.

    >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0]])
    >>> lines(corner, np.array([[0, 1], [1, 2], [2, 3]])).tolist()
    [0, 0, 1]
    """
    m = len(nodes)
    way = unit(points[nodes[:, 1]] - points[nodes[:, 0]])
    ends = nodes.T.ravel()  # of beam k % m
    away = np.concatenate([way, -way])  # from the end into the beam
    met = [np.zeros((0, 2), dtype=int)]
    for at in alike(ends):
        i, j = np.nonzero(np.triu(away[at] @ away[at].T < -STRAIGHT, 1))
        met.append(np.column_stack([at[i] % m, at[j] % m]))
    return components(np.concatenate(met), m)
