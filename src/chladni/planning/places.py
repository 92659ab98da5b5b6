"""Where a sensor can be glued: flat, off edges and folds, with room above, reachable by hand."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import ModelError
from ..fem.locate import locate
from ..model.assembly import Assembly
from ..view.surface import Surface, surface

TILT = np.radians(35.0)  # of the four slanting lines of sight beside the straight one
FOOT, ROOM = 0.008, 0.03  # radius of a sensor's foot, height it needs [m]
RELATIVE = 400.0  # where the unit of length is unknown a foot is this part of the structure


@dataclass(frozen=True, eq=False)
class Places:
    """Grids where a sensor can sit, in an order in which any first few cover the structure.

    Attributes
    ----------
    ids : (n,) int          grids
    rows : (n,) int         rows of points
    points : (n, 3)         [m]
    normals : (n, 3)        unit normal, as the shells around the grid are oriented
    side : (n,)             +1, -1: the side of that normal which can be reached
    refused : {why: count}  grids of the surface that were not taken
    """

    ids: np.ndarray
    rows: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    side: np.ndarray
    refused: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.ids)


def find_places(
    assembly: Assembly,
    count: int = 300,
    *,
    foot: float | None = None,
    room: float | None = None,
    flat: float = 10.0,
    unit: str = "m",
) -> Places:
    """At most ``count`` places spread over the sheets, each farthest from those before it.

    Parameters
    ----------
    foot : radius that must be flat and free of edges, folds and joints [m]
    room : height that must be free above [m]
    flat : greatest root mean square angle of the surface within the foot [degree]
    unit : "" where lengths are in an unknown unit: foot and room are then parts of the structure

    Raises
    ------
    ModelError
        If no grid passes.
    """
    seen = surface(assembly, unit)
    foot = foot or (FOOT if unit else seen.size / RELATIVE)
    room = room or (ROOM if unit else 4 * foot)
    sheet = seen.faces[: len(assembly.shells)] if len(assembly.shells) else seen.faces
    if not len(sheet):
        raise ModelError("the model has no surface a sensor could be glued to, only lines")
    at = np.unique(sheet)
    normals, bend = _bend(seen, sheet, at, foot)
    smooth = bend <= np.sin(np.radians(flat)) ** 2
    clear = smooth.copy()
    clear[smooth] = _off_edges(seen, seen.points[at[smooth]], foot)
    refused = {
        "not flat": int((~smooth).sum()),
        "near an edge, fold or joint": int((smooth & ~clear).sum()),
    }
    if not clear.any():
        raise ModelError("no grid of the surface is flat and off the edges: refine the mesh")
    order = spread(seen.points[at[clear]], min(3 * count, int(clear.sum())))
    rows, n = at[clear][order], normals[clear][order]
    side = _reachable(seen, seen.points[rows], n, foot, room, count)
    good = np.flatnonzero(side)[:count]
    refused["not reachable"] = int((side[: good[-1]] == 0).sum()) if len(good) else len(rows)
    if not len(good):
        raise ModelError("no flat grid can be reached from outside")
    rows = rows[good]
    return Places(assembly.ids[rows], rows, seen.points[rows], n[good], side[good], refused)


def _bend(
    seen: Surface, sheet: np.ndarray, at: np.ndarray, foot: float
) -> tuple[np.ndarray, np.ndarray]:
    """Normal of each grid and the mean sin² of the surface's angle to it within a foot.

    The tensor Σ A n nᵀ of the faces is blind to their orientation; its first vector is the normal,
    with the sense that most of the faces around the grid have.
    """
    faces = Surface(seen.points, sheet)
    a = faces.areas()
    size = np.linalg.norm(a, axis=1)
    tensor = np.einsum("mi,mj,m->mij", a, a, 1 / np.maximum(size, 1e-300))
    own, sense = np.zeros((len(seen.points), 3, 3)), np.zeros((len(seen.points), 3))
    for k in range(4):
        np.add.at(own, sheet[:, k], tensor)
        np.add.at(sense, sheet[:, k], a)
    normals = np.linalg.eigh(own[at])[1][:, :, 2]
    normals *= np.where(np.einsum("ni,ni->n", normals, sense[at]) < 0, -1.0, 1.0)[:, None]
    centres = cKDTree(seen.points[sheet].mean(axis=1))
    pairs = cKDTree(seen.points[at]).sparse_distance_matrix(centres, foot, output_type="ndarray")
    wide = own[at]
    np.add.at(wide, pairs["i"], tensor[pairs["j"]])
    along = np.einsum("ni,nij,nj->n", normals, wide, normals)
    return normals, 1 - along / np.trace(wide, axis1=1, axis2=2)


def _off_edges(seen: Surface, points: np.ndarray, foot: float) -> np.ndarray:
    """True where no free edge, fold, part boundary, beam or solid joint is within a foot."""
    edges = seen.outline(20.0)
    a, b = seen.points[edges[:, 0]], seen.points[edges[:, 1]]
    dense = np.concatenate([a + t * (b - a) for t in (0.0, 0.25, 0.5, 0.75, 1.0)])
    if not len(dense):
        return np.ones(len(points), bool)
    return np.asarray(cKDTree(dense).query(points)[0] >= foot)


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """Order of ``count`` points in which each is the farthest from those before it (Gonzalez 1985).

    It begins at the point farthest from the middle; of points equally far the first is taken.
    """
    far = np.linalg.norm(points - points.mean(axis=0), axis=1)
    order = [_farthest(far)]
    far = np.linalg.norm(points - points[order[0]], axis=1)
    while len(order) < count:
        order.append(_farthest(far))
        far = np.minimum(far, np.linalg.norm(points - points[order[-1]], axis=1))
    return np.array(order)


def _farthest(far: np.ndarray) -> int:
    return int(np.argmax(far >= (1 - 1e-9) * far.max()))


def _reachable(
    seen: Surface, points: np.ndarray, normals: np.ndarray, foot: float, room: float, enough: int
) -> np.ndarray:
    """+1 or -1: the side of the normal that has room and is seen from outside; 0: neither (n,).

    Stops when ``enough`` have been found; the rest stays 0.
    """
    triangles = np.concatenate([seen.faces[:, [0, 1, 2]], seen.faces[:, [0, 2, 3]]])
    corners = seen.points[triangles[triangles[:, 1] != triangles[:, 2]]]
    sheet, out = Sheet.of(corners), np.zeros(len(points))
    lift = [
        locate(seen.points, seen.faces, points + side * room / 2 * normals).distance >= 0.4 * room
        for side in (1, -1)
    ]
    for k in range(len(points)):
        if np.count_nonzero(out) == enough:
            break
        for side, free in zip((1, -1), lift, strict=True):
            n = side * normals[k]
            if free[k] and sheet.clear(points[k] + 0.25 * foot * n, _sights(n)):
                out[k] = side
                break
    return out


def _sights(n: np.ndarray) -> np.ndarray:
    """Five lines of sight: along the normal and tilted to four sides (5, 3)."""
    t = np.cross(n, np.eye(3)[np.abs(n).argmin()])
    t /= np.linalg.norm(t)
    b = np.cross(n, t)
    tilted = [np.cos(TILT) * n + np.sin(TILT) * s for s in (t, -t, b, -b)]
    return np.array([n, *tilted])


@dataclass(frozen=True, eq=False)
class Sheet:
    """Triangles that may stand in a line of sight.

    Attributes
    ----------
    a, e1, e2 : (m, 3)   a corner and two edges [m]
    reach : (m,)         longest of the two edges [m]
    """

    a: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    reach: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray) -> "Sheet":
        """From the corners (m, 3, 3)."""
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        longest = np.maximum(np.linalg.norm(e1, axis=1), np.linalg.norm(e2, axis=1))
        return cls(corners[:, 0], e1, e2, longest)

    def clear(self, start: np.ndarray, directions: np.ndarray) -> bool:
        """True where a ray from the point meets no triangle, in any of the directions."""
        to = self.a - start
        square = np.einsum("ij,ij->i", to, to)
        return any(not self._hit(to, square, d) for d in directions)

    def _hit(self, to: np.ndarray, square: np.ndarray, d: np.ndarray) -> bool:
        """Whether the ray meets a triangle (Möller and Trumbore 1997, J. Graphics Tools 2(1))."""
        along = to @ d
        near = np.flatnonzero((square - along**2 <= self.reach**2) & (along >= -self.reach))
        to, e1, e2 = to[near], self.e1[near], self.e2[near]
        p, q = np.cross(d, e2), np.cross(-to, e1)
        det = np.einsum("ij,ij->i", p, e1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", -to, p) / det
            v = q @ d / det
            t = np.einsum("ij,ij->i", q, e2) / det
            inside = (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        return bool(inside.any())
