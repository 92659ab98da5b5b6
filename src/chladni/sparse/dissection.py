"""Nested dissection of a symmetric sparsity pattern, by the places of its rows if they are known.

George 1973 (SIAM J. Numer. Anal. 10, 345). Rows are first collected into nodes (six dofs, one
vertex). Vertices are split at medians of their coordinates. The separator is the smallest set of
vertices that touches all edges of the cut. Distances in the graph from a few far vertices are
additional coordinates, or the only ones if places are unknown. Their planes are level sets (George
and Liu 1978, SIAM J. Numer. Anal. 15).
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra, maximum_bipartite_matching

from ..errors import ShapeError

_LEAF = 24  # vertices eliminated as one dense block
_HUB = 10  # times the mean degree: such a vertex belongs to the last separator
_LANDMARKS = 12  # half as many if places are known
_TRIES = 12  # coordinates tried for a cut, the widest first
_CUTS = (0.5, 0.42, 0.58)


@dataclass(frozen=True, eq=False)
class Fronts:
    """Elimination order by fronts, children before parents.

    Attributes
    ----------
    order : (n,)         rows of the matrix in the order of elimination
    start : (f + 1,)     first pivot of each front, in the new numbering
    boundary : f arrays  rows (new numbers, increasing) that a front updates beyond its own
    children : f tuples  fronts whose updates a front receives
    """

    order: np.ndarray
    start: np.ndarray
    boundary: tuple[np.ndarray, ...]
    children: tuple[tuple[int, ...], ...]

    def ordered(self) -> Self:
        """Fronts for a matrix whose rows are already in this order."""
        return replace(self, order=np.arange(len(self.order)))

    @property
    def nnz(self) -> int:
        """Entries of the lower triangular factor."""
        a = np.diff(self.start)
        b = np.array([len(rows) for rows in self.boundary])
        return int(np.sum(a * (a + 1) // 2 + a * b))


def pattern(*matrices: sp.csr_array) -> sp.csr_array:
    """Joint sparsity pattern of some matrices, as small integers."""
    marks = [
        sp.csr_array((np.ones(A.nnz, np.int8), A.indices, A.indptr), shape=A.shape)
        for A in map(sp.csr_array, matrices)
    ]
    return sum(marks[1:], start=marks[0])


def analyse(
    A: sp.csr_array, points: np.ndarray | None = None, nodes: np.ndarray | None = None
) -> Fronts:
    """Fronts of a symmetric pattern (n, n).

    Parameters
    ----------
    points : (n, 3), optional   place of each row
    nodes : (n,) int, optional  number of each row's node; default one node for each row
    """
    n = A.shape[0]
    for name, given in {"points": points, "nodes": nodes}.items():
        if given is not None and len(given) != n:
            raise ShapeError(f"{len(given)} {name} given, one for each of {n} rows is needed")
    vertex = np.arange(n) if nodes is None else np.unique(nodes, return_inverse=True)[1]
    G = quotient(A, vertex)
    hops = distances(G, _LANDMARKS if points is None else _LANDMARKS // 2)
    places = hops if points is None else np.hstack([_principal(points, vertex, hops.max()), hops])
    pivots, children = _dissected(G, places)
    return _symbolic(G, vertex, pivots, children)


def quotient(A: sp.csr_array, vertex: np.ndarray) -> sp.csr_array:
    """Graph of the nodes: an edge between nodes with coupled rows, and the diagonal."""
    A = sp.csr_array(A)
    N = int(vertex.max()) + 1
    vertex = vertex.astype(np.int32)
    row = np.repeat(vertex, np.diff(A.indptr))
    own = np.arange(N, dtype=np.int32)
    ij = np.r_[row, own], np.r_[vertex[A.indices], own]
    G = sp.coo_array((np.ones(A.nnz + N, bool), ij), shape=(N, N)).tocsr()
    return sp.csr_array((np.ones(G.nnz, np.int8), G.indices, G.indptr), shape=(N, N))


def _principal(points: np.ndarray, vertex: np.ndarray, extent: float) -> np.ndarray:
    """Places of the nodes along their principal axes, scaled to an extent (N, 3).

    A mesh is aligned with its body rather than with the axes of the deck.
    """
    x = np.zeros((int(vertex.max()) + 1, np.shape(points)[1]))
    np.add.at(x, vertex, np.asarray(points, float))
    x /= np.bincount(vertex)[:, None]
    x -= x.mean(axis=0)
    x = x @ np.linalg.eigh(x.T @ x)[1]
    return x * (extent / max(np.ptp(x, axis=0).max(), np.finfo(float).tiny))


def distances(G: sp.csr_array, count: int) -> np.ndarray:
    """Hops from a few far vertices (N, count), whose level sets are narrow cuts."""
    hops = _hops(G, 0)
    nearest = hops
    columns: list[np.ndarray] = []
    for _ in range(count):
        hops = _hops(G, int(np.argmax(nearest)))
        nearest = hops if not columns else np.minimum(nearest, hops)
        columns.append(hops)
    return np.array(columns).T


def _hops(G: sp.csr_array, start: int) -> np.ndarray:
    """Number of edges on the shortest path from a vertex; a large number in other components."""
    hops = dijkstra(G, unweighted=True, indices=start)
    hops[np.isinf(hops)] = 2 * hops[np.isfinite(hops)].max() + 2
    return hops


def _dissected(
    G: sp.csr_array, places: np.ndarray
) -> tuple[list[np.ndarray], list[tuple[int, ...]]]:
    """Pivot vertices of every front and its children, in postorder."""
    pivots: list[np.ndarray] = []
    children: list[tuple[int, ...]] = []
    degree = np.diff(G.indptr)
    hub = degree > max(_HUB * degree.mean(), 4 * _LEAF)
    E = sp.coo_array(G)
    u, v = E.coords
    use = (u != v) & ~hub[u] & ~hub[v]
    local = np.zeros(G.shape[0], np.int64)

    def visit(ids: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[int, ...]:
        if len(ids) <= _LEAF:
            return front(ids, ())
        local[ids] = np.arange(len(ids))
        side = _split(places[ids], local[u], local[v])
        parts = [(ids[side == k], (side[local[u]] == k) & (side[local[v]] == k)) for k in (0, 1)]
        below = [visit(part, u[inner], v[inner]) for part, inner in parts]
        return front(ids[side == 2], below[0] + below[1])

    def front(ids: np.ndarray, below: tuple[int, ...]) -> tuple[int, ...]:
        if len(ids) == 0:  # no separator: both halves become children of the parent front
            return below
        pivots.append(ids)
        children.append(below)
        return (len(pivots) - 1,)

    top = visit(np.flatnonzero(~hub), u[use], v[use])
    front(np.flatnonzero(hub), top)
    return pivots, children


def _split(x: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Best of a few straight cuts (m,): 0 or 1 for the halves and 2 for the separator."""
    m, extent = len(x), np.ptp(x, axis=0)
    axes = [a for a in np.argsort(-extent)[:_TRIES] if extent[a] >= 0.3 * extent.max()]
    best, cost = np.zeros(m, bool), np.inf
    for axis in axes:
        rank = np.argsort(np.argsort(x[:, axis], kind="stable"))
        for low in _halves(x[:, axis], rank):
            cross = low[u] & ~low[v]
            shores = [np.count_nonzero(np.bincount(w[cross], minlength=m)) for w in (u, v)]
            price = min(shores) * (1 + abs(2 * low.sum() / m - 1))
            if price < cost:
                best, cost = low, price
    cross = best[u] & ~best[v]
    return np.where(_cover(u[cross], v[cross], m), 2, np.where(best, 0, 1))


