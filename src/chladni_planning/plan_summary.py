"""A plan row by row: sensors, shakers, modes, lines and duration; the table of sensors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.io.tables.csv_table import csv_text

from .layouts.information import candidates, value
from .measurement_lines import (
    burst_random_time,
    delay_at,
    even_lines,
    half_bandwidth,
    lines_per_bandwidth,
    lines_time,
)
from .whole_plan import Plan

PER_BANDWIDTH = (
    4  # lines in every half-bandwidth; three are enough, Echaniz Granado 2015, section 5.2
)
AVERAGES = 20
SHOWN = 20  # actuators listed


@dataclass(frozen=True, eq=False)
class PlannedPlace:
    """A place and a direction; ``side`` of the surface normal is +1 or -1."""

    label: str
    grid: int | None  # None: the centre of a shell
    direction: np.ndarray
    point_m: np.ndarray
    mounted: Literal["flat", "on a block", "fixed"]
    side: int


@dataclass(frozen=True, eq=False)
class PlannedSensor:
    """A sensor; ``for_mode`` is the mode it was moved for, ``cost`` that of its place."""

    rank: int
    at: PlannedPlace
    for_mode: int | None
    mass_kg: float
    cost: float


@dataclass(frozen=True, eq=False)
class PlannedActuator:
    """A shaker place with its scores and the reasons against it."""

    at: PlannedPlace
    condition: float
    weakest_mode: float
    least_over_mean_residue: float
    straight_way_to_it: bool
    rattles_from_n: float | None
    rattles_between: tuple[str, str] | None
    rattles_in_mode: int | None
    rattle_gap_known: bool | None
    vetoed: bool
    is_sensor: bool


@dataclass(frozen=True)
class PlannedMode:
    """Visibility of a mode at the sensors; ``mode`` counts in the deck, from 1."""

    mode: int
    frequency_hz: float
    visibility: float
    visibility_before: float
    seen_by_normals: bool
    seen: bool
    with_sensor_mass_hz: float


@dataclass(frozen=True)
class MovedSensor:
    """A sensor moved from one label to another, so that a mode is seen."""

    mode: int
    given_up: str
    taken: str
    before: float
    after: float


@dataclass(frozen=True)
class RattleOverview:
    """Clearances in the mesh and their consequence for all shaker places."""

    force_n: float
    places_vetoed: int
    without_a_straight_way: int
    open_places: int
    least_clearance_m: float | None
    touching_places: int
    touching_pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PlanScores:
    """Numbers by which layouts are compared."""

    log_det: float
    log_det_by_method: Mapping[str, float]
    cost: float  # of the sensors, by their places
    cost_by_method: Mapping[str, float]
    auto_mac_highest: float
    observability_rank: int
    states: int
    gramian_quotient: float


@dataclass(frozen=True, eq=False)
class Durations:
    """Lines and time of a stepped-sine sweep and of burst random."""

    band_hz: tuple[float, float]
    lines: int
    lines_hz: np.ndarray
    lines_per_octave: float
    lines_per_half_bandwidth: np.ndarray
    stepped_sine_s: float
    longest_wait_cycles: float
    burst_random_s: float
    burst_random_resolution_hz: float


@dataclass(frozen=True, eq=False)
class PlanSummary:
    """Ordered sensors, ranked actuators, modes, scores."""

    sensors: tuple[PlannedSensor, ...]
    actuators: tuple[PlannedActuator, ...]
    actuators_together: tuple[PlannedPlace, ...]
    hangers: np.ndarray
    rattle: RattleOverview
    modes: tuple[PlannedMode, ...]
    moves: tuple[MovedSensor, ...]
    mode_sweep: tuple[tuple[int, float], ...]
    candidates: int
    refused: Mapping[str, int]
    scores: PlanScores
    test: Durations


def summary(found: Plan) -> PlanSummary:
    """The plan row by row."""
    return PlanSummary(
        sensors=_sensors(found),
        actuators=tuple(_actuator(found, int(i)) for i in found.actuators.order[:SHOWN]),
        actuators_together=tuple(_place(found, int(i)) for i in found.together),
        hangers=found.hangers,
        rattle=_rattle(found),
        modes=_modes(found),
        moves=_moves(found),
        mode_sweep=found.sweep,
        candidates=len(found.places),
        refused=dict(found.places.refused),
        scores=_scores(found),
        test=durations(found),
    )


def _place(found: Plan, i: int) -> PlannedPlace:
    """Description of one place and direction."""
    m = found.mounts
    grid = int(m.ids[i]) if found.places.is_grid[m.place[i]] else None
    mounted: Literal["flat", "on a block", "fixed"] = "flat" if m.normal[i] else "on a block"
    if m.normal[i] and found.places.fixed[m.place[i]]:
        mounted = "fixed"
    return PlannedPlace(m.labels[i], grid, m.directions[i], m.points[i], mounted, int(m.side[i]))


def _sensors(found: Plan) -> tuple[PlannedSensor, ...]:
    moved = {m.into: found.first + 1 + m.mode for m in found.moves}
    return tuple(
        PlannedSensor(
            k + 1,
            _place(found, i),
            moved.get(i),
            found.settings.mass,
            float(found.places.cost[found.mounts.place[i]]),
        )
        for k, i in enumerate(found.layout.tolist())
    )


def _actuator(found: Plan, i: int) -> PlannedActuator:
    place = int(found.rattle.place[i])
    quiet = place < 0
    return PlannedActuator(
        at=_place(found, i),
        condition=float(found.actuators.condition[i]),
        weakest_mode=float(found.actuators.weakest[i]),
        least_over_mean_residue=float(found.actuators.residue[i]),
        straight_way_to_it=bool(found.places.straight[found.mounts.place[i]]),
        rattles_from_n=None if quiet else float(found.rattle.force[i]),
        rattles_between=None if quiet else found.openings.pairs[found.openings.pair[place]],
        rattles_in_mode=None if quiet else found.first + 1 + int(found.rattle.mode[i]),
        rattle_gap_known=None if quiet else bool(found.openings.known[place]),
        vetoed=not bool(found.actuators.allowed[i]),
        is_sensor=bool(i in found.layout),
    )


def _rattle(found: Plan) -> RattleOverview:
    clearance, known = found.openings.clearance, found.openings.known
    return RattleOverview(
        force_n=found.settings.force,
        places_vetoed=int((found.rattle.force < found.settings.force).sum()),
        without_a_straight_way=int((~found.places.straight).sum()),
        open_places=int(known.sum()),
        least_clearance_m=float(clearance[known].min()) if known.any() else None,
        touching_places=int((~known).sum()),
        touching_pairs=found.openings.touching,
    )


def _modes(found: Plan) -> tuple[PlannedMode, ...]:
    return tuple(
        PlannedMode(
            mode=found.first + 1 + k,
            frequency_hz=float(f),
            visibility=float(found.visible[k]),
            visibility_before=float(found.visible_before[k]),
            seen_by_normals=bool(found.aimed[k]),
            seen=bool(found.visible[k] >= found.settings.floor),
            with_sensor_mass_hz=float(found.loaded[k]),
        )
        for k, f in enumerate(found.modal.frequency)
    )


def _moves(found: Plan) -> tuple[MovedSensor, ...]:
    names = found.mounts.labels
    return tuple(
        MovedSensor(found.first + 1 + m.mode, names[m.out], names[m.into], m.before, m.after)
        for m in found.moves
    )


def _scores(found: Plan) -> PlanScores:
    kept = candidates(found.phi).fisher(found.layout)
    return PlanScores(
        log_det=value("D", kept),
        log_det_by_method=found.log_det,
        cost=cost_of(found),
        cost_by_method=found.cost,
        auto_mac_highest=float((found.auto_mac - np.eye(len(found.modal))).max(initial=0.0)),
        observability_rank=found.observable[0],
        states=found.observable[1],
        gramian_quotient=found.quotient,
    )


def cost_of(found: Plan) -> float:
    """Sum of the costs of the sensors' places."""
    return float(found.places.cost[found.mounts.place[found.layout]].sum())


