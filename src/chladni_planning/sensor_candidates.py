"""Candidate places for sensors: flat, off edges and folds, with room above; across a beam."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from chladni.errors import ModelError
from chladni.fem.locate import shares_of
from chladni.geometry.facets import point_normals, tangents, unit, vector_areas
from chladni.geometry.nearest import ShellSurface
from chladni.geometry.sampling import farthest_point_sample
from chladni.model.assembly import Assembly
from chladni.view.surface import Surface, surface
from chladni.workflows.place_words import PlaceRules, centre_ids, place_rules

TILT = np.radians(35.0)  # of the four oblique lines of sight around the normal one
FOOT, ROOM = 0.008, 0.03  # radius of a sensor's foot, height it needs [m]
SMALLER = (1.0, 0.5, 0.25)  # of a foot, in turn, until a place passes
ALONG = 1 - 1e-6  # cosine of two directions that are one
RELATIVE = 400.0  # size of the structure over a foot, where the unit of length is unknown


@dataclass(frozen=True, eq=False)
class SensorCandidates:
    """Places where a sensor can sit, in an order in which any first few cover the structure.

    A place is a grid, or the centre of a shell that has no suitable corner.  A coarse mesh has no
    grid within a narrow strip.

    Attributes
    ----------
    ids : (n,) int          grid; for a centre the digit 1 before the number of its shell, padded
                            to the longest number of the deck (see :func:`centre_ids`)
    is_grid : (n,) bool
    nodes : (n, 4) int      rows of points around the place; a grid repeats itself
    weights : (n, 4)        of these
    points : (n, 3)         [m]
    normals : (n, 3)        unit normal, as the shells around the place are oriented
    side : (n,)             +1, -1: the side of that normal which can be reached
    straight : (n,) bool    free line along the normal: room for the rod of a shaker
    refused : {why: count}  places of the surface that were refused
    foot : share of a sensor's foot over which the surface is flat: 1, or 1/2 or 1/4 where no place
           passes with more; 0 on beams, which have no sheet
    cost : (n,)             of a sensor there, relative to other places
    fixed : (n,) text       label of the fixed sensor there, which points along the normal; else ""
    """

    ids: np.ndarray
    is_grid: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    side: np.ndarray
    straight: np.ndarray
    refused: Mapping[str, int]
    foot: float = 1.0
    cost: np.ndarray = field(default_factory=lambda: np.ones(0))
    fixed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=object))

    def __post_init__(self) -> None:
        if len(self.cost) != len(self.ids):
            object.__setattr__(self, "cost", np.ones(len(self.ids)))
        if len(self.fixed) != len(self.ids):
            object.__setattr__(self, "fixed", np.full(len(self.ids), "", dtype=object))

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def outward(self) -> np.ndarray:
        """Unit normal on the side that can be reached (n, 3)."""
        return self.normals * self.side[:, None]

    def moving(self, values: np.ndarray, which: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Values of the points (n_points, ...) at (some of) the places."""
        at = values[self.nodes[which]]
        return np.einsum("nc,nc...->n...", self.weights[which], at)


def find_sensor_candidates(
    assembly: Assembly,
    count: int = 300,
    *,
    foot: float | None = None,
    room: float | None = None,
    flat: float = 10.0,
    unit: str = "m",
    rules: PlaceRules | None = None,
) -> SensorCandidates:
    """At most ``count`` places spread over the sheets, each farthest from the earlier ones.

    A structure of beams alone has them at its grids, across the beams.

    Parameters
    ----------
    foot : radius that must be flat and free of edges, folds and joints [m]; half or a quarter of
           it, where no place passes with more
    room : height that must be free above [m]
    flat : greatest root mean square angle of the surface within the foot [degree]
    unit : "" where lengths are in an unknown unit: foot and room are then parts of the structure
    rules : on the surface of the assembly; its fixed sensors are places beyond the count

    Raises
    ------
    ModelError
        If no place passes.
    """
    seen = surface(assembly, unit)
    rules = rules or place_rules(assembly, seen)
    if not len(seen.faces):
        return _with_fixed(_across_beams(assembly, count, rules), assembly, rules)
    foot = foot or (FOOT if unit else seen.size / RELATIVE)
    room = room or (ROOM if unit else 4 * foot)
    sheet = seen.faces[: len(assembly.shells)] if len(assembly.shells) else seen.faces
    every = _every(assembly, seen, sheet)
    allowed, named = rules.allowed[every.spot], rules.named[every.spot]
    for share in SMALLER:
        normals, smooth, clear = _flat(seen, sheet, every, share * foot, flat)
        clear = (clear | named) & allowed
        if clear.any():
            break
    grid = every.is_grid & allowed
    refused = {
        "not allowed": int((every.is_grid & ~allowed).sum()),
        "not flat": int((~smooth & ~named & grid).sum()),
        "near an edge, fold or joint": int((smooth & ~clear & grid).sum()),
    }
    has_one = np.zeros(int(every.nodes.max()) + 1, bool)
    has_one[every.nodes[clear & every.is_grid, 0]] = True
    clear &= every.is_grid | ~has_one[every.nodes].any(axis=1)
    if not clear.any():
        where = "place of the surface" if allowed.all() else "allowed place"
        raise ModelError(
            f"no {where} is flat within {1e3 * SMALLER[-1] * foot:.2g} mm and as far "
            "from edges, folds and joints: refine the mesh, or give your own places by label"
            if unit
            else f"no {where} is flat and away from edges, folds and joints; give --units"
        )
    at = np.flatnonzero(clear)
    at = at[farthest_point_sample(every.points[at], min(3 * count, len(at)))]
    side, straight = _reachable(seen, every.points[at], normals[at], foot, room, count)
    side[named[at] & (side == 0)] = 1
    good = np.flatnonzero(side)[:count]
    refused["not reachable"] = int((side[: good[-1]] == 0).sum()) if len(good) else len(at)
    if not len(good):
        raise ModelError("no flat grid can be reached from outside")
    found = every.taken(at[good], normals[at[good]], side[good], straight[good], refused, share)
    return _with_fixed(replace(found, cost=rules.cost[every.spot[at[good]]]), assembly, rules)


