"""Cases with an effect concealed, made by our own bench from a finer mesh than the deck's.

Each case is a folder a user could have written (deck, universal file, case.toml) and a sealed
truth beside it that only the score may open, after the answer is on disk.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.bench.noisy_frf import MeasurementChain, measured
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.effects import registry
from chladni.effects.family import Article
from chladni.fem.assemble import Structure, structure
from chladni.geometry.sampling import farthest_point_sample
from chladni.io.nastran import write_assembly
from chladni.io.uff.write_uff import write_uff
from chladni.model.assembly import Assembly
from chladni.model.properties import Isotropic
from chladni.output import write_json, write_text
from chladni.units import units
from chladni_specimens.holed_plate import holed_plate
from chladni_specimens.plates import STEEL, folded_panel

from .outcome_row import NULLS

NUMBERED = 7  # families before the nulls in the order that seeds the random numbers of a case


def concealable() -> tuple[str, ...]:
    """Names of all that can be concealed: every family that acts on a bare sheet, and the nulls.

    The order seeds the cases, so that what comes later must stand later.
    """
    names = tuple(family.name for family in registry.families() if not family.needs)
    return (*names[:NUMBERED], *NULLS, *names[NUMBERED:])


@dataclass(frozen=True)
class Specimen:
    """A structure at two mesh densities and how it is tested.

    ``build(times)`` makes the mesh of the deck (1) or one every element of which is cut (2).
    """

    name: str
    build: Callable[[int], Assembly]
    f_max: float  # highest recorded frequency [Hz]
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
    rng = np.random.default_rng([seed, concealable().index(effect), len(specimen.name)])
    deck, made = specimen.build(1), specimen.build(2)
    outputs, drive, hangers = _layout(deck, specimen, rng)
    made = _ordinary(made, effect, rng)
    article = Article(made, deck, outputs, hangers, np.ones(len(outputs)))
    if effect not in NULLS:
        article = registry.family(effect).conceal(article, rng)
    article = replace(article, assembly=_scattered(article.assembly, 0.006, rng))
    built = structure(article.assembly, residual_bending=bool(rng.integers(2)))
    frf = _recording(built, article, drive, specimen, rng)
    labels = tuple(f"{g}:+Z" for g in outputs)
    frf = replace(frf, values=frf.values * article.gains[:, None], outputs=labels)
    mass = (article.weight - article.off_scale) * (1 + 5e-4 * rng.normal())
    truth = {"effect": effect, "seed": seed, "specimen": specimen.name, **article.truth}
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
    shaken = X[used] + 0.01 * rng.normal(size=(len(used), 3))
    chosen = used[farthest_point_sample(shaken, specimen.sensors)]
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


def _recording(
    built: Structure, article: Article, drive: int, specimen: Specimen, rng: np.random.Generator,
) -> FRF:  # fmt: skip
    """Accelerance with noise at the deck's sensor grids."""
    modes = normal_modes(built.system, band=2.5 * specimen.f_max)
    zeta = 0.007 * np.exp(0.3 * rng.normal(size=len(modes.frequency)))
    outputs = article.outputs
    ids = np.array(article.grids_at(outputs))
    at = np.array(article.grids_at(np.array([drive])))
    phi_o = built.along(ids, np.tile([0.0, 0, 1], (len(ids), 1))) @ modes.shapes
    phi_i = built.along(at, np.array([[0.0, 0, 1]])) @ modes.shapes
    f = np.arange(4.0, specimen.f_max, 0.25)
    chain = MeasurementChain(noise=0.01, floor=0.001)
    labels = tuple(f"{g}:+Z" for g in outputs)
    return measured(modes.with_damping(zeta), phi_o, phi_i, f, chain, rng, labels, (f"{drive}:+Z",))


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
band = [{high}, {specimen.f_max - 10}]
"""
