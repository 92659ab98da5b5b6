"""A parallel camera that shows most of a structure: three unit vectors and a window."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from .surface import Surface


@dataclass(frozen=True, eq=False)
class Camera:
    """Parallel projection u = right · x, v = up · x, depth = toward · x.

    ``toward`` points from the structure to the eye. ``window`` is (u_low, u_high, v_low, v_high) in
    metres, so lengths in the picture are lengths of the structure.
    """

    right: np.ndarray
    up: np.ndarray
    toward: np.ndarray
    window: tuple[float, float, float, float]

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 2) places in the picture plane [m]."""
        return np.asarray(points) @ np.stack([self.right, self.up], axis=1)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance towards the eye [m]."""
        return np.asarray(points) @ self.toward

    def framing(self, points: np.ndarray, margin: float = 0.04) -> Self:
        """The same view on a window that holds these points."""
        uv = self.project(points)
        low, high = uv.min(axis=0), uv.max(axis=0)
        pad = margin * max(float(np.max(high - low)), 1e-9)
        (u0, v0), (u1, v1) = (low - pad).tolist(), (high + pad).tolist()
        return replace(self, window=(u0, u1, v0, v1))

    @property
    def aspect(self) -> float:
        """Width over height."""
        u0, u1, v0, v1 = self.window
        return (u1 - u0) / (v1 - v0)


def best_view(seen: Surface, focus: np.ndarray | None = None, tilt: float = 24.0) -> Camera:
    """The direction of largest projected area ½ Σ |a · d|, tilted a little so that depth shows.

    Areas are counted over 400 directions spread by the golden angle (Vogel 1979); a structure
    without faces is seen along the direction in which its points spread least. Where ``focus``
    (k, 3) points are better seen from behind, the eye goes there.
    """
    d = _broadest(seen)
    front = _looking(d, seen, tilt)
    if focus is None or not len(focus) or not len(seen.faces):
        return front
    back = _looking(-d, seen, tilt)
    return back if _visible(back, seen, focus) > 1.05 * _visible(front, seen, focus) else front


def _looking(d: np.ndarray, seen: Surface, tilt: float) -> Camera:
    """The camera that looks along -d, after the tilt."""
    up = _upright(d, seen)
    right = np.cross(up, d)
    above = tilt * np.sign(d[2]) if abs(d[2]) > 0.8 else -tilt  # the eye is above the front edge
    toward = _turned(_turned(d, right, above), up, 0.7 * tilt)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    return Camera(right, up, toward, (0.0, 1.0, 0.0, 1.0)).framing(seen.points[seen.used])


def _visible(camera: Camera, seen: Surface, focus: np.ndarray, cells: int = 80) -> float:
    """Share of the points that nothing lies clearly in front of, on a coarse depth map."""
    middle = seen.points[seen.faces].mean(axis=1)
    u0, u1, v0, v1 = camera.window

    def cell(points: np.ndarray) -> np.ndarray:
        ij = (camera.project(points) - [u0, v0]) / [u1 - u0, v1 - v0] * cells
        i, j = np.clip(ij.astype(int), 0, cells - 1).T
        return np.asarray(i * cells + j)

    nearest = np.full(cells**2, -np.inf)
    np.maximum.at(nearest, cell(middle), camera.depth(middle))
    hidden = nearest[cell(focus)] - camera.depth(focus)
    return float(np.mean(hidden < 0.012 * seen.size))


def _broadest(seen: Surface) -> np.ndarray:
    if not len(seen.faces):
        used = seen.points[seen.used]
        spread = np.linalg.svd(used - used.mean(axis=0), full_matrices=True)[2][-1]
        return _outward(spread)
    areas = seen.areas()
    areas = areas[:: max(1, len(areas) // 5000)]
    k = np.arange(400)
    z = 1 - (k + 0.5) / 400  # half a sphere: d and -d show the same area
    turn = k * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    d = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    d = np.concatenate([np.eye(3), d])  # an axis wins a tie
    return _outward(
        d[np.argmax(np.abs(areas @ d.T).sum(axis=0) * (1 + 1e-3 * (np.arange(403) < 3)))]
    )


def _outward(d: np.ndarray) -> np.ndarray:
    """Of d and -d the one that looks from above, else from -Y, else from +X."""
    for value in (d[2], -d[1], d[0]):
        if abs(value) > 0.2:
            return d if value > 0 else -d
    return d


def _upright(d: np.ndarray, seen: Surface) -> np.ndarray:
    """Z is up unless one looks along it; then the shorter side is, so that pictures are wide."""
    up = np.array([0.0, 0.0, 1.0])
    if abs(d[2]) > 0.8:
        span = np.ptp(seen.points[seen.used], axis=0)
        up = np.array([0.0, 1.0, 0.0]) if span[0] >= span[1] else np.array([-1.0, 0.0, 0.0])
    up = up - (up @ d) * d
    return up / np.linalg.norm(up)


def _turned(vector: np.ndarray, axis: np.ndarray, degrees: float) -> np.ndarray:
    """Rotation about a unit axis (Rodrigues)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return c * vector + s * np.cross(axis, vector) + (1 - c) * (axis @ vector) * axis
