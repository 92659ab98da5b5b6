"""Curvature of shell meshes, and places flat and reachable enough for a sensor.

The curvature tensor of a triangle is fitted to the change of the nodal normals along its sides
and averaged to the nodes (Rusinkiewicz, 3DPVT 2004, 486-493).
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..model.assembly import Assembly
from ..model.connections_faces import tangents
from ..model.mesher_pairing import edges_of


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
    """The cells as triangles; a quad counts with both its diagonals (each half twice weighed)."""
    three = nodes[:, 2] == nodes[:, 3]
    quads = nodes[~three]
    corners = ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))
    return np.vstack([nodes[three][:, :3], *(quads[:, list(c)] for c in corners)])


def curvature(points: np.ndarray, nodes: np.ndarray) -> Curvature:
    """Curvature at the points of a mesh of quads and triangles (m, 4), consistently oriented."""
    T = triangles(nodes)
    x = points[T]
    cross = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    n = len(points)
    normal = np.zeros((n, 3))
    for k in range(3):
        np.add.at(normal, T[:, k], cross)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    tensor = _tensors(x, normal[T], cross)
    at_nodes = np.zeros((n, 3, 3))
    weight = np.zeros(n)
    area = np.linalg.norm(cross, axis=1)
    for k in range(3):
        np.add.at(at_nodes, T[:, k], area[:, None, None] * tensor)
        np.add.at(weight, T[:, k], area)
    at_nodes /= np.maximum(weight, 1e-30)[:, None, None]
    return _principal(at_nodes, normal)


def _tensors(x: np.ndarray, normal: np.ndarray, cross: np.ndarray) -> np.ndarray:
    """S with δn = S δx along the three sides in least squares, as (m, 3, 3) tensors."""
    unit = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    basis = np.stack(tangents(unit), axis=1)  # (m, 2, 3)
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
    return np.asarray(basis.swapaxes(1, 2) @ S @ basis)


def _principal(tensor: np.ndarray, normal: np.ndarray) -> Curvature:
    basis = np.stack(tangents(normal), axis=1)
    values = np.linalg.eigvalsh(basis @ tensor @ basis.swapaxes(1, 2))
    larger = np.abs(values).argmax(axis=1)
    rows = np.arange(len(values))
    return Curvature(values[rows, larger], values[rows, 1 - larger], normal)


def part_curvature(assembly: Assembly) -> np.ndarray:
    """κ at the corners of every shell (n, 4), each part for itself [1/m]."""
    shells = assembly.shells
    out = np.zeros(shells.nodes.shape)
    for part in np.unique(shells.part):
        rows = shells.part == part
        out[rows] = curvature(assembly.points, shells.nodes[rows]).total[shells.nodes[rows]]
    return out


@dataclass(frozen=True, eq=False)
class Candidates:
    """Places for a sensor.

    Attributes
    ----------
    ids : (k,) int            grids
    points, normal : (k, 3)   place and the free side's normal
    part : tuple of str
    curvature : (k,)          [1/m]
    """

    ids: np.ndarray
    points: np.ndarray
    normal: np.ndarray
    part: tuple[str, ...]
    curvature: np.ndarray


def candidates(
    assembly: Assembly,
    *,
    flat: float = 6.0,
    radius: float = 0.006,
    height: float = 0.120,
    edge: float = 0.012,
    spacing: float = 0.055,
    parts: tuple[str, ...] = (),
) -> Candidates:
    """Grids where an accelerometer could be glued: flat, away from edges, free on one side.

    Parameters
    ----------
    flat : largest curvature κ [1/m]
    radius, height : of the space a sensor and the hand that mounts it need above the sheet [m]
    edge : least distance from a free edge [m]
    spacing : least distance between candidates on one part [m]
    parts : only these; default all
    """
    shells = assembly.shells
    wanted = [assembly.part(p) for p in parts] or np.unique(shells.part).tolist()
    found = [_on_part(assembly, p, flat, edge, spacing) for p in wanted]
    rows = np.concatenate([r for r, _, _ in found])
    normal = np.vstack([n for _, n, _ in found])
    kappa = np.concatenate([k for _, _, k in found])
    part = np.concatenate([np.full(len(r), p) for (r, _, _), p in zip(found, wanted, strict=True)])
    side = free_side(assembly, rows, normal, radius, height)
    ok = side != 0
    order = np.argsort(rows[ok], kind="stable")
    rows, part = rows[ok][order], part[ok][order]
    return Candidates(
        assembly.ids[rows],
        assembly.points[rows],
        (normal[ok] * side[ok][:, None])[order],
        tuple(assembly.parts[p].name for p in part),
        kappa[ok][order],
    )


def _on_part(
    assembly: Assembly, part: int, flat: float, edge: float, spacing: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, normals and curvature of the flat inner grids of a part, thinned to the spacing."""
    nodes = assembly.shells.nodes[assembly.shells.part == part]
    bent = curvature(assembly.points, nodes)
    rows = np.unique(nodes)
    sides, count = np.unique(edges_of(nodes), axis=0, return_counts=True)
    rim = np.unique(sides[count == 1])
    rows = rows[bent.total[rows] <= flat]
    if len(rim) and len(rows):
        rows = rows[cKDTree(assembly.points[rim]).query(assembly.points[rows])[0] >= edge]
    rows = rows[np.argsort(bent.total[rows], kind="stable")]
    kept: list[int] = []
    for row in rows.tolist():
        away = assembly.points[kept] - assembly.points[row]
        if not kept or np.linalg.norm(away, axis=1).min() >= spacing:
            kept.append(row)
    picked = np.array(kept, dtype=int)
    return picked, bent.normal[picked], bent.total[picked]


