"""Hidden effects of the catalogue, of any size; effects of size 1 are weak."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from chladni.effects.calibration_parameters import scaled as sheet_scaled
from chladni.effects.calibration_parameters import value
from chladni.effects.membrane_prestress import WAYS, critical_force, prestressed, tensors
from chladni.errors import ModelError
from chladni.geometry.facets import cell_areas, cell_normals, unit
from chladni.model.assembly import Assembly
from chladni.model.ground_springs import with_ground_bushes
from chladni.model.properties import Isotropic, Orthotropic, Part, ShellSection
from chladni_bench import scaled_parts

from .hidden import Hidden, Site, near_outputs, with_lumps
from .mesh_transfer import nearest_rows
from .response_of_article import Coupling

STEEP = 0.95  # cosine between normal and material axis above which a shell keeps its own axis
FEWEST, CRACKED = 6, 4  # shells of a patch and of a crack, at least
Kind = Callable[[Site, np.random.Generator, float], Hidden]


def nothing(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """No effect: scatter alone."""
    return Hidden(site.article, {})


def calibration(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A change of E of one part by 6 to 12 % at size 1."""
    part = site.part(rng)
    factor = float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.06, 0.12) * size))
    return Hidden(
        scaled_parts(site.article, {part: {"E": factor}}), {"part": part, "value": factor}
    )


