"""Areas, normals and tangents of shells: one definition for labels, effects and pictures.

The sign of a normal. A shell's normal follows the right-hand rule round its grids in the deck's
order, as Nastran's does. The normal at a grid is the area-weighted mean of the normals of the
shells around it. A shell more than 135 degrees from the first of them, in the deck's order, is
reversed first. The mean then does not vanish on a panel with some shells of reversed numbering, or
on a flange folded flat. The sign follows the larger area; if that is even, the first shell. Thus
``12:n``, an attachment at grid 12 and the arrow in a picture agree. At a place within a shell the
normal is that of its triangle.

Cells are rows of points (m, 4); a triangle repeats its third.
"""

import numpy as np

OPPOSITE = -np.sqrt(0.5)  # cosine to the first shell below which a shell is reversed
EVEN = 1e-9  # of the area: a smaller difference is rounding


def unit(v: np.ndarray) -> np.ndarray:
    """v / |v| along the last axis (..., 3); zero remains zero."""
    length: np.ndarray = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length == 0, 1.0, length)


def vector_areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Vector areas a = ½ d₁₃ x d₂₄ (m, 3) [m²], d the diagonals; exact for triangles too.

    Parameters
    ----------
    points : (n, 3)      [m]
    cells : (m, 4) int   rows of points
    """
    x = points[cells]
    return 0.5 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])


def cell_areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """A = |a| (m,) [m²]."""
    area: np.ndarray = np.linalg.norm(vector_areas(points, cells), axis=1)
    return area


def cell_normals(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Unit normals n = a / |a| (m, 3); zero for a cell without area."""
    return unit(vector_areas(points, cells))


def point_normals(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Unit normals at the points, n = Σ ±a / |Σ ±a| (n, 3), with the sign defined above.

    Zero at a point without cells.
    """
    real = np.ones(cells.shape, bool)
    real[:, 3] = cells[:, 3] != cells[:, 2]  # the repeated corner of a triangle counts once
    a, point, cell = vector_areas(points, cells), cells[real], np.nonzero(real)[0]
    first = np.full(len(points), len(cells))
    np.minimum.at(first, point, cell)
    own, lead = a[cell], a[first[point]]
    cosine = np.einsum("ci,ci->c", unit(own), unit(lead))
    turned = np.where(cosine < OPPOSITE, -1.0, 1.0)
    total, plain = (_at_points(point, v, len(points)) for v in (turned[:, None] * own, own))
    area = _at_points(point, np.linalg.norm(own, axis=1), len(points))
    most = np.einsum("ni,ni->n", unit(total), plain)
    return unit(total) * np.where(most < -EVEN * area, -1.0, 1.0)[:, None]


def _at_points(point: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sum of the corners' values at each of ``count`` points."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, point, values)
    return total


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (..., 3) with u x v = n, u nearest to the axis with the least part of n."""
    e = np.eye(3)[np.abs(normal).argmin(axis=-1)]
    u = unit(e - (e * normal).sum(axis=-1, keepdims=True) * normal)
    return u, np.cross(normal, u)
