"""Cases with an effect concealed, made by our own bench from a finer mesh than the deck's.

Each case is a folder a user could have written (deck, universal file, case.toml) and a sealed
truth beside it that only the score may open, after the answer is on disk.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.bench.article import Front, measured
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.effects import catalogue, points
from chladni.fem.assemble import Structure, structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import write_assembly
from chladni.io.uff.write_uff import write_uff
from chladni.model.assembly import Assembly
from chladni.model.properties import Isotropic, Orthotropic, ShellSection
from chladni.output import write_json, write_text
from chladni.units import units
from chladni_specimens.holed_plate import holed_plate
from chladni_specimens.plates import STEEL, folded_panel

EFFECTS = (*catalogue.NAMES, "nothing", "calibration")


@dataclass(frozen=True)
class Specimen:
    """A structure at two mesh densities and how it is tested.

    ``build(times)`` makes the mesh of the deck (1) or one every element of which is cut (2).
    """

    name: str
    build: Callable[[int], Assembly]
    top: float  # highest recorded frequency [Hz]
    fit: tuple[float, float]  # band to fit [Hz]
    sensors: int = 20


def plate_with_hole(times: int) -> Assembly:
    """500 x 400 x 1.2 mm steel, hole of 100 mm off the middle; elements of 25 mm."""
    return holed_plate(0.5, 0.4, (0.2, 0.22, 0.05), 0.025, 1.2e-3, times=times)


def panel(times: int) -> Assembly:
    """600 x 300 mm, 1 mm, bulging by 10 mm, long edges folded down; elements of 20 mm."""
    return folded_panel(0.6, 0.3, 0.04, 0.01, 0.02 / times, 1e-3)


SPECIMENS = {
    "plate": Specimen("plate", plate_with_hole, 230.0, (15.0, 190.0)),
    "panel": Specimen("panel", panel, 380.0, (12.0, 310.0)),
}


@dataclass(frozen=True, eq=False)
class Concealed:
    """One case: what the user has, and what is sealed."""

    specimen: Specimen
    deck: Assembly
    frf: FRF
    mass: float
    hangers: np.ndarray
    truth: dict[str, Any]


def made(specimen: Specimen, effect: str, seed: int) -> Concealed:
    """An article with an effect concealed, recorded.

    Truth: every element of the deck's mesh cut in four, element formulation drawn, smooth
    thickness scatter 0.6 %, E and rho off by 1 % (sd), noise 1 % per line, modal damping 0.4-1.2 %.
    "calibration" has one of E, rho, t off by up to 10 %, "nothing" none, both with scatter.
    """
    rng = np.random.default_rng([seed, EFFECTS.index(effect), len(specimen.name)])
    deck, article = specimen.build(1), specimen.build(2)
    outputs, drive, hangers = _layout(deck, specimen, rng)
    article = _ordinary(article, effect, rng)
    article, truth, gains = _concealed(article, deck, effect, outputs, hangers, rng)
    article = _scattered(article, 0.006, rng)
    built = structure(article, residual_bending=bool(rng.integers(2)))
    frf = _recording(built, deck, outputs, drive, specimen, rng)
    frf = replace(
        frf, values=frf.values * gains[:, None], outputs=tuple(f"{g}:+Z" for g in outputs)
    )
    off_scale = truth["value"] * len(outputs) if effect == "sensor-mass" else 0.0
    mass = (_mass(article) - off_scale) * (1 + 5e-4 * rng.normal())
    truth = {"effect": effect, "seed": seed, "specimen": specimen.name, **truth}
    return Concealed(specimen, deck, frf, mass, hangers, truth)


def write(case: Concealed, folder: Path, sealed: Path) -> None:
    """The case as a user would have it, and elsewhere the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    write_assembly(case.deck, folder / "deck.bdf", units("mm-t-s"))
    write_uff(folder / "recording.uff", case.frf)
    write_text(folder / "case.toml", _case(case.specimen, case.mass, case.hangers))
    sealed.parent.mkdir(parents=True, exist_ok=True)
    write_json(sealed, case.truth)


