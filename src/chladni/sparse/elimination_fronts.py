"""Order of elimination of a symmetric sparsity pattern, and its dense fronts.

Coupled rows of a node are one vertex (six dofs of a curved shell). METIS orders the vertices by
nested dissection (Karypis and Kumar 1998, SIAM J. Sci. Comput. 20, 359). Where it has no wheel,
SciPy's SuperLU orders them by minimum degree. The elimination tree (Liu 1990, SIAM J. Matrix Anal.
Appl. 11, 134) says which vertices are eliminated as one front. A front takes in its child where
this stores few zeros (Ashcraft and Grimes 1989, ACM TOMS 15, 291).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self, TypeVar

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..errors import ShapeError

try:
    import pymetis
except ImportError:
    pymetis = None  # type: ignore[assignment]

_LEAF = 72  # rows of a subtree that are eliminated as one dense block
_ZEROS = 0.15  # largest share of zeros in a front that took in its child
_HUB = 10  # times the mean degree: METIS orders such a vertex last

_Count = TypeVar("_Count", int, np.ndarray)
_Pivots = list[np.ndarray]
_Below = list[list[int]]


@dataclass(frozen=True, eq=False)
class Fronts:
    """Elimination order by fronts, children before parents."""

    order: np.ndarray  # (n,) rows of the matrix in the order of elimination
    start: np.ndarray  # (f + 1,) first pivot of each front, in the new numbering
    # f arrays: rows (new numbers, increasing) that a front updates beyond its own
    boundary: tuple[np.ndarray, ...]
    children: tuple[tuple[int, ...], ...]  # f tuples: fronts whose updates a front receives

    def ordered(self) -> Self:
        """Fronts for a matrix whose rows are already in this order."""
        return replace(self, order=np.arange(len(self.order)))

    @property
    def nnz(self) -> int:
        """Entries of the lower triangular factor."""
        b = np.array([len(rows) for rows in self.boundary])
        return int(_entries(np.diff(self.start), b).sum())


def pattern(*matrices: sp.csr_array) -> sp.csr_array:
    """Joint sparsity pattern of some matrices, as small integers."""
    marks = [
        sp.csr_array((np.ones(A.nnz, np.int8), A.indices, A.indptr), shape=A.shape)
        for A in map(sp.csr_array, matrices)
    ]
    return sum(marks[1:], start=marks[0])


def analyse(A: sp.csr_array, nodes: np.ndarray | None = None) -> Fronts:
    """Fronts of a symmetric pattern (n, n).

    Parameters
    ----------
    nodes : (n,) int, optional  number of each row's node; default one node for each row
    """
    n = A.shape[0]
    if nodes is not None and len(nodes) != n:
        raise ShapeError(f"{len(nodes)} nodes given, one for each of {n} rows is needed")
    A, vertex = sp.csr_array(A), np.arange(n)
    if nodes is not None:
        vertex = coupled(A, np.unique(nodes, return_inverse=True)[1])
    G = quotient(A, vertex)
    order = dissected(G) if pymetis else minimum_degree(G)
    P = G[order][:, order]
    size = np.bincount(vertex)[order]  # rows of each vertex
    pivots, below = _collected(elimination_tree(P), size)
    boundary = _boundaries(P, pivots, below)
    pivots, below, boundary = _merged(pivots, below, boundary, size)
    return _numbered([order[p] for p in pivots], below, [order[b] for b in boundary], vertex)


def coupled(A: sp.csr_array, node: np.ndarray) -> np.ndarray:
    """Vertex (n,) of each row: rows of a node, next to one another, that some row of A couples.

    Membrane and bending of a flat sheet along the axes are two vertices, which halves their fill.
    """
    n, together = len(node), np.argsort(node, kind="stable")
    first = np.searchsorted(node[together], node)  # of the rows of each row's node
    place = np.argsort(together) - first
    met = np.zeros((n, place.max(initial=0) + 1), bool)  # with the rows of its node
    of_entry = node.astype(np.int32)[A.indices]
    same = np.zeros(A.nnz + 1, bool)  # entries whose node is that of the one before in the row
    same[1:-1] = of_entry[1:] == of_entry[:-1]
    same[A.indptr] = False
    at = np.flatnonzero(same)
    met[A.indices[at - 1], place[A.indices[at]]] = True
    row, k = np.nonzero(met)
    ties = sp.coo_array((np.ones(len(row), bool), (row, together[first[row] + k])), shape=(n, n))
    return np.asarray(connected_components(ties, directed=False)[1])


def quotient(A: sp.csr_array, vertex: np.ndarray) -> sp.csr_array:
    """Graph of the nodes: an edge between nodes with coupled rows, and the diagonal."""
    N = int(vertex.max()) + 1
    vertex = vertex.astype(np.int32)
    row = np.repeat(vertex, np.diff(A.indptr))
    own = np.arange(N, dtype=np.int32)
    ij = np.r_[row, own], np.r_[vertex[A.indices], own]
    G = sp.coo_array((np.ones(A.nnz + N, bool), ij), shape=(N, N)).tocsr()
    return sp.csr_array((np.ones(G.nnz, np.int8), G.indices, G.indptr), shape=(N, N))


def dissected(G: sp.csr_array) -> np.ndarray:
    """Vertices (N,) in the order of METIS' nested dissection."""
    E = sp.coo_array(G)
    u, v = E.coords
    E = sp.coo_array((np.ones(np.sum(u != v), np.int8), (u[u != v], v[u != v])), G.shape).tocsr()
    if E.nnz == 0:
        return np.arange(G.shape[0])
    graph = pymetis.CSRAdjacency(E.indptr, E.indices)
    options = pymetis.Options(seed=0, pfactor=10 * _HUB)  # METIS counts in tenths
    return np.array(pymetis.nested_dissection(graph, options=options)[0])


