"""Assembly of element matrices into sparse ones: 6 x 6 blocks between points, then Tᵀ A T."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

Rows = np.ndarray | slice


EVERY = np.ones((6, 6), dtype=bool)
TRANSLATIONS = np.kron(np.diag([True, False]), np.ones((3, 3), dtype=bool))  # of solids
INERTIA = np.kron(np.eye(2, dtype=bool), np.ones((3, 3), dtype=bool)) & (
    np.eye(6, dtype=bool) | (np.arange(6) > 2)
)  # a mass without offset: translations uncoupled, rotations full


@dataclass(frozen=True, eq=False)
class DofPairs:
    """The b pairs of points that share an element, row by row, and their positions for elements."""

    nodes: np.ndarray  # (m, k) int
    column: np.ndarray  # (b,) int: second point of each pair
    width: np.ndarray  # (n,) int: pairs of each point
    slot: np.ndarray  # (m, k, k) int: position of an element's pair among its first point's
    before: np.ndarray  # (n,) int: pairs before each point's


def pairs(nodes: np.ndarray, n: int) -> DofPairs:
    """Pairs of points among n that share an element; nodes (m, k) int."""
    nodes = np.asarray(nodes, dtype=np.int64)
    key = nodes[:, :, None] * n + nodes[:, None, :]
    found, slot = np.unique(key, return_inverse=True)
    row, column = np.divmod(found, n)
    width = np.bincount(row, minlength=n)
    before = np.cumsum(width) - width
    slot = slot.reshape(key.shape) - before[nodes][:, :, None]
    return DofPairs(nodes, column, width, slot, before)


@dataclass(frozen=True, eq=False)
class Pattern:
    """A csr of six rows a point whose 6 x 6 blocks are filled according to ``mask``.

    Entry (r, c) of a block has the position ``start + width * above[r] + slot * along[r] +
    rank(r, c)``.
    """

    pairs: DofPairs
    mask: np.ndarray  # (6, 6) bool
    # along, above: (6,) int: entries of a block's row, and before it
    along: np.ndarray
    above: np.ndarray
    start: np.ndarray  # (n,) int: entries before a point's

    def structure(self) -> tuple[np.ndarray, np.ndarray]:
        """Column indices and row pointers of the csr."""
        p, n = self.pairs, len(self.start)
        if self.mask.all():
            spots = np.empty((len(p.column), 6, 6), dtype=np.int8)
            first = np.append(p.before, len(spots)).astype(np.int32)
            where = (spots, p.column.astype(np.int32), first)
            wide = sp.bsr_array(where, shape=(6 * n, 6 * n)).tocsr()
            return wide.indices, wide.indptr
        count = (p.width[:, None] * self.along).ravel()
        indices = np.empty(count.sum(), dtype=np.int32)
        columns = 6 * p.column[:, None] + np.arange(6)
        for r in range(6):
            first = self.start + p.width * self.above[r] - p.before * self.along[r]
            at = np.repeat(first, p.width) + np.arange(len(p.column)) * self.along[r]
            indices[at[:, None] + np.arange(self.along[r])] = columns[:, self.mask[r]]
        return indices, np.concatenate([[0], np.cumsum(count)]).astype(np.int32)

    def add(self, data: np.ndarray, matrices: np.ndarray, rows: Rows = slice(None)) -> None:
        """Add element matrices of these rows of elements to the csr's values.

        They are (r, 6k, 6k), or (r, 3k, 3k) of translations where the mask has no others.
        """
        nodes, slot = self.pairs.nodes[rows], self.pairs.slot[rows]
        m, k = nodes.shape
        r, c = np.nonzero(self.mask)
        rank = np.cumsum(self.mask, axis=1)[r, c] - 1
        first = self.start[nodes][..., None] + self.pairs.width[nodes][..., None] * self.above[r]
        at = slot[..., None] * self.along[r]
        at += (first + rank)[:, :, None]
        motions = matrices.shape[1] // k
        A = matrices.reshape(m, k, motions, k, motions).swapaxes(2, 3)
        values = np.ascontiguousarray(A) if self.mask.all() else A[..., r, c]
        np.add.at(data, at.ravel(), values.ravel())


def pattern(shared: DofPairs, mask: np.ndarray) -> Pattern:
    """Pattern of these pairs with blocks filled according to the mask (6, 6)."""
    along = mask.sum(axis=1)
    start = shared.before * int(along.sum())
    return Pattern(shared, mask, along, np.cumsum(along) - along, start)


def accumulate(
    nodes: np.ndarray,
    n: int,
    parts: Iterable[tuple[Rows, tuple[np.ndarray, ...]]],
    masks: Sequence[np.ndarray] = (EVERY,),
) -> list[sp.csr_array]:
    """Sums of several kinds of element matrices that arrive in pieces.

    Parameters
    ----------
    nodes : (m, k) int
    n : int                 points
    parts : pairs of (rows of elements, their matrices of each kind as :meth:`Pattern.add` has them)
    masks : (6, 6) bool of each kind, where a block between two points may be nonzero

    Returns
    -------
    list of csr (6n, 6n)
    """
    shared = pairs(nodes, n)
    patterns = [pattern(shared, mask) for mask in masks]
    sums = [np.zeros(len(shared.column) * int(mask.sum())) for mask in masks]
    for rows, matrices in parts:
        for data, places, A in zip(sums, patterns, matrices, strict=True):
            places.add(data, A, rows)
    return [_csr(data, *p.structure()) for data, p in zip(sums, patterns, strict=True)]


def _csr(data: np.ndarray, indices: np.ndarray, indptr: np.ndarray) -> sp.csr_array:
    """A csr without explicit zeros; the index arrays are not copied."""
    n = len(indptr) - 1
    out = sp.csr_array((data, indices, indptr), shape=(n, n))
    out.eliminate_zeros()
    return out


def blocks(matrices: np.ndarray, nodes: np.ndarray, n: int) -> sp.csr_array:
    """Sum of element matrices (m, 6k, 6k), or (m, 3k, 3k) of translations: csr (6n, 6n)."""
    if not len(nodes):
        return sp.csr_array((6 * n, 6 * n))
    mask = EVERY if matrices.shape[1] == 6 * nodes.shape[1] else TRANSLATIONS
    return accumulate(nodes, n, [(slice(None), (np.asarray(matrices),))], (mask,))[0]


def narrowed(A: sp.csr_array) -> sp.csr_array:
    """A with four-byte indices if these suffice; eight bytes make it a third larger."""
    if A.indices.dtype == np.int32 or max(A.nnz, *A.shape) > np.iinfo(np.int32).max:
        return A
    indices, indptr = A.indices.astype(np.int32), A.indptr.astype(np.int32)
    return sp.csr_array((A.data, indices, indptr), shape=A.shape)


def congruence(T: sp.csr_array, A: sp.csr_array) -> sp.csr_array:
    """Tᵀ A T for symmetric A; rows of T that only select a dof need no product."""
    if not A.nnz:
        return sp.csr_array((T.shape[1], T.shape[1]), dtype=A.dtype)
    rows, columns, rest = _split(T)
    in_order = np.array_equal(rows, np.arange(A.shape[0]))
    picked = A if in_order else A[rows][:, rows]
    picked = _embed(picked, columns, T.shape[1])
    if not len(rest):
        return picked
    T_d = T[rest]
    side = _lift(A[rows][:, rest] @ T_d, columns, T.shape[1])
    return sp.csr_array(picked + side + side.T + T_d.T @ (A[rest][:, rest] @ T_d))


def _split(T: sp.csr_array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows that select one column (sorted by it), their columns, and all other rows."""
    count = np.diff(T.indptr)
    single = np.flatnonzero(count == 1)
    at = T.indptr[single]
    single = single[T.data[at] == 1]
    columns, first = np.unique(T.indices[T.indptr[single]], return_index=True)
    rows = single[first]
    others = count > 0
    others[rows] = False
    return rows, columns, np.flatnonzero(others)


def _embed(A: sp.csr_array, columns: np.ndarray, n: int) -> sp.csr_array:
    """Embed A in a larger square matrix, at increasing ``columns``."""
    if len(columns) == n:
        return sp.csr_array(A)
    lifted = _lift(A, columns, n)
    return sp.csr_array((lifted.data, columns[lifted.indices], lifted.indptr), shape=(n, n))


def _lift(A: sp.csr_array, rows: np.ndarray, n: int) -> sp.csr_array:
    """Place the rows of A at increasing ``rows`` of n."""
    count = np.zeros(n, dtype=A.indptr.dtype)
    count[rows] = np.diff(A.indptr)
    indptr = np.concatenate([[0], np.cumsum(count)]).astype(A.indptr.dtype)
    return sp.csr_array((A.data, A.indices, indptr), shape=(n, A.shape[1]))
