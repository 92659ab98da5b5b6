"""Plane curves for the mesher: rounded polygons, even spacing, distance and offset."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

from chladni.arrays import readonly

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


FAR = 0.12  # largest distance from a loop that is computed [m]


def counterclockwise(loop: np.ndarray) -> np.ndarray:
    """The closed line (n, 2) turning left, area Σ x_i y_j - x_j y_i > 0."""
    x, y = loop.T
    return loop if np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0 else loop[::-1]


def rounded(corners: Sequence[tuple[float, float, float]], per_corner: int = 24) -> np.ndarray:
    """Closed polyline through the corners (x, y, radius), each rounded by its arc.

    >>> loop = rounded([(0, 0, 0.1), (1, 0, 0.1), (1, 1, 0.1), (0, 1, 0.1)])
    >>> loop.shape
    (96, 2)
    """
    n = len(corners)
    arcs = [_arc(corners[k - 1], corners[k], corners[(k + 1) % n], per_corner) for k in range(n)]
    return counterclockwise(np.vstack(arcs))


def _arc(
    before: tuple[float, ...], corner: tuple[float, ...], after: tuple[float, ...], count: int
) -> np.ndarray:
    """Points (count, 2) of the arc that rounds one corner."""
    p0, p1, p2 = (np.array(p[:2], dtype=float) for p in (before, corner, after))
    a, b = _unit(p0 - p1), _unit(p2 - p1)
    half = np.arccos(np.clip(a @ b, -1, 1)) / 2
    radius = max(corner[2], 1e-9)
    centre = p1 + _unit(a + b) * radius / np.sin(half)
    start, end = (p1 + e * radius / np.tan(half) - centre for e in (a, b))
    first = np.arctan2(start[1], start[0])
    turn = (np.arctan2(end[1], end[0]) - first + np.pi) % (2 * np.pi) - np.pi
    angle = first + turn * np.linspace(0, 1, count)
    return centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def arc_length(line: np.ndarray) -> np.ndarray:
    """Length along an open polyline at each of its points (n,)."""
    return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]


def resampled(
    line: np.ndarray, step: float = 0.0, *, count: int = 0, closed: bool = True, even: bool = True
) -> np.ndarray:
    """The line with evenly spaced points: `count` pieces, or pieces of about `step`.

    A closed line gets an even number of points, as all-quad regions need, and does not repeat its
    first point. An open line keeps both ends (pieces + 1 points).
    """
    dense = np.vstack([line, line[:1]]) if closed else np.asarray(line)
    along = arc_length(dense)
    n = count or max(6 if closed else 1, round(along[-1] / step))
    n += n % 2 if closed and even else 0
    at = np.linspace(0, along[-1], n + 1)
    out = np.column_stack([np.interp(at, along, x) for x in dense.T])
    return out[:-1] if closed else out


def inside(loop: np.ndarray, points: np.ndarray) -> np.ndarray:
    """True where a point lies inside the closed line (crossing number)."""
    (x0, y0), (x1, y1) = loop.T[:, :, None], np.roll(loop, -1, axis=0).T[:, :, None]
    slope = (x1 - x0) / np.where(y1 == y0, np.inf, y1 - y0)
    out = np.zeros(len(points), bool)
    for k in range(0, len(points), 4000):  # blocks, so that the table stays small
        x, y = points[k : k + 4000].T
        crossed = ((y0 > y) != (y1 > y)) & (x < slope * (y - y0) + x0)
        out[k : k + 4000] = crossed.sum(axis=0) % 2 == 1
    return out


def rectangle(x0: float, y0: float, x1: float, y1: float, radius: float) -> np.ndarray:
    """Rounded rectangle as a dense closed line."""
    return rounded([(x0, y0, radius), (x1, y0, radius), (x1, y1, radius), (x0, y1, radius)])


def stadium(a: Sequence[float], b: Sequence[float], radius: float) -> np.ndarray:
    """Points at one distance from a straight segment, as a dense closed line."""
    p, q = np.array(a, dtype=float), np.array(b, dtype=float)
    e = _unit(q - p)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 25)[:, None]
    cap = np.cos(angle) * e + np.sin(angle) * np.array([-e[1], e[0]])
    return np.vstack([q + radius * cap, p - radius * cap])


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed line, dense enough to measure distances from it."""

    points: np.ndarray  # (n, 2) counter-clockwise, evenly spaced
    tree: "cKDTree" = field(repr=False)

    @classmethod
    def through(cls, line: np.ndarray, spacing: float) -> Self:
        """The loop through these points, resampled at `spacing`."""
        from scipy.spatial import cKDTree

        points = counterclockwise(resampled(line, spacing))
        return cls(readonly(points), cKDTree(points))

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distance of the points (n, 2) from the line (n,), exact on its segments, up to 0.12 m."""
        at = self.tree.query(points, distance_upper_bound=FAR)[1]
        out, near = np.full(len(points), FAR), at < len(self.points)
        out[near] = np.linalg.norm(points[near] - self._projected(points[near], at[near]), axis=-1)
        return out

    def normal(self, points: np.ndarray) -> np.ndarray:
        """Unit normal into the loop at the nearest place of the line (n, 2)."""
        nearest, n, reach = self.tree.query(points)[1], len(self.points), 12
        t = self.points[(nearest + reach) % n] - self.points[(nearest - reach) % n]
        return _unit(np.column_stack([-t[:, 1], t[:, 0]]))

    def offset(self, points: np.ndarray, inward: float) -> np.ndarray:
        """Points (n, 2) of the line, moved inward along its normal."""
        return points + inward * self.normal(points)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Nearest places of the line (n, 2)."""
        return self._projected(points, self.tree.query(points)[1])

    def _projected(self, points: np.ndarray, at: np.ndarray) -> np.ndarray:
        here, n = self.points[at], len(self.points)
        projected = np.stack([_foot(points, here, self.points[(at + k) % n]) for k in (-1, 1)])
        side = np.linalg.norm(projected - points, axis=-1).argmin(axis=0)
        return projected[side, np.arange(len(here))]

    def between(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The open line along the loop, counter-clockwise from one place to another."""
        i, j = self.tree.query(np.stack([start, end]))[1]
        count = (j - i) % len(self.points)
        rows = (i + 1 + np.arange(max(count - 1, 0))) % len(self.points)
        return np.vstack([start, self.points[rows], end])

    def inside(self, points: np.ndarray) -> np.ndarray:
        """True where a point (n, 2) is within the loop."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        out = ((points >= low) & (points <= high)).all(axis=1)
        out[out] = inside(self.points[::4], points[out])
        return out


def _foot(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Nearest point of the segment a-b to p, all (..., 2)."""
    along = b - a
    t = ((p - a) * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-30)
    return a + np.clip(t, 0, 1)[..., None] * along


def in_step(
    outer: Loop, inner: Loop, outer_arc: np.ndarray, inner_arc: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The middle line between two loops (n, 2) and its feet on both, dense, over two arcs."""
    n = len(outer_arc)
    middle = (outer_arc + resampled(inner_arc, count=n - 1, closed=False)) / 2
    for _ in range(4):
        middle = resampled(
            (outer.nearest(middle) + inner.nearest(middle)) / 2, count=n - 1, closed=False
        )
    return middle, outer.nearest(middle), inner.nearest(middle)
