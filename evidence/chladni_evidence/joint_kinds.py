"""Hidden effects of joints, in structures that have such joints."""

from dataclasses import replace

import numpy as np

from chladni.effects.hems import HemLine, hem_lines
from chladni.errors import ModelError
from chladni.model.assembly import Assembly, Solids
from chladni.model.properties import Isotropic, SolidSection
from chladni_bench import scaled_parts
from chladni_specimens import grip

from .hidden import Hidden, Site
from .hidden_kinds import Kind

SOFTEST = 20e9  # [Pa] least E of a weld: softer solids are adhesive
REDRAWN = np.log(1.5)  # ln of the growth of a size: another weld is drawn for every size


def weld_missing(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A missing weld or screw; a larger size draws another one."""
    a = site.article
    order = rng.permutation(sum(len(rows) for _, rows in _welds(a)) + len(_screws(a)))
    k = int(order[round(float(np.log(size) / REDRAWN)) % len(order)])
    for group, rows in _welds(a):
        if k < len(rows):
            place = a.points[a.solids[group].nodes[rows[k]]].mean(axis=0)
            made = _without(a, group, np.arange(len(a.solids[group])) == rows[k])
            return Hidden(made, {"value": 0.0, "point_m": place.tolist()})
        k -= len(rows)
    kept = np.arange(len(a.beams)) != _screws(a)[k]
    beams = type(a.beams)(**{name: column[kept] for name, column in vars(a.beams).items()})
    place = a.points[a.beams.nodes[~kept][0]].mean(axis=0)
    return Hidden(replace(a, beams=beams), {"value": 0.0, "point_m": place.tolist()})


def weld_run(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Two to four adjacent welds of one row that were never set; more at a larger size."""
    a = site.article
    rows = [(group, held) for group, held in _welds(a) if len(held) >= 4]
    if not rows:
        raise ModelError("the article has no row of four welds")
    group, held = rows[int(rng.integers(len(rows)))]
    places = a.points[a.solids[group].nodes[held]].mean(axis=1)
    count = int(np.clip(round(rng.integers(2, 5) * size), 2, len(held) - 1))
    first = places[int(rng.integers(len(held)))]
    gone = held[np.argsort(np.linalg.norm(places - first, axis=1))[:count]]
    middle = a.points[a.solids[group].nodes[gone]].mean(axis=(0, 1))
    made = _without(a, group, np.isin(np.arange(len(a.solids[group])), gone))
    return Hidden(made, {"value": 0.0, "count": count, "point_m": middle.tolist()})


def _without(a: Assembly, group: int, gone: np.ndarray) -> Assembly:
    """The assembly without some solids of a group (n,) bool."""
    solids, old = list(a.solids), a.solids[group]
    solids[group] = Solids(old.ids[~gone], old.nodes[~gone], old.part[~gone])
    return replace(a, solids=tuple(solids))


def _welds(a: Assembly) -> list[tuple[int, np.ndarray]]:
    """Group and rows of metal solids, for each weld."""
    hard = np.array([_modulus(p.section) >= SOFTEST for p in a.parts])
    return [(k, np.flatnonzero(hard[group.part])) for k, group in enumerate(a.solids)]


def _screws(a: Assembly) -> np.ndarray:
    return np.arange(len(a.beams)) if len(a.shells) else np.zeros(0, int)


def _modulus(section: object) -> float:
    if isinstance(section, SolidSection) and isinstance(section.material, Isotropic):
        return section.material.E
    return 0.0


def adhesive(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Adhesive of one part that is softer or stiffer by e^3 to e^4 at size 1."""
    a = site.article
    soft = [p.name for p in a.parts if 0 < _modulus(p.section) < SOFTEST]
    if not soft:
        raise ModelError("the article has no adhesive")
    name, sign = str(rng.choice(soft)), float(rng.choice([-1, 1]))
    section = a.parts[a.part(name)].section
    sign = -1.0 if _modulus(section) > 1e9 else sign  # a stiffer epoxy layer would change little
    factor = float(np.exp(sign * rng.uniform(3.0, 4.0) * size))
    made = scaled_parts(a, {name: {"E": factor}})
    return Hidden(made, {"value": _modulus(section) * factor, "part": name})


def viscoelastic(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Mastic as adhesive of one part, E_r (1 + Δ (sτ)^b / (1 + (sτ)^b)): fractional Zener solid.

    E of the bead falls by e^3 to e^4 at size 1 in the middle of the band. E and loss factor are
    stated there.  Δ, b and the frequency of largest loss are drawn (Pritz 1996, J. Sound and
    Vibration 195, 103: four parameters for real polymers).
    """
    a = site.article
    soft = [p.name for p in a.parts if 0 < _modulus(p.section) < SOFTEST]
    if not soft:
        raise ModelError("the article has no adhesive")
    name = str(rng.choice(soft))
    middle = 2j * np.pi * np.sqrt(site.first * site.f_max)
    factor = float(np.exp(-rng.uniform(3.0, 4.0) * size))
    relaxed, b = float(rng.uniform(2.0, 8.0)), float(rng.uniform(0.5, 0.8))
    tau = float(np.exp(rng.uniform(-1.0, 1.0))) / abs(middle)

    def modulus(s: np.ndarray | complex) -> np.ndarray:
        return np.asarray(1 + relaxed * (s * tau) ** b / (1 + (s * tau) ** b))

    there = complex(modulus(middle))

    def law(s: np.ndarray) -> np.ndarray:
        return modulus(s) / there.real - 1

    made = scaled_parts(a, {name: {"E": factor}})
    k = made.part(name)
    section = made.parts[k].section
    assert isinstance(section, SolidSection)
    assert isinstance(section.material, Isotropic)
    E = section.material.E
    parts = list(made.parts)
    parts[k] = parts[k].with_section(material=replace(section.material, damping=1.0))
    truth = {
        "value": E, "E": E, "loss factor": there.imag / there.real, "part": name,
        "relaxation": relaxed, "exponent": b, "tau_s": tau,
    }  # fmt: skip
    return Hidden(made.with_parts(tuple(parts)), truth, law=law)


def hem(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A hem that does not slide anywhere along its string, 1e9 to 1e10 N/m² at size 1."""
    line, k = _line(site), _grip(rng) * size
    made = _gripped(site.article, line, np.ones(len(line), bool), k)
    return Hidden(made, {"value": k, "K": k})


def hem_stretch(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A hem that does not slide on a fifth to a half of its string, placed at its middle."""
    line, k = _line(site), _grip(rng) * size
    middle, L = rng.uniform(0, line.length), line.length * float(rng.uniform(0.2, 0.5))
    d = np.abs(line.from_place(float(middle)))
    made = _gripped(site.article, line, d <= L / 2, k)
    point = line.middle[int(d.argmin())].tolist()
    return Hidden(made, {"value": k, "K": k, "L": L, "point_m": point})


def _line(site: Site) -> HemLine:
    """The longest string of the article."""
    lines = hem_lines(site.article)
    if not lines:
        raise ModelError("the article has no string of adhesive between two sheets")
    return max(lines, key=lambda one: one.length)


def _grip(rng: np.random.Generator) -> float:
    """Stiffness against sliding [N/m²]."""
    return float(np.exp(rng.uniform(np.log(1e9), np.log(1e10))))


def _gripped(a: Assembly, line: HemLine, held: np.ndarray, k: float) -> Assembly:
    """The article with springs against sliding wherever a line is held (k,) bool."""
    names = np.array([[_part_at(a, rows) for rows in side] for side in line.sides])
    for pair in {(str(one), str(two)) for one, two in names}:
        on = held & (names == pair).all(axis=1)
        if on.any():
            places, along, share = line.middle[on], line.along[on], line.share[on]
            a = grip(a, places, along, k * share, pair, reach=0.02)[0]
    return a


def _part_at(a: Assembly, rows: np.ndarray) -> str:
    """Name of the sheet that has these points."""
    inside = np.isin(a.shells.nodes, rows).any(axis=1)
    return a.parts[int(np.bincount(a.shells.part[inside]).argmax())].name


JOINTS: dict[str, Kind] = {
    "weld-missing": weld_missing,
    "weld-run": weld_run,
    "adhesive-stiffness": adhesive,
    "viscoelastic-joint": viscoelastic,
    "hem-contact": hem,
    "hem-stretch": hem_stretch,
}
