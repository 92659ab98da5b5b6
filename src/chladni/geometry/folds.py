"""Folds of a mesh: edges, beads, flanges and coarsely meshed curves."""

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from .facets import cell_normals, point_normals
from .smooth_sides import fans

SMOOTH = np.cos(np.radians(35.0))  # a point is at a fold if a facet is farther from their mean
FOLDED = np.cos(np.radians(20.0))  # a fold is where normals of shells at one grid differ by more


def share_at_folds(points: np.ndarray, cells: np.ndarray, folded: float = FOLDED) -> np.ndarray:
    """Share of the corners of each shell at a fold, with a shell of another direction (m,).

    The share is from 0 to 1. The orientation of a shell makes no difference. Shells of one smooth
    surface, however coarse, have no fold between them (:mod:`.smooth_sides`).

    Parameters
    ----------
    points : (n, 3)      [m]
    cells : (m, 4) int   rows of points; a triangle repeats its third
    folded : cosine between two normals below which there is a fold
    """
    normal, m = cell_normals(points, cells), len(cells)
    ones = np.ones(cells.size)
    holds = sp.csr_array((ones, (cells.ravel(), np.repeat(np.arange(m), 4))), (len(points), m))
    meet = sp.triu(holds.T @ holds, 1).tocoo()
    cosine = np.abs(np.einsum("ij,ij->i", normal[meet.row], normal[meet.col]))
    at = cosine < folded
    (a, b), fan = (meet.row[at], meet.col[at]), fans(points, cells)
    both = cells[a][:, :, None] == cells[b][:, None, :]
    both &= fan[a][:, :, None] != fan[b][:, None, :]
    fold = np.zeros(len(points), bool)
    fold[cells[a][both.any(axis=2)]] = True
    return np.asarray(fold[cells].mean(axis=1))


def smooth_points(assembly: Assembly) -> np.ndarray:
    """Mask of the points away from folds, where all facets are of one part (n,)."""
    nodes = assembly.shells.nodes
    face, mean = (of(assembly.points, nodes) for of in (cell_normals, point_normals))
    least, low, high = (np.full(len(mean), v) for v in (1.0, 1e9, -1e9))
    for k in range(4):
        np.minimum.at(least, nodes[:, k], np.einsum("ij,ij->i", face, mean[nodes[:, k]]))
        np.minimum.at(low, nodes[:, k], assembly.shells.part)
        np.maximum.at(high, nodes[:, k], assembly.shells.part)
    return (least > SMOOTH) & (low == high)
