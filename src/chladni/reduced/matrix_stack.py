"""Symmetric matrices of many groups over one basis, and over bases that grow from it.

Every hypothesis has a basis of its own: the common one and a few further vectors. Only the border
of its matrices is its own.  The common block is held once for all hypotheses.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

EVERY = slice(None)
COLUMNS = 64  # of a block


@dataclass(frozen=True, eq=False)
class MatrixStack:
    """Matrices (g, r, r), symmetric."""

    # (g, end, k) each, columns of the upper triangle, which end with the k of the diagonal
    blocks: tuple[np.ndarray, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r)."""
        return self.blocks[-1].shape[:2]

    def bordered(self, border: np.ndarray) -> "MatrixStack":
        """Extend the stack by the columns (g, r + k, k) of further basis vectors."""
        return MatrixStack((*self.blocks, border))

    def divided(self, parent: np.ndarray, pieces: np.ndarray, of: np.ndarray) -> "MatrixStack":
        """Matrices of other groups: the p-th is that of ``parent[p]``, pieces (k,) have their own.

        The latter are ``of`` (k, r, r).
        """
        out = []
        for at, block in self._placed():
            made = block[parent]
            made[pieces] = of[:, : at.stop, at]
            out.append(made)
        return MatrixStack(tuple(out))

    def alike(self, values: np.ndarray) -> "MatrixStack":
        """The stack of other symmetric matrices (g, r, r), in the same blocks."""
        return MatrixStack(tuple(
            np.ascontiguousarray(values[:, : at.stop, at]) for at, _ in self._placed()
        ))  # fmt: skip

    def less(self, others: Iterable["MatrixStack"]) -> "MatrixStack":
        """The rest of it without others of the same blocks."""
        every = zip(self.blocks, *(other.blocks for other in others), strict=True)
        return MatrixStack(tuple(own - sum(taken) for own, *taken in every))

    def weighted(self, weights: np.ndarray) -> np.ndarray:
        """Σ_g w_g A_g (r, r) of weights (g,)."""
        out = np.empty(2 * self.shape[1:])
        for at, block in self._placed():
            g, end, k = block.shape
            out[:end, at] = (weights @ block.reshape(g, end * k)).reshape(end, k)
            out[at, : at.start] = out[: at.start, at].T
            out[at, at] = (out[at, at] + out[at, at].T) / 2
        return out

    def times(self, z: np.ndarray) -> np.ndarray:
        """A_g z of every group (g, r, n), for vectors z (r, n)."""
        out = np.zeros((*self.shape, z.shape[1]))
        for at, block in self._placed():
            g, end, k = block.shape
            out[:, :end] += (block.reshape(g * end, k) @ z[at]).reshape(g, end, -1)
            if at.start:
                out[:, at] += block[:, : at.start].swapaxes(1, 2) @ z[: at.start]
        return out

    def _placed(self) -> Iterator[tuple[slice, np.ndarray]]:
        """Every block with the positions of its columns."""
        yield from ((slice(b.shape[1] - b.shape[2], b.shape[1]), b) for b in self.blocks)


def stacked(values: np.ndarray) -> MatrixStack:
    """The stack of symmetric matrices (g, r, r), without most of the half below the diagonal."""
    r = values.shape[1]
    ends = [min(k + COLUMNS, r) for k in range(0, r, COLUMNS)]
    starts = [0, *ends[:-1]]
    return MatrixStack(tuple(
        np.ascontiguousarray(values[:, :end, start:end])
        for start, end in zip(starts, ends, strict=True)
    ))  # fmt: skip
