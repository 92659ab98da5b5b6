"""What a forming simulation leaves: a mesh of its own with the thickness at its corners."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import readonly
from ..errors import ModelError, ShapeError
from .cells import check_surface, point_means
from .facets import cell_areas


@dataclass(frozen=True, eq=False)
class FormedMesh:
    """Sheets with the thickness forming left them."""

    ids: np.ndarray  # (n,) int; node ids of the file
    points: np.ndarray  # (n, 3) [m]
    # (m, 4) int; rows of points; a triangle repeats its third; (0, 4): points alone
    cells: np.ndarray
    part: np.ndarray  # (m,) int; part id of each cell
    thickness: np.ndarray  # (m, 4) at the corners [m]
    # part id -> name, where the file has them
    names: dict[int, str] = field(default_factory=dict)
    # (n,) thickness at the points [m], NaN where no cell has any
    nodal: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if self.thickness.shape != self.cells.shape or len(self.part) != len(self.cells):
            raise ShapeError(
                f"thickness is {self.thickness.shape}, cells {self.cells.shape}, "
                f"part {self.part.shape}; one row per cell is due"
            )
        check_surface(self.points, self.cells)
        if not len(self.nodal):
            object.__setattr__(
                self, "nodal", point_means(self.cells, self.thickness, len(self.points))
            )
        known = self.nodal[np.isfinite(self.nodal)]
        if len(known) and (known.min() <= 0 or known.max() > 0.05):
            raise ModelError(
                f"thickness runs from {known.min() * 1e3:g} to {known.max() * 1e3:g} mm, but "
                "sheets have 0 to 50 mm; check the unit system"
            )
        for name in ("points", "cells", "thickness", "nodal"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def area(self) -> np.ndarray:
        """Area of each cell (m,) [m²]."""
        return cell_areas(self.points, self.cells)

    def of_part(self, id_: int) -> "FormedMesh":
        """The cells of one part, on the same points."""
        mine = self.part == id_
        if not mine.any():
            known = ", ".join(f"{k} {self.names.get(k, '')}".strip() for k in np.unique(self.part))
            raise ModelError(f"the formed mesh has no part {id_}; there are {known}")
        return FormedMesh(
            self.ids,
            self.points,
            self.cells[mine],
            self.part[mine],
            self.thickness[mine],
            self.names,
        )
