"""Symmetric matrices of many groups over one basis, and over bases that grow from it.

Every hypothesis has a basis of its own: the common one and a few further vectors. Only the border
of its matrices is its own.  The common block is held once for all hypotheses.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

EVERY = slice(None)


class MatrixStack(Protocol):
    """Matrices (g, r, r), symmetric."""

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r)."""

    def add_to(
        self, targets: Sequence[np.ndarray], weights: np.ndarray, among: slice = EVERY
    ) -> None:
        """Add Σ_g w_g A_g over the groups ``among`` to each target (r, r), weights (p, n)."""


def weighted(stack: MatrixStack, weights: np.ndarray) -> np.ndarray:
    """Σ_g w_g A_g of each row of weights (p, g) -> (p, r, r)."""
    out = np.zeros((len(weights), stack.shape[1], stack.shape[1]))
    stack.add_to(tuple(out), weights)
    return out


def add_slopes(stack: MatrixStack, change: np.ndarray, slopes: np.ndarray) -> None:
    """Add Σ_g c_gp A_g to the slope of every parameter p (n_p, r, r), over the groups it moves."""
    for among, parameters in felt_alike(change):
        stack.add_to([slopes[p] for p in parameters], change[among, parameters].T, among)


def felt_alike(change: np.ndarray) -> Iterator[tuple[slice, list[int]]]:
    """Slices of consecutive groups with the parameters that move them, from change (g, n_p)."""
    felt = change != 0
    ends = np.stack([felt.argmax(axis=0), len(felt) - felt[::-1].argmax(axis=0)], axis=1)
    for first, stop in np.unique(ends[felt.any(axis=0)], axis=0):
        alike = felt.any(axis=0) & (ends == (first, stop)).all(axis=1)
        yield slice(first, stop), list(np.flatnonzero(alike))


@dataclass(frozen=True, eq=False)
class Whole:
    """All of the matrices, without the half below the diagonal.

    Attributes
    ----------
    upper : (g, r (r + 1) / 2)     rows of the upper triangle, one after the other
    at : (r, r) int                position in it of each entry
    """

    upper: np.ndarray
    at: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r)."""
        return len(self.upper), len(self.at)

    def add_to(
        self, targets: Sequence[np.ndarray], weights: np.ndarray, among: slice = EVERY
    ) -> None:
        """Add Σ_g w_g A_g over the groups ``among`` to each target (r, r)."""
        for target, upper in zip(targets, weights @ self.upper[among], strict=True):
            target += upper[self.at]


def whole(values: np.ndarray) -> Whole:
    """The stack of symmetric matrices (g, r, r)."""
    r = values.shape[1]
    rows, columns = np.triu_indices(r)
    at = np.empty((r, r), np.intp)
    at[rows, columns] = at[columns, rows] = np.arange(len(rows))
    return Whole(np.ascontiguousarray(values[:, rows, columns]), at)


def _summed(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Σ_g w_pg A_g of weights (p, g) and matrices (g, m, n): (p, m, n)."""
    g, m, n = values.shape
    return np.asarray(weights @ values.reshape(g, m * n)).reshape(-1, m, n)


def bordered(inner: MatrixStack, border: np.ndarray) -> "Bordered":
    """Extend a stack by the columns (g, r + k, k) of further basis vectors."""
    r = inner.shape[1]
    corner = border[:, r:]
    return Bordered(inner, border[:, :r], (corner + corner.transpose(0, 2, 1)) / 2)


@dataclass(frozen=True, eq=False)
class Bordered:
    """[[A, S], [Sᵀ, C]] for every group.

    Attributes
    ----------
    inner : A, shared
    side : S (g, r, k)
    corner : C (g, k, k)
    """

    inner: MatrixStack
    side: np.ndarray
    corner: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r + k)."""
        g, r, k = self.side.shape
        return g, r + k

    def add_to(
        self, targets: Sequence[np.ndarray], weights: np.ndarray, among: slice = EVERY
    ) -> None:
        """Add Σ_g w_g A_g over the groups ``among`` to each target (r + k, r + k)."""
        r = self.side.shape[1]
        self.inner.add_to([target[:r, :r] for target in targets], weights, among)
        sides, corners = _summed(weights, self.side[among]), _summed(weights, self.corner[among])
        for target, side, corner in zip(targets, sides, corners, strict=True):
            target[:r, r:] += side
            target[r:, :r] += side.T
            target[r:, r:] += corner


def along(A: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """φ_kᵀ A_p φ_k of matrices (n_p, r, r) and each column of φ (r, k): (n_p, k)."""
    return np.einsum("rk,prk->pk", phi, A @ phi)


def each_times(A: np.ndarray, z: np.ndarray) -> np.ndarray:
    """A_p z of real matrices (n_p, r, r), many of them zero, and a complex z (r, n_f)."""
    out = np.zeros((*A.shape[:2], z.shape[1]), complex)
    both = np.ascontiguousarray(z).view(float)  # real and imaginary parts side by side
    for p in np.flatnonzero(A.any(axis=(1, 2))):
        out[p] = (A[p] @ both).view(complex)
    return out
