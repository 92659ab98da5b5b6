"""Thickness of sheets from a scan of both their faces.

Let x be a place of the shells, n its normal and t₀ the gauge. The upper face is the nearest point
to x + t₀ n, the lower face that to x - t₀ n. The thickness is the distance of these two points
along n. The position of the shells between the faces does not matter, as long as they are
less than t₀ off the middle.
"""

from dataclasses import replace

import numpy as np

from ..errors import ModelError
from ..model.assembly import Assembly
from .nearest import ShellSurface
from .thickness_mapping import (
    FACING,
    Mapped,
    PartMapping,
    area_mean,
    completed,
    samples,
    shell_area,
    shell_mass,
)

THINNEST, THICKEST = 0.3, 1.7  # of the gauge: limits of an accepted thickness
LEAST_COVERED = 0.05  # of the area: a scan of one face has less with two faces


def thickness_of_scan(assembly: Assembly, points: np.ndarray, cells: np.ndarray) -> Mapped:
    """Map the thickness of a scan (n, 3), (m, 4) to the corners of the shells [m].

    ``distance_95`` of a part is the distance of its shells from the middle of the sheet. Shells
    without two faces keep their thickness.
    """
    shells = assembly.shells
    at, normal = samples(assembly.points, shells.nodes)
    gauge = np.repeat(assembly.thickness(), 4)
    surface = ShellSurface.over("the scan", points, cells)
    found, off = _between(surface, at.reshape(-1, 3), np.repeat(normal, 4, axis=0), gauge)
    corner = completed(found.reshape(-1, 4))
    seen = np.isfinite(corner).all(axis=1)
    area = shell_area(assembly)
    if area[seen].sum() < LEAST_COVERED * area.sum():
        raise ModelError(
            f"{100 * area[seen].sum() / area.sum():.1f} % of the shells lie between two faces of "
            "the scan; scan both faces, align the scan with the deck and use its unit of length"
        )
    t = np.where(seen[:, None], corner, shells.thickness)
    after = replace(assembly, shells=replace(shells, thickness=t))
    present = np.unique(shells.part[seen]).tolist()
    parts = (_report(assembly, after, p, seen, off.reshape(-1, 4)) for p in present)
    return Mapped(after, tuple(parts))


def _between(
    surface: ShellSurface, at: np.ndarray, normal: np.ndarray, gauge: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Thickness at each place, NaN without two faces, and the distance from the middle."""
    height = []
    for side in (1.0, -1.0):
        start = at + side * gauge[:, None] * normal
        foot = surface.closest_points(start, normal, FACING)
        away = np.einsum("nk,nk->n", foot.place - at, normal)
        height.append(np.where(foot.distance <= gauge, away, np.nan))
    t, off = height[0] - height[1], np.abs(height[0] + height[1]) / 2
    ok = (THINNEST * gauge < t) & (t < THICKEST * gauge)
    return np.where(ok, t, np.nan), np.where(ok, off, np.nan)


def _report(
    before: Assembly, after: Assembly, part: int, seen: np.ndarray, off: np.ndarray
) -> PartMapping:
    rows = np.flatnonzero(before.shells.part == part)
    area = shell_area(before)[rows]
    close = off[rows][np.isfinite(off[rows])]
    return PartMapping(
        before.parts[part].name,
        "both faces",
        float(area[seen[rows]].sum() / area.sum()),
        float(np.percentile(close, 95)),
        area_mean(after, rows),
        float(shell_mass(before)[rows].sum()),
        float(shell_mass(after)[rows].sum()),
        float("nan"),
    )
