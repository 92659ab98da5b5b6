"""Multifrontal Cholesky in numpy: dense blocks along a nested dissection, BLAS-3 throughout.

Duff and Reid 1983 (ACM TOMS 9, 302); Liu 1992 (SIAM Review 34, 82). Indefinite symmetric matrices
use the same method, with pivoting within a front (Bunch-Kaufman) but never across fronts. This is
sufficient for K - ω²M of structures, because only few fronts have negative pivots.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack, ldl, lu_factor, lu_solve

from ..errors import ModelError
from .elimination_fronts import Fronts, analyse, runs

_FEW_RUNS = 40  # number of runs up to which slices are faster than index arrays


@dataclass(frozen=True, eq=False)
class _Cholesky:
    """F = [[L11 L11ᵀ, .], [L21 L11ᵀ, .]].

    L11 is packed without the half of zeros (Gustavson et al. 2010, ACM TOMS 37, 18).
    """

    L11: np.ndarray  # (a (a + 1) / 2,)
    L21: np.ndarray
    negative: ClassVar[int] = 0  # pivots

    def forward(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forward substitution: the part at the pivots and the update of the boundary."""
        y = lapack.dtfsm(1.0, self.L11, b.T, side="R", uplo="L", trans="T")
        return y.T, (y @ self.L21.T).T

    def backward(self, y: np.ndarray, x2: np.ndarray) -> np.ndarray:
        """x_1 = L11⁻ᵀ (y - L21ᵀ x_2)."""
        return lapack.dtfsm(1.0, self.L11, y.T - x2.T @ self.L21, side="R", uplo="L").T

    def product(self, v1: np.ndarray, v2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contribution of this front to A v, at its pivots and at its boundary."""
        L = np.tril(lapack.dtfttr(len(v1), self.L11, uplo="L")[0])
        y = L.T @ v1 + self.L21.T @ v2
        return L @ y, self.L21 @ y


@dataclass(frozen=True, eq=False)
class _Ldl:
    """F11 = Pᵀ L D Lᵀ P with D = T⁻¹ S T⁻ᵀ, S = diag(±1), and Z = T L⁻¹ P F12."""

    L: np.ndarray
    T: sp.csr_array
    sign: np.ndarray
    order: np.ndarray
    Z: np.ndarray

    def forward(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forward substitution: the part at the pivots and the update of the boundary."""
        y = self.T @ _unit_lower(self.L, b[self.order])
        return y, self.Z.T @ (self.sign * y)

    def backward(self, y: np.ndarray, x2: np.ndarray) -> np.ndarray:
        """x_1 = Pᵀ L⁻ᵀ Tᵀ S (y - Z x_2)."""
        x = np.empty_like(y)
        w = self.T.T @ (self.sign * (y - self.Z @ x2))
        x[self.order] = _unit_lower(self.L, w, transposed=True)
        return x

    def product(self, v1: np.ndarray, v2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contribution of this front to A v: [G; Zᵀ S] S [Gᵀ v_1 + S Z v_2], G = Pᵀ L T⁻¹.

        T⁻¹ = Tᵀ N⁻¹, because rows of T are orthogonal; N are their squared lengths.
        """
        N = np.asarray((self.T * self.T).sum(axis=1))[:, None]
        y = self.sign * ((self.T @ (self.L.T @ v1[self.order])) / N) + self.Z @ v2
        out = np.empty_like(v1)
        out[self.order] = self.L @ (self.T.T @ (y / N))
        return out, self.Z.T @ (self.sign * y)

    @property
    def negative(self) -> int:
        """Number of negative pivots."""
        return int(np.sum(self.sign < 0))


@dataclass(frozen=True, eq=False)
class _Lu:
    """F11 = P L U of a complex front, and X = F11⁻¹ F12."""

    lu: tuple[np.ndarray, np.ndarray]
    X: np.ndarray

    def forward(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forward substitution: the part at the pivots and the update of the boundary."""
        return lu_solve(self.lu, b, check_finite=False), self.X.T @ b

    def backward(self, y: np.ndarray, x2: np.ndarray) -> np.ndarray:
        """x_1 = F11⁻¹ b_1 - X x_2."""
        return y - self.X @ x2


_Part = _Cholesky | _Ldl | _Lu
_Blocks = tuple[np.ndarray, np.ndarray, np.ndarray]  # F11, F21, F22


class NotDefinite(ModelError):
    """A pivot is not positive, although the matrix should be positive definite."""

    def __init__(self, row: int) -> None:
        super().__init__(f"the matrix is not positive definite, seen at row {row}")
        self.row = row


class Multifrontal:
    """A = L Lᵀ front by front.

    Attributes
    ----------
    fronts : Fronts   the order
    """

    def __init__(
        self,
        A: sp.sparray,
        nodes: np.ndarray | None = None,
        *,
        definite: bool = True,
        fronts: Fronts | None = None,
    ) -> None:
        A = sp.csr_array(A)
        self.definite = definite
        self.fronts = analyse(A, nodes) if fronts is None else fronts
        self._in_order = _in_order(self.fronts)
        self._parts = list(_eliminated(A, self.fronts, definite))

    @property
    def nnz(self) -> int:
        """Entries of L."""
        return self.fronts.nnz

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B for one (n,) or several (n, k) right sides."""
        fronts, B = self.fronts, np.asarray(B)
        X = B.reshape(len(B), -1)
        X = np.array(X, order="C") if self._in_order else X[fronts.order]
        for i, part in enumerate(self._parts):
            own = slice(fronts.start[i], fronts.start[i + 1])
            X[own], down = part.forward(X[own])
            X[fronts.boundary[i]] -= down
        for i in range(len(self._parts) - 1, -1, -1):
            own = slice(fronts.start[i], fronts.start[i + 1])
            X[own] = self._parts[i].backward(X[own], X[fronts.boundary[i]])
        if not self._in_order:
            X, solved = np.empty_like(X), X
            X[fronts.order] = solved
        return X.reshape(B.shape)

    def between(self, B: sp.csr_array) -> np.ndarray:
        """Bᵀ A⁻¹ B (k, k) of sparse columns (n, k): (L⁻¹ B)ᵀ L⁻¹ B, on the fronts they reach."""
        if not self.definite:
            return np.asarray(B.T @ self.solve(B.toarray()))
        fronts, B = self.fronts, B[self.fronts.order]
        X, out = B.toarray(), np.zeros(2 * B.shape[1:])
        front_of = np.repeat(np.arange(len(self._parts)), np.diff(fronts.start))
        reached = np.zeros(len(self._parts), bool)
        reached[front_of[np.diff(B.indptr) > 0]] = True
        for i, part in enumerate(self._parts):
            if reached[i]:
                y, down = part.forward(X[fronts.start[i] : fronts.start[i + 1]])
                out += y.T @ y
                if len(rows := fronts.boundary[i]):
                    X[rows] -= down
                    reached[front_of[rows[0]]] = True
        return out


def counted(
    A: sp.sparray,
    nodes: np.ndarray | None = None,
    fronts: Fronts | None = None,
) -> tuple[int, float]:
    """Negative pivots of a real symmetric A, and |A v - L D Lᵀ v| / (|A| |v|) for a random v.

    Fronts are discarded after their elimination, because a count of eigenvalues does not need them.
    """
    A = sp.csr_array(A)
    fronts = analyse(A, nodes) if fronts is None else fronts
    v = np.random.default_rng(0).standard_normal((A.shape[0], 1))
    size = np.abs(A).sum(axis=1).max() * np.abs(v).max()
    negative, rest = 0, A[fronts.order] @ v
    v = v[fronts.order]
    for i, part in enumerate(_eliminated(A, fronts, definite=False)):
        assert not isinstance(part, _Lu)
        own, rows = slice(fronts.start[i], fronts.start[i + 1]), fronts.boundary[i]
        here, there = part.product(v[own], v[rows])
        rest[own] -= here
        rest[rows] -= there
        negative += part.negative
    error = np.abs(rest).max() / size
    return negative, float(error) if np.isfinite(error) else np.inf


def _in_order(fronts: Fronts) -> bool:
    return bool(np.all(np.diff(fronts.order) == 1))


def _eliminated(A: sp.csr_array, fronts: Fronts, definite: bool) -> Iterator[_Part]:
    """Eliminate one front after another."""
    updates: dict[int, np.ndarray] = {}
    A = A if _in_order(fronts) else A[fronts.order][:, fronts.order]
    where = np.empty(A.shape[0], np.int64)
    for i, children in enumerate(fronts.children):
        begin, end, rows = fronts.start[i], fronts.start[i + 1], fronts.boundary[i]
        where[begin:end] = np.arange(end - begin)
        where[rows] = np.arange(end - begin, end - begin + len(rows))
        F = _gathered(A, begin, end, where, len(rows))
        for c in (c for c in children if c in updates):
            _extend_add(F, where[fronts.boundary[c]], updates.pop(c))
        part = _front(F, definite, fronts.order[begin:end])
        if len(rows):
            updates[i] = F[2]
        yield part


def _front(F: _Blocks, definite: bool, pivots: np.ndarray) -> _Part:
    """Eliminate the pivots of one front; F22 becomes the Schur complement in place."""
    if np.iscomplexobj(F[0]):
        return _lu(F)
    L11, info = lapack.dpotrf(F[0], lower=1, clean=1, overwrite_a=definite)
    if info == 0:
        return _cholesky(L11, F)
    if definite:
        raise NotDefinite(int(pivots[info - 1]))
    return _ldl(F)


def _gathered(A: sp.csr_array, begin: int, end: int, where: np.ndarray, b: int) -> _Blocks:
    """Blocks F11, F21 of the matrix (from its rows, by symmetry) and an empty F22."""
    a = end - begin
    F11, F21, F22 = (np.zeros(s, A.dtype, order="F") for s in ((a, a), (b, a), (b, b)))
    part = slice(A.indptr[begin], A.indptr[end])
    open_ = A.indices[part] >= begin  # the others belong to fronts already eliminated
    i = where[A.indices[part][open_]]
    j = np.repeat(np.arange(a), np.diff(A.indptr[begin : end + 1]))[open_]
    values, own = A.data[part][open_], i < a
    F11[i[own], j[own]] = values[own]
    F21[i[~own] - a, j[~own]] = values[~own]
    return F11, F21, F22


def _extend_add(F: _Blocks, to: np.ndarray, update: np.ndarray) -> None:
    """Add a child's Schur complement at rows ``to`` (increasing); lower triangles only."""
    F11, F21, F22 = F
    a = len(F11)
    k = int(np.searchsorted(to, a))
    own, rest = to[:k], to[k:] - a
    of_own, of_rest = runs(own), runs(rest)
    _add(F11, own, of_own, own, of_own, update[:k, :k], lower=True)
    _add(F21, rest, of_rest, own, of_own, update[k:, :k])
    _add(F22, rest, of_rest, rest, of_rest, update[k:, k:], lower=True)


def _add(
    F: np.ndarray, i: np.ndarray, rows: list[slice], j: np.ndarray, columns: list[slice],
    values: np.ndarray, *, lower: bool = False,
) -> None:  # fmt: skip
    """Add values at rows i and columns j, with their runs; of a symmetric block the lower half."""
    if not values.size:
        return
    few = len(rows) <= _FEW_RUNS
    for n, c in enumerate(columns):
        block, first = F[:, j[c.start] : j[c.stop - 1] + 1], n if lower else 0
        if few:
            for r in rows[first:]:
                block[i[r.start] : i[r.stop - 1] + 1] += values[r, c]
        else:
            below = slice(rows[first].start, None)
            block[i[below]] += values[below, c]


def _cholesky(L11: np.ndarray, F: _Blocks) -> _Cholesky:
    _, L21, F22 = F
    if len(L21):
        L21 = blas.dtrsm(1.0, L11, L21, side=1, lower=1, trans_a=1, overwrite_b=1)
        blas.dsyrk(-1.0, L21, beta=1.0, c=F22, lower=1, overwrite_c=1)
    return _Cholesky(lapack.dtrttf(L11, uplo="L")[0], L21)


def _ldl(F: _Blocks) -> _Ldl:
    """Bunch-Kaufman factors of a front; F22 - Zᵀ S Z by one product for each sign."""
    F11, F21, F22 = F
    lu, D, order = ldl(F11, lower=True, check_finite=False)
    L = np.asfortranarray(lu[order])
    T, sign = _whitened(D)
    Z = np.asfortranarray(T @ _unit_lower(L, F21.T[order]))
    for s in (1.0, -1.0):
        if Z.shape[1] and np.any(sign[:, 0] == s):
            part = np.asfortranarray(Z[sign[:, 0] == s])
            blas.dsyrk(-s, part, beta=1.0, c=F22, trans=1, lower=1, overwrite_c=1)
    return _Ldl(L, T, sign, order, Z)


def _lu(F: _Blocks) -> _Lu:
    F11, F21, F22 = F
    whole = np.tril(F11) + np.tril(F11, -1).T
    lu = lu_factor(whole, overwrite_a=True, check_finite=False)
    X = lu_solve(lu, F21.T, check_finite=False)
    F22 -= F21 @ X
    return _Lu(lu, X)


def _whitened(D: np.ndarray) -> tuple[sp.csr_array, np.ndarray]:
    """T, S with T D Tᵀ = S = diag(±1) for D of 1 x 1 and 2 x 2 blocks; S as a column."""
    k = np.flatnonzero(np.diagonal(D, -1))
    lam, Q = np.diagonal(D).copy(), np.ones(len(D))
    pairs = D[np.c_[k, k + 1][:, :, None], np.c_[k, k + 1][:, None, :]]
    w, V = np.linalg.eigh(pairs)
    lam[k], lam[k + 1] = w[:, 0], w[:, 1]
    Q[k], Q[k + 1] = V[:, 0, 0], V[:, 1, 1]
    scale = 1 / np.sqrt(np.abs(lam))
    rows, columns = np.r_[np.arange(len(D)), k, k + 1], np.r_[np.arange(len(D)), k + 1, k]
    values = np.r_[Q, V[:, 1, 0], V[:, 0, 1]] * scale[rows]
    T = sp.csr_array((values, (rows, columns)), shape=D.shape)
    return T, np.sign(lam)[:, None]


def _unit_lower(L: np.ndarray, B: np.ndarray, *, transposed: bool = False) -> np.ndarray:
    """L⁻¹ B or L⁻ᵀ B, L unit lower triangular."""
    return blas.dtrsm(1.0, L, B, lower=1, diag=1, trans_a=int(transposed))
