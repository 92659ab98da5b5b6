"""A welded frame of tubes, and its modes as a laboratory would deliver them."""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.refine import refined
from chladni.io.nastran import assembly, read_deck
from chladni.io.uff.write_shapes import write_shapes
from chladni.model.assembly import Assembly
from chladni.model.point_masses import with_mass_pairs

STEP = 50  # [mm] between grids
LONG, WIDE, ACROSS, HIGH = 800, 500, 300, 200  # [mm]


def frame_deck(path: Path) -> Path:
    """Two long tubes, three across and a hoop, free: 2 kg of steel, in mm-t-s."""
    grids: dict[tuple[int, int, int], int] = {}
    bars: list[str] = []

    def tube(start: tuple[int, int, int], end: tuple[int, int, int]) -> None:
        a, b = np.array(start), np.array(end)
        n = int(np.abs(b - a).max()) // STEP
        line = [tuple(int(x) for x in a + (b - a) * k // n) for k in range(n + 1)]
        rows = [grids.setdefault(p, 10 + len(grids)) for p in line]  # type: ignore[call-overload]
        up = "1.,0.,0." if start[2] != end[2] else "0.,0.,1."
        for i, j in pairwise(rows):
            bars.append(f"CBAR,{len(bars) + 1},1,{i},{j},{up}")

    for y in (0, WIDE):
        tube((0, y, 0), (LONG, y, 0))
    for x in (0, ACROSS, LONG):
        tube((x, 0, 0), (x, WIDE, 0))
    tube((ACROSS, 0, 0), (ACROSS, 0, HIGH))
    tube((ACROSS, 0, HIGH), (ACROSS, WIDE, HIGH))
    cards = [f"GRID,{id},,{x}.,{y}.,{z}." for (x, y, z), id in grids.items()]
    cards += ["PBARL,1,1,,TUBE", "+,9.,7.9", "MAT1,1,210000.,,.3,7.85-9"]
    path.write_text("\n".join(["BEGIN BULK", *cards, *bars, "ENDDATA", ""]))
    return path


@dataclass(frozen=True)
class Lump:
    """What the deck lacks: a mass [kg] at a place [m]; and the mass of the article with it [kg]."""

    mass: float
    place: np.ndarray
    article: float


def recorded_shapes(
    deck: Path, out: Path, seed: int, mass: float = 0.06, modes: int = 10, every: int = 4,
    noise: float = 0.01,
) -> Lump:  # fmt: skip
    """Write shapes of a mesh four times as fine with a lump at some grid.

    E and rho differ from the deck by tolerances, frequencies have 0.1 % of noise. Every shape has a
    factor of its own.

    Parameters
    ----------
    every : one of so many grids has a triaxial sensor
    noise : of the rms of each shape
    """
    rng = np.random.default_rng(seed)
    made = assembly(read_deck(deck), "mm-t-s")
    fine = refined(refined(_varied(made, 1 + 0.02 * rng.normal(), 1 + 0.004 * rng.normal())))
    k = int(rng.integers(len(made.ids)))
    fine = with_mass_pairs(fine, [(int(made.ids[k]), mass)])
    built = structure(fine)
    modal, at = normal_modes(built.system, 6 + modes), np.arange(0, len(made.ids), every)
    rows = fine.rows(made.ids[at].tolist())
    u = np.asarray(built.T @ modal.shapes[:, 6:]).reshape(len(fine.points), 6, -1)[rows, :3]
    u /= np.sqrt((u**2).mean(axis=(0, 1)))
    u = (u + noise * rng.normal(size=u.shape)) * rng.normal(size=modes)
    f = modal.frequency[6:] * (1 + 1e-3 * rng.normal(size=modes))
    write_shapes(out, f, u, made.ids[at], made.points[at], damping=0.003)
    return Lump(mass, made.points[k], float(mass_properties(fine)[0]))


def _varied(made: Assembly, E: float, rho: float) -> Assembly:
    """The frame with E and rho of its tubes times factors."""
    parts = []
    for p in made.parts:
        steel = p.section.material  # type: ignore[union-attr]
        parts.append(p.with_section(material=replace(steel, E=steel.E * E, rho=steel.rho * rho)))
    return made.with_parts(tuple(parts))
