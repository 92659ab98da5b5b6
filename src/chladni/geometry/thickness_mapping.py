"""Thickness from a forming mesh to a finite element mesh, part by part.

Each shell is sampled at its Gauss points, so that the integral of the thickness is preserved at
sharp folds. A sample takes the value of the nearest place of the formed sheet with a similar
normal, within a reach. Shells without such a place keep their thickness and are reported as
uncovered (the folded flange of a hem, which is flat in the blank).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError, named
from ..model.assembly import Assembly
from ..model.properties import ShellSection
from .cells import components
from .facets import cell_areas, cell_normals
from .formed_mesh import FormedMesh
from .nearest import ShellSurface

FACING = np.cos(np.deg2rad(45))
_NEAR, _FAR = 0.5 + np.array([1, -1]) / np.sqrt(12)
_GAUSS = np.array([_NEAR**2, _NEAR * _FAR, _FAR**2, _NEAR * _FAR])  # weights of the corners


@dataclass(frozen=True)
class PartMapping:
    """The result of the mapping for one part."""

    part: str
    source: str  # name or number of the formed part
    coverage: float  # share of the area with a partner
    distance_95: float  # 95th percentile of the distance to it [m]
    mean: float  # area mean of the mapped thickness [m]
    # mass_before, mass_after: [kg]
    mass_before: float
    mass_after: float
    round_trip: float  # rms of formed -> mesh -> formed, relative to t; nan for points, scans


@dataclass(frozen=True, eq=False)
class Mapped:
    """The assembly with mapped thickness, and the results for its parts."""

    assembly: Assembly
    parts: tuple[PartMapping, ...]

    @property
    def mass_before(self) -> float:
        """Mass of the mapped parts before the mapping [kg]."""
        return sum(p.mass_before for p in self.parts)

    @property
    def mass_after(self) -> float:
        """Mass of the mapped parts after the mapping [kg]."""
        return sum(p.mass_after for p in self.parts)


def shell_area(assembly: Assembly) -> np.ndarray:
    """Area of every shell (n,) [m²]."""
    return cell_areas(assembly.points, assembly.shells.nodes)


def shell_mass(assembly: Assembly) -> np.ndarray:
    """A (ρ t + m'') of every shell (n,) [kg]."""
    sections = [p.section for p in assembly.parts]
    rho, extra = np.zeros(len(sections)), np.zeros(len(sections))
    for k, section in enumerate(sections):
        if isinstance(section, ShellSection):
            material = section.membrane or section.bending
            rho[k], extra[k] = getattr(material, "rho", 0.0), section.nonstructural
    part = assembly.shells.part
    mean = _cell_mean(assembly.shells.nodes, assembly.shells.thickness)
    return shell_area(assembly) * (rho[part] * mean + extra[part] + assembly.shells.nonstructural)


def area_mean(assembly: Assembly, rows: np.ndarray) -> float:
    """Mean thickness over the area of these shells [m]."""
    area, shells = shell_area(assembly)[rows], assembly.shells
    mean = _cell_mean(shells.nodes[rows], shells.thickness[rows])
    return float((mean * area).sum() / area.sum())


def _cell_mean(nodes: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Mean over the corners; the repeated corner of a triangle counts once."""
    triangle = nodes[:, 2] == nodes[:, 3]
    return np.where(triangle, t[:, :3].mean(axis=1), t.mean(axis=1))


