"""A structure on the test bench: deck, meshes of its articles, sensors, shaker, cords, bands."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from chladni.dofs import label
from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.geometry.facets import cell_normals, point_normals
from chladni.geometry.nearest import ShellSurface
from chladni.geometry.sampling import farthest_point_sample
from chladni.model.assembly import Assembly
from chladni.model.properties import ShellSection
from chladni_bench import TABLE_3, stage_lines
from chladni_planning import PlanSettings, even_lines, plan_test
from chladni_specimens import FORMS, TailgateDesign, folded_panel, holed_plate, plate, tailgate

from .kratos_structures import ARTICLES, DECKS
from .kratos_structures import FINER as FINER_BY_KRATOS
from .mesh_transfer import Spots

ZETA = 0.007  # median damping ratio of an article
FLAT = 0.999  # least length of the mean normal of a point's shells where a sensor can be glued
FINER = {"fine": 1.7, "calculix": 1.3}  # refinement of a form's articles over the deck
TAILGATE = {"16 mm": 0.016, "12 mm": 0.012, "calculix": 0.022}  # CalculiX' elements halve them


@dataclass(frozen=True)
class Specimen:
    """A small structure with the meshes of its articles and its test.

    ``build(times)`` makes the mesh of the deck (1) or one with every element divided (2).
    ``unlike()`` makes a mesh that shares no point with the deck.
    """

    build: Callable[[int], Assembly]
    unlike: Callable[[], Assembly]
    f_max: float  # highest recorded frequency [Hz]
    fit: tuple[float, float]  # band to fit [Hz]
    sensors: int = 20


def _plate(size: float, times: int = 1) -> Assembly:
    """Steel plate of 500 x 400 x 1.2 mm with a hole of 100 mm away from the middle."""
    return holed_plate(0.5, 0.4, (0.2, 0.22, 0.05), size, 1.2e-3, times=times)


def _panel(size: float) -> Assembly:
    """Panel of 600 x 300 x 1 mm with a bulge of 10 mm and long edges folded down."""
    return folded_panel(0.6, 0.3, 0.04, 0.01, size, 1e-3)


SPECIMENS = {
    "plate": Specimen(
        lambda times: _plate(0.025, times), lambda: _plate(0.021), 230.0, (15.0, 190.0)
    ),
    "panel": Specimen(
        lambda times: _panel(0.02 / times), lambda: _panel(0.017), 380.0, (12.0, 310.0)
    ),
}


def _clamped(times: float) -> Assembly:
    """Steel plate of 300 x 200 x 2 mm with one short side in a clamp."""
    free = plate(0.3, 0.2, round(12 * times), round(8 * times), 2e-3)
    edge = np.flatnonzero(free.points[:, 0] == 0)
    return replace(free, supports=np.array([(row, c) for row in edge for c in range(1, 7)]))


CLAMPED = {
    "clamped plate": Specimen(_clamped, lambda: _clamped(1.3), 620.0, (10.0, 480.0), 16),
}


@dataclass(frozen=True, eq=False)
class Bench:
    """Test of a structure.

    Attributes
    ----------
    name : str
    deck : Assembly
    meshes : {name: builder}   of articles; "calculix" is solved by the other code
    outputs, drive : Spots     sensors, and the one shaker
    hangers : tuple of int     grids of the deck
    lines : (n_f,)             measured [Hz]
    fit, held : (low, high)    bands to fit and to hold out [Hz]
    first : float              first elastic mode of the deck [Hz]
    sheets : tuple of str      parts an effect may sit on
    material_axis, rolled      direction of rolling, parts that may be orthotropic
    """

    name: str
    deck: Assembly
    meshes: dict[str, Callable[[], Assembly]]
    outputs: Spots
    drive: Spots
    hangers: tuple[int, ...]
    lines: np.ndarray
    fit: tuple[float, float]
    held: tuple[float, float]
    first: float
    sheets: tuple[str, ...]
    material_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    rolled: tuple[str, ...] = ()

    @property
    def held_sensors(self) -> int:
        """Number of held-out sensors: a sixth of all, two at least."""
        return max(2, len(self.outputs) // 6)


def form_bench(name: str, seed: int) -> Bench:
    """Bench of a form, by seed: 8 to 30 sensors, a band of 10 to 15 elastic modes and four more."""
    meshes: dict[str, Callable[[], Assembly]]
    if name in FORMS:
        form = FORMS[name]
        meshes = {k: partial(form.made, seed, finer) for k, finer in FINER.items()}
    else:
        form = DECKS[name]
        meshes = {"kratos": partial(ARTICLES[name].made, seed, FINER_BY_KRATOS)}
    deck, rng = form.made(seed), np.random.default_rng([seed, 2, *name.encode()])
    built = structure(deck)
    held = deck.ids[deck.supports[:, 0]]
    rigid = 0 if len(held) else 6
    modes = normal_modes(built.system, 21 + rigid)
    f = modes.frequency[rigid:]
    n = int(rng.integers(10, 16))
    ends = (0.75 * f[0], (f[n - 1] + f[n]) / 2, (f[n + 3] + f[n + 4]) / 2)
    moving = (built.T @ modes.shapes[:, rigid : rigid + n]).reshape(len(deck.points), 6, -1)[:, :3]
    every = glue_candidates(deck)
    every = every.only(np.flatnonzero(~np.isin(every.grids, held)))
    spots = every.only(_spread(every, int(rng.integers(8, 31)), rng))
    return Bench(
        name=name,
        deck=deck,
        meshes=meshes,
        outputs=spots,
        drive=every.only(_driven(deck, every, moving, rng)),
        hangers=() if len(held) else _hung(every),
        lines=even_lines(0.6 * f[0], 1.03 * ends[2], ZETA, 3.0),
        fit=(float(ends[0]), float(ends[1])),
        held=(float(ends[1]), float(ends[2])),
        first=float(f[0]),
        sheets=tuple(p.name for p in deck.parts if p.name in every.parts),
        material_axis=form.material_axis,
        rolled=form.rolled,
    )


def panel_bench(name: str, seed: int) -> Bench:
    """Bench of the small plate or panel, free or clamped, with sensors laid out by the seed."""
    spec, rng = {**SPECIMENS, **CLAMPED}[name], np.random.default_rng([seed, 3, *name.encode()])
    deck = spec.build(1)
    built = structure(deck)
    modes = normal_modes(built.system, 20)
    rigid = 0 if len(deck.supports) else 6
    moving = (built.T @ modes.shapes[:, rigid:]).reshape(len(deck.points), 6, -1)[:, :3]
    every = glue_candidates(deck)
    every = every.only(np.flatnonzero(~np.isin(every.grids, deck.ids[deck.supports[:, 0]])))
    return Bench(
        name=name,
        deck=deck,
        meshes={"fine": lambda: spec.build(2), "calculix": spec.unlike},
        outputs=every.only(_spread(every, spec.sensors, rng)),
        drive=every.only(_driven(deck, every, moving, rng)),
        hangers=() if len(deck.supports) else _hung(every),
        lines=np.arange(4.0, spec.f_max, 0.25),
        fit=spec.fit,
        held=(spec.fit[1], spec.f_max - 10),
        first=float(modes.frequency[rigid]),
        sheets=tuple(p.name for p in deck.parts),
        rolled=tuple(p.name for p in deck.parts),
    )


@cache
def tailgate_bench() -> Bench:
    """Bench of the tailgate at 20 mm: sensors, shaker and cords as planned, lines of the thesis."""
    deck = tailgate(TailgateDesign(size=0.020))
    found = plan_test(deck, PlanSettings(sensors=30))
    m = found.mounts
    sheets = tuple(p.name for p in deck.parts if isinstance(p.section, ShellSection))

    def spots(at: np.ndarray) -> Spots:
        shell = ShellSurface.whole(deck).closest_points(m.points[at]).shell
        is_grid = np.isin(m.ids[at], deck.ids)
        return Spots(
            tuple(m.labels[int(k)] for k in at),
            np.where(is_grid, m.ids[at], 0),
            m.points[at],
            m.directions[at],
            tuple(deck.parts[int(p)].name for p in deck.shells.part[shell]),
        )

    return Bench(
        name="tailgate",
        deck=deck,
        meshes={n: partial(tailgate, TailgateDesign(size=h)) for n, h in TAILGATE.items()},
        outputs=spots(found.layout),
        drive=spots(found.together),
        hangers=tuple(int(i) for i in found.hangers),
        lines=stage_lines(TABLE_3),
        fit=(20.0, 200.0),
        held=(200.0, 300.0),
        first=float(found.modal.frequency[0]),
        sheets=tuple(s for s in sheets if s in ("inner", "outer upper", "outer lower")),
        material_axis=(0.0, 1.0, 0.0),
        rolled=sheets,
    )


def glue_candidates(deck: Assembly) -> Spots:
    """Grids where a sensor can be glued: flat on a sheet, or on a tube across it."""
    n = point_normals(deck.points, deck.shells.nodes)
    part, direction_at = np.full(len(deck.points), -1), n.copy()
    if len(deck.shells):
        part[deck.shells.nodes.ravel()] = np.repeat(deck.shells.part, 4)
        part[_mean_normal(deck) < FLAT] = -1
    else:
        along = deck.points[deck.beams.nodes[:, 1]] - deck.points[deck.beams.nodes[:, 0]]
        part[deck.beams.nodes[:, 0]] = deck.beams.part
        direction_at[deck.beams.nodes[:, 0]] = np.eye(3)[np.abs(along).argmin(axis=1)]
    at = np.flatnonzero(part >= 0)
    return Spots(
        tuple(_label(int(i), d) for i, d in zip(deck.ids[at], direction_at[at], strict=True)),
        deck.ids[at],
        deck.points[at],
        direction_at[at],
        tuple(deck.parts[p].name for p in part[at]),
    )


def _mean_normal(deck: Assembly) -> np.ndarray:
    """Length of the mean of the unit normals of the shells round each point."""
    n = cell_normals(deck.points, deck.shells.nodes)
    total, count = np.zeros_like(deck.points), np.zeros(len(deck.points))
    for corner in range(4):
        np.add.at(total, deck.shells.nodes[:, corner], n)
        np.add.at(count, deck.shells.nodes[:, corner], 1)
    return np.linalg.norm(total, axis=1) / np.maximum(count, 1)


def _label(grid: int, direction: np.ndarray) -> str:
    axis = int(np.abs(direction).argmax())
    if abs(direction[axis]) > 1 - 1e-9:
        return label(grid, axis + 1, 1 if direction[axis] > 0 else -1)
    return f"{grid}:n"


def _spread(every: Spots, count: int, rng: np.random.Generator) -> np.ndarray:
    """Positions of places far from each other, varied a little by the seed."""
    noise = 0.02 * np.ptp(every.points, axis=0).max() * rng.normal(size=every.points.shape)
    return farthest_point_sample(every.points + noise, count)


def _driven(
    deck: Assembly, every: Spots, moving: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """The one of thirty drawn places that drives the modes most evenly (geometric mean)."""
    drawn = rng.choice(len(every), min(30, len(every)), replace=False)
    at = deck.rows(every.grids[drawn])
    phi = np.abs(np.einsum("kir,ki->kr", moving[at], every.directions[drawn]))
    even = np.log(phi / np.abs(phi).max(axis=0) + 0.02).mean(axis=1)
    return np.asarray(drawn[[int(even.argmax())]])


def _hung(every: Spots) -> tuple[int, ...]:
    """Two grids, one near either end of the longest side."""
    axis = int(np.ptp(every.points, axis=0).argmax())
    ends = np.argsort(every.points[:, axis], kind="stable")
    return int(every.grids[ends[0]]), int(every.grids[ends[-1]])
