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
        """Positions in the picture plane (n, 2) [m]."""
        return np.asarray(points) @ np.stack([self.right, self.up], axis=1)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Distance towards the eye (n,) [m]."""
        return np.asarray(points) @ self.toward

    def framing(self, points: np.ndarray, margin: float = 0.04) -> Self:
        """Return the view with a window that holds these points."""
        uv = self.project(points)
        low, high = uv.min(axis=0), uv.max(axis=0)
        pad = margin * max(float(np.max(high - low)), 1e-9)
        (u0, v0), (u1, v1) = (low - pad).tolist(), (high + pad).tolist()
        return replace(self, window=(u0, u1, v0, v1))

    @property
    def aspect(self) -> float:
        """Width of the window over its height."""
        u0, u1, v0, v1 = self.window
        return (u1 - u0) / (v1 - v0)


def best_view(seen: Surface, focus: np.ndarray | None = None, tilt: float = 24.0) -> Camera:
    """The camera along the largest projected area ½ Σ |a · d|, tilted a little to show depth.

    It is searched over 400 directions spread by the golden angle (Vogel 1979). A structure without
    faces is seen along the direction in which its points spread least. The view is from behind
    where ``focus`` points (k, 3) are better seen from there.
    """
    front, back = both_views(seen, tilt)
    if focus is None or not len(focus) or not len(seen.faces):
        return front
    share = [float(np.mean(visible(camera, seen, focus))) for camera in (front, back)]
    return back if share[1] > 1.05 * share[0] else front


def both_views(seen: Surface, tilt: float = 24.0) -> tuple[Camera, Camera]:
    """The best view, and the same view from behind."""
    d = _broadest(seen)
    return _looking(d, seen, tilt), _looking(-d, seen, tilt)


def needed_views(seen: Surface) -> tuple[Camera, ...]:
    """The best view, and the view from behind where a quarter of the faces is hidden."""
    front, back = both_views(seen)
    if not len(seen.faces):
        return (front,)
    shown = visible(front, seen, seen.points[seen.faces].mean(axis=1))
    return (front,) if shown.mean() > 0.85 else (front, back)


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


def visible(camera: Camera, seen: Surface, focus: np.ndarray, cells: int = 120) -> np.ndarray:
    """Mask of points (k,) bool that no face clearly covers, from a coarse depth map."""
    sheet = _samples(seen, (camera.window[1] - camera.window[0]) / cells)
    u0, u1, v0, v1 = camera.window

    def cell(points: np.ndarray) -> np.ndarray:
        ij = (camera.project(points) - [u0, v0]) / [u1 - u0, v1 - v0] * cells
        i, j = np.clip(ij.astype(int), 0, cells - 1).T
        return i * cells + j

    nearest = np.full(cells**2, -np.inf)
    np.maximum.at(nearest, cell(sheet), camera.depth(sheet))
    hidden = nearest[cell(focus)] - camera.depth(focus)
    return hidden < 0.006 * seen.size


def _samples(seen: Surface, step: float) -> np.ndarray:
    """Points on the faces about a step apart (n, 3): k by k on each, k from the typical face."""
    corners = seen.points[seen.faces]
    side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    k = int(np.clip(np.ceil(np.quantile(side, 0.9) / step), 1, 12)) if len(side) else 1
    r = (np.arange(k) + 0.5) / k
    xi, eta = (g.ravel() for g in np.meshgrid(r, r))
    N = np.stack([(1 - xi) * (1 - eta), xi * (1 - eta), xi * eta, (1 - xi) * eta])
    return np.einsum("cp,mci->mpi", N, corners).reshape(-1, 3)


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
    """The one of d and -d that looks from above, else from -Y, else from +X."""
    for value in (d[2], -d[1], d[0]):
        if abs(value) > 0.2:
            return d if value > 0 else -d
    return d


def _upright(d: np.ndarray, seen: Surface) -> np.ndarray:
    """The upward direction: z, or the shorter side in a view along z, so that pictures are wide."""
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