def minimum_degree(G: sp.csr_array) -> np.ndarray:
    """Vertices (N,) in the order of SuperLU's multiple minimum degree (Liu 1985)."""
    dominant = sp.csc_array(G, dtype=float) + sp.diags_array(2.0 * np.diff(G.indptr))
    lu = splu(
        sp.csc_array(dominant), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    return np.argsort(lu.perm_c)


def elimination_tree(P: sp.csr_array) -> np.ndarray:
    """Parent (N,) of each vertex of an ordered graph, -1 for a root: its first later fill.

    Liu 1990, algorithm 4.2: ancestors are compressed on the way.
    """
    lower = sp.tril(P, -1, format="csr")
    start, column = lower.indptr.tolist(), lower.indices.tolist()
    parent, ancestor = [-1] * P.shape[0], [-1] * P.shape[0]
    for j in range(P.shape[0]):
        for i in column[start[j] : start[j + 1]]:
            while ancestor[i] not in (-1, j):
                ancestor[i], i = j, ancestor[i]
            if ancestor[i] == -1:
                ancestor[i] = parent[i] = j
    return np.array(parent)


def _collected(parent: np.ndarray, rows: np.ndarray) -> tuple[_Pivots, _Below]:
    """Pivots of first fronts, and the fronts below each, in postorder.

    Small subtrees are one front each, and so are chains in which each vertex has one child.
    """
    N, size = len(parent), rows.copy()
    for j, p in enumerate(parent.tolist()):
        if p >= 0:
            size[p] += size[j]
    small, children = size <= _LEAF, np.bincount(parent[parent >= 0], minlength=N)
    top = np.arange(N)
    for j in range(N - 1, -1, -1):
        p = parent[j]
        if p >= 0 and (small[p] if small[j] else children[p] == 1):
            top[j] = top[p]
    heads, front = np.unique(top, return_inverse=True)
    pivots = np.split(np.argsort(front, kind="stable"), np.cumsum(np.bincount(front))[:-1])
    below: _Below = [[] for _ in heads]
    for i, head in enumerate(heads):
        if parent[head] >= 0:
            below[front[parent[head]]].append(i)
    return _reordered(pivots, below, pivots)[:2]


def _reordered(
    pivots: _Pivots, below: _Below, more: list[np.ndarray]
) -> tuple[_Pivots, _Below, list[np.ndarray]]:
    """The fronts that roots reach in postorder: children directly before their parents."""
    order = list(_postorder(below))
    new = {i: k for k, i in enumerate(order)}
    renamed = [[new[c] for c in below[i]] for i in order]
    return [pivots[i] for i in order], renamed, [more[i] for i in order]


def _postorder(below: _Below) -> Iterator[int]:
    """Numbers of the fronts, those below each before it."""
    inner = {c for children in below for c in children}
    stack = [(i, False) for i in range(len(below) - 1, -1, -1) if i not in inner]
    while stack:
        i, done = stack.pop()
        if done:
            yield i
        else:
            stack += [(i, True), *((c, False) for c in reversed(below[i]))]


def _boundaries(P: sp.csr_array, pivots: _Pivots, below: _Below) -> list[np.ndarray]:
    """Later neighbours of the pivots of each front, and of the fronts below it."""
    boundary: list[np.ndarray] = []
    for ids, children in zip(pivots, below, strict=True):
        seen = [_neighbours(P, ids), *(boundary[c] for c in children)]
        rows = np.unique(np.concatenate(seen))
        boundary.append(rows[rows > ids.max()])
    return boundary


def _merged(
    pivots: _Pivots, below: _Below, boundary: list[np.ndarray], size: np.ndarray
) -> tuple[_Pivots, _Below, list[np.ndarray]]:
    """Fronts that took in those below them, where zeros are at most a share ``_ZEROS``."""
    own, below = [[ids] for ids in pivots], [list(children) for children in below]
    a = [int(size[ids].sum()) for ids in pivots]
    b = [int(size[rows].sum()) for rows in boundary]
    stored = [_entries(m, n) for m, n in zip(a, b, strict=True)]  # without zeros
    for i, children in enumerate(below):
        for c in sorted(children, key=lambda c: -b[c]):
            both = stored[c] + stored[i]
            if both >= (1 - _ZEROS) * _entries(a[c] + a[i], b[i]):
                own[i], a[i], stored[i] = own[c] + own[i], a[c] + a[i], both
                below[i].remove(c)
                below[i] += below[c]
                own[c], below[c] = [], []
    joined = [np.concatenate(parts) if parts else np.zeros(0, int) for parts in own]
    found = _reordered(joined, below, boundary)
    kept = [i for i, ids in enumerate(found[0]) if len(ids)]
    new = {i: k for k, i in enumerate(kept)}
    return (
        [found[0][i] for i in kept],
        [[new[c] for c in found[1][i]] for i in kept],
        [found[2][i] for i in kept],
    )


def _entries(a: _Count, b: _Count) -> _Count:
    """Entries of the factor in a front of a pivots and b boundary rows."""
    return a * (a + 1) // 2 + a * b


def _numbered(
    pivots: _Pivots, below: _Below, boundary: list[np.ndarray], vertex: np.ndarray
) -> Fronts:
    """Fronts of rows from fronts of vertices; in a front, vertices keep the order of the deck.

    Neighbours in the deck are neighbours on the mesh, so a boundary is a few runs of rows.
    """
    order = np.concatenate([np.sort(ids) for ids in pivots])
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    size = np.bincount(vertex)[order]  # rows of each vertex, in the new order
    begin = np.cumsum(np.r_[0, size])
    later = [np.sort(new[ids]) for ids in boundary]
    return Fronts(
        np.argsort(new[vertex], kind="stable"),
        begin[np.cumsum([0, *map(len, pivots)])],
        tuple(_ranges(begin[rows], size[rows]) for rows in later),
        tuple(map(tuple, below)),
    )


def _neighbours(G: sp.csr_array, ids: np.ndarray) -> np.ndarray:
    return G.indices[_ranges(G.indptr[ids], np.diff(G.indptr)[ids])]


def _ranges(begin: np.ndarray, length: np.ndarray) -> np.ndarray:
    """begin_k, begin_k + 1, ... of each length, in one array."""
    ends = np.cumsum(length)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(begin - ends + length, length)


def runs(rows: np.ndarray) -> list[slice]:
    """Slices of positions over which the numbers are consecutive."""
    cuts = np.flatnonzero(rows[1:] - rows[:-1] != 1) + 1
    return [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), len(rows)])]