def durations(found: Plan) -> Durations:
    """Lines and time of a stepped-sine sweep and of burst random."""
    f, zeta = found.modal.frequency, found.modal.damping
    low, high = float(0.7 * f[0]), float(1.05 * f[-1])
    lines = even_lines(low, high, float(zeta.min()), PER_BANDWIDTH)
    wait = delay_at(lines, f, zeta)
    resolution = float(half_bandwidth(f[0], zeta[0]) / PER_BANDWIDTH)
    return Durations(
        band_hz=(low, high),
        lines=len(lines),
        lines_hz=lines,
        lines_per_octave=float(np.log(2) / np.log(lines[1] / lines[0])),
        lines_per_half_bandwidth=lines_per_bandwidth(lines, f, zeta),
        stepped_sine_s=lines_time(lines, wait),
        longest_wait_cycles=float(wait.max()),
        burst_random_s=burst_random_time(resolution, AVERAGES),
        burst_random_resolution_hz=resolution,
    )


def sensors_csv(found: Plan, driven: str = "") -> str:
    """The sensor table of a case: sensors in order of rank, then the shakers or ``driven``.

    A place that is not a grid is given by x, y, z [m]; its label is a number that no grid has.
    """
    table: list[list[object]] = [["label", "grid", "x", "y", "z", "nx", "ny", "nz", "role", "mass"]]
    rows = [(int(i), "output", found.settings.mass) for i in found.layout]
    rows += [] if driven else [(int(i), "input", 0.0) for i in found.together]
    for i, role, mass in rows:
        at = _place(found, i)
        place = [""] * 3 if at.grid is not None else [f"{x:.7g}" for x in at.point_m]
        direction = [f"{x:.9g}" for x in at.direction]
        table.append([at.label, at.grid, *place, *direction, role, f"{mass:g}"])
    if driven:
        table.append([driven, *[""] * 7, "input", "0"])
    return csv_text(table)
