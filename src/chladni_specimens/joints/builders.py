"""Joint builders: spot welds, adhesive beads, hems, screws, masses, on any assembly.

Welds and adhesive are solids whose corners follow the nearest shells (RBE3).  Screws are bars
between rigid spiders (RBE2), as in Echaniz Granado (2015), section 2.3. Every builder finds its
faces itself and reports its connections. Its error for a failed connection names place and
distance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.errors import ModelError
from chladni.geometry.facets import tangents
from chladni.geometry.nearest import ClosestPoints, ShellChoice, ShellSurface, nearest_parts
from chladni.model.added_points import next_id, with_points
from chladni.model.assembly import Assembly, Average, Solids, concatenated
from chladni.model.properties import Isotropic, Part, Section, SolidSection

from ..mesher.plane_curves import arc_length

REACH = 0.006  # a joint farther from its sheet is an error [m]
STEEL = Isotropic(210e9, 0.3, 7850.0, id=1)
MASSLESS_STEEL = Isotropic(210e9, 0.3, 0.0, id=3)
SOFT_ADHESIVE = Isotropic(6e6, 0.4, 1000.0, id=2)


@dataclass(frozen=True)
class Joint:
    """A connection made by a builder."""

    kind: str  # "spot weld", "adhesive", "screw", "hem", "tied hole", "grip"
    place: tuple[float, float, float]  # (3,) middle [m]
    sheets: tuple[str, str]  # names of the joined sheets
    elements: tuple[int, ...]  # ids of the solids, bars or springs
    distance: float  # farthest corner from its sheet [m]


Joined = tuple[Assembly, tuple[Joint, ...]]


def with_part(assembly: Assembly, name: str, section: Section) -> tuple[Assembly, int]:
    """The assembly with this part, and its position; an existing part of that name is reused."""
    for k, part in enumerate(assembly.parts):
        if part.name == name:
            return assembly, k
    part = Part(1 + max((p.id for p in assembly.parts), default=0), name, section)
    return replace(assembly, parts=(*assembly.parts, part)), len(assembly.parts)


def _with_hexahedra(assembly: Assembly, ids: np.ndarray, nodes: np.ndarray, part: int) -> Assembly:
    """The assembly with these hexahedra added to its own, as one family."""
    old = [s for s in assembly.solids if s.nodes.shape[1] == 8]
    rest = tuple(s for s in assembly.solids if s.nodes.shape[1] != 8)
    merged = concatenated(*old, Solids(ids, nodes, np.full(len(ids), part)))
    return replace(assembly, solids=(*rest, merged))


def averages(
    first: int, references: np.ndarray, carriers: Sequence[tuple[np.ndarray, np.ndarray]]
) -> tuple[Average, ...]:
    """One RBE3 per reference, which translates with the weighted rigid motion of its carriers."""
    T = (1, 2, 3)
    return tuple(
        Average(
            first + k,
            int(reference),
            T,
            tuple((int(row), T, float(w)) for row, w in zip(rows, weight, strict=True)),
        )
        for k, (reference, (rows, weight)) in enumerate(zip(references, carriers, strict=True))
    )


def tied(
    assembly: Assembly, places: np.ndarray, carriers: Sequence[tuple[np.ndarray, np.ndarray]]
) -> tuple[Assembly, np.ndarray]:
    """Grids at these places, each on an RBE3 over its carriers (rows, weights)."""
    grown, rows = with_points(assembly, places)
    means = averages(next_id(assembly), rows, carriers)
    return replace(grown, rigid=(*grown.rigid, *means)), rows


def cell_carriers(
    surface: ShellSurface, closest: ClosestPoints
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The nodes of the nearest shell, all of weight one (Echaniz Granado 2015, figure 1)."""
    return [(nodes, np.ones(len(nodes))) for nodes in surface.cells(closest)]