def free_side(
    assembly: Assembly, rows: np.ndarray, normal: np.ndarray, radius: float, height: float
) -> np.ndarray:
    """+1, -1: the side of the sheet with free space above (n,); 0 where neither is free."""
    u, v = tangents(normal)
    around = [np.zeros_like(u), u, -u, v, -v]
    out = np.zeros(len(rows), dtype=int)
    for sign in (-1, 1):
        free = np.ones(len(rows), bool)
        for offset in around:
            start = assembly.points[rows] + radius * offset + sign * 1e-3 * normal
            free &= ~blocked(assembly, start, sign * normal, height)
        out[free] = sign
    return out


def blocked(
    assembly: Assembly, start: np.ndarray, direction: np.ndarray, length: float
) -> np.ndarray:
    """True where a ray (n, 3) meets a shell within `length` (Möller and Trumbore 1997)."""
    nodes = assembly.shells.nodes
    T = np.vstack([nodes[:, :3], nodes[:, [0, 2, 3]][nodes[:, 2] != nodes[:, 3]]])
    ray, row = _beside(assembly.points[T], start, direction, length)
    a, b, c = assembly.points[T[row]].transpose(1, 0, 2)
    e1, e2, d, s = b - a, c - a, direction[ray], start[ray] - a
    p = np.cross(d, e2)
    det = (e1 * p).sum(axis=1)
    ok = np.abs(det) > 1e-18
    inverse = np.where(ok, 1 / np.where(ok, det, 1), 0)
    u, q = (s * p).sum(axis=1) * inverse, np.cross(s, e1)
    v, t = (q * d).sum(axis=1) * inverse, (e2 * q).sum(axis=1) * inverse
    hit = ok & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < length)
    return np.bincount(ray[hit], minlength=len(start)) > 0


def _beside(
    x: np.ndarray, start: np.ndarray, direction: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (ray, triangle) that pass each other closely enough to meet."""
    middle = x.mean(axis=1)
    size = np.linalg.norm(x - middle[:, None], axis=2).max()
    step = np.arange(0.0, length + size, size)
    places = start[:, None] + step[:, None] * direction[:, None]
    near = cKDTree(middle).query_ball_point(places.reshape(-1, 3), 1.2 * size)
    ray = np.repeat(np.repeat(np.arange(len(start)), len(step)), [len(k) for k in near])
    row = np.concatenate([np.asarray(k, dtype=int) for k in near])
    pairs = np.unique(np.column_stack([ray, row]), axis=0)
    return pairs[:, 0], pairs[:, 1]
