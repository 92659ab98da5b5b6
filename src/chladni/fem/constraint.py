"""Linear dependencies u_m = G u as flat arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np


@dataclass(frozen=True, eq=False)
class Rows:
    """Dependent dofs and their independent ones; dofs are 6 * row of points + component - 1."""

    # dof, owner: (m,) int: dependent dof and the position of its element in ``Assembly.rigid``
    dof: np.ndarray
    owner: np.ndarray
    # row, on: (e,) int: of the entries: index of the m rows, and the dof on which it depends
    row: np.ndarray
    on: np.ndarray
    factor: np.ndarray  # (e,) [-], [m] or [1/m]

    @classmethod
    def none(cls) -> Self:
        """An empty set of dependencies."""
        nothing = np.zeros(0, dtype=np.int64)
        return cls(nothing, nothing, nothing, nothing, np.zeros(0))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Join the rows of several sets."""
        first = np.cumsum([0] + [len(p.dof) for p in parts])
        return cls(
            np.concatenate([p.dof for p in parts]),
            np.concatenate([p.owner for p in parts]),
            np.concatenate([p.row + k for p, k in zip(parts, first[:-1], strict=True)]),
            np.concatenate([p.on for p in parts]),
            np.concatenate([p.factor for p in parts]),
        )
