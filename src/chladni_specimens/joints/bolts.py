"""Screws, holes, hems, grips against sliding, and masses."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from chladni.errors import ModelError
from chladni.geometry.facets import tangents
from chladni.geometry.mesh_quality import free_edges
from chladni.geometry.nearest import ShellChoice, ShellSurface
from chladni.model.added_points import next_id, with_points
from chladni.model.assembly import Assembly, Beams, Bushes, Masses, RigidBody, concatenated
from chladni.model.properties import BeamSection, Isotropic

from .builders import (
    REACH,
    STEEL,
    Joined,
    Joint,
    cell_carriers,
    tied,
    with_part,
)

_ALL = (1, 2, 3, 4, 5, 6)


def rim(surface: ShellSurface, place: np.ndarray, radius: float) -> np.ndarray:
    """Rows of the points round a hole: its rim, else free edges within `radius`, else a shell's.

    A hole is a closed free edge no wider than four radii whose middle is within two radii. The
    nearest shell replaces a bolt hole that the mesh does not resolve.
    """
    sides = free_edges(surface.nodes)
    if len(loop := _loop(surface.points, sides, place, radius)):
        return loop
    edge = np.unique(sides)
    near = edge[np.linalg.norm(surface.points[edge] - place, axis=1) <= radius]
    if len(near) >= 3:
        return near
    return np.unique(surface.nodes[surface.closest_points(place[None]).shell[0]])


def _loop(points: np.ndarray, sides: np.ndarray, place: np.ndarray, radius: float) -> np.ndarray:
    """Rows of the small closed edge nearest to a place; empty without such an edge."""
    near = sides[np.linalg.norm(points[sides[:, 0]] - place, axis=1) <= 6 * radius]
    if not len(near):
        return np.zeros(0, int)
    rows, ends = np.unique(near, return_inverse=True)
    ends = ends.reshape(-1, 2)
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(len(rows), len(rows)))
    piece = connected_components(graph, directed=False)[1]
    best, out = 2 * radius, np.zeros(0, int)
    for k in range(piece.max() + 1):
        ring, x = rows[piece == k], points[rows[piece == k]]
        closed = len(ring) >= 3 and (piece[ends[:, 0]] == k).sum() == len(ring)
        away = float(np.linalg.norm(x.mean(axis=0) - place))
        if closed and np.linalg.norm(np.ptp(x, axis=0)) <= 4 * radius and away <= best:
            best, out = away, ring
    return out


def _spider(id_: int, centre: int, rows: np.ndarray) -> RigidBody:
    return RigidBody(id_, int(centre), tuple(rows.tolist()), (_ALL,) * len(rows))


def screw(
    assembly: Assembly,
    place: np.ndarray,
    sheets: tuple[ShellChoice, ShellChoice],
    *,
    diameter: float = 0.006,
    mass: float = 0.012,
    material: Isotropic = STEEL,
    reach: float = REACH,
    name: str = "screws",
) -> Joined:
    """A bar between the rims of two holes (RBE2), with half of the mass at each end.

    The bar itself has little mass over the millimetre between two sheets; head and nut have the
    rest.
    """
    place = np.asarray(place, dtype=float)
    surfaces = tuple(ShellSurface.of(assembly, s) for s in sheets)
    closest = [s.closest_points(place[None]) for s in surfaces]
    for surface, foot in zip(surfaces, closest, strict=True):
        surface.within(foot, place[None], reach)
    rims = [rim(s, f.place[0], diameter) for s, f in zip(surfaces, closest, strict=True)]
    if common := set(rims[0].tolist()) & set(rims[1].tolist()):
        raise ModelError(f"the holes of a screw share grids {sorted(common)[:3]}; name two sheets")
    ends = _ends(closest[0].place[0], closest[1].place[0], closest[0].normal[0])
    grown, centres = with_points(assembly, ends)
    first = next_id(grown)
    spiders = tuple(_spider(first + k, centres[k], rims[k]) for k in range(2))
    grown = replace(grown, rigid=(*grown.rigid, *spiders))
    I = np.pi * diameter**4 / 64  # of a round bar
    section = BeamSection(material, np.pi * diameter**2 / 4, I, I, 0.0, 2 * I)
    grown = _with_bar(grown, first + 2, centres, section, name)
    bar = material.rho * np.pi * diameter**2 / 4 * float(np.linalg.norm(ends[1] - ends[0]))
    grown = with_masses(grown, centres, max(mass - bar, 0.0) / 2)
    far = max(float(f.distance[0]) for f in closest)
    x, y, z = ends.mean(axis=0).tolist()
    return grown, (
        Joint("screw", (x, y, z), (surfaces[0].name, surfaces[1].name), (first + 2,), far),
    )


def _ends(a: np.ndarray, b: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Ends of the bar: the feet, at least a millimetre apart."""
    gap = float(np.linalg.norm(b - a))
    if gap > 1e-3:
        return np.stack([a, b])
    axis = normal if gap < 1e-5 else (b - a) / max(gap, 1e-9)
    return (a + b) / 2 + np.outer([-0.5e-3, 0.5e-3], axis)


