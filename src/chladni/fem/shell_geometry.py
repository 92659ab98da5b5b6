"""Geometry of flat four- and three-node shells: frames, flattened corners, link to the nodes.

A quadrilateral's plane is the mean plane of its corners, as in Nastran's CQUAD4: the normal is
along the cross product of the diagonals, x along their bisector. A triangle's x is along side 1-2.

The corners of a warped quadrilateral lie alternately above and below the plane. A force in the
plane acts on its corner. Normal forces at that corner and its two neighbours balance the couple,
not moments (NASTRAN-95, QDMM1D; MacNeal, Computers and Structures 8, 1978, 175-183). Hence a rigid
motion of the nodes causes no strain, and membrane forces do not rotate nodes. MSC Nastran 2020 does
the same: a patch of its results agrees to 1.3e-6 in, but only to 1.8e-4 in with the slope of the
middle for all corners.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..errors import ModelError, named
from ..model.assembly import Shells
from .shell_membrane import corner_slopes


@dataclass(frozen=True, eq=False)
class ShellGeometry:
    """Frames and flattened corners of m shells; a mask, rows or a slice as index give a subset."""

    # (m, 4 or 8) int: rows of points; a triangle repeats its third; 8 where some shells have nodes
    # on edges, of which an absent one repeats the edge's first end
    nodes: np.ndarray
    places: np.ndarray  # (m, 4 or 8, 3) of the nodes [m]
    frames: np.ndarray  # (m, 3, 3) rows are the unit vectors x, y, n of the element frame
    corners: np.ndarray  # (m, 4, 2) flattened corners from the element's middle [m]
    warp: np.ndarray  # (m, 4) height of each node along n above the plane [m]
    offset: np.ndarray  # (m,) of the mid-surface along n (Nastran's ZOFFS) [m]
    triangle: np.ndarray  # (m,) bool
    area: np.ndarray  # (m,) of the flattened element [m²]
    sides: np.ndarray  # (m, 2) length along x and y for residual bending flexibility [m]
    turn: np.ndarray  # (m,) angle from the element's x to material axis 1 [rad]

    def __len__(self) -> int:
        return len(self.nodes)

    def __getitem__(self, which: np.ndarray | slice) -> Self:
        return replace(self, **{name: value[which] for name, value in vars(self).items()})

    @property
    def curved(self) -> np.ndarray:
        """(m,) bool, True where the shell has nodes on its edges."""
        return (self.nodes[:, 4:] != self.nodes[:, : self.nodes.shape[1] - 4]).any(axis=1)

    @property
    def motions(self) -> int:
        """Columns of an element matrix: six a node."""
        return 6 * self.nodes.shape[1]


def geometry(points: np.ndarray, shells: Shells) -> ShellGeometry:
    """Frames, flattened corners and warp of every shell.

    Parameters
    ----------
    points : (n, 3)     places in the basic frame [m]
    shells : Shells

    Raises
    ------
    ModelError
        If a shell has no area or an inner angle beyond 180 degrees; the sentence names it.
    """
    x, triangle, nodes = points[shells.nodes], shells.triangle, shells.nodes
    if shells.curved.any():
        nodes = np.hstack([nodes, np.where(shells.middle >= 0, shells.middle, nodes)])
    frames = _frames(x, triangle)
    middle = np.where(triangle[:, None], x[:, :3].mean(axis=1), x.mean(axis=1))
    local = (x - middle[:, None]) @ frames.swapaxes(1, 2)
    corners = np.ascontiguousarray(local[:, :, :2])
    area = _areas(corners)
    _check(shells.ids, corners, triangle)
    axis = np.einsum("mij,mj->mi", frames[:, :2], shells.axis)
    return ShellGeometry(
        nodes=nodes,
        places=points[nodes],
        frames=frames,
        corners=corners,
        warp=np.ascontiguousarray(local[:, :, 2]),
        offset=shells.offset,
        triangle=triangle,
        area=area,
        sides=_sides(corners, triangle),
        turn=np.arctan2(axis[:, 1], axis[:, 0]),
    )


def to_element(geo: ShellGeometry) -> np.ndarray:
    """Motion of the flattened mid-surface in the element frame from that of the nodes (m, 24, 24).

    u_i' = R u_i + d (R r_i x n) + z_i (w,x w,y)_i with d the offset and z_i the warp. The slope at
    corner i is that of the bilinear w through the corners' deflections (NASTRAN-95, QDMM1D).
    """
    T = np.zeros((len(geo), 4, 6, 4, 6))
    x, y, n = (geo.frames[:, k] for k in range(3))
    for k in range(4):
        T[:, k, :3, k, :3] = T[:, k, 3:, k, 3:] = geo.frames
        T[:, k, 0, k, 3:] = geo.offset[:, None] * y
        T[:, k, 1, k, 3:] = -geo.offset[:, None] * x
    if geo.warp.any() and not geo.triangle.any():
        slope = corner_slopes(geo.corners)
        T[:, :, :2, :, :3] += np.einsum("mk,mkij,ml->mkijl", geo.warp, slope, n)
    return T.reshape(len(geo), 24, 24)


def _frames(x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Rows e1, e2, n; (m, 3, 3) of corners (m, 4, 3)."""
    first, second = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
    n = _unit(np.cross(first, second))
    e1 = np.where(triangle[:, None], x[:, 1] - x[:, 0], _unit(first) - _unit(second))
    e1 = _unit(e1)
    return np.stack([e1, np.cross(n, e1), n], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length == 0, 1, length)


def _cross2(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _areas(corners: np.ndarray) -> np.ndarray:
    """½ |d₁₃ × d₂₄|, which holds for triangles as well."""
    return _cross2(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2


def _sides(corners: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Mean distance of opposite sides; of a triangle √(12 ∫x² dA / A) = √(Σ x_i²)."""
    c = corners
    quad = np.abs(
        np.stack(
            [
                c[:, 1, 0] + c[:, 2, 0] - c[:, 0, 0] - c[:, 3, 0],
                c[:, 2, 1] + c[:, 3, 1] - c[:, 0, 1] - c[:, 1, 1],
            ],
            axis=1,
        )
    )
    return np.where(triangle[:, None], np.sqrt((c[:, :3] ** 2).sum(axis=1)), quad / 2)


def _check(ids: np.ndarray, corners: np.ndarray, triangle: np.ndarray) -> None:
    """Raise unless every corner turns left, which ensures area and convexity."""
    side = np.roll(corners, -1, axis=1) - corners
    side[triangle, 2] = side[triangle, 3]
    turn = np.stack([_cross2(side[:, k - 1], side[:, k]) for k in range(4)], axis=1)
    turn[triangle, 3] = turn[triangle, 2]
    bad = ~(turn > 0).all(axis=1)
    if bad.any():
        raise ModelError(
            f"shells {named(ids[bad])} ({bad.sum()} in all) have no area or an inner angle "
            "beyond 180 degrees; check the order and place of their grids"
        )
