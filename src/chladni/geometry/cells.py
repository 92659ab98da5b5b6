"""Cells of a mesh: their sides, their shape, the pieces they make."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..errors import ModelError
from .facets import cell_normals

FARTHEST = 1e9  # [m] from the origin: no structure is larger


def check_surface(points: np.ndarray, cells: np.ndarray) -> None:
    """Refuse coordinates that are no numbers and cells that name points that are not there.

    Parameters
    ----------
    points : (n, 3)   [m]
    cells : (m, k) int rows of points
    """
    for k in np.flatnonzero(~(np.abs(points) < FARTHEST).all(axis=1))[:1]:
        place = ", ".join(f"{x:g}" for x in points[k])
        raise ModelError(
            f"point {k} (counted from 0) is at ({place}) m, which is not a finite place"
        )
    for k, j in np.argwhere((cells < 0) | (cells >= len(points)))[:1]:
        raise ModelError(
            f"cell {k} (counted from 0) names point {cells[k, j]}; there are 0 to {len(points) - 1}"
        )


def contradicted(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Rows of ``values`` (n, k) that differ from the row ``first`` (n,) where their id stood."""
    return np.flatnonzero((values != values[first]).any(axis=1))


def corner_quality(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Least sine of a corner angle, min_k sin(θ_k), negative where a quad folds over (n,).

    Points are (k, 2) or (k, 3); in space the angles are counted about the cell's mean normal.
    Triangles are measured against the equilateral one, so that 1 is the best of both.
    """
    triangle = quads[:, 2] == quads[:, 3]
    x = points[quads]
    ahead, behind = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    ahead[triangle, 2] = x[triangle, 0] - x[triangle, 2]  # past the repeated node
    if points.shape[1] == 2:
        cross = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    else:
        normal = cell_normals(points, quads)
        cross = np.einsum("nki,ni->nk", np.cross(ahead, behind), normal)
    size = np.linalg.norm(ahead, axis=-1) * np.linalg.norm(behind, axis=-1)
    sine = cross / np.maximum(size, 1e-30)
    sine[triangle, 3] = 1.0
    return np.where(triangle, sine.min(axis=1) * 2 / np.sqrt(3), sine.min(axis=1))


def edges_of(cells: np.ndarray) -> np.ndarray:
    """All sides (k, 2) of the cells, smaller row first, repeated; collapsed ones left out."""
    return np.sort(directed_edges(cells)[0], axis=1)


def directed_edges(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sides (k, 2) as the cells run round them and whose they are (k,); collapsed ones left out."""
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    real = sides[:, 0] != sides[:, 1]
    return sides[real], np.repeat(np.arange(len(cells)), cells.shape[1])[real]


def point_means(cells: np.ndarray, corner: np.ndarray, count: int) -> np.ndarray:
    """Mean at each of ``count`` points of values at the corners of cells (m, k); nan at no cell."""
    at = cells.ravel()
    held = np.bincount(at, minlength=count)
    total = np.bincount(at, corner.ravel(), minlength=count)
    return np.where(held > 0, total / np.maximum(held, 1), np.nan)


def components(cells: np.ndarray, count: int) -> np.ndarray:
    """Number (from 0) of the connected piece each of `count` points belongs to.

    Cells (m, k) of any number of points hold these together, sides (m, 2) among them.
    """
    a, b = edges_of(cells).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    return connected_components(graph, directed=False)[1]
