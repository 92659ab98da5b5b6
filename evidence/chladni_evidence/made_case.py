"""One case: a measured article with a hidden effect, a folder for the user and a sealed truth."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.effects.calibration_parameters import value
from chladni.errors import ModelError
from chladni.fem.energy import mass_properties
from chladni.geometry.facets import cell_areas
from chladni.io.nastran import write_assembly
from chladni.io.tables.csv_table import csv_text
from chladni.io.uff.estimate_stamp import stamp
from chladni.io.uff.write_uff import write_uff
from chladni.model.assembly import Assembly
from chladni.model.properties import BeamSection, ShellSection
from chladni.output import write_json, write_text
from chladni.units import units
from chladni_bench import (
    AccelerometerType,
    Draw,
    MeasurementChain,
    decades_apart,
    drawn_gains,
    recognisable,
    recorded,
    scattered_parts,
)

from .article_modes import ArticleModes, Solver, article_modes
from .bench_of_structure import ZETA, Bench
from .benched_recording import (
    PLAIN,
    Benched,
    Recorder,
    benched_recording,
    can_be_benched,
    true_places,
)
from .held_kinds import HELD
from .hidden import Hidden, Site
from .hidden_kinds import CATALOGUED, Kind
from .joint_kinds import JOINTS
from .kratos_kinds import BY_KRATOS
from .mesh_transfer import Spots, still_there
from .outside_kinds import OUTSIDE
from .package_kinds import package_kinds
from .pair_kinds import members, together
from .response_of_article import accelerance, seen

KINDS: dict[str, Kind] = {**CATALOGUED, **OUTSIDE, **JOINTS, **HELD, **BY_KRATOS}
UNSIZED = ("nothing", "sensor-fault", "duplicated-pair")  # kinds without a size
NOTHING = 0.02  # an effect that changes less is a bad draw [rms decades]
NEAR_SIZE, FAR_SIZE, STEP = 0.1, 0.25, 5.0  # ln of a change: near enough, too far; growth a try
SHIFT = (0.01, 0.06)  # largest change of a frequency by an effect in an article by Kratos
GROWTH, TRIES, COARSE = 1.5, 5, 250  # the size is found on about COARSE lines of the band
CHAIN = MeasurementChain(noise=0.01, floor=0.001)
DAMPING_SPREAD = 0.3  # of ln ζ between modes
LIGHT = 5e-4  # error of the balance, relative


@dataclass(frozen=True, eq=False)
class MadeCase:
    """Data of the user (bench, recording, weighed mass) and the sealed truth.

    ``benched`` is the laboratory's knowledge of a recording of the virtual bench.
    """

    bench: Bench
    frf: FRF
    mass: float
    truth: dict[str, Any]
    benched: Benched | None = None


@dataclass(frozen=True, eq=False)
class _Rig:
    """Solves articles of one case for their noiseless responses at the sensors."""

    bench: Bench
    outputs: Spots  # true places and directions of the sensors
    article: Assembly  # before an effect is hidden in it
    zeta: np.ndarray
    cache: Path | None
    residual_bending: bool
    sizing: Solver  # where no other solver is given

    def responses(
        self, hidden: Hidden, lines: np.ndarray, solver: Solver | None = None
    ) -> tuple[np.ndarray, ArticleModes]:
        """Accelerance (n_f, n_out, 1) and its modes."""
        a = hidden.article
        out = still_there(a, self.article, self.outputs)
        drive = still_there(a, self.article, self.bench.drive)
        tied = [c.rows for c in hidden.couplings]
        modes = article_modes(
            a,
            np.concatenate([out.rows.ravel(), *tied]),
            np.concatenate([drive.rows.ravel(), *tied]),
            float(lines[-1]),
            solver or self.sizing,
            self.cache,
            self.residual_bending,
        )
        phi_o = seen(modes, out, self.outputs.directions)
        phi_i = seen(modes, drive, self.bench.drive.directions)
        zeta = self.zeta[np.minimum(np.arange(phi_o.shape[1]), len(self.zeta) - 1)]
        H = accelerance(modes, phi_o, phi_i, zeta, lines, hidden.couplings, hidden.law)
        return H, modes


def made_case(
    bench: Bench, kind: str, seed: int, mesh: str, cache: Path | None = None,
    recorder: Recorder = PLAIN, times: float | None = None, draw: Draw = scattered_parts,
) -> MadeCase:  # fmt: skip
    """Measure an article of one of the bench's meshes, with part scatter and an effect.

    The effect grows (up to fivefold) until its change of the responses over the fitted band is
    :func:`chladni_bench.recognisable`. That change and the one by scatter (rms decades) are in the
    truth. With several effects each does so alone, and the figure is the least of them. On
    CalculiX' mesh our elements give the size, and CalculiX the recording. On Kratos' mesh Kratos
    gives both: the largest change of a frequency of the fitted band is drawn from ``SHIFT``.

    Parameters
    ----------
    recorder : "independent noise" on every line, or a test on the virtual bench; effects with a law
        of frequency of their own (rotors, foam, friction, lumps) always have the first
    times : change by the effect over that by scatter and mesh together, which the size is set to
    draw : another article of the same drawing, and the factors on its values
    """
    common = [seed, *bench.name.encode(), *mesh.encode()]
    rng, noise = np.random.default_rng(common), np.random.default_rng([*common, *kind.encode()])
    plain = bench.meshes[mesh]()
    article, scales = draw(plain, rng)  # one article a seed, for all hidden effects
    zeta = ZETA * np.exp(DAMPING_SPREAD * rng.normal(size=2000))
    bending = bool(rng.integers(2))
    kind_of_sensor = AccelerometerType()
    outputs = true_places(bench.outputs, kind_of_sensor, rng)
    gains = drawn_gains(kind_of_sensor, len(outputs), rng)
    solver: Solver = "chladni" if mesh not in ("calculix", "kratos") else mesh  # type: ignore
    sizing: Solver = "kratos" if solver == "kratos" else "chladni"
    rig = _Rig(bench, outputs, article, zeta, cache, bending, sizing)
    site = _site(bench, article)
    band = bench.lines[(bench.lines >= bench.fit[0]) & (bench.lines <= bench.fit[1])]
    band = band[:: max(1, len(band) // COARSE)]
    own, own_modes = rig.responses(Hidden(article, {}), band)
    scatter = decades_apart(own, rig.responses(Hidden(plain, {}), band)[0])
    floor = scatter
    if times is not None:
        of_deck = replace(rig, article=bench.deck)
        floor = decades_apart(own, of_deck.responses(Hidden(bench.deck, {}), band)[0])

    def moved(hidden: Hidden) -> float:
        return decades_apart(hidden.spoil(rig.responses(hidden, band)[0]), own)

    def shift(hidden: Hidden) -> float:
        return _largest_shift(rig.responses(hidden, band)[1], own_modes, bench.fit[1])

    def sized(name: str, own_seed: list[int]) -> tuple[Hidden, float, float]:
        if times is not None and name not in UNSIZED:
            return _of_change(rig, site, name, own_seed, moved, times * floor)
        if solver == "kratos" and name not in (*UNSIZED, "calibration"):
            due = np.exp(np.random.default_rng([*own_seed, 1]).uniform(*np.log(SHIFT)))
            hidden, _, size = _of_change(rig, site, name, own_seed, shift, float(due), SHIFT)
            return hidden, moved(hidden), size
        return _sized(rig, site, name, own_seed, own, scatter, band)

    if len(members(kind)) > 1:
        hidden, truths, effect = together(site, kind, seed, sized)
        known: dict[str, Any] = {"effects": truths}
    else:
        hidden, effect, size = sized(kind, [seed, *kind.encode()])
        known = {**hidden.truth, "size": size}
    H, modes = rig.responses(hidden, bench.lines, solver)
    tested = None
    if recorder != PLAIN and can_be_benched(hidden, modes):
        tested = benched_recording(
            bench, article, hidden, zeta, recorder, solver, rig.residual_bending, cache, noise
        )
        frf = tested.frf
    else:
        H = H * gains[:, None]
        frf = recorded(H, bench.lines, CHAIN, noise, bench.outputs.labels, bench.drive.labels)
        frf = _spoiled(frf, hidden)
    weight = mass_properties(hidden.article)[0] - hidden.unweighed
    truth = {
        "effect": kind, "seed": seed, "structure": bench.name, "mesh": mesh,
        "solver": solver, **({} if tested is None else {"recorded_by": recorder}),
        **known, **_calibration_parameters(bench.deck, hidden.article),
        "moved_by_scatter_decades": scatter, "moved_by_effect_decades": effect,
        **({} if times is None else {"times": times, "moved_by_scatter_and_mesh_decades": floor}),
        "frequency_without_hz": own_modes.frequency[own_modes.frequency < 1.5 * bench.held[1]],
        "scales": scales, "frequency_hz": modes.frequency[modes.frequency < 1.5 * bench.held[1]],
        "drive": bench.drive.labels[0], "mass_kg": weight,
        "unweighed_kg": hidden.unweighed,
    }  # fmt: skip
    return MadeCase(bench, frf, weight * (1 + LIGHT * noise.normal()), truth, tested)


def _calibration_parameters(deck: Assembly, article: Assembly) -> dict[str, Any]:
    """E, rho, t [SI] and wall [of the deck's] of sheets and tubes, and the mass of each part.

    The wall is given by the ratio of the areas.
    """
    known: dict[str, dict[str, float]] = {q: {} for q in ("E", "rho", "t", "wall")}
    weight = {}
    beams = deck.points[deck.beams.nodes]
    length = np.linalg.norm(beams[:, 1] - beams[:, 0], axis=1)
    area = cell_areas(deck.points, deck.shells.nodes) * deck.thickness()
    for k, (was, p) in enumerate(zip(deck.parts, article.parts, strict=False)):
        if isinstance(p.section, ShellSection):
            known["t"][p.name] = value(p, "t")
        elif isinstance(p.section, BeamSection) and isinstance(was.section, BeamSection):
            known["wall"][p.name] = p.section.area / was.section.area
        else:
            continue
        volume = area[deck.shells.part == k].sum()
        if isinstance(was.section, BeamSection):
            volume = was.section.area * length[deck.beams.part == k].sum()
        if isinstance(was.section, type(p.section)):  # E of a bar also stands for a sheet's t
            known["E"][p.name] = value(p, "E")
        known["rho"][p.name] = value(p, "rho")
        weight[p.name] = float(volume * value(p, "rho"))
    return {"values": known, "part_mass_kg": weight}


def _site(bench: Bench, article: Assembly) -> Site:
    return Site(
        article,
        bench.outputs,
        bench.deck.points[bench.deck.rows(list(bench.hangers))],
        bench.drive,
        mass_properties(article)[0],
        bench.first,
        bench.fit[1],
        bench.sheets,
        np.array(bench.material_axis),
        bench.rolled,
    )


def _sized(
    rig: _Rig, site: Site, kind: str, seed: list[int], own: np.ndarray, scatter: float,
    band: np.ndarray,
) -> tuple[Hidden, float, float]:  # fmt: skip
    """The effect at the smallest sufficient size, its change of the responses, and the size."""
    size, hide = 1.0, KINDS.get(kind) or package_kinds()[kind]
    for _ in range(TRIES):
        hidden = hide(site, np.random.default_rng(seed), size)
        if kind == "nothing":
            return hidden, 0.0, size
        moved = decades_apart(hidden.spoil(rig.responses(hidden, band)[0]), own)
        if kind in UNSIZED or kind not in KINDS or moved >= recognisable(scatter):
            break
        size *= GROWTH
    if kind not in UNSIZED and moved < NOTHING:
        raise ModelError(f"{kind} of size {size:.3g} moves {rig.bench.name} by {moved:.1e} decades")
    return hidden, moved, size


def _of_change(
    rig: _Rig, site: Site, kind: str, seed: list[int], measure: Callable[[Hidden], float],
    due: float, enough: tuple[float, float] = (np.inf, np.inf),
) -> tuple[Hidden, float, float]:  # fmt: skip
    """The effect of the size whose measured change is ``due`` within a tenth, its change, the size.

    The measure is in decades of the responses, or a share of a frequency. An effect that comes in
    steps, such as a missing weld, may have any change between those that are ``enough``.
    """
    size, tried, hide = 1.0, [], KINDS.get(kind) or package_kinds()[kind]
    for _ in range(TRIES):
        hidden = hide(site, np.random.default_rng(seed), size)
        moved = measure(hidden)
        tried.append((abs(np.log(max(moved, 1e-12) / due)), hidden, moved, size))
        if tried[-1][0] < NEAR_SIZE:
            break
        size *= float(np.clip(due / max(moved, 1e-12), 1 / STEP, STEP))
    off, hidden, moved, size = min(tried, key=lambda one: one[0])
    if off > FAR_SIZE and not enough[0] <= moved <= enough[1]:
        raise ModelError(f"{kind} moves {rig.bench.name} by {moved:.3g}, not by {due:.3g}")
    return hidden, moved, size


def _largest_shift(modes: ArticleModes, before: ArticleModes, top: float) -> float:
    """Largest relative change of an elastic frequency up to ``top`` [Hz], in their order.

    Rigid modes that a spring to ground lifts stand below the elastic ones.
    """
    f = before.frequency[(before.frequency > 0) & (before.frequency <= top)]
    first = int((before.frequency == 0).sum())
    return float(np.abs(modes.frequency[first : first + len(f)] / f - 1).max())


def _spoiled(frf: FRF, hidden: Hidden) -> FRF:
    return FRF(
        hidden.spoil(frf.values), frf.frequency, frf.outputs, frf.inputs, frf.quantity,
        variance=frf.variance,
    )  # fmt: skip


def write_case(case: MadeCase, folder: Path, sealed: Path) -> str:
    """Write the case as a user has it, and the truth elsewhere; return the hash of the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    write_assembly(case.bench.deck, folder / "deck.bdf", units("mm-t-s"))
    title = stamp(case.benched.averages, 0.0) if case.benched else "NONE"
    write_uff(folder / "recording.uff", case.frf, title=title)
    write_text(folder / "sensors.csv", _sensors(case))
    write_text(folder / "case.toml", _toml(case))
    return seal_hash(write_json(sealed, case.truth))


def seal_hash(sealed: Path) -> str:
    """SHA-256 of a sealed truth."""
    return hashlib.sha256(sealed.read_bytes()).hexdigest()


def _sensors(case: MadeCase) -> str:
    """Table of the sensors and the shaker, with their masses where the bench attached them."""
    bench, known = case.bench, case.benched
    masses = (known.sensor_mass, known.gauge_mass) if known else (0.0, 0.0)
    head = ["label", "grid", "x", "y", "z", "nx", "ny", "nz", "role"]
    rows = [head + ["mass"] * (known is not None)]
    for spots, role, m in zip(
        (bench.outputs, bench.drive), ("output", "input"), masses, strict=True
    ):
        tail = [f"{m:g}"] * (known is not None)
        rows += [_sensor(spots, k, role) + tail for k in range(len(spots))]
    return csv_text(rows)


def _sensor(spots: Spots, k: int, role: str) -> list[str]:
    grid, place = str(spots.grids[k]), [""] * 3
    if spots.grids[k] == 0:
        grid, place = "", [f"{x:.7g}" for x in spots.points[k]]
    return [spots.labels[k], grid, *place, *(f"{x:.9g}" for x in spots.directions[k]), role]


def _toml(case: MadeCase) -> str:
    b = case.bench
    return f"""[model]
deck = "deck.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["recording.uff"]
sensors = "sensors.csv"
mass = {case.mass:.5f}
mass_sd = {0.001 * case.mass:.5f}
hangers = [{", ".join(str(h) for h in b.hangers)}]

[band]
fit = [{b.fit[0]:.2f}, {b.fit[1]:.2f}]

[held_out]
sensors = {b.held_sensors}
band = [{b.held[0]:.2f}, {b.held[1]:.2f}]
"""
