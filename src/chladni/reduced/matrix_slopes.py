"""Slopes of a reduced matrix by all parameters, as products with vectors: none is assembled.

A response needs ∂K u for the few motions u that its lines span, which costs a tenth of all ∂K.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sl

from .matrix_stack import MatrixStack

RANK = 1e-8  # of the largest column: smaller remainders of unit columns are left out

Product = Callable[[np.ndarray], np.ndarray]
# adds ∂A z (n_p, m, n) of z (m, n) to an array, from some parameter on
Part = Callable[[np.ndarray, np.ndarray, int], None]


@dataclass(eq=False)
class MatrixSlopes:
    """∂A/∂x (n_p, m, m), symmetric, as a sum of parts that multiply vectors."""

    count: int  # n_p
    parts: list[tuple[int, Part]] = field(default_factory=list)  # and the last parameter of each

    def times(self, z: np.ndarray, first: int = 0) -> np.ndarray:
        """∂A/∂x z (n_p, m, n) of vectors z (m, n), by the parameters from ``first`` on."""
        out = np.zeros((self.count, *z.shape))
        for last, part in self.parts:
            if last >= first:
                part(z, out, first)
        return out[first:]

    def of_last(self, k: int) -> "MatrixSlopes":
        """The slopes by the last k parameters alone."""
        at = self.count - k

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            out[first:] += self.times(z, at + first)

        return MatrixSlopes(k, [(k - 1, part)])

    def along(self, z: np.ndarray) -> np.ndarray:
        """zᵀ ∂A/∂x z of every column of z (m, n): (n_p, n)."""
        return np.einsum("rk,prk->pk", z, self.times(z))

    def between(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Leftᵀ ∂A/∂x right (n_p, a, b)."""
        return np.asarray(left.T @ self.times(right))

    def add_groups(self, stack: MatrixStack, change: np.ndarray) -> None:
        """Add Σ_g c_gp A_g, over the first dofs, with c (g, n_p)."""
        moved = np.flatnonzero(change.any(axis=0))
        weights = change[:, moved].T

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            g, r = stack.shape
            each = stack.times(z[:r])
            out[moved, :r] += (weights @ each.reshape(g, -1)).reshape(len(moved), r, -1)

        if len(moved):
            self.parts.append((int(moved[-1]), part))

    def add_operator(self, A: np.ndarray, gradient: np.ndarray) -> None:
        """Add ∂c/∂x A with ∂c/∂x (n_p,)."""
        moved = np.flatnonzero(gradient)

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            Az = A @ z
            for p in moved:
                out[p] += gradient[p] * Az

        if len(moved):
            self.parts.append((int(moved[-1]), part))

    def add_points(
        self, b: np.ndarray, gradient: np.ndarray, at: slice, moved: Mapping[int, np.ndarray],
        coefficient: np.ndarray,
    ) -> None:  # fmt: skip
        """Add the slopes of Σ c bᵀb: ∂c/∂x (k, n) at some parameters, ∂b/∂x of ``moved`` ones."""

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            bz, c = b @ z, coefficient[:, None]
            out[at] += b.T @ (gradient.T[:, :, None] * bz)
            for p, db in moved.items():
                out[at.start + p] += b.T @ (c * (db @ z)) + db.T @ (c * bz)

        self.parts.append((at.stop - 1, part))

    def add_half(self, p: int, left: np.ndarray, at: np.ndarray, right: np.ndarray) -> None:
        """Add B + Bᵀ to one slope: B is L R, L (m, k) and R (k, n), in the columns ``at`` (n,)."""

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            out[p] += left @ (right @ z[at])
            out[p][at] += right.T @ (left.T @ z)

        self.parts.append((p, part))

    def add_scaled(self, other: "MatrixSlopes", factor: float) -> None:
        """Add other slopes of the same parameters times a factor."""

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            out[first:] += factor * other.times(z, first)

        self.parts.append((self.count - 1, part))

    def transformed(self, G: Product, G_transposed: Product) -> "MatrixSlopes":
        """Gᵀ ∂A G, by functions of vectors (..., m, n)."""

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            out[first:] += G_transposed(self.times(G(z), first))

        return MatrixSlopes(self.count, [(self.count - 1, part)])


def spanned(Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q (m, k) and C (k, n) with Y = Q C up to ``RANK``: an orthonormal basis of complex columns.

    Columns of neighbouring lines are nearly equal, so k is a tenth of their number.
    """
    size = np.linalg.norm(Y, axis=0)
    Y = Y / np.where(size > 0, size, 1.0)
    Q, R, _ = sl.qr(np.concatenate([Y.real, Y.imag], axis=1), mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(R)) > RANK * np.abs(R[0, 0])).sum())
    Q = np.ascontiguousarray(Q[:, :rank])
    return Q, (Q.T @ Y) * size
