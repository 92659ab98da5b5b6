"""From a structure to a test plan (thesis 4.1): sensors with direction, shaker, cords, lines."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..dofs import label
from ..dynamics.eigen import normal_modes
from ..dynamics.modes import ModalModel, rigid_modes
from ..ema import pretest
from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..model.assembly import Assembly
from ..progress import Progress, silent
from .places import Places, find_places

SPARE = 6  # modes computed beyond those wanted, so that the sweep sees what lies above
BLIND = 0.25  # of the floor: what no place sees better than this is not aimed at
TANGENT = 0.6  # a direction this far off the normal (cosine) needs a mounting block


@dataclass(frozen=True)
class Wishes:
    """What the test is to be; lengths in metres.

    Attributes
    ----------
    sensors : uniaxial accelerometers at hand
    modes : target modes; None: those below ``top``, or 24, or 4/5 of the sensors
    top : highest frequency of interest [Hz]
    damping : expected damping ratio of every mode
    candidates : places looked at
    spacing : least distance between two sensors [m]
    actuators : shakers that are to work together
    floor : least visibility of a mode: largest motion a sensor sees over the largest anywhere
    mass : of one sensor [kg]
    draws, spread : models drawn with every part's thickness uncertain by this share (1 sd);
                    the layout then serves all of them
    seed : of the draws
    """

    sensors: int = 30
    modes: int | None = None
    top: float | None = None
    damping: float = 0.01
    candidates: int = 300
    spacing: float = 0.0
    actuators: int = 1
    floor: float = 0.2
    mass: float = 0.005
    draws: int = 0
    spread: float = 0.1
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Mount:
    """A place and a direction in which a sensor may measure: rows of ``phi`` of a :class:`Plan`.

    Attributes
    ----------
    ids : (m,) int          grids
    points, directions : (m, 3)
    labels : tuple of str   412:+Z along an axis, else 412:n
    normal : (m,) bool      glued flat; False: on a block, along the sheet
    side : (m,)             +1, -1: on which side of the surface normal
    """

    ids: np.ndarray
    points: np.ndarray
    directions: np.ndarray
    labels: tuple[str, ...]
    normal: np.ndarray
    side: np.ndarray


@dataclass(frozen=True, eq=False)
class Plan:
    """A test plan; arrays over modes are over the flexible target modes.

    Attributes
    ----------
    places : Places
    modal : ModalModel            target modes, damping as wished
    first : int                   number of the first of them in the deck (rigid modes before it)
    mounts : Mount                every candidate: normals first, then directions on blocks
    phi : (m, r)                  target shapes at the mounts
    aimed : (r,) bool             modes a sensor glued flat sees at all: the layout is for them
    layout : (n_sensors,) int     mounts, the most informative first
    moves : tuple of Move         sensors given up so that a mode is seen
    visible_before, visible : (r,)  before and after the moves
    log_det : {method: value}     of the layouts of several methods, before the moves
    sweep : ((modes, overlap), ...)  share of the layout kept when the sweep takes more modes
    actuators : ActuatorRanking   over the normals, each alone
    together : (k,) int           the shakers that drive all modes most evenly together
    observable : (rank, states)
    quotient : float              of the observability gramian (thesis 4.1.1)
    auto_mac : (r, r)             at the sensors
    loaded : (r,)                 frequencies with the sensors' mass on [Hz]
    hangers : (k,) int            grids, the quietest first
    quiet : (k,)                  their rms motion over the first modes, of the largest anywhere
    """

    wishes: Wishes
    places: Places
    modal: ModalModel
    first: int
    mounts: Mount
    phi: np.ndarray
    aimed: np.ndarray
    layout: np.ndarray
    moves: tuple[pretest.Move, ...]
    visible_before: np.ndarray
    visible: np.ndarray
    log_det: dict[str, float]
    sweep: tuple[tuple[int, float], ...]
    actuators: pretest.ActuatorRanking
    together: np.ndarray
    observable: tuple[int, int]
    quotient: float
    auto_mac: np.ndarray
    loaded: np.ndarray
    hangers: np.ndarray
    quiet: np.ndarray


def plan(
    assembly: Assembly,
    wishes: Wishes | None = None,
    *,
    built: Structure | None = None,
    unit: str = "m",
    progress: Progress = silent,
) -> Plan:
    """Candidates on the mesh, effective independence and exchange, visibility, shaker, cords.

    Parameters
    ----------
    built : the assembled structure, where it is at hand
    unit : "" where the deck's unit of length is not known
    """
    wishes = wishes or Wishes()
    progress("places a sensor can sit at", 0.05)
    places = find_places(assembly, wishes.candidates, unit=unit)
    progress("modes", 0.2)
    built = built or structure(assembly)
    modal, above, first = target_modes(built, wishes)
    mounts = mounts_at(places)
    phi = shapes(built, above, mounts)
    largest = np.linalg.norm(motion(built, modal), axis=1).max(axis=0)
    progress("sensors", 0.6)
    r, normal = len(modal), mounts.normal
    aimed = pretest.visibility(phi[normal, :r], largest) >= BLIND * wishes.floor
    flat = phi[normal, :r][:, aimed]
    draws = _draws(assembly, wishes, mounts, r, progress)[:, :, aimed] if wishes.draws else flat
    ranked, log_det = _layout(draws, mounts, wishes)
    layout, moves = pretest.with_visible_modes(
        phi[:, :r], ranked, largest, floor=wishes.floor, rules=_near(mounts, wishes)
    )
    progress("shaker and cords", 0.8)
    f, zeta, seen = modal.frequency, modal.damping, phi[layout, :r]
    shaker = pretest.shaking(f[aimed], zeta[aimed], seen[:, aimed], flat)
    observed = pretest.observability_gramian(f, zeta, seen)
    hangers, quiet = hang_points(built, modal, places)
    return Plan(
        wishes,
        places,
        modal,
        first,
        mounts,
        phi[:, :r],
        aimed,
        layout,
        moves,
        pretest.visibility(phi[ranked, :r], largest),
        pretest.visibility(seen, largest),
        log_det,
        mode_sweep(_visible(phi[normal], aimed), wishes.sensors, int(aimed.sum())),
        pretest.ranked_actuators(shaker, f[aimed], flat),
        pretest.best_actuators(shaker, wishes.actuators),
        (pretest.modal_rank(f, seen), 2 * r),
        pretest.gramian_quotient(observed, f),
        pretest.auto_mac(seen),
        _loaded(built, modal, mounts.ids[layout], wishes.mass),
        hangers,
        quiet,
    )


def _visible(phi: np.ndarray, aimed: np.ndarray) -> np.ndarray:
    """Shapes at the normals of the modes aimed at and of all above the targets."""
    return phi[:, np.r_[aimed, np.ones(phi.shape[1] - len(aimed), bool)]]


def target_modes(built: Structure, wishes: Wishes) -> tuple[ModalModel, ModalModel, int]:
    """Target modes, these and some above, and the number of rigid modes before them."""
    due = wishes.modes or min(24, 4 * wishes.sensors // 5)
    n = len(built.system.dofs)
    where = built.assembly.points[built.assembly.rows(built.system.dofs[:, 0])]
    modal = normal_modes(built.system, min(n, due + SPARE + 6), points=where)
    rigid = int(rigid_modes(modal).sum())
    above = modal.sel(slice(rigid, None)).with_damping(wishes.damping)
    below = np.flatnonzero(above.frequency <= (wishes.top or np.inf))
    if not len(below):
        raise ModelError(
            f"no flexible mode below {wishes.top:g} Hz; the first is at {above.frequency[0]:.4g} Hz"
        )
    return above.sel(slice(0, min(due, len(below)))), above, rigid


def motion(built: Structure, modal: ModalModel) -> np.ndarray:
    """Translation of every point (n_points, 3, r)."""
    u = built.T @ modal.shapes
    return np.asarray(u.reshape(len(built.assembly.points), 6, -1)[:, :3])


def shapes(built: Structure, modal: ModalModel, mounts: Mount) -> np.ndarray:
    """Shapes at the mounts along their directions (m, r)."""
    return np.asarray(built.along(mounts.ids, mounts.directions) @ modal.shapes)


def mounts_at(places: Places) -> Mount:
    """Normals of all places, then the two axes of the basic frame most along each sheet."""
    ids, points = [places.ids], [places.points]
    directions, names = [places.normals], [_labels(places.ids, places.normals)]
    side = [places.side]
    across = np.argsort(np.abs(places.normals), axis=1)[:, :2]
    for k in range(2):
        axes = np.eye(3)[across[:, k]]
        good = np.abs(np.einsum("ij,ij->i", axes, places.normals)) < TANGENT
        ids.append(places.ids[good])
        points.append(places.points[good])
        directions.append(axes[good])
        names.append(_labels(places.ids[good], axes[good]))
        side.append(places.side[good])
    count = sum(map(len, ids))
    return Mount(
        np.concatenate(ids),
        np.concatenate(points),
        np.concatenate(directions),
        tuple(name for group in names for name in group),
        np.arange(count) < len(places),
        np.concatenate(side),
    )


def _labels(ids: np.ndarray, directions: np.ndarray) -> list[str]:
    """412:+Z where the direction is an axis, else 412:n."""
    axis = np.abs(directions).argmax(axis=1)
    value = directions[np.arange(len(ids)), axis]
    return [
        label(int(i), int(a) + 1, 1 if v > 0 else -1) if abs(v) > 1 - 1e-6 else f"{i}:n"
        for i, a, v in zip(ids, axis, value, strict=True)
    ]


def _near(mounts: Mount, wishes: Wishes) -> pretest.Rules:
    """Sensors keep their distance; one grid bears one sensor."""
    near = pretest.too_near(mounts.points, max(wishes.spacing, 1e-9))
    return pretest.Rules(near=near)


def _layout(phi: np.ndarray, mounts: Mount, wishes: Wishes) -> tuple[np.ndarray, dict[str, float]]:
    """The layout, ranked, and log det of the layouts of several methods."""
    c = pretest.candidates(phi)
    rules = pretest.Rules(near=pretest.too_near(mounts.points[mounts.normal], wishes.spacing))
    rules = rules if wishes.spacing > 0 else pretest.Rules()
    efi = pretest.deletion(c, wishes.sensors, rules=rules).ranked
    greedy = pretest.greedy(c, wishes.sensors, rules=rules)
    kept = pretest.exchange(c, efi, rules=rules)
    best = pretest.deletion(c, wishes.sensors, rules=_only(kept, len(c))).ranked
    layouts = {"greedy": greedy, "effective independence": efi, "with exchange": kept}
    if wishes.spacing == 0 and c.rows.shape[0] == 1:
        layouts = {"pivoted QR": pretest.qr_ranking(c.rows[0])[: wishes.sensors], **layouts}
    return best, {name: pretest.value("D", c.fisher(k)) for name, k in layouts.items()}


def _only(kept: np.ndarray, n: int) -> pretest.Rules:
    """Rules that leave no choice but the kept."""
    forbidden = np.ones(n, bool)
    forbidden[kept] = False
    return pretest.Rules(forbidden=forbidden)


def _draws(
    assembly: Assembly, wishes: Wishes, mounts: Mount, r: int, progress: Progress
) -> np.ndarray:
    """Target shapes of models with drawn thickness, at the normals (draws, m, r)."""
    rng, out = np.random.default_rng(wishes.seed), []
    for k in range(wishes.draws):
        progress(f"model {k + 1} of {wishes.draws} drawn", 0.6 + 0.15 * k / wishes.draws)
        scale = np.exp(wishes.spread * rng.standard_normal(len(assembly.parts)).clip(-2, 2))
        shells = assembly.shells
        t = shells.thickness * scale[shells.part][:, None]
        drawn = structure(replace(assembly, shells=replace(shells, thickness=t)))
        modal, _, _ = target_modes(drawn, replace(wishes, modes=r, top=None))
        out.append(shapes(drawn, modal, mounts)[mounts.normal])
    return np.stack(out)


def mode_sweep(phi: np.ndarray, n_sensors: int, target: int) -> tuple[tuple[int, float], ...]:
    """Share of the layout that stays when more modes are targeted (thesis 4.1, figure 8).

    Each entry is (modes, overlap of its layout with that of the entry before).
    """
    most = min(n_sensors, phi.shape[1])
    counts = sorted({*np.linspace(max(2, target // 3), most, 7).astype(int).tolist(), target})
    layouts = {}
    for count in counts:
        layouts[count] = pretest.effective_independence(phi[:, :count], n_sensors)
    pairs = pairwise(counts)
    return tuple((b, pretest.overlap(layouts[b], layouts[a])) for a, b in pairs)


def _loaded(built: Structure, modal: ModalModel, ids: np.ndarray, mass: float) -> np.ndarray:
    """Frequencies with the sensors on [Hz]."""
    three = np.stack(
        [built.along(ids, np.tile(axis, (len(ids), 1))) @ modal.shapes for axis in np.eye(3)], 1
    )
    return pretest.loaded_frequency(modal.frequency, three, mass)


def hang_points(
    built: Structure, modal: ModalModel, places: Places, count: int = 4, first: int = 5
) -> tuple[np.ndarray, np.ndarray]:
    """Grids that move least in the first modes, well apart: near nodes, where cords add least.

    Returns the grids and their rms motion, each mode over its largest anywhere.
    """
    size = np.linalg.norm(motion(built, modal.sel(slice(0, first))), axis=1)
    quiet = np.sqrt(((size[places.rows] / size.max(axis=0)) ** 2).mean(axis=1))
    reach = 0.3 * float(np.linalg.norm(np.ptp(places.points, axis=0)))
    chosen: list[int] = []
    for k in np.argsort(quiet, kind="stable"):
        away = np.linalg.norm(places.points[chosen] - places.points[k], axis=1)
        if len(chosen) < count and np.all(away >= reach):
            chosen.append(int(k))
    return places.ids[chosen], quiet[chosen]