def samples(points: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points (n, 4, 3) of the cells, one near each corner, and cell normals (n, 3)."""
    x = points[nodes]
    at = np.stack([np.einsum("c,nci->ni", np.roll(_GAUSS, k), x) for k in range(4)], axis=1)
    return at, cell_normals(points, nodes)


def map_thickness(
    assembly: Assembly,
    formed: FormedMesh,
    *,
    pairs: Mapping[str, int] | None = None,
    reach: float | None = None,
    facing: float = FACING,
) -> Mapped:
    """Map the thickness of a formed mesh to the corners of the shells.

    Parameters
    ----------
    pairs : dict, optional
        Part of the assembly -> part id of the formed mesh. By default parts of the same name belong
        together. Without such parts, each connected sheet is assigned to the part on which it lies,
        so that two sheets a millimetre apart are never mixed.
    reach : float, optional
        Largest distance of a partner [m]; default a third of the median shell size, 1.5 to 6 mm.
    facing : float
        Least |cos| between the normals of partners.
    """
    reach = default_reach(assembly) if reach is None else reach
    sources = _sources(assembly, formed, pairs, reach, facing)
    if not sources:
        raise ModelError(
            f"none of the formed parts {named(sorted(set(formed.part.tolist())))} lies on a part "
            f"of the assembly within {1e3 * reach:.1f} mm; align the meshes or name the pairs"
        )
    t = assembly.shells.thickness.copy()
    report = []
    for part, (name, source) in sources.items():
        rows = np.flatnonzero(assembly.shells.part == part)
        values, far = _sampled(assembly, rows, source, reach, facing)
        t[rows] = np.where(np.isfinite(values), values, t[rows])
        after = replace(assembly, shells=replace(assembly.shells, thickness=t))
        report.append(_report(assembly, after, part, name, source, far, reach, facing))
    return Mapped(replace(assembly, shells=replace(assembly.shells, thickness=t)), tuple(report))


def default_reach(assembly: Assembly) -> float:
    """A third of the median shell size, 1.5 to 6 mm."""
    return float(np.clip(np.median(np.sqrt(shell_area(assembly))) / 3, 1.5e-3, 6e-3))


def _sources(
    assembly: Assembly,
    formed: FormedMesh,
    pairs: Mapping[str, int] | None,
    reach: float,
    facing: float,
) -> dict[int, tuple[str, FormedMesh]]:
    """Position of each part -> (name of the formed part, its mesh)."""
    present = [int(p) for p in np.unique(assembly.shells.part)]
    if pairs is not None:
        named = {assembly.part(name): id_ for name, id_ in pairs.items()}
    else:
        named = _same_name(assembly, formed, present)
    if named:
        label = formed.names
        return {p: (label.get(k, str(k)), formed.of_part(k)) for p, k in named.items()}
    if not len(formed.cells):
        return {p: ("points", formed) for p in present}
    return _by_place(assembly, formed, present, reach, facing)


def _same_name(assembly: Assembly, formed: FormedMesh, present: list[int]) -> dict[int, int]:
    ids = {name.strip().lower(): k for k, name in formed.names.items() if name.strip()}
    in_cells = set(formed.part.tolist())
    named = {p: ids.get(assembly.parts[p].name.strip().lower(), -1) for p in present}
    return {p: k for p, k in named.items() if k in in_cells}


def _by_place(
    assembly: Assembly, formed: FormedMesh, present: list[int], reach: float, facing: float
) -> dict[int, tuple[str, FormedMesh]]:
    """Connected sheets of the formed mesh, each assigned to the part whose shells lie on it."""
    piece = components(formed.cells, len(formed.points))[formed.cells[:, 0]]
    surfaces = {
        p: ShellSurface.of(assembly, np.flatnonzero(assembly.shells.part == p)) for p in present
    }
    owner: dict[int, list[int]] = {}
    for k in np.unique(piece):
        cells = formed.cells[piece == k]
        at, normal = samples(formed.points, cells[:: max(1, len(cells) // 400)])
        far = {
            p: np.median(s.closest_points(at[:, 0], normal, facing).distance)
            for p, s in surfaces.items()
        }
        best = min(far, key=lambda p: float(far[p]))
        if far[best] <= reach:
            owner.setdefault(best, []).append(int(k))
    return {
        p: (f"sheet {', '.join(map(str, pieces))}", _cells_of(formed, np.isin(piece, pieces)))
        for p, pieces in owner.items()
    }


def _cells_of(formed: FormedMesh, mine: np.ndarray) -> FormedMesh:
    return FormedMesh(
        formed.ids,
        formed.points,
        formed.cells[mine],
        formed.part[mine],
        formed.thickness[mine],
        formed.names,
    )


def values_at(
    formed: FormedMesh, places: np.ndarray, normal: np.ndarray, reach: float, facing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Thickness and distance (n,) of the nearest facing place; NaN and inf without a partner."""
    if not len(formed.cells):
        return _from_points(formed, places, reach)
    surface = ShellSurface.over("the formed mesh", formed.points, formed.cells)
    closest_points = surface.closest_points(places, normal, facing)
    t = np.einsum("nk,nk->n", formed.nodal[closest_points.nodes], closest_points.weight)
    return np.where(closest_points.distance <= reach, t, np.nan), closest_points.distance


def _from_points(
    formed: FormedMesh, places: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Inverse-distance mean of the four nearest points, for files without cells."""
    from scipy.spatial import cKDTree

    far, near = cKDTree(formed.points).query(places, min(4, len(formed.points)))
    far, near = far.reshape(len(places), -1), near.reshape(len(places), -1)
    weight = 1 / np.maximum(far, 1e-9) ** 2
    t = (formed.nodal[near] * weight).sum(axis=1) / weight.sum(axis=1)
    spacing = np.median(cKDTree(formed.points).query(formed.points, 2)[0][:, 1])
    return np.where(far[:, 0] <= max(reach, 2 * spacing), t, np.nan), far[:, 0]


def _sampled(
    assembly: Assembly, rows: np.ndarray, formed: FormedMesh, reach: float, facing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Thickness at the corners (n, 4), NaN without a partner, and distances (n, 4)."""
    at, normal = samples(assembly.points, assembly.shells.nodes[rows])
    t, far = values_at(formed, at.reshape(-1, 3), np.repeat(normal, 4, axis=0), reach, facing)
    t, far = t.reshape(-1, 4), far.reshape(-1, 4)
    return completed(t), far


def completed(t: np.ndarray) -> np.ndarray:
    """Fill missing samples of a shell with the mean of its others; NaN if fewer than two exist."""
    known = np.isfinite(t)
    count = known.sum(axis=1)
    mean = np.where(known, t, 0).sum(axis=1) / np.maximum(count, 1)
    filled = np.where(known, t, mean[:, None])
    return np.where((count >= 2)[:, None], filled, np.nan)


def _report(
    before: Assembly,
    after: Assembly,
    part: int,
    name: str,
    source: FormedMesh,
    far: np.ndarray,
    reach: float,
    facing: float,
) -> PartMapping:
    rows = np.flatnonzero(before.shells.part == part)
    area = shell_area(before)[rows]
    found = (far <= reach).sum(axis=1) >= 2
    close = far[np.isfinite(far)]
    return PartMapping(
        before.parts[part].name,
        name,
        float(area[found].sum() / area.sum()),
        float(np.percentile(close, 95)) if len(close) else float("inf"),
        area_mean(after, rows),
        float(shell_mass(before)[rows].sum()),
        float(shell_mass(after)[rows].sum()),
        round_trip(after, rows, source, facing),
    )


def round_trip(assembly: Assembly, rows: np.ndarray, source: FormedMesh, facing: float) -> float:
    """Rms of (t_back - t)/t over the formed cells, t_back mapped back from the assembly."""
    back = as_formed(assembly, rows)
    if not len(source.cells):
        return float("nan")
    at, normal = samples(source.points, source.cells)
    t, _ = values_at(back, at[:, 0], normal, np.inf, facing)
    true = _cell_mean(source.cells, source.thickness)
    error = (t - true) / true
    ok = np.isfinite(error)
    weight = source.area[ok]
    return float(np.sqrt((weight * error[ok] ** 2).sum() / weight.sum()))


def as_formed(assembly: Assembly, rows: np.ndarray) -> FormedMesh:
    """Shells of an assembly with their thickness, as a formed mesh."""
    shells = assembly.shells
    return FormedMesh(
        assembly.ids,
        assembly.points,
        shells.nodes[rows],
        np.array([assembly.parts[p].id for p in shells.part[rows]]),
        shells.thickness[rows],
        {p.id: p.name for p in assembly.parts},
    )
