"""Symmetric matrices of many groups over one basis, and over bases that grow from it.

Every hypothesis has a basis of its own: the common one and a few vectors more. Of its matrices only
the border is its own; what they have in common is held once, however many hypotheses there are.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class MatrixStack(Protocol):
    """Matrices (g, r, r), symmetric."""

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r)."""

    def weighted(self, weights: np.ndarray) -> np.ndarray:
        """Σ_g w_g A_g of each row of weights (p, g) -> (p, r, r)."""


@dataclass(frozen=True, eq=False)
class Whole:
    """All of the matrices: ``values`` (g, r, r)."""

    values: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """(g, r)."""
        return self.values.shape[0], self.values.shape[1]

    def weighted(self, weights: np.ndarray) -> np.ndarray:
        """Σ_g w_g A_g (p, r, r)."""
        g, r = self.shape
        return np.asarray(weights @ self.values.reshape(g, r * r)).reshape(-1, r, r)


def bordered(inner: MatrixStack, border: np.ndarray) -> "Bordered":
    """Of matrices (g, r + k, k) that are what further vectors of a basis add."""
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

    def weighted(self, weights: np.ndarray) -> np.ndarray:
        """Σ_g w_g A_g (p, r + k, r + k)."""
        g, r, k = self.side.shape
        out = np.empty((len(weights), r + k, r + k))
        out[:, :r, :r] = self.inner.weighted(weights)
        out[:, :r, r:] = (weights @ self.side.reshape(g, r * k)).reshape(-1, r, k)
        out[:, r:, :r] = out[:, :r, r:].transpose(0, 2, 1)
        out[:, r:, r:] = (weights @ self.corner.reshape(g, k * k)).reshape(-1, k, k)
        return out