def _with_bar(
    assembly: Assembly, id_: int, nodes: np.ndarray, section: BeamSection, name: str
) -> Assembly:
    grown, part = with_part(assembly, name, section)
    axis = np.diff(grown.points[nodes], axis=0)
    up = tangents(axis / np.linalg.norm(axis))[0]
    new = Beams(
        np.array([id_]),
        nodes[None],
        np.array([part]),
        up,
        np.zeros((1, 2, 3)),
        np.zeros((1, 2, 6), bool),
    )
    return replace(grown, beams=concatenated(grown.beams, new))


def with_masses(assembly: Assembly, rows: np.ndarray, mass: float | np.ndarray) -> Assembly:
    """Point masses [kg] at these rows of points."""
    rows = np.atleast_1d(np.asarray(rows, dtype=np.int64))
    matrix = np.zeros((len(rows), 6, 6))
    matrix[:, :3, :3] = np.broadcast_to(mass, len(rows))[:, None, None] * np.eye(3)
    ids = next_id(assembly) + np.arange(len(rows))
    return replace(assembly, masses=concatenated(assembly.masses, Masses(ids, rows, matrix)))


def accelerometers(assembly: Assembly, ids: Sequence[int], mass: float = 0.005) -> Assembly:
    """The sensors' mass at these grids."""
    return with_masses(assembly, assembly.rows(list(ids)), mass)


def tied_hole(
    assembly: Assembly,
    place: np.ndarray,
    sheets: Sequence[ShellChoice],
    *,
    radius: float = 0.006,
    reach: float = REACH,
) -> Joined:
    """One RBE2 over the rims of an empty hole in all its sheets, which has no real counterpart."""
    place = np.asarray(place, dtype=float)
    surfaces = [ShellSurface.of(assembly, s) for s in sheets]
    closest = [s.closest_points(place[None]) for s in surfaces]
    for surface, foot in zip(surfaces, closest, strict=True):
        surface.within(foot, place[None], reach)
    rows = np.unique(
        np.concatenate([rim(s, f.place[0], radius) for s, f in zip(surfaces, closest, strict=True)])
    )
    grown, centre = with_points(assembly, np.mean([f.place for f in closest], axis=0))
    id_ = next_id(grown)
    grown = replace(grown, rigid=(*grown.rigid, _spider(id_, centre[0], rows)))
    x, y, z = grown.points[centre[0]].tolist()
    far = max(float(f.distance[0]) for f in closest)
    names = (surfaces[0].name, surfaces[-1].name)
    return grown, (Joint("tied hole", (x, y, z), names, (id_,), far),)


def grip(
    assembly: Assembly,
    places: np.ndarray,
    directions: np.ndarray,
    stiffness: np.ndarray,
    sheets: tuple[ShellChoice, ShellChoice],
    *,
    reach: float = REACH,
) -> Joined:
    """Springs k (u_a - u_b)·e between two sheets at one point each, so that rigid motion is free.

    Both ends are RBE3 grids at the same place, because a spring over a gap would resist rotation.

    Parameters
    ----------
    places, directions : (k, 3)   [m], unit vectors
    stiffness : (k,)              [N/m]
    """
    surfaces = tuple(ShellSurface.of(assembly, s) for s in sheets)
    ends, far = [], np.zeros(len(places))
    for surface in surfaces:
        closest = surface.closest_points(places)
        surface.within(closest, places, reach)
        far = np.maximum(far, closest.distance)
        assembly, rows = tied(assembly, places, cell_carriers(surface, closest))
        ends.append(rows)
    k = np.zeros((len(places), 6))
    k[:, 0] = stiffness
    none = np.zeros_like(k)
    ids = next_id(assembly) + np.arange(len(places))
    e = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    u, v = tangents(e)
    new = Bushes(ids, np.column_stack(ends), np.stack([e, u, v], axis=1), places, k, none, none)
    names = (surfaces[0].name, surfaces[1].name)
    joints = tuple(
        Joint("grip", tuple(p), names, (int(i),), float(d))
        for p, i, d in zip(places.tolist(), ids, far, strict=True)
    )
    return replace(assembly, bushes=concatenated(assembly.bushes, new)), joints


def along_line(line: np.ndarray, per_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit tangents (k, 3) of a polyline and the share of `per_length` at each of its points."""
    t = np.gradient(line, axis=0)
    length = np.linalg.norm(t, axis=1)
    return t / length[:, None], per_length * length
