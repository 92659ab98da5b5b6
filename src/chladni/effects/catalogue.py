"""Every effect proposes its own candidates from the deck and the set-up of the test."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..model.properties import Isotropic, Part, ShellSection
from . import points
from .effect import Effect
from .movable_attachment import NEIGHBOURS, ExtraSupport, Patch, PointMass, moved
from .ordinary import PartScale, ordinary
from .orthotropic_material import orthotropic
from .shell_groups import Sheet

NAMES = (
    "orthotropic-material",
    "sensor-mass",
    "point-mass",
    "extra-support",
    "suspension",
    "thickness-distribution",
    "sensor-fault",
)


FACING = 0.85  # cosine between normals that still lie in one face


@dataclass(frozen=True, eq=False)
class Setup:
    """What the catalogue may know of the test.

    Attributes
    ----------
    sensors : grid ids of the outputs;  rows (n_out, n) their directions in the structure
    hangers : grid ids
    weight : mass of the structure [kg]
    top : highest frequency of interest [Hz]
    """

    sensors: tuple[int, ...]
    hangers: tuple[int, ...]
    weight: float
    top: float


@dataclass(frozen=True, eq=False)
class Places:
    """Grids where something unknown may sit, with the surface normal there.

    ``rows`` (k, n) is translation along the normal; ``point`` (k, 3) [m].
    """

    grids: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    rows: sp.csr_array

    def __len__(self) -> int:
        return len(self.grids)

    def position(self, grid: int) -> int:
        """Position of a grid among them."""
        return int(np.flatnonzero(self.grids == grid)[0])

    def only(self, chosen: np.ndarray) -> "Places":
        """Some of them."""
        return Places(
            self.grids[chosen], self.normal[chosen], self.point[chosen], self.rows[chosen]
        )


def places(sheet: Sheet) -> Places:
    """All grids of shells."""
    assembly = sheet.structure.assembly
    shells = assembly.shells
    X = assembly.points[shells.nodes]
    n = np.cross(X[:, 2] - X[:, 0], X[:, 3] - X[:, 1])
    n = np.where(shells.triangle[:, None], np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]), n)
    total = np.zeros_like(assembly.points)
    for corner in range(4):
        np.add.at(total, shells.nodes[:, corner], n)
    length = np.linalg.norm(total, axis=1)
    at = np.flatnonzero(length > 0)
    normal = total[at] / length[at, None]
    rows = sheet.structure.along(assembly.ids[at], normal)
    moving = np.flatnonzero(np.diff(rows.indptr) > 0)
    return Places(
        assembly.ids[at[moving]], normal[moving], assembly.points[at[moving]], rows[moving]
    )


def spread(point: np.ndarray, most: int) -> np.ndarray:
    """Positions of at most ``most`` points, each the farthest from those before it."""
    if len(point) <= most:
        return np.arange(len(point))
    chosen = [int(np.argmin(((point - point.mean(axis=0)) ** 2).sum(axis=1)))]
    far = ((point - point[chosen[0]]) ** 2).sum(axis=1)
    for _ in range(most - 1):
        chosen.append(int(np.argmax(far)))
        far = np.minimum(far, ((point - point[chosen[-1]]) ** 2).sum(axis=1))
    return np.array(chosen)


def everywhere(sheet: Sheet, grids: Sequence[int]) -> sp.csr_array:
    """Rows of all three translations of each grid (3k, n)."""
    ids = np.repeat(np.asarray(grids), 3)
    return sheet.structure.along(ids, np.tile(np.eye(3), (len(grids), 1)))


def point_mass(sheet: Sheet, setup: Setup, spots: Places, k: int, tried: int) -> Effect:
    """A mass near one grid; median 3 % of the structure's."""
    m = points.strength("M", "kg", 0.03 * setup.weight, 1.2, (-1.5, -0.5, 0.5))
    area = patch(sheet, spots, k, np.eye(3))
    return PointMass(moved(m), places=tried, patch=area, **_there(sheet, spots, k))


def extra_support(sheet: Sheet, setup: Setup, spots: Places, k: int, tried: int) -> Effect:
    """A spring to ground along the normal near one grid."""
    K = points.strength("K", "N/m", stiffness_scale(setup), 2.0, (-2.0, 0.0, 2.0))
    n = spots.normal[k]
    area = patch(sheet, spots, k, n[None])
    return ExtraSupport(moved(K), places=tried, patch=area, direction=n, **_there(sheet, spots, k))


def _there(sheet: Sheet, spots: Places, k: int) -> dict[str, Any]:
    grid = int(spots.grids[k])
    return {"text": f"at grid {grid}", "grids": (grid,), "point": _tuple(spots.point[k])}


