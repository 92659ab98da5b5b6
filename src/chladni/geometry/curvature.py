"""Curvature of shell meshes.

The curvature tensor of a triangle is fitted to the change of the nodal normals along its sides
and averaged to the nodes (Rusinkiewicz, 3DPVT 2004, 486-493).
"""

from dataclasses import dataclass

import numpy as np

from ..model.assembly import Assembly
from .facets import point_normals, tangents, unit


@dataclass(frozen=True, eq=False)
class Curvature:
    """Principal curvatures and unit normals at the points (n,), zero where there is no shell."""

    first: np.ndarray  # of larger magnitude [1/m]
    second: np.ndarray  # [1/m]
    normal: np.ndarray  # (n, 3)

    @property
    def total(self) -> np.ndarray:
        """κ = √(κ₁² + κ₂²) [1/m]."""
        return np.hypot(self.first, self.second)


def triangles(nodes: np.ndarray) -> np.ndarray:
    """The cells as triangles; a quad is split along both of its diagonals."""
    three = nodes[:, 2] == nodes[:, 3]
    quads = nodes[~three]
    corners = ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))
    return np.vstack([nodes[three][:, :3], *(quads[:, list(c)] for c in corners)])


def curvature(points: np.ndarray, nodes: np.ndarray) -> Curvature:
    """Curvature at the points of a mesh of quads and triangles (m, 4), consistently oriented."""
    T = triangles(nodes)
    x = points[T]
    cross = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    n, normal = len(points), point_normals(points, nodes)
    tensor = _tensors(x, normal[T], cross)
    at_nodes = np.zeros((n, 3, 3))
    weight = np.zeros(n)
    area = np.linalg.norm(cross, axis=1)
    for k in range(3):
        np.add.at(at_nodes, T[:, k], area[:, None, None] * tensor)
        np.add.at(weight, T[:, k], area)
    at_nodes /= np.maximum(weight, 1e-30)[:, None, None]
    basis = np.stack(tangents(normal), axis=1)
    values = np.linalg.eigvalsh(basis @ at_nodes @ basis.swapaxes(1, 2))
    larger = np.abs(values).argmax(axis=1)
    rows = np.arange(len(values))
    return Curvature(values[rows, larger], values[rows, 1 - larger], normal)


def _tensors(x: np.ndarray, normal: np.ndarray, cross: np.ndarray) -> np.ndarray:
    """S with δn = S δx along the three sides in least squares, as (m, 3, 3) tensors."""
    basis = np.stack(tangents(unit(cross)), axis=1)  # (m, 2, 3)
    side = np.einsum("mai,mki->mka", basis, np.roll(x, -1, axis=1) - x)
    turn = np.einsum("mai,mki->mka", basis, np.roll(normal, -1, axis=1) - normal)
    a, b = side[..., 0], side[..., 1]
    zero = np.zeros_like(a)
    A = np.concatenate([np.stack([a, b, zero], -1), np.stack([zero, a, b], -1)], axis=1)
    right = np.concatenate([turn[..., 0], turn[..., 1]], axis=1)
    AtA = A.swapaxes(1, 2) @ A
    AtA += 1e-12 * np.trace(AtA, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    s = np.linalg.solve(AtA, np.einsum("mki,mk->mi", A, right)[..., None])[..., 0]
    S = np.stack([s[:, :2], s[:, 1:]], axis=1)  # (m, 2, 2): e f / f g
    return basis.swapaxes(1, 2) @ S @ basis


def part_curvature(assembly: Assembly) -> np.ndarray:
    """κ at the corners of every shell (n, 4), computed for each part separately [1/m]."""
    shells = assembly.shells
    out = np.zeros(shells.nodes.shape)
    for part in np.unique(shells.part):
        rows = shells.part == part
        out[rows] = curvature(assembly.points, shells.nodes[rows]).total[shells.nodes[rows]]
    return out
