"""Test plan of a structure: sensors with direction, shaker, bungee cords, spectral lines.

The method is that of Echaniz Granado (2015), section 4.1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from pathlib import Path

import numpy as np

from chladni.arguments import refuse_fields
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import ModalModel, rigid_modes
from chladni.effects.calibration_parameters import thickness_of
from chladni.ema.correlation import auto_mac
from chladni.errors import ModelError, ShapeError
from chladni.fem.assemble import Structure, structure
from chladni.inference.result import NextMeasurement
from chladni.model.assembly import Assembly
from chladni.progress import Progress, silent, within
from chladni.results import Result
from chladni.view.surface import Surface, surface
from chladni.workflows.before_any_test import PlannedTests
from chladni.workflows.place_words import PlaceRules, place_rules

from .actuator_ranking import ActuatorRanking, best_actuators, ranked_actuators, shaking
from .drawn_models import drawn, ensemble
from .gramians import gramian_quotient, modal_rank, observability_gramian
from .layouts.deletion import deletion, effective_independence, greedy, qr_ranking
from .layouts.distinct import distinct
from .layouts.exchange import exchange
from .layouts.information import Candidates, candidates, value
from .layouts.layout_quality import Move, loaded_frequency, overlap, visibility, with_visible_modes
from .layouts.layout_rules import Rules, too_near
from .mounts import Mount, mounts_at, seen_at
from .rattle import Openings, Rattle, first_rattle, openings
from .sensor_candidates import SensorCandidates, find_sensor_candidates

SPARE = 6  # modes computed beyond the target modes, for the sweep over more modes
_CORDS = 4  # of an article that hangs
BLIND = 0.25  # of the floor: a mode that no place sees better is no target of the layout


@dataclass(frozen=True)
class PlanSettings:
    """Settings of a test plan; lengths in metres.

    Attributes
    ----------
    sensors : number of uniaxial accelerometers
    modes : target modes; None: modes below ``f_max``, or 24, or 4/5 of the sensors, one at least
    f_max : highest frequency of interest [Hz]
    damping : expected damping ratio of every mode
    candidates : number of candidate places
    spacing : least distance between two sensors [m]
    alike : highest AutoMAC of two modes at the sensors; 1: no limit
    actuators : number of shakers that work together
    force : amplitude of a shaker at which nothing may rattle [N]
    floor : least visibility of a mode: largest motion a sensor sees over the largest anywhere
    mass : of one sensor [kg]
    draws, spread : number of models drawn, and standard deviation of ln of every part's thickness;
                    the layout then serves all of them
    seed : of the draws
    regions : parts, boxes, labels or files of labels (:mod:`chladni.workflows.place_words`);
              nothing is put elsewhere
    fixed : labels, or tables, of sensors in every layout
    forbidden : places for no sensor, shaker or cord, in words as the regions
    cost : of a sensor, by place: ``inner=3`` (a dict in Python) or a CSV file; others cost 1. The
           layout has the most information with that of a place divided by its cost.
    separate : names of effects, or the folder of a diagnosis, whose open explanations some of the
               sensors must tell apart; the others see the modes
    """

    sensors: int = 30
    modes: int | None = None
    f_max: float | None = None
    damping: float = 0.01
    candidates: int = 300
    spacing: float = 0.0
    alike: float = 0.15
    actuators: int = 1
    force: float = 5.0
    floor: float = 0.2
    mass: float = 0.005
    draws: int = 0
    spread: float = 0.1
    seed: int = 0
    regions: Sequence[str] = ()
    fixed: Sequence[str] = ()
    forbidden: Sequence[str] = ()
    cost: Sequence[str] | Mapping[str, float] = ()
    separate: str | Path | Sequence[str] = ()

    def __post_init__(self) -> None:
        refuse_fields(
            self, sensors=(1, inf), modes=(1, inf), f_max=(0, inf), damping=(1e-6, inf),
            candidates=(2, inf), spacing=(0, inf), alike=(0, 1), actuators=(1, inf),
            force=(1e-9, inf), floor=(0, 1), mass=(0, inf), draws=(0, inf), spread=(0, inf),
            seed=(0, inf),
        )  # fmt: skip

    def rules(self, assembly: Assembly, seen: Surface) -> PlaceRules:
        """The rules for places on a mesh that these settings state."""
        return place_rules(assembly, seen, self.regions, self.fixed, self.forbidden, self.cost)


@dataclass(frozen=True, eq=False)
class Separation:
    """Sensors of a layout that tell explanations apart.

    Attributes
    ----------
    names : of the explanations
    folder : of the diagnosis that left them open; "" before any test
    labels : of the sensors that serve for it
    apart : distance d of the explanations with these sensors, in standard deviations of all that
            is not known; of several pairs that of the mean of ln(1 + d²)
    steps : these sensors one after the other, with what they would do
    before, after : tests of articles by the sensors for modes alone, and by this layout
    """

    names: tuple[str, ...]
    folder: str = ""
    labels: tuple[str, ...] = ()
    apart: float = 0.0
    steps: tuple[NextMeasurement, ...] = ()
    before: PlannedTests | None = None
    after: PlannedTests | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Result):
    """A test plan; arrays over modes are over the flexible target modes.

    Attributes
    ----------
    places : SensorCandidates
    modal : ModalModel            target modes, damping as in the settings
    first : int                   number of the first of them in the deck (rigid modes before it)
    mounts : Mount                every candidate: normals first, then directions on blocks
    phi : (m, r)                  target shapes at the mounts
    aimed : (r,) bool             modes visible to a sensor glued flat: the layout is for them
    layout : (n_sensors,) int     mounts, the most informative first
    moves : tuple of Move         sensors moved so that a mode is seen
    visible_before, visible : (r,)  before and after the moves
    log_det : {method: value}     of the layouts of several methods, before the moves
    cost : {method: value}        of these layouts, the sum over their sensors
    sweep : ((modes, overlap), ...)  share of the layout kept when the sweep takes more modes
    actuators : ActuatorRanking   over the normals, each alone; vetoed without a free line to the
                                  place, or where it rattles below the force of the settings
    rattle : Rattle               at the normals
    openings : Openings           where sheets may meet
    together : (k,) int           the shakers that drive all modes most evenly together
    observable : (rank, states)
    quotient : float              of the observability gramian (Echaniz Granado 2015, section 4.1.1)
    auto_mac : (r, r)             at the sensors
    loaded : (r,)                 frequencies with the sensors' mass on [Hz]
    hangers : (k,) int            grids, the quietest first; none of a structure that is held
    quiet : (k,)                  their rms motion over the first modes, of the largest anywhere
    rules : PlaceRules            on the surface of the model
    notes : the unit system, where it was guessed
    separation : explanations that the layout must tell apart, where the settings name some
    """

    settings: PlanSettings
    places: SensorCandidates
    modal: ModalModel
    first: int
    mounts: Mount
    phi: np.ndarray
    aimed: np.ndarray
    layout: np.ndarray
    moves: tuple[Move, ...]
    visible_before: np.ndarray
    visible: np.ndarray
    log_det: dict[str, float]
    cost: dict[str, float]
    sweep: tuple[tuple[int, float], ...]
    actuators: ActuatorRanking
    rattle: Rattle
    openings: Openings
    together: np.ndarray
    observable: tuple[int, int]
    quotient: float
    auto_mac: np.ndarray
    loaded: np.ndarray
    hangers: np.ndarray
    quiet: np.ndarray
    rules: PlaceRules
    notes: tuple[str, ...] = ()
    separation: Separation | None = None


def plan_test(
    assembly: Assembly,
    settings: PlanSettings | None = None,
    *,
    built: Structure | None = None,
    unit: str = "m",
    progress: Progress = silent,
) -> Plan:
    """Plan a test: candidates on the mesh, effective independence, exchange, shaker and cords.

    Parameters
    ----------
    built : the assembled structure, if it exists already
    unit : "" where the deck's unit of length is not known
    """
    settings = settings or PlanSettings()
    if not any(map(thickness_of, assembly.parts)):
        settings = replace(settings, draws=0)  # nothing to draw
    progress("places for sensors", 0.05)
    rules = settings.rules(assembly, surface(assembly, unit))
    places = find_sensor_candidates(assembly, settings.candidates, unit=unit, rules=rules)
    settings = replace(settings, sensors=min(settings.sensors, len(places)))
    progress("modes", 0.2)
    built = built or structure(assembly)
    modal, above, first = target_modes(built, settings)
    mounts = mounts_at(places)
    moving = motion(built, above)
    phi = seen_at(places, mounts, moving)
    progress("sensors", 0.6)
    r, normal = len(modal), mounts.normal
    largest = np.linalg.norm(moving, axis=1).max(axis=0)
    visible = visibility(phi[normal], largest) >= BLIND * settings.floor
    aimed, largest = visible[:r], largest[:r]
    flat = phi[normal, :r][:, aimed]
    draws = flat
    if settings.draws:
        stage = within(progress, 0.6, 0.75)
        models = ensemble(built, float(modal.frequency[-1]), settings.spread, stage)
        basis = seen_at(places, mounts, recovered(built, models.basis))[normal]
        _, draws = drawn(models, basis, r, settings.draws, settings.spread, settings.seed)
        draws = draws[:, :, aimed]
    ranked, log_det, cost = _layout(draws, places, settings)
    held = _rules(mounts.points, np.flatnonzero(places.fixed != ""), max(settings.spacing, 1e-9))
    layout, moves = with_visible_modes(
        phi[:, :r], ranked, largest, floor=settings.floor, rules=held
    )
    progress("shaker and cords", 0.8)
    f, zeta, seen = modal.frequency, modal.damping, phi[layout, :r]
    shaker = shaking(f[aimed], zeta[aimed], seen[:, aimed], flat)
    observed = observability_gramian(f, zeta, seen)
    gaps = openings(assembly, moving[:, :, :r])
    rattle = first_rattle(f, zeta, phi[normal, :r], gaps)
    ranking = ranked_actuators(
        shaker, f[aimed], flat, margin=rattle.force / settings.force, access=places.straight
    )
    enough = ranking.allowed.sum() >= settings.actuators
    together = best_actuators(shaker, settings.actuators, ranking.allowed if enough else None)
    if not np.isfinite(shaker.condition(together)):
        together = np.sort(ranking.order[: settings.actuators])
    hangers, quiet = hang_points(moving[:, :, :r], places, _CORDS if first else 0)
    three = places.moving(moving, mounts.place[layout])[..., :r]
    return Plan(
        settings,
        places,
        modal,
        first,
        mounts,
        phi[:, :r],
        aimed,
        layout,
        moves,
        visibility(phi[ranked, :r], largest),
        visibility(seen, largest),
        log_det,
        cost,
        mode_sweep(phi[normal][:, visible], settings.sensors, int(aimed.sum())),
        ranking,
        rattle,
        gaps,
        together,
        (modal_rank(f, seen), 2 * r),
        gramian_quotient(observed, f),
        auto_mac(seen),
        loaded_frequency(f, three, settings.mass),
        hangers,
        quiet,
        rules,
    )


def target_modes(built: Structure, settings: PlanSettings) -> tuple[ModalModel, ModalModel, int]:
    """Target modes, target modes plus some above, and the number of rigid modes before them."""
    due = settings.modes or max(1, min(24, 4 * settings.sensors // 5))
    n = len(built.system.dofs)
    modal = normal_modes(built.system, min(n, due + SPARE + 6))
    rigid = int(rigid_modes(modal).sum())
    above = modal.sel(slice(rigid, None)).with_damping(settings.damping)
    below = np.flatnonzero(
        above.frequency <= (np.inf if settings.f_max is None else settings.f_max)
    )
    if not len(below):
        raise ModelError(
            f"no flexible mode below {settings.f_max:g} Hz; raise the top of the band above the "
            f"first, at {above.frequency[0]:.4g} Hz"
        )
    return above.sel(slice(0, min(due, len(below)))), above, rigid


def motion(built: Structure, modal: ModalModel) -> np.ndarray:
    """Translation of every point (n_points, 3, r)."""
    return recovered(built, modal.shapes)


def recovered(built: Structure, vectors: np.ndarray) -> np.ndarray:
    """Translation of every point (n_points, 3, k) in vectors over the free dofs (n_free, k)."""
    u = built.T @ vectors
    return u.reshape(len(built.assembly.points), 6, -1)[:, :3]


def _rules(points: np.ndarray, fixed: np.ndarray, spacing: float) -> Rules:
    """Fixed places, and a minimum distance between others and to them; 0: any."""
    if spacing <= 0:
        return Rules(fixed=fixed)
    near = too_near(points, spacing)
    near[np.ix_(fixed, fixed)] = False
    return Rules(fixed=fixed, near=near)


def _layout(
    phi: np.ndarray, places: SensorCandidates, settings: PlanSettings
) -> tuple[np.ndarray, dict[str, float], dict[str, float]]:
    """The layout, ranked; log det and cost of the layouts of several methods.

    With costs c the rows of φ are divided by √c, as in designs under a limit on the total cost
    (Fedorov and Leonov 2013, Optimal Design for Nonlinear Response Models, chapter 4). The unit of
    the costs is of no matter.
    """
    plain, n = candidates(phi), settings.sensors
    even = bool(np.ptp(places.cost) == 0)
    c = plain if even else candidates(phi, places.cost)
    rules = _rules(places.points, np.flatnonzero(places.fixed != ""), settings.spacing)

    def improved(c: Candidates) -> dict[str, np.ndarray]:
        efi = deletion(c, n, rules=rules).ranked
        kept = {"effective independence": efi, "with exchange": exchange(c, efi, rules=rules)}
        if settings.alike < 1:
            kept["with modes distinguished"] = distinct(
                c, kept["with exchange"], ceiling=settings.alike, rules=rules, shapes=plain
            )
        return kept

    layouts = {"greedy": greedy(c, n, rules=rules), **improved(c)}
    best = list(layouts.values())[-1]
    if not even:
        layouts = {"without costs": list(improved(plain).values())[-1], **layouts}
    if even and rules.near is None and not len(rules.fixed) and c.rows.shape[0] == 1:
        layouts = {"pivoted QR": qr_ranking(c.rows[0])[:n], **layouts}
    forbidden = np.ones(len(c), bool)
    forbidden[best] = False
    ranked = deletion(c, n, rules=Rules(forbidden=forbidden)).ranked
    log_det = {name: value("D", plain.fisher(k)) for name, k in layouts.items()}
    return ranked, log_det, {name: float(places.cost[k].sum()) for name, k in layouts.items()}


def mode_sweep(phi: np.ndarray, n_sensors: int, target: int) -> tuple[tuple[int, float], ...]:
    """Share of the layout that stays when more modes are targeted.

    Echaniz Granado (2015), section 4.1 and figure 8.

    Each entry is (modes, overlap of its layout with that of the entry before). The list ends where
    the places cannot distinguish more modes.
    """
    most = min(n_sensors, phi.shape[1])
    counts = sorted({*np.linspace(max(2, target // 3), most, 7).astype(int).tolist(), target})
    layouts = {}
    for count in counts:
        try:
            layouts[count] = effective_independence(phi[:, :count], n_sensors)
        except ShapeError:
            break
    pairs = pairwise(layouts)
    return tuple((b, overlap(layouts[b], layouts[a])) for a, b in pairs)


def hang_points(
    moving: np.ndarray, places: SensorCandidates, count: int, first: int = 5
) -> tuple[np.ndarray, np.ndarray]:
    """Grids that move least in the first modes, well apart: cords add least near nodes.

    Returns the grids and their rms motion, where each mode is scaled to its largest motion;
    ``moving`` is the motion of all points (n_points, 3, r).
    """
    size = np.linalg.norm(moving[:, :, :first], axis=1)
    quiet = np.sqrt(((places.moving(size) / size.max(axis=0)) ** 2).mean(axis=1))
    quiet[~places.is_grid] = np.inf  # a case names hangers by grid
    reach = 0.3 * float(np.linalg.norm(np.ptp(places.points, axis=0)))
    chosen: list[int] = []
    for k in np.argsort(quiet, kind="stable"):
        away = np.linalg.norm(places.points[chosen] - places.points[k], axis=1)
        if len(chosen) < count and np.all(away >= reach) and np.isfinite(quiet[k]):
            chosen.append(int(k))
    return places.ids[chosen], quiet[chosen]
