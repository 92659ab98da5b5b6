"""Shell with nodes on its edges: quadrilateral of eight nodes, triangle of six, curved.

V_i is the surface's normal at node i, β_i = θ_i x V_i, and d the offset:

    x = Σ N_i (x_i + d V_i)    n = Σ N_i V_i    u = Σ N_i (u_i + d β_i)    β = Σ N_i β_i

(Ahmad, Irons, Zienkiewicz, Int. J. Num. Meth. Eng. 2 (1970) 419-451). To first order in the
distance from the mid-surface the covariant strains, zero for rigid motions, are

    ε_ab = ½ (x,a · u,b + x,b · u,a)
    κ_ab = ½ (x,a · β,b + x,b · β,a + n,a · u,b + n,b · u,a)
    γ_a = x,a · β + n · u,a

Transverse shear is tied: MITC8 (Bathe, Dvorkin, Int. J. Num. Meth. Eng. 22 (1986) 697-722) and
MITC6 (Lee, Bathe, Computers and Structures 82 (2004) 945-962). The membrane strain is projected on
1, r, s (and rs), with ``VARYING_MEMBRANE`` of the rest. A curved element can then bend without
stretching. Constant strains and their forces stay as they are. A mid-side node that an element
lacks leaves a straight edge (:func:`.solid_shapes.with_middles`).
"""

from dataclasses import dataclass

import numpy as np

from ..geometry.solid_shapes import SURFACES, ShapeFamily, with_middles
from .shell_drilling import damped
from .shell_geometry import ShellGeometry
from .shell_membrane import invert

VARYING_MEMBRANE = 0.1  # of the strain that four points do not see: it holds their hourglass

_COLUMNS = {8: np.arange(8), 6: np.array([0, 1, 2, 4, 5, 6])}  # nodes among the eight of the arrays
_LEVI_CIVITA = np.zeros((3, 3, 3))
_LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1
_LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1
_G = 1 / np.sqrt(3)


@dataclass(frozen=True, eq=False)
class _Surface:
    """m elements of one kind: places, directors and how the given nodes move all k nodes."""

    family: ShapeFamily
    X: np.ndarray  # (m, k, 3) of the mid-surface [m]
    V: np.ndarray  # (m, k, 3)
    motion: np.ndarray  # (m, k, 6, 8, 6) of u + d β and β from the nodal motions of the arrays
    turn: np.ndarray  # (m, k, 8) of θ from them
    x: np.ndarray  # (m, 3) the element's x axis


def _surface(geo: ShellGeometry) -> _Surface:
    k = 6 if geo.triangle.any() else 8
    family, columns, m = SURFACES[k], _COLUMNS[k], len(geo)
    corners = k // 2
    edges = tuple((e, (e + 1) % corners) for e in range(corners))
    X, T = with_middles(geo.places[:, columns], edges)
    V = np.stack([_normal(family.gradients(xi)[:2] @ X) for xi in family.nodes], axis=1)
    turn = np.zeros((m, k, 8))
    turn[:, :, columns] = np.eye(k) if T is None else T
    spin = np.einsum("pqr,mkr->mkpq", _LEVI_CIVITA, V)  # β = S θ
    d = geo.offset[:, None, None]
    motion = np.zeros((m, k, 6, 8, 6))
    motion[:, :, :3, :, :3] = np.einsum("mkj,pq->mkpjq", turn, np.eye(3))
    motion[:, :, 3:, :, 3:] = np.einsum("mkj,mkpq->mkpjq", turn, spin)
    motion[:, :, :3, :, 3:] = d[..., None, None] * motion[:, :, 3:, :, 3:]
    return _Surface(family, X + d * V, V, motion, turn, geo.frames[:, 0])


def _normal(a: np.ndarray) -> np.ndarray:
    """Unit normal of two tangents (m, 2, 3)."""
    n = np.cross(a[:, 0], a[:, 1])
    return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])


def _covariant(s: _Surface, xi: np.ndarray) -> np.ndarray:
    """ε_rr ε_ss 2ε_rs κ_rr κ_ss 2κ_rs γ_r γ_s at a point from u + d β and β: (m, 8, k, 6)."""
    N, D = s.family.values(xi), s.family.gradients(xi)[:2]
    a, n, dn = D @ s.X, N @ s.V, D @ s.V
    B = np.zeros((len(a), 8, len(N), 6))
    for row, (p, q) in enumerate(((0, 0), (1, 1), (0, 1))):
        twice = 1 if p == q else 2
        both = twice / 2 * (D[q][:, None] * a[:, None, p] + D[p][:, None] * a[:, None, q])
        B[:, row, :, :3] = B[:, 3 + row, :, 3:] = both
        B[:, 3 + row, :, :3] = (
            twice / 2 * (D[q][:, None] * dn[:, None, p] + D[p][:, None] * dn[:, None, q])
        )
    for p in range(2):
        B[:, 6 + p, :, :3] = D[p][:, None] * n[:, None]
        B[:, 6 + p, :, 3:] = N[:, None] * a[:, None, p]
    return B


