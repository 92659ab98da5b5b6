"""How far the sheets of a model are from a scan of the part."""

from dataclasses import dataclass

import numpy as np

from ..errors import FileError
from ..geometry.facets import cell_areas
from ..geometry.nearest import ShellSurface
from ..geometry.scan_alignment import align_scan, as_sheet
from ..geometry.thickness_alignment import Alignment, moved
from ..io.scanned_surface import ScannedSurface
from ..model.assembly import Assembly

REACH = 0.01  # of the size of the structure: shells farther from the scan were not scanned


@dataclass(frozen=True)
class PartDistance:
    """One part against the scan: share of its area that was scanned; of that, in metres.

    ``median`` and ``most`` are the distances that 50 % and 95 % of the area do not exceed.
    """

    part: str
    covered: float
    median: float
    most: float
    worst: float
    worst_point: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class ScanComparison:
    """Distance of every shell's face to the scan."""

    # (m,) | distance of the shell's middle to the scan - t/2 | [m], nan: not scanned
    off: np.ndarray
    parts: tuple[PartDistance, ...]  # those scanned, the best covered first
    alignment: Alignment | None  # what brought the scan onto the model, or None


def compare_with_scan(
    assembly: Assembly, scan: ScannedSurface, aligned: bool = False
) -> ScanComparison:
    """Distances of the sheets' faces from a scan, which may be brought onto the model first.

    A scanner sees the outside of a sheet: half the thickness from the middle the shells stand for.
    """
    if not len(assembly.shells):
        raise FileError("the model has no shells to compare with a scan")
    formed = as_sheet(scan.points, scan.cells)
    fit = align_scan(assembly, formed) if aligned else None
    points = scan.points if fit is None else moved(formed, fit).points
    middle = assembly.points[assembly.shells.nodes].mean(axis=1)
    away = ShellSurface.over("the scan", points, scan.cells).closest_points(middle).distance
    off = np.abs(away - assembly.thickness() / 2)
    size = float(np.linalg.norm(np.ptp(middle, axis=0)))
    if off.min() > REACH * size:
        raise FileError(
            f"the scan is {off.min():.3g} m or more from the sheets, which are {size:.3g} m "
            "across; check that it is in the deck's unit of length, or use --align to move it "
            "onto the model"
        )
    off = np.where(off <= REACH * size, off, np.nan)
    return ScanComparison(off, _by_part(assembly, middle, off), fit)


def _by_part(assembly: Assembly, middle: np.ndarray, off: np.ndarray) -> tuple[PartDistance, ...]:
    area, out = cell_areas(assembly.points, assembly.shells.nodes), []
    for part in np.unique(assembly.shells.part[np.isfinite(off)]):
        own = assembly.shells.part == part
        rows = np.flatnonzero(own & np.isfinite(off))
        rows = rows[np.argsort(off[rows])]
        share = np.cumsum(area[rows]) / area[rows].sum()
        half, most = (float(off[rows[np.searchsorted(share, q)]]) for q in (0.5, 0.95))
        x, y, z = middle[rows[-1]].tolist()
        covered, name = float(area[rows].sum() / area[own].sum()), assembly.parts[part].name
        out.append(PartDistance(name, covered, half, most, float(off[rows[-1]]), (x, y, z)))
    return tuple(sorted(out, key=lambda p: (-round(p.covered, 3), p.most)))