def _layout(
    deck: Assembly, specimen: Specimen, rng: np.random.Generator
) -> tuple[np.ndarray, int, np.ndarray]:
    """Grids of sensors, shaker and hangers, on the faces that look up."""
    X = deck.points
    used = np.unique(deck.shells.nodes[deck.shells.part == 0])
    chosen = used[
        catalogue.spread(X[used] + 0.01 * rng.normal(size=(len(used), 3)), specimen.sensors)
    ]
    low = np.quantile(X[used], 0.12, axis=0), np.quantile(X[used], 0.3, axis=0)
    corner = [k for k in used if np.all((X[k, :2] > low[0][:2]) & (X[k, :2] < low[1][:2]))]
    edge = used[np.argsort(X[used, 1])[-max(4, len(used) // 15) :]]
    hung = edge[[int(np.argmin(X[edge, 0])), int(np.argmax(X[edge, 0]))]]
    return deck.ids[chosen], int(deck.ids[rng.choice(corner)]), deck.ids[hung]


def _ordinary(article: Assembly, effect: str, rng: np.random.Generator) -> Assembly:
    """E and rho off by 1 %; for "calibration" one of E, rho, t by up to 10 %; else exact."""
    scale = {q: float(np.exp(0.01 * rng.normal())) for q in ("E", "rho")} | {"t": 1.0}
    if effect == "nothing":
        scale = dict.fromkeys(scale, 1.0)
    if effect == "calibration":
        scale = dict.fromkeys(scale, 1.0)
        scale[("E", "rho", "t")[rng.integers(3)]] = float(
            1 + rng.choice([-1, 1]) * rng.uniform(0.03, 0.1)
        )
    steel = Isotropic(STEEL.E * scale["E"], STEEL.nu, STEEL.rho * scale["rho"])
    parts = tuple(p.with_section(membrane=steel, bending=steel) for p in article.parts)
    t = article.shells.thickness * scale["t"]
    return replace(article.with_parts(parts), shells=replace(article.shells, thickness=t))


def _scattered(article: Assembly, sd: float, rng: np.random.Generator) -> Assembly:
    """Thickness times 1 + a smooth random field of standard deviation sd."""
    X = article.points / np.ptp(article.points, axis=0).max()
    waves = rng.normal(size=(8, 3)) * 4.0
    field = np.cos(X @ waves.T + rng.uniform(0, 2 * np.pi, 8)).sum(axis=1) / 2.0
    t = article.shells.thickness * (1 + sd * field)[article.shells.nodes]
    return replace(article, shells=replace(article.shells, thickness=t))


def _concealed(
    article: Assembly, deck: Assembly, effect: str, outputs: np.ndarray, hangers: np.ndarray,
    rng: np.random.Generator,
) -> tuple[Assembly, dict[str, Any], np.ndarray]:  # fmt: skip
    """The article with the effect in it, what it is, and the factors on the channels."""
    gains = np.ones(len(outputs))
    weight = _mass(article)
    if effect in ("nothing", "calibration"):
        return article, {}, gains
    if effect == "sensor-fault":
        at = int(rng.integers(len(outputs)))
        gains[at] = float(rng.choice([-1.0, 0.5, 0.7, 1.4, 2.0, -1.3]))
        return article, {"channel": f"{outputs[at]}:+Z", "value": float(gains[at])}, gains
    if effect == "orthotropic-material":
        return *_grained(article, rng), gains
    if effect == "thickness-distribution":
        return *_thinned(article, rng), gains
    if effect == "sensor-mass":
        each = float(rng.uniform(0.0025, 0.006)) * weight
        return _at(article, deck, outputs, points.with_masses, each), {"value": each}, gains
    if effect == "suspension":
        K = float(np.exp(rng.uniform(np.log(800), np.log(6000))))
        return _at(article, deck, hangers, _springs, K), {"value": K}, gains
    used = np.unique(deck.shells.nodes)
    spot = int(rng.choice(used))
    truth: dict[str, Any] = {"point_m": deck.points[spot].tolist()}
    if effect == "point-mass":
        m = float(rng.uniform(0.015, 0.08)) * weight
        return (
            _at(article, deck, deck.ids[[spot]], points.with_masses, m),
            {**truth, "value": m},
            gains,
        )
    k = float(np.exp(rng.uniform(np.log(2e3), np.log(5e4))))
    return _at(article, deck, deck.ids[[spot]], _springs, k), {**truth, "value": k}, gains


def _grained(article: Assembly, rng: np.random.Generator) -> tuple[Assembly, dict[str, Any]]:
    section = article.parts[0].section
    assert isinstance(section, ShellSection)
    old = section.membrane
    assert isinstance(old, Isotropic)
    ratio = float(rng.choice([-1, 1]) * rng.uniform(0.06, 0.3))
    E1, E2 = old.E * np.exp(ratio / 2), old.E * np.exp(-ratio / 2)
    G = old.shear_modulus
    G12 = G * float(np.exp(rng.uniform(-0.15, 0.15)))
    grain = Orthotropic(E1, E2, old.nu * np.sqrt(E1 / E2), G12, G, G, old.rho)
    parts = tuple(p.with_section(membrane=grain, bending=grain) for p in article.parts)
    axis = np.broadcast_to([1.0, 0, 0], article.shells.axis.shape)
    changed = replace(article.with_parts(parts), shells=replace(article.shells, axis=axis))
    return changed, {"E1": E1, "E2": E2, "G12": G12}


def _thinned(article: Assembly, rng: np.random.Generator) -> tuple[Assembly, dict[str, Any]]:
    top = article.shells.nodes[article.shells.part == 0]
    centre = article.points[rng.choice(np.unique(top))]
    alpha, R = float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.04, 0.09))
    q = np.exp(-((article.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    t = article.shells.thickness * (1 - alpha * q)[article.shells.nodes]
    truth = {"point_m": centre.tolist(), "value": alpha, "radius_m": R}
    return replace(article, shells=replace(article.shells, thickness=t)), truth


def _at(
    article: Assembly, deck: Assembly, grids: np.ndarray, add: Callable[..., Assembly], value: float
) -> Assembly:
    """The same thing at the article's nodes that lie where the deck's grids are."""
    return add(article, tuple(_same(article, deck, grids)), value)


def _same(article: Assembly, deck: Assembly, grids: np.ndarray) -> list[int]:
    where = deck.points[deck.rows(grids)]
    d2 = ((article.points[None] - where[:, None]) ** 2).sum(axis=-1)
    return [int(i) for i in article.ids[d2.argmin(axis=1)]]


def _springs(article: Assembly, grids: tuple[int, ...], k: float) -> Assembly:
    up = np.tile([0.0, 0.0, 1.0], (len(grids), 1))
    return points.with_springs(article, grids, up, k)


def _mass(article: Assembly) -> float:
    return mass_properties(article)[0]


def _recording(
    built: Structure, deck: Assembly, outputs: np.ndarray, drive: int, specimen: Specimen,
    rng: np.random.Generator,
) -> FRF:  # fmt: skip
    """Accelerance with noise at the deck's sensor grids."""
    modes = normal_modes(built.system, band=2.5 * specimen.top)
    zeta = 0.007 * np.exp(0.3 * rng.normal(size=len(modes.frequency)))
    ids = np.array(_same(built.assembly, deck, outputs))
    at = np.array(_same(built.assembly, deck, np.array([drive])))
    phi_o = built.along(ids, np.tile([0.0, 0, 1], (len(ids), 1))) @ modes.shapes
    phi_i = built.along(at, np.array([[0.0, 0, 1]])) @ modes.shapes
    f = np.arange(4.0, specimen.top, 0.25)
    front = Front(noise=0.01, floor=0.001)
    labels = tuple(f"{g}:+Z" for g in outputs)
    return measured(modes.with_damping(zeta), phi_o, phi_i, f, front, rng, labels, (f"{drive}:+Z",))


def _case(specimen: Specimen, mass: float, hangers: np.ndarray) -> str:
    low, high = specimen.fit
    return f"""[model]
deck = "deck.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["recording.uff"]
mass = {mass:.5f}
mass_sd = {0.001 * mass:.5f}
hangers = [{", ".join(str(h) for h in hangers)}]

[band]
fit = [{low}, {high}]

[held_out]
sensors = 4
band = [{high}, {specimen.top - 10}]
"""
