"""Sheets: pressings as height fields over a plane, joined from meshed patches.

A point of a sheet has planform coordinates (y, s) and a depth d below a base surface, which gives
its place in space. Patches are meshed in the plane and joined where their nodes coincide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from chladni.errors import ModelError
from chladni.geometry.cells import components
from chladni.geometry.facets import cell_areas

from .flat_regions import strip
from .quads_from_triangles import split_folded

Depth = Callable[[np.ndarray], np.ndarray]  # planform (n, 2) -> depth (n,) [m]
MAIN, BASE, FOLD = 0, 1, 2  # zones: the sheet itself, base of the hem's U, its folded flange


@dataclass(frozen=True, eq=False)
class PressedSheet:
    """One pressing."""

    name: str
    plan: np.ndarray  # (n, 3) y, s and depth of the nodes [m]
    points: np.ndarray  # (n, 3) places [m]
    quads: np.ndarray  # (m, 4) rows of points; a triangle repeats its third
    zone: np.ndarray  # (m,) MAIN, BASE or FOLD

    @property
    def area(self) -> np.ndarray:
        """Area of every cell (m,) [m²]."""
        return cell_areas(self.points, self.quads)


@dataclass(frozen=True)
class Patches:
    """Collects meshed patches of one pressing."""

    plans: list[np.ndarray] = field(default_factory=list)
    cells: list[np.ndarray] = field(default_factory=list)
    zones: list[np.ndarray] = field(default_factory=list)

    def add(
        self,
        mesh: tuple[np.ndarray, np.ndarray],
        depth: Depth | float | Sequence[float] | np.ndarray,
        zone: int = MAIN,
    ) -> None:
        """Add a patch from its plane mesh and its depth (field, constant or value per node)."""
        points, quads = mesh
        d = depth(points) if callable(depth) else np.broadcast_to(depth, len(points))
        self.cells.append(quads + sum(len(p) for p in self.plans))
        self.plans.append(np.column_stack([points, d]))
        self.zones.append(np.full(len(quads), zone))

    def sheet(
        self, name: str, surface: Callable[[np.ndarray], np.ndarray], tolerance: float = 2e-5
    ) -> PressedSheet:
        """The pressing with coincident nodes joined and collapsed quads turned to triangles.

        Raises
        ------
        ModelError
            If the pressing falls into pieces.
        """
        plan = np.vstack(self.plans)
        row = _joined(plan, tolerance)
        used, new = np.unique(row, return_inverse=True)
        quads = _collapsed(new[np.vstack(self.cells)])
        plan = plan[used]
        if (pieces := components(quads, len(plan))).max() > 0:
            where = plan[np.argmax(pieces)]
            raise ModelError(
                f"{name} falls into {pieces.max() + 1} pieces, one near y {where[0]:.3f} m, s "
                f"{where[1]:.3f} m; its patches do not touch"
            )
        points = surface(plan)
        quads, source = split_folded(points, quads)
        return PressedSheet(name, plan, points, quads, np.concatenate(self.zones)[source])


def fold(out: Patches, edge: np.ndarray, back: np.ndarray, gap: float, *, closed: bool) -> None:
    """Add the base of a hem's U below the outer sheet's edge (n, 2) and the folded flange."""
    out.add(strip([edge, edge], closed=closed), np.repeat([2 * gap, 0.0], len(edge)), BASE)
    out.add(strip([back, edge], closed=closed), 2 * gap, FOLD)


def _joined(points: np.ndarray, tolerance: float) -> np.ndarray:
    """The first coincident point for each point."""
    from scipy.spatial import cKDTree

    row = np.arange(len(points))
    for i, j in sorted(cKDTree(points).query_pairs(tolerance)):
        row[j] = min(row[j], row[i])
    while not np.array_equal(row, row[row]):
        row = row[row]
    return row


def _collapsed(quads: np.ndarray) -> np.ndarray:
    """Quads with one collapsed side written as triangles, the third node repeated."""
    out = quads.copy()
    for k in range(3):  # sides 0-1, 1-2 and 3-0; 2-3 is already in place
        a, b = (0, 1, 3)[k], (1, 2, 0)[k]
        same = out[:, a] == out[:, b]
        out[same] = np.roll(out[same], (2, 1, -1)[k], axis=1)
    return out


def mirrored(
    sheet: PressedSheet, name: str, surface: Callable[[np.ndarray], np.ndarray]
) -> PressedSheet:
    """The sheet of the other side, y -> -y, with its cells turned so that normals stay outward."""
    plan = sheet.plan * (-1, 1, 1)
    triangle = sheet.quads[:, 2] == sheet.quads[:, 3]
    turned = np.where(triangle[:, None], sheet.quads[:, [1, 0, 2, 2]], sheet.quads[:, ::-1])
    return PressedSheet(name, plan, surface(plan), turned, sheet.zone)
