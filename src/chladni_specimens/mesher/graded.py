"""Graded triangle meshes by a size field, as in forming simulations."""

from collections.abc import Callable, Sequence

import numpy as np

from chladni.errors import ModelError

from ..joints.bolts import free_edges
from .plane_curves import counterclockwise, inside, resampled

SizeField = Callable[[np.ndarray], np.ndarray]  # planform (n, 2) -> required size (n,) [m]


def loops(nodes: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    """Closed free edges of a mesh (k, 2 or 3), the longest first."""
    following: dict[int, list[int]] = {}
    for a, b in free_edges(nodes).tolist():
        following.setdefault(a, []).append(b)
        following.setdefault(b, []).append(a)
    if odd := [a for a, near in following.items() if len(near) != 2]:
        raise ModelError(f"{len(odd)} grids of a free edge do not have two neighbours on it")
    out = []
    while following:
        chain = [next(iter(following))]
        while True:
            near = following.pop(chain[-1])
            step = [b for b in near if b in following and b not in chain[1:2]]
            if not step:
                break
            chain.append(step[0])
        out.append(points[chain])
    return sorted(out, key=lambda line: -_length(line))


def _length(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.roll(line, -1, axis=0) - line, axis=1).sum())


def quadtree(
    low: np.ndarray, high: np.ndarray, size: SizeField, coarse: float, fine: float
) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 2) and sides (n,) of square cells no larger than the size field allows."""
    axes = [
        np.arange(a + coarse / 2, b + coarse / 2, coarse) for a, b in zip(low, high, strict=True)
    ]
    centre = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    side, leaves = coarse, []
    probe = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 5)] * 2), axis=-1).reshape(-1, 2)
    while len(centre):
        at = centre[:, None] + side * probe
        smallest = size(at.reshape(-1, 2)).reshape(len(centre), -1).min(axis=1)
        cut = (smallest < 0.75 * side) & (side / 2 >= 0.75 * fine)
        leaves.append((centre[~cut], np.full((~cut).sum(), side)))
        quarter = side / 4 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        centre = (centre[cut][:, None] + quarter).reshape(-1, 2)
        side /= 2
    return np.vstack([c for c, _ in leaves]), np.concatenate([s for _, s in leaves])


def graded(
    borders: Sequence[np.ndarray], size: SizeField, coarse: float, fine: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and triangles (m, 3) within the first border and outside the others."""
    from scipy.spatial import Delaunay, cKDTree

    outer, *holes = (counterclockwise(resampled(b, 1.5 * fine)) for b in borders)
    centre, side = quadtree(outer.min(axis=0), outer.max(axis=0), size, coarse, fine)
    edge = np.vstack([outer, *holes])
    keep = (cKDTree(edge).query(centre)[0] > 0.4 * side) & inside(outer, centre)
    for hole in holes:
        keep &= ~inside(hole, centre)
    points = np.vstack([edge, centre[keep]])
    T = Delaunay(points).simplices
    middle = points[T].mean(axis=1)
    ok = inside(outer, middle)
    for hole in holes:
        ok &= ~inside(hole, middle)
    a, b, c = points[T].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    T = np.where(area[:, None] > 0, T, T[:, ::-1])[ok & (np.abs(area) > 1e-3 * fine**2)]
    used, row = np.unique(T, return_inverse=True)
    return points[used], row.reshape(-1, 3)
