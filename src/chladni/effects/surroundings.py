"""What an effect may know before anything is fitted: the shells, their grids, the test."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..fem.locate import Share
from ..geometry.facets import point_normals
from .shell_groups import ShellGroups


@dataclass(frozen=True, eq=False)
class Setup:
    """What effects may know of the test.

    Attributes
    ----------
    sensors : of each output the (grid id, weight) it hangs on
    hangers : grid ids
    weight : mass of the structure [kg]
    f_max : highest frequency of interest [Hz]
    """

    sensors: tuple[Share, ...]
    hangers: tuple[int, ...]
    weight: float
    f_max: float

    @property
    def stiffness(self) -> float:
        """Spring on which a tenth of the mass swings at a third of the top frequency [N/m]."""
        return 0.1 * self.weight * (2 * np.pi * self.f_max / 3) ** 2


@dataclass(frozen=True, eq=False)
class ShellGrids:
    """Grids of shells where something unknown may sit.

    Attributes
    ----------
    grids : (k,) int      ids
    normal : (k, 3)       of the surface, unit length
    point : (k, 3) [m]
    rows : (k, n)         translation along the normal
    """

    grids: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    rows: sp.csr_array

    def __len__(self) -> int:
        return len(self.grids)

    def position(self, grid: int) -> int:
        """Position of a grid among them."""
        return int(np.flatnonzero(self.grids == grid)[0])

    def only(self, chosen: np.ndarray) -> Self:
        """Some of them."""
        return type(self)(
            self.grids[chosen], self.normal[chosen], self.point[chosen], self.rows[chosen]
        )


def shell_grids(groups: ShellGroups) -> ShellGrids:
    """All grids of shells that can move along the normal there."""
    assembly = groups.structure.assembly
    normal = point_normals(assembly.points, assembly.shells.nodes)
    at = np.flatnonzero(normal.any(axis=1))
    normal = normal[at]
    rows = groups.structure.along(assembly.ids[at], normal)
    moving = np.flatnonzero(np.diff(rows.indptr) > 0)
    return ShellGrids(
        assembly.ids[at[moving]], normal[moving], assembly.points[at[moving]], rows[moving]
    )


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The structure and its test as every effect may know them.

    Attributes
    ----------
    groups : the shells in groups
    grids : ShellGrids        all of them
    places : ShellGrids       a sample of them, tried where a place is unknown
    setup : Setup             of the test
    """

    groups: ShellGroups
    grids: ShellGrids
    places: ShellGrids
    setup: Setup

    def translations(self, grids: Sequence[int]) -> sp.csr_array:
        """Rows of all three translations of each grid (3k, n)."""
        ids = np.repeat(np.asarray(grids), 3)
        return self.groups.structure.along(ids, np.tile(np.eye(3), (len(grids), 1)))

    def at_shares(self, shares: Sequence[Share]) -> sp.csr_array:
        """Rows of all three translations of places that hang on grids by weights (3k, n)."""
        weighted = [
            sp.csr_array(sum(w * self.translations([grid]) for grid, w in share))
            for share in shares
        ]
        return sp.csr_array(sp.vstack(weighted))