def patch(sheet: Sheet, spots: Places, k: int, directions: np.ndarray) -> Patch:
    """The grids round one of the places that lie in the same face of the sheet."""
    d = spots.point - spots.point[k]
    facing = np.abs(spots.normal @ spots.normal[k]) > FACING
    distance = np.where(facing, np.linalg.norm(d, axis=1), np.inf)
    near = np.argsort(distance, kind="stable")[:NEIGHBOURS]
    near = near[np.isfinite(distance[near])]
    n = spots.normal[k]
    e1 = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    e1 /= np.linalg.norm(e1)
    plane = np.stack([e1, np.cross(n, e1)])
    size = float(np.sort(distance)[1:5].mean())
    rows = tuple(
        sheet.structure.along(spots.grids[near], np.tile(axis, (len(near), 1)))
        for axis in directions
    )
    return Patch(spots.grids[near], d[near] @ plane.T, plane, spots.point[k], rows, size)


def stiffness_scale(setup: Setup) -> float:
    """Spring that makes a tenth of the structure's mass swing at a third of the top frequency."""
    return 0.1 * setup.weight * (2 * np.pi * setup.top / 3) ** 2


def sensor_mass(sheet: Sheet, setup: Setup) -> list[Effect]:
    """One mass for all sensors; median 0.4 % of the structure's mass each, at least 2 g."""
    if not setup.sensors:
        return []
    grids = tuple(sorted(set(setup.sensors)))
    scale = max(2e-3, 0.06 * setup.weight / len(grids))
    m = points.strength("M", "kg", scale, 1.3, (-2.0, -1.0, 0.0))
    text = f"at the {len(grids)} sensors"
    rows = everywhere(sheet, grids)
    return [points.SensorMass((m,), text, grids=grids, rows=rows, directions=np.eye(3))]


def suspension(sheet: Sheet, setup: Setup, normals: Places) -> list[Effect]:
    """Springs at the hangers, along the surface normal or along every direction."""
    if not setup.hangers:
        return []
    hangers = tuple(setup.hangers)
    where = {int(g): n for g, n in zip(normals.grids, normals.normal, strict=True)}
    normal = np.array([where.get(int(g), np.array([0.0, 0.0, 1.0])) for g in hangers])
    k = points.strength("K", "N/m", 0.1 * stiffness_scale(setup), 2.0, (-3.0, -1.5, 0.0, 1.5))
    text = f"at hangers {', '.join(map(str, hangers))}"
    along = sheet.structure.along(np.array(hangers), normal)
    n = len(hangers)
    return [
        points.Suspension((k,), text, grids=hangers, rows=along, directions=normal),
        points.Suspension(
            (k,), text + ", every direction", grids=tuple(np.repeat(hangers, 3)), places=2,
            rows=everywhere(sheet, hangers), directions=np.tile(np.eye(3), (n, 1)),
        ),
    ]  # fmt: skip


def grains(sheet: Sheet) -> list[Effect]:
    """Orthotropy of every isotropic material, axis 1 along each in-plane principal direction."""
    parts = sheet.structure.assembly.parts
    used = sorted(set(sheet.part.tolist()))
    by_material: dict[object, list[int]] = {}
    for k in used:
        if (material := isotropic(parts[k])) is not None:
            by_material.setdefault(material, []).append(k)
    out: list[Effect] = []
    for positions in by_material.values():
        inside = np.isin(sheet.part, positions)
        X = sheet.centre[inside] - np.average(
            sheet.centre[inside], axis=0, weights=sheet.area[inside]
        )
        directions = np.linalg.svd(X, full_matrices=False)[2][:1] if len(X) > 2 else np.eye(3)[:1]
        out += [orthotropic(sheet, tuple(positions), _nearest_axis(d)) for d in directions]
    return out


def isotropic(part: Part) -> Isotropic | None:
    """The isotropic sheet material of a part, if that is what it has."""
    if not isinstance(part.section, ShellSection):
        return None
    material = part.section.bending or part.section.membrane
    return material if isinstance(material, Isotropic) else None


def _nearest_axis(direction: np.ndarray) -> np.ndarray:
    """The direction itself, or the coordinate axis it all but is."""
    k = int(np.argmax(np.abs(direction)))
    return np.eye(3)[k] if abs(direction[k]) > 0.98 else direction


def defaults(sheet: Sheet) -> list[PartScale]:
    """E and rho of every material and t of every shell part: what a user may calibrate anyway."""
    parts = sheet.structure.assembly.parts
    used = sorted(set(sheet.part.tolist()))
    by_material: dict[int, list[int]] = {}
    for k in used:
        section = parts[k].section
        if isinstance(section, ShellSection):
            material = section.membrane or section.bending
            by_material.setdefault(id(material) if material is None else material.id, []).append(k)
    out = [ordinary(sheet, q, ks) for ks in by_material.values() for q in ("E", "rho")]
    return out + [ordinary(sheet, "t", [k]) for k in used]


def _tuple(point: np.ndarray) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])
