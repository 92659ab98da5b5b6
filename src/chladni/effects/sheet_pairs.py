"""Springs between two sheets: the relative motion of the sheets at places, and the cards.

The motion is that between two averages at one point. Each average is the best rigid motion of the
nearby grids of one sheet. Between two different points a rigid rotation would load the spring.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure
from ..fem.average import average_rows
from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, Average, appended


@dataclass(frozen=True, eq=False)
class SheetPairs:
    """Places at which two sheets face each other.

    Attributes
    ----------
    middle, along : (k, 3)   places [m], unit vectors of the relative motion
    sides : rows of the attached grids in either sheet for each place, three at least
    """

    middle: np.ndarray
    along: np.ndarray
    sides: tuple[tuple[np.ndarray, np.ndarray], ...]

    def __len__(self) -> int:
        return len(self.sides)

    def relative_rows(self, built: Structure) -> sp.csr_array:
        """Rows (k, n): motion of the second sheet relative to the first along the direction."""
        bare, ends = self.tied(replace(built.assembly, axes=None, rigid=()))
        means = average_rows(bare, np.arange(len(bare.rigid)))
        where = (means.dof[means.row], means.on)
        n = 6 * len(bare.points)
        G = sp.csr_array((means.factor, where), shape=(n, n))[:, : built.T.shape[0]]
        first, second = (self._pick(end, n) for end in ends.T)
        return sp.csr_array((second - first) @ G @ built.T)

    def _pick(self, rows: np.ndarray, n: int) -> sp.csr_array:
        k = len(rows)
        columns = (6 * rows[:, None] + np.arange(3)).ravel()
        where = (np.repeat(np.arange(k), 3), columns)
        return sp.csr_array((self.along.ravel(), where), shape=(k, n))

    def tied(self, assembly: Assembly, on: np.ndarray | None = None) -> tuple[Assembly, np.ndarray]:
        """Add both ends of springs at some places (default all); return also their rows (k, 2)."""
        at = np.arange(len(self)) if on is None else on
        grown, rows = with_points(assembly, np.repeat(self.middle[at], 2, axis=0))
        first, T = next_id(assembly), (1, 2, 3)
        carriers = [grids for k in at for grids in self.sides[k]]
        means = tuple(
            Average(first + j, int(row), T, tuple((int(g), T, 1.0) for g in grids))
            for j, (row, grids) in enumerate(zip(rows, carriers, strict=True))
        )
        turns = np.array([(r, c) for r in rows for c in (4, 5, 6)], dtype=np.int64).reshape(-1, 2)
        supports = np.concatenate([grown.supports, turns])
        grown = replace(grown, rigid=(*grown.rigid, *means), supports=supports)
        return grown, rows.reshape(-1, 2)

    def gripped(self, assembly: Assembly, k: np.ndarray) -> Assembly:
        """Add springs k (k,) [N/m] along the directions, where k is positive."""
        on = np.flatnonzero(k > 0)
        grown, ends = self.tied(assembly, on)
        e = self.along[on]
        z = np.cross(e, np.eye(3)[np.abs(e).argmin(axis=1)])
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        stiffness = np.zeros((len(on), 6))
        stiffness[:, 0] = k[on]
        new = appended(
            grown.bushes, ids=next_id(grown) + np.arange(len(on)), nodes=ends,
            frame=np.stack([e, np.cross(z, e), z], axis=1), place=self.middle[on],
            stiffness=stiffness,
        )  # fmt: skip
        return replace(grown, bushes=new)
