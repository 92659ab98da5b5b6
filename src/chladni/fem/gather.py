"""Element matrices into sparse ones: six by six blocks between points, then Tᵀ A T."""

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp

Rows = np.ndarray | slice


def pattern(nodes: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Block pattern of elements over n points.

    Parameters
    ----------
    nodes : (m, k) int

    Returns
    -------
    indptr (n + 1,), indices (b,), slot (m, k, k)
        Compressed rows of the b blocks, and the block each pair of an element's nodes adds to.
    """
    key = nodes[:, :, None].astype(np.int64) * n + nodes[:, None, :]
    pairs, slot = np.unique(key, return_inverse=True)
    row, indices = np.divmod(pairs, n)
    indptr = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    return indptr, indices.astype(np.int32), slot.reshape(key.shape)


def accumulate(
    nodes: np.ndarray, n: int, parts: Iterable[tuple[Rows, tuple[np.ndarray, ...]]], count: int
) -> list[sp.csr_array]:
    """Sum of element matrices that arrive in pieces, ``count`` matrices at a time.

    Parameters
    ----------
    nodes : (m, k) int
    n : int                 points
    parts : pairs of (rows of elements, (A (r, 6k, 6k), B (r, 6k, 6k), ...))

    Returns
    -------
    list of csr (6n, 6n)
    """
    indptr, indices, slot = pattern(nodes, n)
    sums = [np.zeros((len(indices), 36)) for _ in range(count)]
    for rows, matrices in parts:
        blocks_here, where = np.unique(slot[rows], return_inverse=True)
        where = where.ravel()
        pick = sp.csr_array(
            (np.ones(len(where)), (where, np.arange(len(where)))),
            shape=(len(blocks_here), len(where)),
        )
        for total, A in zip(sums, matrices, strict=True):
            total[blocks_here] += pick @ _blocks_of(A)
    return [_csr(total, indptr, indices, n) for total in sums]


def blocks(matrices: np.ndarray, nodes: np.ndarray, n: int) -> sp.csr_array:
    """Sum of element matrices (m, 6k, 6k) over n points: csr (6n, 6n)."""
    nodes = np.asarray(nodes, dtype=np.int64)
    if not len(nodes):
        return sp.csr_array((6 * n, 6 * n))
    return accumulate(nodes, n, [(slice(None), (np.asarray(matrices),))], 1)[0]


def with_rotations(matrices: np.ndarray) -> np.ndarray:
    """(m, 3k, 3k) of translations alone as (m, 6k, 6k) with empty rotations."""
    m, k = len(matrices), matrices.shape[1] // 3
    wide = np.zeros((m, k, 6, k, 6))
    wide[:, :, :3, :, :3] = matrices.reshape(m, k, 3, k, 3)
    return wide.reshape(m, 6 * k, 6 * k)


def congruence(T: sp.csr_array, A: sp.csr_array) -> sp.csr_array:
    """Tᵀ A T for symmetric A; rows of T that only pick a dof cost no product."""
    if not A.nnz:
        return sp.csr_array((T.shape[1], T.shape[1]), dtype=A.dtype)
    rows, columns, rest = _split(T)
    picked = A[rows][:, rows] if len(rows) < A.shape[0] else A
    picked = _embed(picked, columns, T.shape[1])
    if not len(rest):
        return picked
    T_d = T[rest]
    side = _lift(A[rows][:, rest] @ T_d, columns, T.shape[1])
    return sp.csr_array(picked + side + side.T + T_d.T @ (A[rest][:, rest] @ T_d))


def _split(T: sp.csr_array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows that alone pick a column (sorted by it), their columns, and all other rows."""
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
    """A's rows and columns at increasing ``columns`` of a wider square matrix."""
    if len(columns) == n:
        return sp.csr_array(A)
    lifted = _lift(A, columns, n)
    return sp.csr_array((lifted.data, columns[lifted.indices], lifted.indptr), shape=(n, n))


def _lift(A: sp.csr_array, rows: np.ndarray, n: int) -> sp.csr_array:
    """A's rows at increasing ``rows`` of n."""
    count = np.zeros(n, dtype=A.indptr.dtype)
    count[rows] = np.diff(A.indptr)
    indptr = np.concatenate([[0], np.cumsum(count)]).astype(A.indptr.dtype)
    return sp.csr_array((A.data, A.indices, indptr), shape=(n, A.shape[1]))


def _blocks_of(A: np.ndarray) -> np.ndarray:
    """(m, 6k, 6k) as its 6 x 6 blocks (m k k, 36)."""
    m, k = len(A), A.shape[1] // 6
    return np.ascontiguousarray(A.reshape(m, k, 6, k, 6).swapaxes(2, 3)).reshape(-1, 36)


def _csr(data: np.ndarray, indptr: np.ndarray, indices: np.ndarray, n: int) -> sp.csr_array:
    """Blocks as csr without the zeros."""
    wide = sp.bsr_array((data.reshape(-1, 6, 6), indices, indptr), shape=(6 * n, 6 * n))
    A = sp.csr_array(wide.tocsr())
    A.eliminate_zeros()
    return A