def _with_fixed(
    places: SensorCandidates, assembly: Assembly, rules: PlaceRules
) -> SensorCandidates:
    """Name the places of fixed sensors; sensors at none of the places, or across it, are more."""
    held, fixed = rules.fixed, places.fixed.copy()
    more: list[int] = []
    for k in range(len(held.labels)):
        along = np.abs(places.normals @ held.directions[k]) > ALONG
        here = np.linalg.norm(places.points - held.points[k], axis=1) < 1e-6
        if (same := along & here & (fixed == "")).any():
            fixed[np.argmax(same)] = held.labels[k]
        else:
            more.append(k)
    if not more:
        return replace(places, fixed=fixed)
    nodes, weights = np.zeros((len(more), 4), int), np.zeros((len(more), 4))
    for i, share in enumerate(shares_of(assembly, held.grids[more], held.points[more])):
        nodes[i] = assembly.rows([share[0][0]])[0]
        nodes[i, : len(share)] = assembly.rows([grid for grid, _ in share])
        weights[i, : len(share)] = [weight for _, weight in share]
    free = 10 * int(centre_ids(assembly).max(initial=int(assembly.ids[-1])))
    ids = np.where(held.grids[more] > 0, held.grids[more], free + np.arange(len(more)))
    n, grid = len(more), held.grids[more] > 0
    added = {
        "ids": ids, "is_grid": grid, "nodes": nodes, "weights": weights,
        "points": held.points[more], "normals": held.directions[more], "side": np.ones(n),
        "straight": np.zeros(n, bool), "cost": np.where(grid, rules.cost[nodes[:, 0]], 1.0),
    }  # fmt: skip
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(places, name), new]) for name, new in added.items()
    }
    labels = np.array([held.labels[k] for k in more], dtype=object)
    return replace(places, **joined, fixed=np.concatenate([fixed, labels]))


