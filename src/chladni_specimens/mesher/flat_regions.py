"""Quad-dominant meshes of flat regions: strips along borders, grids, and the rest filled.

The filler keeps the border's points.  It adds points along feature lines, in rings parallel to the
border and on a square grid. Delaunay triangulation (Bowyer, Watson 1981) joins them; the triangles
are then paired into quadrilaterals and smoothed. The filler works in the plane; a pressing is the
image of its plane mesh under a height field.
"""

from collections.abc import Sequence

import numpy as np

from chladni.errors import ModelError

from .plane_curves import counterclockwise, inside, resampled
from .quads_from_triangles import paired, smoothed, without_doublets

# clearances in units of the mesh size; a border segment survives Delaunay above 0.55
_FEATURE, _RING, _GRID = 0.42, 0.72, 0.66


def fill(
    outer: np.ndarray,
    size: float,
    holes: Sequence[np.ndarray] = (),
    lines: Sequence[np.ndarray] = (),
    rings: int = 2,
    closest: float = np.inf,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and quads (m, 4) of the region within `outer` and outside the `holes`.

    Parameters
    ----------
    outer, holes : closed lines (k, 2); their points are kept and come first
    size : mesh size [m]
    lines : polylines of feature points (folds); cell edges follow them
    rings : rows of points parallel to the borders before the square grid begins
    closest : feature points farther apart than this are kept even in a coarser mesh [m]

    Raises
    ------
    ModelError
        If a border segment is lost, naming the place: the border is too close to itself.
    """
    borders = [counterclockwise(loop) for loop in (outer, *holes)]
    points, folds = _feature_points(borders, lines, size, min(_FEATURE * size, closest))
    fixed = len(points)
    for step in range(1, rings + 1):
        points = _with_ring(points, borders, step, size)
    points = np.vstack([points, _clear(_lattice(borders[0], size), points, borders, size, _GRID)])
    triangles = _triangles(points, borders, size)
    _refuse_lost_borders(points, triangles, borders)
    quads = without_doublets(paired(points, triangles, folds), fixed)
    return _compact(smoothed(points, quads, fixed), quads, fixed)


def _feature_points(
    borders: Sequence[np.ndarray], lines: Sequence[np.ndarray], size: float, gap: float
) -> tuple[np.ndarray, set[tuple[int, int]]]:
    """Border and feature points, and the pairs of rows that follow a feature line."""
    from scipy.spatial import cKDTree

    points = np.vstack(borders)
    border = cKDTree(np.vstack([resampled(b, size / 8) for b in borders]))
    before = np.full((1, 2), np.inf)
    folds: set[tuple[int, int]] = set()
    for line in lines:
        kept = line[(border.query(line)[0] > 0.4 * size) & (_away(line, before) > gap)]
        rows = len(points) + np.arange(len(kept))
        points = np.vstack([points, kept])
        folds |= {(int(min(e)), int(max(e))) for e in zip(rows, np.roll(rows, -1), strict=True)}
        closed = np.linalg.norm(line[0] - line[-1]) < 2 * size
        before = np.vstack([before, resampled(line, gap / 4, closed=bool(closed))])
    return points, folds


def _away(line: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Distance of the points of a line from the nearest of some places (n,)."""
    from scipy.spatial import cKDTree

    finite = places[np.isfinite(places[:, 0])]
    return cKDTree(finite).query(line)[0] if len(finite) else np.full(len(line), np.inf)


def _lattice(outer: np.ndarray, size: float) -> np.ndarray:
    """Square grid over the bounding box, symmetric about its middle."""
    low, high = outer.min(axis=0), outer.max(axis=0)
    axes = []
    for a, b in zip(low, high, strict=True):
        n = int((b - a) / size)
        axes.append((a + b) / 2 + size * (np.arange(n) - (n - 1) / 2))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _clear(
    places: np.ndarray,
    points: np.ndarray,
    borders: Sequence[np.ndarray],
    size: float,
    clearance: float,
) -> np.ndarray:
    """The places inside the region, clear of its border, of the points and of each other."""
    from scipy.spatial import cKDTree

    outer, *holes = borders
    dense = cKDTree(np.vstack([resampled(b, size / 8) for b in borders]))
    ok = inside(outer, places) & (dense.query(places)[0] > clearance * size)
    ok &= cKDTree(points).query(places)[0] > clearance * size
    for hole in holes:
        ok &= ~inside(hole, places)
    places = places[ok]
    alive = np.ones(len(places), bool)
    for i, j in sorted(cKDTree(places).query_pairs(clearance * size)) if len(places) else ():
        alive[j] &= not alive[i]
    return places[alive]


def _with_ring(
    points: np.ndarray, borders: Sequence[np.ndarray], step: int, size: float
) -> np.ndarray:
    """The points with a row parallel to each border, `step` sizes away from it."""
    for k, loop in enumerate(borders):
        t = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
        n = np.column_stack([-t[:, 1], t[:, 0]]) / np.linalg.norm(t, axis=1, keepdims=True)
        ring = loop + (1 if k == 0 else -1) * step * size * n
        points = np.vstack([points, _clear(ring, points, borders, size, _RING)])
    return points


def _triangles(points: np.ndarray, borders: Sequence[np.ndarray], size: float) -> np.ndarray:
    """Delaunay triangles (n, 3) of the region, counter-clockwise."""
    from scipy.spatial import Delaunay

    T = Delaunay(points).simplices
    outer, *holes = borders
    middle = points[T].mean(axis=1)
    ok = inside(outer, middle)
    for hole in holes:
        ok &= ~inside(hole, middle)
    T = T[ok]
    a, b, c = points[T].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(area[:, None] > 0, T, T[:, ::-1])[np.abs(area) > 1e-3 * size**2]


def _refuse_lost_borders(
    points: np.ndarray, triangles: np.ndarray, borders: Sequence[np.ndarray]
) -> None:
    sides = np.sort(np.vstack([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    have = set(map(tuple, sides.tolist()))
    start = 0
    for loop in borders:
        n = len(loop)
        ring = [(start + i, start + (i + 1) % n) for i in range(n)]
        start += n
        if lost := [e for e in ring if (min(e), max(e)) not in have]:
            x, y = points[lost[0][0]]
            raise ModelError(
                f"{len(lost)} border segments cannot be kept, the first near ({x:.4f}, {y:.4f}) m; "
                "the border runs too close to itself, use a smaller mesh size"
            )


def _compact(points: np.ndarray, quads: np.ndarray, fixed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points that a cell uses (the first `fixed` always stay) and renumbered quads."""
    used = np.zeros(len(points), bool)
    used[quads] = True
    row = np.cumsum(used) - 1
    return points[used], row[quads]


def strip(rows: Sequence[np.ndarray], *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points and quads between lines of equally many points (n, 2), turning left across rows.

    >>> strip([np.array([[0, 0], [1, 0.]]), np.array([[0, 1], [1, 1.]])], closed=False)[1]
    array([[0, 1, 3, 2]])
    """
    n = len(rows[0])
    if lengths := {len(row) for row in rows} - {n}:
        raise ModelError(f"rows of a strip have {n} and {sorted(lengths)} points; give as many")
    i = np.arange(n if closed else n - 1)
    j = (i + 1) % n
    quads = np.vstack([np.column_stack([i, j, j + n, i + n]) + k * n for k in range(len(rows) - 1)])
    return np.vstack(rows), quads


def grid(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and quads of the lattice with these ticks."""
    return strip([np.column_stack([x, np.full(len(x), v)]) for v in y], closed=False)