def hexahedra(
    assembly: Assembly,
    corners: np.ndarray,
    sheets: tuple[ShellSurface, ShellSurface],
    *,
    material: Isotropic,
    name: str,
    kind: str,
    reach: float = REACH,
    patch: float = 0.0,
) -> Joined:
    """Solids between two sheets, each corner on an RBE3; equal corners are shared.

    Parameters
    ----------
    corners : (n, 8, 3)   the first four lie towards sheets[0], the last four towards sheets[1]
    patch : radius over which the sheets are held, 0: the nodes of the nearest shell [m]
    """
    if not len(corners):
        return assembly, ()
    side = np.tile(np.repeat([0, 1], 4), len(corners))
    key = np.column_stack([corners.reshape(-1, 3).round(7), side])
    _, first, at = np.unique(key, axis=0, return_index=True, return_inverse=True)
    first, at = _in_order(first, at.ravel())
    places = corners.reshape(-1, 3)[first]
    carriers, far = _carriers(places, side[first], sheets, reach, patch, corners, first // 8)
    grown, rows = tied(assembly, places, carriers)
    grown, part = with_part(grown, name, SolidSection(material))
    ids = next_id(grown) + np.arange(len(corners))
    nodes = rows[at].reshape(-1, 8)
    grown = _with_hexahedra(grown, ids, _right_handed(grown.points, nodes), part)
    far = far[at].reshape(-1, 8).max(axis=1)
    names = (sheets[0].name, sheets[1].name)
    middles = corners.mean(axis=1)
    return grown, tuple(
        Joint(kind, tuple(m), names, (int(i),), float(d))
        for m, i, d in zip(middles.tolist(), ids, far, strict=True)
    )


def _in_order(first: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """np.unique's results renumbered by first appearance."""
    order = np.argsort(first)
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return first[order], back[at]


def _carriers(
    places: np.ndarray,
    side: np.ndarray,
    sheets: tuple[ShellSurface, ShellSurface],
    reach: float,
    patch: float,
    corners: np.ndarray,
    owner: np.ndarray,
) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]:
    """Rows and weights that carry each corner, and its distance from its sheet."""
    out: list = [None] * len(places)
    far = np.zeros(len(places))
    for k, surface in enumerate(sheets):
        mine = np.flatnonzero(side == k)
        closest = surface.closest_points(places[mine])
        surface.within(closest, places[mine], reach)
        far[mine] = closest.distance
        if patch:
            middle = corners[:, 4 * k : 4 * k + 4].mean(axis=1)
            discs = {o: surface.patch(middle[o], patch) for o in np.unique(owner[mine])}
            found = [discs[o] for o in owner[mine]]
        else:
            found = cell_carriers(surface, closest)
        for row, carrier in zip(mine, found, strict=True):
            out[row] = carrier
    return out, far


def _right_handed(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    x = points[nodes]
    up = np.cross(x[:, 1] - x[:, 0], x[:, 3] - x[:, 0])
    turned = np.einsum("ni,ni->n", up, x[:, 4] - x[:, 0]) < 0
    return np.where(turned[:, None], nodes[:, [4, 5, 6, 7, 0, 1, 2, 3]], nodes)


def _facing(
    assembly: Assembly, places: np.ndarray, a: ShellSurface, b: ShellSurface
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet on a, unit axes from a to b and the distances (k,) of the sheets there.

    Sheets that touch have no distance.  The axis is then the normal of a, and the distance half
    the sum of the thicknesses.
    """
    foot = a.closest_points(places)
    other = b.closest_points(foot.place)
    t = assembly.thickness()
    contact = (t[a.rows[foot.shell]] + t[b.rows[other.shell]]) / 2
    gap = np.linalg.norm(other.place - foot.place, axis=1)
    touching = gap < 0.2 * contact
    across = other.place - foot.place
    along = np.einsum("ki,ki->k", across, foot.normal)
    normal = foot.normal * np.where(along < 0, -1, 1)[:, None]
    axis = np.where(touching[:, None], normal, across / np.maximum(gap, 1e-12)[:, None])
    height = np.where(touching, contact, gap)
    start = np.where(
        touching[:, None], (foot.place + other.place) / 2 - axis * height[:, None] / 2, foot.place
    )
    return start, axis, height


def _centred(
    start: np.ndarray, axis: np.ndarray, distance: np.ndarray, height: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The axes, cut to a height in the middle of the distance; None keeps the whole distance."""
    h = distance if height is None else np.full(len(start), height)
    return start + axis * ((distance - h) / 2)[:, None], axis, h


def spot_welds(
    assembly: Assembly,
    places: np.ndarray,
    sheets: tuple[ShellChoice, ShellChoice] | None = None,
    *,
    side: float = 0.005,
    height: float | None = None,
    material: Isotropic = MASSLESS_STEEL,
    patch: float = 0.0,
    reach: float = REACH,
    name: str = "spot welds",
) -> Joined:
    """A hexahedron of the nugget's size at each place (k, 3), across the sheets' distance.

    With `height` the solid has that height in the middle of the distance: spots of mastic.

    Without `sheets` each place joins the two parts nearest to it. With `patch` the weld holds the
    sheets over a disc of that radius instead of the nearest shell.  Its stiffness is then
    independent of the mesh.
    """
    places = np.atleast_2d(np.asarray(places, dtype=float))
    pairs = [sheets] * len(places) if sheets else nearest_parts(assembly, places, reach)
    report: list[Joint] = []
    for pair in dict.fromkeys(map(_key, pairs)):
        mine = np.array([_key(p) == pair for p in pairs])
        these = next(p for p in pairs if _key(p) == pair)
        a, b = (ShellSurface.of(assembly, s) for s in these)
        for surface in (a, b):
            surface.within(surface.closest_points(places[mine]), places[mine], reach)
        corners = _nuggets(*_centred(*_facing(assembly, places[mine], a, b), height), side)
        assembly, joints = hexahedra(
            assembly,
            corners,
            (a, b),
            material=material,
            name=name,
            kind="spot weld",
            reach=reach,
            patch=patch,
        )
        report += joints
    return assembly, tuple(report)


def _key(pair: tuple[ShellChoice, ShellChoice]) -> tuple:
    return tuple(s if isinstance(s, str | int) else tuple(np.asarray(s).tolist()) for s in pair)


def _nuggets(start: np.ndarray, axis: np.ndarray, height: np.ndarray, side: float) -> np.ndarray:
    """Corners (k, 8, 3) of square bricks on their axes."""
    u, v = tangents(axis)
    turn = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * side / 2
    lower = start[:, None] + np.einsum("ca,aki->kci", turn, np.stack([u, v]))
    return np.concatenate([lower, lower + (axis * height[:, None])[:, None]], axis=1)


def adhesive_bead(
    assembly: Assembly,
    line: np.ndarray,
    sheets: tuple[ShellChoice, ShellChoice],
    *,
    width: float = 0.010,
    height: float | None = None,
    pitch: float | None = None,
    material: Isotropic = SOFT_ADHESIVE,
    reach: float = REACH,
    name: str = "adhesive",
) -> Joined:
    """A string of hexahedra along a polyline (k, 3) between two sheets.

    `height` is the bead's own, centred between the mid-surfaces; None fills their distance. The
    line is followed at `pitch`, or point by point without it; a line that ends where it starts is
    a closed bead.
    """
    a, b = (ShellSurface.of(assembly, s) for s in sheets)
    line = followed(np.asarray(line, dtype=float), pitch)
    for surface in (a, b):
        surface.within(surface.closest_points(line), line, reach)
    start, axis, h = _centred(*_facing(assembly, line, a, b), height)
    along = _tangent(line)
    across = np.cross(axis, along)
    across *= width / 2 / np.linalg.norm(across, axis=1, keepdims=True)
    top = start + axis * h[:, None]
    corners = np.stack(
        [
            x[rows] + sign * across[rows]
            for x in (start, top)
            for rows, sign in ((np.s_[:-1], -1), (np.s_[1:], -1), (np.s_[1:], 1), (np.s_[:-1], 1))
        ],
        axis=1,
    )
    return hexahedra(
        assembly, corners, (a, b), material=material, name=name, kind="adhesive", reach=reach
    )


def followed(line: np.ndarray, pitch: float | None) -> np.ndarray:
    """The polyline (k, 3) at even pitch, or unchanged without a pitch."""
    if len(line) < 2:
        raise ModelError(f"a bead needs a line of two points or more, {len(line)} given")
    if pitch is None:
        return line
    along = arc_length(line)
    at = np.linspace(0, along[-1], max(1, round(along[-1] / pitch)) + 1)
    return np.column_stack([np.interp(at, along, x) for x in line.T])


def _tangent(line: np.ndarray) -> np.ndarray:
    """Unit tangent at each point; the ends of a closed line share theirs."""
    t = np.gradient(line, axis=0) if len(line) > 2 else np.repeat(np.diff(line, axis=0), 2, axis=0)
    if len(line) > 2 and np.allclose(line[0], line[-1]):
        t[0] = t[-1] = line[1] - line[-2]
    return t / np.linalg.norm(t, axis=1, keepdims=True)
