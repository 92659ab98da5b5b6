"""The nearest point of a set of shells: its shell, its triangle and the weights of its grids.

A quadrilateral is treated as the two triangles at its diagonal 1-3. Sample points cover every
shell: each point of a shell is within ``cover`` of one of its sample points. The shells with the
nearest sample points are tried first. All other shells that can be nearer than the best of these
are tried next.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self, cast
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import LabelError, ModelError
from ..model.assembly import Assembly
from .facets import tangents, unit
from .solid_faces import skin

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


NEAR_QUADS = 12  # quads around a place whose triangles are tried first
AT_ONCE = 20_000  # places whose nearest shells are in memory at a time, a third of a gigabyte
BLOCK = 256  # far places processed together: each may need thousands of shells
IN_LINE = 0.02  # nodes whose second extent is below this fraction of the first lie in a line

ShellChoice = str | int | np.ndarray | Sequence[int]  # part (name, id) or rows of shells


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """Nearest points of a surface to k places."""

    shell: np.ndarray  # (k,) int; rows of ``ShellSurface.nodes``
    place: np.ndarray  # (k, 3) [m]
    nodes: np.ndarray  # (k, 3) int; rows of points of the triangle
    weight: np.ndarray  # (k, 3) barycentric weights of these nodes
    distance: np.ndarray  # (k,) [m]
    normal: np.ndarray  # (k, 3) unit normal of the triangle, by the order of the shell's grids


@dataclass(frozen=True, eq=False)
class ShellSurface:
    """Shells that are searched for nearest points."""

    name: str
    points: np.ndarray  # (n, 3) all points of the assembly [m]
    nodes: np.ndarray  # (m, 4) rows of points
    rows: np.ndarray  # (m,) rows of ``assembly.shells``
    # tree, owner: sample points on the longer mid-lines of shells (k,), and their shells
    tree: "cKDTree" = field(repr=False)
    owner: np.ndarray = field(repr=False)
    # largest distance of a point of the shell from its sample point [m]
    cover: np.ndarray = field(repr=False)

    @classmethod
    def over(cls, name: str, points: np.ndarray, nodes: np.ndarray) -> Self:
        """A surface from points and cells, without an assembly."""
        return cls(name, points, nodes, np.arange(len(nodes)), *_spread(points[nodes]))

    @classmethod
    def whole(cls, assembly: Assembly) -> Self:
        """All shells of an assembly, and the outer faces of its solids; made once for each."""
        if assembly not in _WHOLE:
            faces = [skin(s.nodes, s.part)[0] for s in assembly.solids]
            nodes = np.concatenate([assembly.shells.nodes, *faces])
            _WHOLE[assembly] = cls.over("the structure", assembly.points, nodes)
        return cast(Self, _WHOLE[assembly])

    @classmethod
    def of(cls, assembly: Assembly, sheet: ShellChoice) -> Self:
        """The shells of a part, or the shells with these rows."""
        if isinstance(sheet, str | int):
            part = assembly.part(sheet)
            name, rows = assembly.parts[part].name, np.flatnonzero(assembly.shells.part == part)
        else:
            rows = np.asarray(sheet, dtype=int)
            parts = np.unique(assembly.shells.part[rows])
            name = " and ".join(assembly.parts[p].name for p in parts)
        if not len(rows):
            raise LabelError(f"{name or 'the selection'} has no shells to join to")
        nodes = assembly.shells.nodes[rows]
        return cls(name, assembly.points, nodes, rows, *_spread(assembly.points[nodes]))

    def closest_points(
        self,
        places: np.ndarray,
        normal: np.ndarray | None = None,
        cosine: float = 0.7,
        near: int = NEAR_QUADS,
    ) -> ClosestPoints:
        """The nearest point of the surface to each place (k, 3) [m].

        With a `normal` (k, 3) at each place, triangles of another direction (|cos| below `cosine`)
        do not count, and only the `near` nearest shells are tried. If no triangle remains, the
        distance is infinite.
        """
        places = np.atleast_2d(np.asarray(places, dtype=float))
        found = []
        for k in range(0, max(len(places), 1), AT_ONCE):
            some = slice(k, k + AT_ONCE)
            facing = None if normal is None else normal[some]
            found.append(vars(self._closest(places[some], facing, cosine, near)).values())
        return ClosestPoints(*(np.concatenate(column) for column in zip(*found, strict=True)))

    def _closest(
        self, places: np.ndarray, normal: np.ndarray | None, cosine: float, near: int
    ) -> ClosestPoints:
        k, count = len(places), min(near, len(self.owner))
        reach, at = (v.reshape(k, count) for v in self.tree.query(places, count))
        of = np.repeat(np.arange(k), count)
        closest = self._nearest(places, of, self.owner[at.ravel()], normal, cosine)
        if normal is None and count < len(self.owner):
            open_ = np.flatnonzero(closest.distance > reach[:, -1] - self.cover.max())
            for first in range(0, len(open_), BLOCK):
                self._improve(closest, places, open_[first : first + BLOCK])
        return closest

    def _improve(self, closest: ClosestPoints, places: np.ndarray, rows: np.ndarray) -> None:
        """Try every shell that may be nearer to some of the places than the shell found."""
        x, reach = places[rows], closest.distance[rows] + 1e-12
        near = self.tree.query_ball_point(x, reach + self.cover.max())
        of = np.repeat(np.arange(len(rows)), [len(n) for n in near])
        at = np.concatenate(near).astype(int)
        least = np.linalg.norm(x[of] - self.tree.data[at], axis=1) - self.cover[at]
        worth = least <= reach[of]
        found = self._nearest(x, of[worth], self.owner[at[worth]])
        for name, value in vars(found).items():
            getattr(closest, name)[rows] = value

    def _nearest(
        self,
        places: np.ndarray,
        of: np.ndarray,
        shell: np.ndarray,
        normal: np.ndarray | None = None,
        cosine: float = 0.0,
    ) -> ClosestPoints:
        """The nearest point to each place on its trial shells; ``of`` is their place, increasing.

        If points are equally near to 1e-12 m, the first counts.
        """
        triangles = self.nodes[shell][:, _HALVES].reshape(-1, 3)
        of, x = np.repeat(of, 2), self.points[triangles]
        weight = barycentric_foot(places[of], x)
        foot = np.einsum("ta,tai->ti", weight, x)
        distance = np.linalg.norm(foot - places[of], axis=-1)
        facing = unit(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))
        distance[~facing.any(axis=-1)] = np.inf  # a triangle's second half is a line
        if normal is not None:
            distance[np.abs(np.einsum("ti,ti->t", facing, normal[of])) < cosine] = np.inf
        rounded, begin = distance.round(12), np.flatnonzero(np.diff(of, prepend=-1))
        lowest = np.minimum.reduceat(rounded, begin)
        candidate = np.where(rounded == lowest[of], np.arange(len(of)), len(of))
        best = np.minimum.reduceat(candidate, begin)
        rows = (foot, triangles, weight, distance, facing)
        return ClosestPoints(shell[best // 2], *(v[best] for v in rows))

    def within(self, closest: ClosestPoints, places: np.ndarray, reach: float) -> None:
        """Refuse places farther than `reach` from the surface."""
        worst = int(closest.distance.argmax())
        if closest.distance[worst] > reach:
            x, y, z = 1e3 * np.atleast_2d(places)[worst]
            raise ModelError(
                f"a joint at ({x:.1f}, {y:.1f}, {z:.1f}) mm is "
                f"{1e3 * closest.distance[worst]:.1f} mm from {self.name}, "
                f"farther than {1e3 * reach:.1f} mm; move it or widen its reach"
            )

    def cells(self, closest: ClosestPoints) -> list[np.ndarray]:
        """Nodes of each place's shell; also of its neighbours if its own nodes lie in a line."""
        own = [np.unique(nodes) for nodes in self.nodes[closest.shell]]
        return [self._with_ring(n) if _in_line(self.points[n]) else n for n in own]

    def _with_ring(self, nodes: np.ndarray) -> np.ndarray:
        return np.unique(self.nodes[np.isin(self.nodes, nodes).any(axis=1)])

    def patch(self, place: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights ∫ N_i dA / πR² of a disc about the surface's nearest point.

        The disc is sampled at points of equal area. As the mesh is refined, nodes and weights
        converge to the integral over the disc. On a mesh coarser than the disc they are the shell's
        nodes.
        """
        centre = self.closest_points(place[None])
        u, v = tangents(centre.normal[0])
        closest = self.closest_points(centre.place + radius * (_DISC @ np.stack([u, v])))
        nodes, at = np.unique(closest.nodes, return_inverse=True)
        weight = np.bincount(at.ravel(), closest.weight.ravel()) / len(_DISC)
        keep = weight > 1e-9
        if keep.sum() < 3 or _in_line(self.points[nodes[keep]]):
            nodes = self._with_ring(nodes)
            return nodes, np.full(len(nodes), 1 / len(nodes))
        return nodes[keep], weight[keep]


_WHOLE = WeakKeyDictionary[Assembly, ShellSurface]()  # a tree of 100 000 cells takes a second


def _spread(x: np.ndarray) -> tuple["cKDTree", np.ndarray, np.ndarray]:
    """Sample points along the longer mid-line of each cell (m, 4, 3), closer than the usual size.

    The centre of a long cell may be far from a place near the cell. Returns a tree of the points,
    the cell of each, and the largest distance of any point of a cell from its sample point. A slice
    of a cell lies in the convex hull of its corners, so that a corner is the farthest point.
    """
    side = (x + np.roll(x, -1, axis=1)) / 2
    ends = [(side[:, 0], side[:, 2]), (side[:, 1], side[:, 3])]
    length = np.stack([np.linalg.norm(b - a, axis=1) for a, b in ends])
    longer = length.argmax(axis=0)[:, None]
    a, b = (np.where(longer == 0, p, q) for p, q in zip(*ends, strict=True))
    usual = max(float(np.median(length)) if length.size else 0.0, 1e-9)
    count = np.maximum(1, np.ceil(length.max(axis=0) / (1.5 * usual))).astype(int)
    owner = np.repeat(np.arange(len(x)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    h = (1 / count[owner])[:, None]
    t = (step[:, None] + 0.5) * h
    places = a[owner] + t * (b - a)[owner]
    turned = np.where((longer == 0)[..., None], x, np.roll(x, -1, axis=1))
    from scipy.spatial import cKDTree

    return cKDTree(places), owner, _reach(turned, places, owner, t, h)


def _reach(
    x: np.ndarray, places: np.ndarray, owner: np.ndarray, t: np.ndarray, h: np.ndarray
) -> np.ndarray:
    """Distance of the farthest corner (k,) of the slices t ± h/2 of the cells x (m, 4, 3) [m].

    Sides 0-3 and 1-2, which the mid-line does not cross, are cut in proportion. The triangles of a
    cell deviate by up to |x0 - x1 + x2 - x3| / 4 from the bilinear surface of these cuts.
    """
    X = x[owner]
    far = np.zeros(len(owner))
    for s in (t - h / 2, t + h / 2):
        for u, v in ((0, 3), (1, 2)):
            corner = X[:, u] + s * (X[:, v] - X[:, u])
            far = np.maximum(far, np.linalg.norm(corner - places, axis=1))
    bow = np.linalg.norm(X[:, 0] - X[:, 1] + X[:, 2] - X[:, 3], axis=1) / 4
    return far + np.where(h[:, 0] < 1, bow, 0.0)


_HALVES = np.array([(0, 1, 2), (0, 2, 3)])


def _disc() -> np.ndarray:
    """Points of equal area in the unit disc: the centre and three rings of 6, 12 and 18."""
    rings = [np.zeros((1, 2))]
    inner = 1.0
    for count in (6, 12, 18):
        outer = inner + count
        radius = np.sqrt((inner + outer) / 2 / 37)
        angle = 2 * np.pi * (np.arange(count) + 0.5) / count
        rings.append(radius * np.column_stack([np.cos(angle), np.sin(angle)]))
        inner = outer
    return np.vstack(rings)


_DISC = _disc()


def barycentric_foot(p: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Weights (..., 3) of the point of triangles x (..., 3, 3) nearest to p (..., 3).

    It is the projection inside the triangle, else the nearest point of the three sides (Ericson,
    Real-Time Collision Detection, 5.1.5).
    """
    a, b, c = (x[..., k, :] for k in range(3))
    n = np.cross(b - a, c - a)
    nn = np.maximum((n * n).sum(-1), 1e-60)
    w = np.stack(
        [(np.cross(v - u, p - u) * n).sum(-1) / nn for u, v in ((b, c), (c, a), (a, b))], axis=-1
    )
    options = [w, *(_on_side(p, x, k) for k in range(3))]
    closest = np.stack([np.einsum("...a,...ai->...i", o, x) for o in options])
    far = np.linalg.norm(closest - p, axis=-1)
    far[0] = np.where((w >= 0).all(-1) & (nn > 1e-50), far[0] - 1e-15, np.inf)
    best = far.argmin(axis=0)
    return np.take_along_axis(np.stack(options), best[None, ..., None], axis=0)[0]


def _on_side(p: np.ndarray, x: np.ndarray, k: int) -> np.ndarray:
    """Weights of the point of side k (from corner k to the next) nearest to p."""
    u, v = x[..., k, :], x[..., (k + 1) % 3, :]
    e = v - u
    t = np.clip(((p - u) * e).sum(-1) / np.maximum((e * e).sum(-1), 1e-30), 0, 1)
    w = np.zeros((*np.broadcast_shapes(p.shape[:-1], t.shape), 3))
    w[..., k], w[..., (k + 1) % 3] = 1 - t, t
    return w


def _in_line(x: np.ndarray) -> bool:
    extent = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
    return len(x) < 3 or extent[1] < IN_LINE * extent[0]


def nearest_parts(assembly: Assembly, places: np.ndarray, reach: float) -> list[tuple[int, int]]:
    """Ids of the two parts nearest to each place."""
    present = np.unique(assembly.shells.part)
    surfaces = [
        ShellSurface.of(assembly, np.flatnonzero(assembly.shells.part == p)) for p in present
    ]
    far = np.stack([surface.closest_points(places).distance for surface in surfaces], axis=1)
    order = np.argsort(far, axis=1, kind="stable")[:, :2]
    if order.shape[1] < 2 or np.any(np.take_along_axis(far, order, 1)[:, 1] > reach):
        second = np.sort(far, axis=1)[:, 1] if order.shape[1] == 2 else np.full(len(far), np.inf)
        worst = int(second.argmax())
        x, y, z = 1e3 * places[worst]
        raise ModelError(
            f"no second part within {1e3 * reach:.1f} mm of ({x:.1f}, {y:.1f}, {z:.1f}) mm: the "
            f"next is {1e3 * second[worst]:.1f} mm away; move the joint or widen its reach"
        )
    ids = [assembly.parts[p].id for p in present]
    return [(ids[a], ids[b]) for a, b in order.tolist()]
