"""Recovery of known values by calibration: truth inside the model class, on another mesh.

Two sheets, welds, a screw and a bead of adhesive.  Ten values are drawn from their priors. The
article is meshed twice as fine. Its responses get 1 % noise and its mass 0.1 %.  ``calibrate``
answers. Its 95 % intervals and what it freezes are compared with the truth.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chladni.case import load_case
from chladni.effects.element_groups import element_groups
from chladni.effects.user_parameters import with_factor
from chladni.effects.weld_patch import FIELD, SD_E, SD_R, weld_patch
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.sampling import nearest_points
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.assembly import Assembly
from chladni.model.free_parameter import FreeParameter
from chladni.model.properties import Isotropic
from chladni.workflows.calibrate import calibrate
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni.workflows.frf import frf
from chladni.workflows.loaded_model import load_model
from chladni_specimens import STEEL, adhesive_bead, of_pieces, rectangle, screw, spot_welds, stops

GLUE = Isotropic(20e6, 0.4, 1000.0, id=2)
HIGH, COARSE, FINE = 1.2e-3, 0.025, 0.0125  # gap of the sheets, mesh of deck and of article [m]
NOISE, SCALES = 0.01, 0.001  # sd of H and of the weighed mass, relative
BAND = (20.0, 220.0)  # Hz
SENSORS = 14
PARTS = {"lower": ("lower",), "upper": ("upper",), "both": ("lower", "upper"),
         "glue": ("glue",), "screws": ("screws",)}  # fmt: skip
DRAWN = {  # name: (field, parts, prior sd of ln value)
    "E lower": ("E", "lower", 0.05), "E upper": ("E", "upper", 0.05), "rho": ("rho", "both", 0.04),
    "t lower": ("t", "lower", 0.03), "t upper": ("t", "upper", 0.03), "nu": ("nu", "both", 0.05),
    "E glue": ("E", "glue", 0.7), "E screw": ("E", "screws", 0.3),
}  # fmt: skip
PATCH = {"patch E": SD_E, "patch R": SD_R}


@dataclass(frozen=True)
class Recovered:
    """One value of one seed: truth and interval as factors on the deck's; None where frozen."""

    name: str
    truth: float
    low: float | None
    high: float | None
    prior_sd: float

    @property
    def inside(self) -> bool | None:
        """True if the interval holds the truth; None where the value was frozen."""
        if self.low is None or self.high is None:
            return None
        return self.low <= self.truth <= self.high


def panel(h: float) -> Assembly:
    """Two sheets of 400 x 300 and 300 x 200 mm: three welds, a screw, a sealed edge."""
    pieces = [
        rectangle("lower", (0, 0, 0), stops([0.0, 0.4], h), stops([0.0, 0.3], h)),
        rectangle("upper", (0.05, 0.05, HIGH), stops([0.0, 0.3], h), stops([0.0, 0.2], h)),
    ]
    made, names = of_pieces(pieces, {"lower": (1.5e-3, STEEL), "upper": (1e-3, STEEL)}), (
        "lower", "upper",
    )  # fmt: skip
    places = np.array([(0.07, y, HIGH / 2) for y in (0.08, 0.15, 0.22)])
    made = spot_welds(made, places, names)[0]
    made = screw(made, np.array([0.2, 0.07, HIGH / 2]), names)[0]
    line = np.array([(0.12, 0.23, HIGH / 2), (0.33, 0.23, HIGH / 2), (0.33, 0.07, HIGH / 2)])
    return adhesive_bead(
        made, line, names, height=0.3e-3, pitch=0.024, material=GLUE, name="glue"
    )[0]  # fmt: skip


def free(assembly: Assembly, name: str) -> FreeParameter:
    """One of ``DRAWN`` on an assembly."""
    field, where, sd = DRAWN[name]
    positions = tuple(assembly.part(p) for p in PARTS[where])
    return FreeParameter(name, field, PARTS[where], sd, positions=positions)


def article(deck: Assembly, x: dict[str, float]) -> Assembly:
    """The fine mesh with the values times e^x; the patch has the same radius in metres."""
    made = panel(FINE)
    patches = [weld_patch(element_groups(structure(a), 8), FreeParameter("", FIELD))
               for a in (deck, made)]  # fmt: skip
    (_, coarse), (_, fine) = (p.parameters for p in patches)
    R = np.log(coarse.value(x["patch R"]) / fine.scale)
    made = patches[1].apply(made, np.array([x["patch E"], R]))
    bands = [k for k, p in enumerate(made.parts) if ", band " in p.name]
    for name in DRAWN:
        one = free(made, name)
        own = [k for k in bands if made.parts[k].name.split(",")[0] in one.parts]
        made = with_factor(made, replace(one, positions=(*one.positions, *own)), np.exp(x[name]))
    return made


def drawn(seed: int) -> dict[str, float]:
    """All values of a seed from their priors, two standard deviations at most."""
    rng = np.random.default_rng(seed)
    sd = {name: sd for name, (_, _, sd) in DRAWN.items()} | PATCH
    return {name: float(s * np.clip(rng.normal(), -2, 2)) for name, s in sd.items()}