def _across_beams(assembly: Assembly, count: int, rules: PlaceRules) -> SensorCandidates:
    """Grids of beams, each with the two axes of the basic frame that lie most across its beams."""
    nodes = assembly.beams.nodes
    if not len(nodes):
        raise ModelError("the model has no sheet, solid or beam for a sensor")
    along = assembly.points[nodes[:, 1]] - assembly.points[nodes[:, 0]]
    own = np.zeros((len(assembly.points), 3))
    for end in nodes.T:  # Σ l cos² to each axis
        np.add.at(own, end, along**2 / np.linalg.norm(along, axis=1)[:, None])
    grids = np.unique(nodes)
    refused = {"not allowed": int((~rules.allowed[grids]).sum())}
    grids = grids[rules.allowed[grids]]
    if not len(grids):
        raise ModelError("no beam has an allowed place for a sensor")
    few = farthest_point_sample(assembly.points[grids], min((count + 1) // 2, len(grids)))
    at = np.repeat(grids[few], 2)
    axes = np.argsort(own[grids[few]], axis=1, kind="stable")[:, :2].ravel()
    n = len(at)
    return SensorCandidates(
        assembly.ids[at], np.ones(n, bool), np.repeat(at[:, None], 4, axis=1),
        np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), assembly.points[at], np.eye(3)[axes], np.ones(n),
        np.ones(n, bool), refused, 0.0, rules.cost[at],
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Every:
    """All grids of the sheets, then the centres of all shells; as in :class:`SensorCandidates`."""

    ids: np.ndarray
    is_grid: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    spot: np.ndarray  # (n,) int: position among the points, then the faces, of the surface

    def taken(self, at: np.ndarray, *given: Any) -> SensorCandidates:
        """The sensor candidates at some of these places, with their own properties."""
        own = (self.ids, self.is_grid, self.nodes, self.weights, self.points)
        return SensorCandidates(*(value[at] for value in own), *given)


def _every(assembly: Assembly, seen: Surface, sheet: np.ndarray) -> _Every:
    grids = np.unique(sheet)
    own = np.repeat(grids[:, None], 4, axis=1)
    weights = np.tile([1.0, 0.0, 0.0, 0.0], (len(grids), 1))
    if not len(assembly.shells):  # skins of solids have no numbers: grids only
        sheet = sheet[:0]
    three = (sheet[:, 2] == sheet[:, 3])[:, None]
    centre = np.where(three, [1 / 3, 1 / 3, 1 / 3, 0.0], 0.25)
    nodes, weights = np.concatenate([own, sheet]), np.concatenate([weights, centre])
    return _Every(
        np.concatenate([assembly.ids[grids], centre_ids(assembly)[: len(sheet)]]),
        np.arange(len(nodes)) < len(grids),
        nodes,
        weights,
        np.einsum("nc,nci->ni", weights, seen.points[nodes]),
        np.concatenate([grids, len(seen.points) + np.arange(len(sheet))]),
    )


def _flat(
    seen: Surface, sheet: np.ndarray, every: _Every, foot: float, flat: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals of all places; masks of places flat within a foot, and also off the edges."""
    normals, bend = _bend(seen, sheet, every, foot)
    smooth = bend <= np.sin(np.radians(flat)) ** 2
    clear = smooth.copy()
    clear[smooth] = _off_edges(seen, every.points[smooth], foot)
    return normals, smooth, clear


def _bend(
    seen: Surface, sheet: np.ndarray, every: _Every, foot: float
) -> tuple[np.ndarray, np.ndarray]:
    """Normal of each place and the mean sin² of the surface's angle to it within a foot.

    That mean is 1 - nᵀ (Σ A n nᵀ) n / Σ A, independent of the orientation of the faces.
    """
    from scipy.spatial import cKDTree

    a = vector_areas(seen.points, sheet)
    tensor = np.einsum("mi,mj->mij", a, unit(a))
    own = np.zeros((len(seen.points), 3, 3))
    for k in range(4):
        np.add.at(own, sheet[:, k], tensor)
    grids, centres = every.nodes[every.is_grid, 0], int((~every.is_grid).sum())
    wide = np.concatenate([own[grids], tensor[:centres]])
    normals = np.concatenate([point_normals(seen.points, sheet)[grids], unit(a[:centres])])
    middle = cKDTree(seen.points[sheet].mean(axis=1))
    pairs = cKDTree(every.points).sparse_distance_matrix(middle, foot, output_type="ndarray")
    np.add.at(wide, pairs["i"], tensor[pairs["j"]])
    along = np.einsum("ni,nij,nj->n", normals, wide, normals)
    return normals, 1 - along / np.trace(wide, axis1=1, axis2=2)


def _off_edges(seen: Surface, points: np.ndarray, foot: float) -> np.ndarray:
    """True where no free edge, fold, part boundary, beam or solid joint is within a foot."""
    from scipy.spatial import cKDTree

    edges = seen.outline(20.0)
    a, b = seen.points[edges[:, 0]], seen.points[edges[:, 1]]
    dense = np.concatenate([a + t * (b - a) for t in (0.0, 0.25, 0.5, 0.75, 1.0)])
    if not len(dense):
        return np.ones(len(points), bool)
    return cKDTree(dense).query(points)[0] >= foot


def _reachable(
    seen: Surface, points: np.ndarray, normals: np.ndarray, foot: float, room: float, enough: int
) -> tuple[np.ndarray, np.ndarray]:
    """Side +1 or -1 of the normal that has room and is seen from outside, 0 for neither (n,).

    The second array is True where the line of sight along the normal is free (n,) bool. The search
    stops when ``enough`` places are found; the rest stay 0.
    """
    triangles = np.concatenate([seen.faces[:, [0, 1, 2]], seen.faces[:, [0, 2, 3]]])
    corners = seen.points[triangles[triangles[:, 1] != triangles[:, 2]]]
    blocking, out, straight = (
        Obstacles.of(corners),
        np.zeros(len(points)),
        np.zeros(len(points), bool),
    )
    all_faces = ShellSurface.over("the structure", seen.points, seen.faces)
    lift = [
        all_faces.closest_points(points + side * room / 2 * normals).distance >= 0.4 * room
        for side in (1, -1)
    ]
    for k in range(len(points)):
        if np.count_nonzero(out) == enough:
            break
        for side, free in zip((1, -1), lift, strict=True):
            n = side * normals[k]
            t, b = tangents(n)
            tilted = [np.cos(TILT) * n + np.sin(TILT) * s for s in (t, -t, b, -b)]
            start, sights = points[k] + 0.25 * foot * n, np.array([n, *tilted])
            if free[k] and blocking.clear(start, sights):
                out[k], straight[k] = side, blocking.clear(start, sights[:1])
                break
    return out, straight


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Triangles that may stand in a line of sight."""

    # a, e1, e2: (m, 3) a corner and two edges [m]
    a: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    reach: np.ndarray  # (m,) longest of the two edges [m]

    @classmethod
    def of(cls, corners: np.ndarray) -> "Obstacles":
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
        """True if the ray meets a triangle (Möller and Trumbore 1997, J. Graphics Tools 2(1))."""
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
