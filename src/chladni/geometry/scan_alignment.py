"""Alignment of a scan with the shells of the scanned parts."""

from dataclasses import replace

import numpy as np

from ..model.assembly import Assembly
from .cells import point_means
from .facets import point_normals
from .formed_mesh import FormedMesh
from .thickness_alignment import Alignment, align


def align_scan(assembly: Assembly, scan: FormedMesh, allow_mirror: bool = False) -> Alignment:
    """The best of three alignments: to the mid-surface, and to either face of the sheets."""
    shells, n = assembly.shells, len(assembly.points)
    t = np.nan_to_num(point_means(shells.nodes, shells.thickness, n))[:, None]
    face = t / 2 * point_normals(assembly.points, shells.nodes)
    sides = (replace(assembly, points=assembly.points + s * face) for s in (0.0, 1.0, -1.0))
    fits = (align(side, scan, allow_mirror=allow_mirror) for side in sides)
    return min(fits, key=lambda fit: fit.residual)


def as_sheet(points: np.ndarray, cells: np.ndarray) -> FormedMesh:
    """A scan (n, 3), (m, 4) as the mesh of a sheet of unknown thickness."""
    n, m = len(points), len(cells)
    unknown = np.full((m, 4), np.nan)
    return FormedMesh(np.arange(1, n + 1), points, cells, np.ones(m, int), unknown)
