"""A flat plate with a round hole, meshed so that a finer mesh holds every node of a coarser one."""

from itertools import pairwise

import numpy as np

from chladni.model.assembly import Assembly
from chladni.model.properties import Material

from .plates import STEEL, merged, sheet


def holed_plate(
    length: float,
    width: float,
    hole: tuple[float, float, float],
    h: float,
    t: float,
    material: Material = STEEL,
    times: int = 1,
) -> Assembly:
    """A plate in z = 0, corner at the origin, with an O-grid in a square box round the hole.

    Parameters
    ----------
    length, width, h, t : [m]
    hole : (x, y, radius) [m]
    times : int         number of pieces along each side of an element of the mesh of size h
    """
    x, y, r = hole
    a = 1.8 * r  # half side of the box
    xs = _ticks([0.0, x - a, x + a, length], h, times)
    ys = _ticks([0.0, y - a, y + a, width], h, times)
    X, Y = np.meshgrid(xs, ys, indexing="ij")
    points = np.stack([X.ravel(), Y.ravel(), 0 * X.ravel()], axis=1)
    node = np.arange(X.size).reshape(X.shape)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(
        -1, 4
    )
    middle = points[quads].mean(axis=1)
    quads = quads[(np.abs(middle[:, 0] - x) > a) | (np.abs(middle[:, 1] - y) > a)]
    rim = _box(xs, ys, x, y, a)
    rings, cells = _ring(rim, (x, y), r, h, times)
    all_points = np.concatenate([points, rings])
    used, nodes = np.unique(np.concatenate([quads, cells + len(points)]), return_inverse=True)
    return sheet(*merged(all_points[used], nodes.reshape(-1, 4), 1e-9), t, material)


def _ticks(stops: list[float], h: float, times: int) -> np.ndarray:
    """Coordinates through all stops, pieces of about h, each cut ``times``."""
    pieces = [
        np.linspace(a, b, times * max(1, round((b - a) / h)) + 1)[:-1] for a, b in pairwise(stops)
    ]
    return np.append(np.concatenate(pieces), stops[-1])


def _box(xs: np.ndarray, ys: np.ndarray, x: float, y: float, a: float) -> np.ndarray:
    """Grid points on the border of the box, counter-clockwise."""
    near = 1e-9
    bx = xs[(xs >= x - a - near) & (xs <= x + a + near)]
    by = ys[(ys >= y - a - near) & (ys <= y + a + near)]
    bottom = np.stack([bx[:-1], np.full(len(bx) - 1, y - a)], axis=1)
    right = np.stack([np.full(len(by) - 1, x + a), by[:-1]], axis=1)
    top = np.stack([bx[:0:-1], np.full(len(bx) - 1, y + a)], axis=1)
    left = np.stack([np.full(len(by) - 1, x - a), by[:0:-1]], axis=1)
    return np.concatenate([bottom, right, top, left])


def _ring(
    rim: np.ndarray, centre: tuple[float, float], r: float, h: float, times: int
) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells between the box and the circle."""
    d = rim - centre
    circle = np.array(centre) + r * d / np.linalg.norm(d, axis=1, keepdims=True)
    layers = times * max(1, round(0.9 * r / h))
    s = np.linspace(0, 1, layers + 1)[:, None, None]
    flat = (rim * (1 - s) + circle * s).reshape(-1, 2)
    n = len(rim)
    k, j = np.arange(layers)[:, None] * n, np.arange(n)[None]
    nxt = (j + 1) % n
    cells = np.stack([k + j, k + nxt, k + n + nxt, k + n + j], axis=-1).reshape(-1, 4)
    return np.column_stack([flat, np.zeros(len(flat))]), cells