def write_recovery_case(folder: Path, seed: int) -> dict[str, float]:
    """Write deck, recording and case of a seed; return the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    rng, x, deck = np.random.default_rng([seed, 1]), drawn(seed), panel(COARSE)
    made = article(deck, x)
    write_assembly(deck, folder / "panel.bdf")
    write_assembly(made, folder / "article.bdf")
    sheets = np.unique(deck.shells.nodes)
    chosen = rng.choice(sheets[sheets != sheets[0]], SENSORS, replace=False)
    places = deck.points[[sheets[0], *chosen]]
    theirs = made.ids[nearest_points(made.points, places)]
    own = deck.ids[[sheets[0], *chosen]]
    outputs, drive = [f"{g}:+Z" for g in theirs], f"{theirs[0]}:+Z"
    model = load_model(folder / "article.bdf", "SI")
    H = frf(model, outputs, [drive], np.arange(BAND[0] - 5, BAND[1] + 5, 0.2)).frfs[0]
    H = H.to("accelerance")
    noise = rng.normal(size=(2, *H.values.shape)) / np.sqrt(2)
    values = H.values * (1 + NOISE * (noise[0] + 1j * noise[1]))
    labels = tuple(f"{g}:+Z" for g in own)
    write_npz(folder / "frf.npz", replace(H, values=values, outputs=labels, inputs=labels[:1]))
    (folder / "article.bdf").unlink()
    mass = mass_properties(made)[0] * (1 + SCALES * rng.normal())
    (folder / "case.toml").write_text(_case(mass), encoding="utf-8")
    return x


def _case(mass: float) -> str:
    """The case file: all values free with the priors they were drawn from."""
    head = (
        '[model]\ndeck = "panel.bdf"\nunits = "SI"\ndamping = 0.01\n[test]\n'
        f'recordings = ["frf.npz"]\nmass = {mass:.5f}\n[band]\nfit = [{BAND[0]}, {BAND[1]}]\n'
    )
    blocks = [
        f'[[parameter]]\nname = "{name}"\nfield = "{field}"\nparts = {json.dumps(PARTS[where])}\n'
        f"sd = {sd}\n"
        for name, (field, where, sd) in DRAWN.items()
    ]
    return head + "".join(blocks) + f'[[parameter]]\nname = "patch"\nfield = "{FIELD}"\n'


def compared_with(x: dict[str, float], found: DiagnosisResult) -> list[Recovered]:
    """Truth and interval of every value."""
    study = found.study
    assert study is not None
    rows = {}
    for c in found.calibrated:
        head = c.where.split(":")[0]
        key = head if head in DRAWN else c.estimate.name  # a name that says the field stands alone
        key = f"patch {c.estimate.name}" if "patch" in c.where else key
        e, base = c.estimate, c.deck_value or 1.0
        rows[key] = (
            None if e.low is None else e.low / base,
            None if e.high is None else e.high / base,
        )
    sd = {name: sd for name, (_, _, sd) in DRAWN.items()} | PATCH
    return [
        Recovered(name, float(np.exp(v)), *rows.get(name, (None, None)), sd[name])
        for name, v in x.items()
    ]


def recovery(seeds: Iterable[int], out: Path, say: Callable[[str], None]) -> list[list[Recovered]]:
    """Calibrate every seed; write ``recovery.json`` after each, so that a stop loses nothing."""
    every, masses = [], []
    for seed in seeds:
        folder = out / f"seed{seed}"
        x = write_recovery_case(folder, seed)
        found = calibrate(load_case(folder))
        rows = compared_with(x, found)
        mass = found.mass
        assert mass is not None
        masses.append(abs((mass.model_kg or np.nan) / (mass.weighed_kg or np.nan) - 1))
        every.append(rows)
        known = [r.inside for r in rows if r.inside is not None]
        frozen = ", ".join(r.name for r in rows if r.inside is None) or "none"
        say(
            f"seed {seed}: {sum(known)} of {len(known)} intervals contain the truth; frozen: "
            f"{frozen}; mass {masses[-1]:.2%} off, exit {3 if found.distrust else 0}"
        )
        data = [[vars(r) for r in one] for one in every]
        (out / "recovery.json").write_text(json.dumps({"rows": data, "mass_off": masses}), "utf-8")
    for line in summary(every, masses):
        say(line)
    return every


def summary(every: list[list[Recovered]], masses: list[float]) -> list[str]:
    """Coverage by value, and of all."""
    out = [f"{'value':10} known  inside  frozen  half-width / prior"]
    for name in (*DRAWN, *PATCH):
        mine = [r for rows in every for r in rows if r.name == name]
        known = [r for r in mine if r.inside is not None]
        widths = [
            np.log(r.high / r.low) / (2 * 1.96 * r.prior_sd) for r in known if r.low and r.high
        ]
        width = f"{np.median(widths):.2f}" if widths else "–"
        inside = sum(bool(r.inside) for r in known)
        out.append(f"{name:10} {len(known):5}  {inside:6}  {len(mine) - len(known):6}  {width}")
    held = [r.inside for rows in every for r in rows if r.inside is not None]
    share = sum(held) / max(len(held), 1)
    out.append(
        f"{sum(held)} of {len(held)} intervals of 95 % contain the truth ({share:.1%}); mass off "
        f"by {max(masses, default=np.nan):.2%} at most"
    )
    return out