def point_mass(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A point mass of 1.5 to 3 % of the article's mass."""
    row, m = site.row(rng), float(rng.uniform(0.015, 0.03)) * site.mass * size
    truth = {"value": m, "point_m": site.article.points[row].tolist()}
    return Hidden(with_lumps(site.article, np.array([row]), m), truth)


def extra_support(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A spring to ground across the sheet or tube, 5 to 50 % of m ω_1²."""
    row, k = site.row(rng), float(np.exp(rng.uniform(-3.0, -0.7))) * site.scale * size
    n = site.normal(row, rng)
    truth = {"value": k, "point_m": site.article.points[row].tolist(), "direction": n.tolist()}
    return Hidden(with_ground_bushes(site.article, np.array([row]), n[None], k), truth)


def sensor_mass(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Sensors of together 2 to 4 % of the mass, none of it on the balance."""
    rows = near_outputs(site)
    m = float(rng.uniform(0.02, 0.04)) * site.mass * size / len(rows)
    return Hidden(with_lumps(site.article, rows, m), {"value": m}, unweighed=m * len(rows))


def suspension(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A spring to ground across the sheet at every hanger, each 2 to 8 % of m ω_1².

    On a frame of tubes, which lies flat, they act along z.
    """
    a = site.article
    every = np.arange(len(a.parts))
    rows = np.array([_nearest(a, every, x) for x in site.hangers])
    k = float(np.exp(rng.uniform(-3.9, -2.5))) * site.scale * size
    n = np.array([site.up(int(r)) for r in rows])
    return Hidden(with_ground_bushes(a, rows, n, k), {"value": k})


def _nearest(a: Assembly, parts: np.ndarray, point: np.ndarray) -> int:
    """Row nearest to a place among the points of any shell or beam."""
    rows = [int(nearest_rows(a, int(p), point[None])[0]) for p in parts if _has_points(a, int(p))]
    return min(rows, key=lambda r: float(np.linalg.norm(a.points[r] - point)))


def _has_points(a: Assembly, p: int) -> bool:
    return bool((a.shells.part == p).any() or (a.beams.part == p).any())


def thinning(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A patch of a sheet thinner by 12 to 25 % in its middle, t (1 - α e^(-d²/2R²))."""
    a, part = site.article, site.part(rng)
    if not (a.shells.part == a.part(part)).any():
        raise ModelError(f"part {part} has no sheet to thin")
    centre = a.points[rng.choice(site.rows(part))]
    R = float(rng.uniform(0.06, 0.12)) * site.size * min(size, 1.6) ** 0.5
    alpha = min(0.45, float(rng.uniform(0.12, 0.25)) * size)
    q = np.exp(-((a.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    mine = (a.shells.part == a.part(part))[:, None]
    t = a.shells.thickness * np.where(mine, 1 - alpha * q[a.shells.nodes], 1.0)
    truth = {"point_m": centre.tolist(), "value": alpha, "radius_m": R, "part": part}
    return Hidden(replace(a, shells=replace(a.shells, thickness=t)), truth)


def orthotropic(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Rolled sheets: E1/E2 = e^±(0.12 to 0.3), G12 changed by up to 15 %."""
    a, rolled = site.article, [site.article.part(name) for name in site.rolled]
    ratio = float(rng.choice([-1, 1]) * rng.uniform(0.12, 0.3)) * min(size, 2.0)
    shear = float(np.exp(rng.uniform(-0.15, 0.15) * min(size, 2.0)))
    parts = list(a.parts)
    for p in rolled:
        m = sheet_of(a, p)
        G = m.shear_modulus * shear
        E1, E2 = m.E * np.exp(ratio / 2), m.E * np.exp(-ratio / 2)
        Gz, nu12 = m.shear_modulus, m.nu * np.sqrt(E1 / E2)
        orthotropic = Orthotropic(E1, E2, nu12, G, Gz, Gz, m.rho)
        parts[p] = parts[p].with_section(membrane=orthotropic, bending=orthotropic)
    first = sheet_of(a, rolled[0])
    truth = {
        "E1": first.E * np.exp(ratio / 2),
        "E2": first.E * np.exp(-ratio / 2),
        "G12": first.shear_modulus * shear,
        "parts": list(site.rolled),
    }
    mine = np.isin(a.shells.part, rolled) & (
        np.abs(cell_normals(a.points, a.shells.nodes) @ site.material_axis) < STEEP
    )
    shells = replace(a.shells, axis=np.where(mine[:, None], site.material_axis, a.shells.axis))
    return Hidden(replace(a.with_parts(tuple(parts)), shells=shells), truth)


def sheet_of(a: Assembly, p: int) -> Isotropic:
    """Isotropic material of a part that is a sheet."""
    section = a.parts[p].section
    assert isinstance(section, ShellSection)
    assert isinstance(section.membrane, Isotropic)
    return section.membrane


def sensor_fault(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """One channel with a wrong factor or sign."""
    at = int(rng.integers(len(site.outputs)))
    gain = float(rng.choice([-1.0, 0.5, 0.7, 1.4, 2.0]))

    def spoil(values: np.ndarray) -> np.ndarray:
        wrong = values.copy()
        wrong[:, at] *= gain
        return wrong

    truth = {"channel": site.outputs.labels[at], "value": gain}
    return Hidden(site.article, truth, spoil=spoil)


def local_resonator(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A mass on a spring and a dashpot, m s² (k + cs)/(m s² + cs + k), tuned into the band."""
    row = site.row(rng)
    n = site.normal(row, rng)
    m = float(rng.uniform(0.005, 0.01)) * site.mass * size
    f = float(np.exp(rng.uniform(np.log(1.3 * site.first), np.log(0.8 * site.f_max))))
    k, c = m * (2 * np.pi * f) ** 2, 2 * 0.02 * m * 2 * np.pi * f

    def stiffness(s: np.ndarray) -> np.ndarray:
        return np.asarray((m * s**2 * (k + c * s) / (m * s**2 + c * s + k))[:, None, None])

    truth = {"value": m, "f": f, "point_m": site.article.points[row].tolist()}
    coupling = Coupling(np.array([row]), n[None, None], stiffness)
    return Hidden(site.article, truth, (coupling,), unweighed=-m)


def stiffness_patch(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A disc of a sheet with E times e^-(0.5 to 0.8) and unchanged mass."""
    mine, truth = disc(site, rng)
    factor = float(np.exp(-rng.uniform(0.5, 0.8) * min(size, 2.5)))
    article = _with_disc(site.article, mine, "E", factor)
    return Hidden(article, {**truth, "value": factor})


def mass_patch(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """An added mass of 2 to 4 %, spread evenly over a disc of a sheet."""
    mine, truth = disc(site, rng)
    a, m = site.article, float(rng.uniform(0.02, 0.04)) * site.mass * size
    area, rho = cell_areas(a.points, a.shells.nodes), value(a.parts[a.part(truth["part"])], "rho")
    bare = rho * float((area * a.thickness())[mine].sum())
    return Hidden(_with_disc(a, mine, "rho", 1 + m / bare), {**truth, "value": m})


def disc(site: Site, rng: np.random.Generator) -> tuple[np.ndarray, dict[str, Any]]:
    """Shells (m,) bool of one part round a point of it, ``FEWEST`` at least, and the place."""
    a, part = site.article, site.part(rng)
    of_part = a.shells.part == a.part(part)
    if not of_part.any():
        raise ModelError(f"part {part} has no sheet for a patch")
    centre = a.points[rng.choice(site.rows(part))]
    d = np.linalg.norm(a.points[a.shells.nodes].mean(axis=1) - centre, axis=1)
    R = max(float(rng.uniform(0.12, 0.2)) * site.size, float(np.sort(d[of_part])[:FEWEST][-1]))
    return of_part & (d <= R), {"point_m": centre.tolist(), "radius_m": R, "part": part}


def _with_disc(a: Assembly, mine: np.ndarray, quantity: str, factor: float) -> Assembly:
    """The article with E or rho of some shells of one part times a factor."""
    old = a.parts[int(a.shells.part[mine][0])]
    new = replace(
        sheet_scaled(old, quantity, factor), id=1 + max(p.id for p in a.parts), name="patch"
    )
    part = np.where(mine, len(a.parts), a.shells.part)
    return replace(a, parts=(*a.parts, new), shells=replace(a.shells, part=part))


def prestress(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A membrane force in a sheet, 0.2 to 0.45 of buckling at size 1, of either sign.

    The force in one direction is 0 to 1 times the force in the other.
    """
    a, name = site.article, site.part(rng)
    part = a.part(name)
    if not (a.shells.part == part).any():
        raise ModelError(f"part {name} has no sheet for a membrane force")
    ways = dict(zip(WAYS, tensors(a, part), strict=True))
    first, second = reversed(WAYS) if rng.integers(2) else WAYS
    less = float(rng.uniform(0, 1))
    tensor = ways[first] + less * ways[second]
    share = float(rng.choice([-1, 1]) * min(rng.uniform(0.2, 0.45) * size, 0.7))
    N = share * critical_force(a, part, tensor)
    truth = {f"N {first}": N, f"N {second}": less * N, "value": N, "part": name, "share": share}
    return Hidden(prestressed(a, part, tensor, N), truth)


def crack(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A line of shells across the sheet that lose most bending but no membrane stiffness.

    Its place is the middle of these shells, because the sheet may end before the line does. Its
    hinge is the length of sheet that bends as much.
    """
    a = site.article
    length = float(rng.uniform(0.12, 0.2)) * site.size * float(np.clip(size, 1.0, 3.0))
    for _ in range(50):
        row, angle = site.row(rng), rng.uniform(-np.pi / 6, np.pi / 6)
        p, mine = _along(site, row, angle, length)
        if mine.sum() >= CRACKED:
            break
    kept = 1 / (1 + 3 * size**2)
    section = a.parts[p].section
    assert isinstance(section, ShellSection)
    new = Part(1 + max(x.id for x in a.parts), "cracked", replace(section, bending_ratio=kept))
    shells = replace(a.shells, part=np.where(mine, len(a.parts), a.shells.part))
    middle = a.points[a.shells.nodes[mine]].mean(axis=1)  # edges and holes cut it short
    area, reach = cell_areas(a.points, a.shells.nodes)[mine], _longest(middle)
    across = float(area.sum() / (np.ptp(middle @ reach) + np.sqrt(area).mean()))
    truth = {
        "kept": kept,
        "hinge": across * (1 / kept - 1),
        "point_m": middle.mean(axis=0).tolist(),
        "length_m": float(np.linalg.norm(np.ptp(middle, axis=0))),
        "shells": int(mine.sum()),
    }
    return Hidden(replace(a, parts=(*a.parts, new), shells=shells), truth)


def _along(site: Site, row: int, angle: float, length: float) -> tuple[int, np.ndarray]:
    """The part at a point; its shells (m,) bool on a line ``angle`` from the part's cross axis."""
    a, n = site.article, site.normal(row)
    p = int(a.shells.part[(a.shells.nodes == row).any(axis=1)][0])
    e = _longest(a.points[site.rows(a.parts[p].name)])
    across = unit(np.cross(n, e))
    along = np.cos(angle) * across + np.sin(angle) * np.cross(n, across)
    X = a.points[a.shells.nodes].mean(axis=1) - a.points[row]
    h = float(np.sqrt(np.median(cell_areas(a.points, a.shells.nodes))))
    mine = (a.shells.part == p) & (np.abs(X @ np.cross(n, along)) <= 0.55 * h)
    return p, mine & (np.abs(X @ along) <= length / 2) & (np.abs(X @ n) < length / 4)


def _longest(points: np.ndarray) -> np.ndarray:
    """Direction of the largest extent of points (n, 3)."""
    d = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(d.T @ d)[1][:, -1])


CATALOGUED: dict[str, Kind] = {
    "nothing": nothing,
    "calibration": calibration,
    "point-mass": point_mass,
    "extra-support": extra_support,
    "sensor-mass": sensor_mass,
    "suspension": suspension,
    "thickness-distribution": thinning,
    "orthotropic-material": orthotropic,
    "sensor-fault": sensor_fault,
    "local-resonator": local_resonator,
    "stiffness-patch": stiffness_patch,
    "mass-patch": mass_patch,
    "crack": crack,
    "membrane-prestress": prestress,
}