def _local(s: _Surface, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes t (m, 3, 3) of the tangent plane, P (m, 2, 2) with ∂/∂t_i = P_ia ∂/∂ξ_a, and dA (m,)."""
    a = s.family.gradients(xi)[:2] @ s.X
    n = _normal(a)
    x = s.x - np.einsum("mi,mi->m", s.x, n)[:, None] * n
    x /= np.linalg.norm(x, axis=1)[:, None]
    t = np.stack([x, np.cross(n, x), n], axis=1)
    det, P = invert(a @ t[:, :2].swapaxes(1, 2))
    return t, P, det


def _engineering(P: np.ndarray) -> np.ndarray:
    """(ε_1 ε_2 γ_12) from (ε_rr ε_ss 2ε_rs): (m, 3, 3)."""
    a, b, c, d = P[:, 0, 0], P[:, 0, 1], P[:, 1, 0], P[:, 1, 1]
    rows = ((a * a, b * b, a * b), (c * c, d * d, c * d), (2 * a * c, 2 * b * d, a * d + b * c))
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


Tie = tuple[tuple[tuple[float, float], ...], tuple[float, float]]  # mean over points, along a way


def _ties(k: int) -> list[Tie]:
    """Where and along what transverse shear is sampled."""
    if k == 8:
        along = [(((x, y),), (1.0, 0.0)) for y in (-1.0, 1.0) for x in (-_G, _G)]
        across = [(((x, y),), (0.0, 1.0)) for x in (-1.0, 1.0) for y in (-_G, _G)]
        middle = [(((-_G, 0.0), (_G, 0.0)), (1.0, 0.0)), (((0.0, -_G), (0.0, _G)), (0.0, 1.0))]
        return [*along, *across, *middle]
    centre = ((1 / 3, 1 / 3),)
    out: list[Tie] = [(centre, (1.0, 0.0)), (centre, (0.0, 1.0))]
    for q in ((1 - _G) / 2, (1 + _G) / 2):
        out += [(((q, 0.0),), (1.0, 0.0)), (((0.0, q),), (0.0, 1.0)), (((1 - q, q),), (-1.0, 1.0))]
    return out


def _fields(k: int, r: float, s: float) -> np.ndarray:
    """The tied fields (γ_r, γ_s) at a point (n, 2)."""
    if k == 8:
        one = [(f, 0.0) for f in (1, r, s, r * s, s * s)]
        return np.array([*one, *((0.0, f) for f in (1, r, s, r * s, r * r))])
    linear = [(f, 0.0) for f in (1, r, s)] + [(0.0, f) for f in (1, r, s)]
    return np.array([*linear, (r * s, -r * r), (s * s, -r * s)])


def _tied_shear(s: _Surface) -> np.ndarray:
    """Amplitudes of the tied fields from u + d β and β: (m, n, k, 6)."""
    k = s.X.shape[1]
    samples, known = [], []
    for points, way in _ties(k):
        B = [_covariant(s, np.array([*p, 0.0]))[:, 6:] for p in points]
        samples.append(np.einsum("a,maki->mki", way, sum(B) / len(B)))
        known.append(sum(_fields(k, *p) @ way for p in points) / len(points))
    return np.einsum("nj,mjki->mnki", np.linalg.inv(np.array(known)), np.stack(samples, axis=1))


def strains(geo: ShellGeometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B (m, g, 9, 48), dA (m, g) and N (g, 4) of corners, as :class:`.shell.Strains` has them."""
    s = _surface(geo)
    k, points = s.X.shape[1], s.family.rule[0]
    amplitude = _tied_shear(s)
    B = np.zeros((len(geo), len(points), 9, k, 6))
    omega = np.zeros((len(geo), len(points), 1, 8, 6))
    for g, xi in enumerate(points):
        _, P, _ = _local(s, xi)
        plane, raw = _engineering(P), _covariant(s, xi)
        tied = np.einsum("na,mnki->maki", _fields(k, *xi[:2]), amplitude)
        B[:, g, :3] = np.einsum("mab,mbki->maki", plane, raw[:, :3])
        B[:, g, 3:6] = np.einsum("mab,mbki->maki", plane, raw[:, 3:6])
        B[:, g, 6:8] = np.einsum("mab,mbki->maki", P, tied)
        omega[:, g, 0] = _twist(s, xi)
    weight, N = quadrature(geo)
    flat = B[:, :, :3].reshape(len(geo), len(points), -1)
    smooth = _projection(k, points, weight) @ flat
    B[:, :, :3] = (smooth + VARYING_MEMBRANE * (flat - smooth)).reshape(B[:, :, :3].shape)
    out = np.einsum("mgcki,mkijl->mgcjl", B, s.motion, optimize=True)
    out[:, :, 8:] = damped(omega, weight)
    return out.reshape(len(geo), len(points), 9, 48), weight, N


def _projection(k: int, points: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """F (Fᵀ W F)⁻¹ Fᵀ W (m, g, g): onto 1, r, s, and rs of a quadrilateral."""
    r, s = points[:, 0], points[:, 1]
    F = np.stack([np.ones_like(r), r, s, r * s][: k // 2], axis=1)
    W = weight[:, :, None] * F
    return np.asarray(F @ np.linalg.solve(F.T @ W, W.swapaxes(1, 2)))


def _twist(s: _Surface, xi: np.ndarray) -> np.ndarray:
    """ω - rz = ½ (t_2 · u,1 - t_1 · u,2) - n · θ at a point from nodal motions (m, 8, 6)."""
    t, P, _ = _local(s, xi)
    slope = P @ s.family.gradients(xi)[:2]
    spin = (slope[:, 0, :, None] * t[:, None, 1] - slope[:, 1, :, None] * t[:, None, 0]) / 2
    out = np.einsum("mki,mkijl->mjl", spin, s.motion[:, :, :3])
    out[:, :, 3:] -= np.einsum("k,mkj,mi->mji", s.family.values(xi), s.turn, t[:, 2])
    return np.asarray(out)


def corner_twist(geo: ShellGeometry) -> np.ndarray:
    """√|J|_i (ω_i - rz_i) at all nodes (m, k, 48); Σ |J| is that of the corners alone."""
    s = _surface(geo)
    share = 2.0 if s.X.shape[1] == 8 else 0.5
    rows = [np.sqrt(share * _local(s, xi)[2])[:, None, None] * _twist(s, xi)
            for xi in s.family.nodes]  # fmt: skip
    return np.stack(rows, axis=1).reshape(len(geo), -1, 48)


def quadrature(geo: ShellGeometry) -> tuple[np.ndarray, np.ndarray]:
    """dA (m, g) and the corners' linear functions N (g, 4)."""
    s = _surface(geo)
    points, w = s.family.rule
    weight = np.stack([_local(s, xi)[2] for xi in points], axis=1) * w
    r, q = points[:, 0], points[:, 1]
    if s.X.shape[1] == 6:
        return weight, np.stack([1 - r - q, r, q, 0 * r], axis=1)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return weight, np.prod(1 + points[:, None, :2] * signs, axis=2) / 4


def mass(geo: ShellGeometry, areal: np.ndarray, rotary: np.ndarray, coupled: bool) -> np.ndarray:
    """∫ m u·u + j β·β dA with m and j times dA at the points (m, g); lumped: m at the nodes.

    Lumped masses are the diagonal ∫ m N_i² dA, scaled to ∫ m dA: row sums are negative at corners.
    """
    s = _surface(geo)
    N = np.stack([s.family.values(xi) for xi in s.family.rule[0]])
    if coupled:
        shares = [np.einsum("mg,gi,gj->mij", w, N, N) for w in (areal, rotary)]
    else:
        turned = np.einsum("gk,mkj->mgj", N, s.turn)
        own = np.einsum("mg,mgj->mj", areal, turned**2)
        own *= (areal.sum(axis=1) / own.sum(axis=1))[:, None]
        return _at_nodes(geo, own[:, _COLUMNS[s.X.shape[1]]], s)
    out = np.zeros((len(geo), 48, 48))
    for share, part in zip(shares, (slice(0, 3), slice(3, 6)), strict=True):
        A = s.motion[:, :, part].reshape(len(geo), N.shape[1], 3, 48)
        moved = np.einsum("mij,mjpb->mipb", share, A)
        out += np.einsum("mipa,mipb->mab", A, moved, optimize=True)
    return out


def _at_nodes(geo: ShellGeometry, own: np.ndarray, s: _Surface) -> np.ndarray:
    """Point masses (m, k) at the given nodes, at the offset from them: (m, 48, 48)."""
    columns = _COLUMNS[own.shape[1]]
    out = np.zeros((len(geo), 8, 6, 8, 6))
    for k, column in enumerate(columns):
        A = np.zeros((len(geo), 3, 6))
        A[:, :, :3] = np.eye(3)
        spin = np.einsum("pqr,mr->mpq", _LEVI_CIVITA, s.V[:, k])
        A[:, :, 3:] = geo.offset[:, None, None] * spin
        out[:, column, :, column] = own[:, k, None, None] * (A.swapaxes(1, 2) @ A)
    return out.reshape(len(geo), 48, 48)