def _cover(u: np.ndarray, v: np.ndarray, m: int) -> np.ndarray:
    """Mask (m,) of the smallest set of vertices that touches every edge u-v of a cut (König 1931).

    From the unmatched lower ends of a maximum matching, follow edges up and the matching down. The
    cover consists of the lower vertices not reached and the upper vertices reached.
    """
    below, i = np.unique(u, return_inverse=True)
    above, j = np.unique(v, return_inverse=True)
    edges = sp.csr_array((np.ones(len(i), np.int8), (i, j)), shape=(len(below), len(above)))
    mate = maximum_bipartite_matching(edges, perm_type="column")
    back = np.full(len(above), -1)
    back[mate[mate >= 0]] = np.flatnonzero(mate >= 0)
    reached, over = mate < 0, np.zeros(len(above), bool)
    while True:
        fresh = np.zeros(len(above), bool)
        fresh[j[reached[i]]] = True
        fresh &= ~over
        if not fresh.any():
            break
        over |= fresh
        reached[back[fresh]] = True
    cover = np.zeros(m, bool)
    cover[below[~reached]] = cover[above[over]] = True
    return cover


def _halves(x: np.ndarray, rank: np.ndarray) -> list[np.ndarray]:
    """Candidate lower halves: planes x < c near the median if ties permit, else by rank."""
    m = len(x)
    ordered = np.sort(x)
    cuts = [x < ordered[int(q * m)] for q in (_CUTS if m > 8 * _LEAF else _CUTS[:1])]
    fair = [low for low in cuts if 0.3 * m <= low.sum() <= 0.7 * m]
    return fair or [rank < m // 2]


def _symbolic(
    G: sp.csr_array, vertex: np.ndarray, pivots: list[np.ndarray], children: list[tuple[int, ...]]
) -> Fronts:
    """Boundary of a front: neighbours of its pivots and boundaries of its children, less pivots."""
    order = np.concatenate(pivots)
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    first = np.cumsum([0, *map(len, pivots)])
    boundary: list[np.ndarray] = []
    for i, (ids, below) in enumerate(zip(pivots, children, strict=True)):
        seen = [new[_neighbours(G, ids)], *(boundary[c] for c in below)]
        rows = np.unique(np.concatenate(seen))
        boundary.append(rows[rows >= first[i + 1]])
    size = np.bincount(vertex)[order]  # rows of each vertex, in the new order
    begin = np.cumsum(np.r_[0, size])
    return Fronts(
        np.argsort(new[vertex], kind="stable"),
        begin[first],
        tuple(_ranges(begin[rows], size[rows]) for rows in boundary),
        tuple(children),
    )


def _neighbours(G: sp.csr_array, ids: np.ndarray) -> np.ndarray:
    return G.indices[_ranges(G.indptr[ids], np.diff(G.indptr)[ids])]


def _ranges(begin: np.ndarray, length: np.ndarray) -> np.ndarray:
    """begin_k, begin_k + 1, ... of each length, in one array."""
    ends = np.cumsum(length)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(begin - ends + length, length)


def runs(rows: np.ndarray) -> list[slice]:
    """Slices of positions over which the numbers are consecutive."""
    cuts = np.flatnonzero(np.diff(rows) != 1) + 1
    return [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), len(rows)])]
