"""A plan as a page: pictures of the layout and of its coverage, tables, sentences."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.errors import named
from chladni.fem.assemble import Structure
from chladni.output import write_text
from chladni.report.blocks import (
    Block,
    Drawing,
    Facts,
    Items,
    PageParts,
    Section,
    Table,
    Text,
    still,
)
from chladni.report.mesh_drawings import field, layout, mesh_of, mode_shapes
from chladni.report.shown import Shown
from chladni.report.words import direction, fixed, hertz, number, percent, rounded
from chladni.view import annotations, charts

from .plan_json import plan_json
from .plan_summary import (
    AVERAGES,
    PER_BANDWIDTH,
    Durations,
    PlannedActuator,
    PlannedPlace,
    PlanSummary,
    cost_of,
    sensors_csv,
    summary,
)
from .sensor_candidates import FOOT, SensorCandidates
from .separation_page import separation_section
from .whole_plan import Plan, motion

_SHOWN = 12  # modes in the picture of shapes


def as_page(folder: Path, found: Plan) -> PageParts:
    """Sections of the page; the table of sensors is written into the folder."""
    write_text(folder / "sensors.csv", sensors_csv(found))
    result, model = summary(found), found.origin
    shown = mesh_of(model.seen, model.assembly)
    body = sections(found, result, shown, model.structure)
    files = [("sensors.csv", "sensors and shakers, for case.toml")]
    return PageParts(lead(result), body, notes(found), files)


def as_json(found: Plan) -> dict[str, Any]:
    """Content of ``plan.json``."""
    return plan_json(summary(found))


def in_words(found: Plan) -> PageParts:
    """The page without its pictures."""
    result = summary(found)
    body = [Section("Sensors", [_layout(result)]), *_apart(found)]
    return PageParts(lead(result), body, notes(found))


def _apart(found: Plan) -> list[Section]:
    """The explanations that the layout separates, where the settings name some."""
    return [] if found.separation is None else [separation_section(found.separation)]


def lead(result: PlanSummary) -> str:
    """The plan in two sentences."""
    f = [m.frequency_hz for m in result.modes]
    shake = ", ".join(at.label for at in result.actuators_together)
    unseen = [str(m.mode) for m in result.modes if not m.seen]
    text = (
        f"{len(result.sensors)} sensors tell {len(f)} modes from {number(f[0])} to "
        f"{number(f[-1])} Hz apart; shake at {shake}."
    )
    return text + (f" Barely visible: mode {', '.join(unseen)}." if unseen else "")


def notes(found: Plan) -> list[str]:
    """List decisions of the planning, and warnings."""
    centres = int((~found.places.is_grid).sum())
    out = [*found.notes, *_places_notes(found.places), *_cost_notes(found)]
    apart = () if found.separation is None else found.separation.labels
    if fixed := [name for name in found.places.fixed if name and name not in apart]:
        out.append(f"Fixed by the settings: {named(fixed)}.")
    if len(found.layout) == len(found.places):
        out.append(f"Every place has a sensor: there is room for only {len(found.places)}.")
    if centres:
        out.append(
            f"{centres} of the places are centres of shells, in strips too narrow for a grid away "
            "from the edges; sensors.csv gives their x, y, z."
        )
    shift = np.abs(found.loaded / found.modal.frequency - 1).max()
    if shift > 0.005:
        out.append(
            f"The sensors' mass changes frequencies by up to {100 * shift:.1f} %: add their mass "
            "to the model before the comparison."
        )
    if not found.aimed.all():
        blind = ", ".join(str(found.first + 1 + k) for k in np.flatnonzero(~found.aimed))
        out.append(
            f"No flat sensor sees mode {blind}, which moves along the sheets or where no sensor "
            "fits, and no shaker at a normal drives it well. The layout serves the other modes; "
            "a sensor on a block was moved to this mode where that helps."
        )
    out += _rattle_notes(found)
    if found.settings.draws:
        out.append(
            f"The layout serves {found.settings.draws} models with the thickness of every part "
            f"drawn with a standard deviation of {100 * found.settings.spread:g} %."
        )
    return out


def _places_notes(places: SensorCandidates) -> list[str]:
    """Describe the searched places, and those left out."""
    if not places.foot:
        return [
            f"{len(places)} places and directions were considered: grids of the beams, each with "
            "the two axes of the basic frame most normal to them. A sensor is glued to the wall, "
            "or to a block if the wall is inclined."
        ]
    refused = [f"{count} grids {why}" for why, count in places.refused.items() if count]
    out = [
        f"{len(places)} places were considered, spread over all flat surfaces that can be "
        f"reached; left out: {', '.join(refused) or 'none'}."
    ]
    if places.foot < 1:
        out.append(
            f"No surface is flat over the whole base of a sensor, whose radius is {1e3 * FOOT:g} "
            f"mm: the places are flat over {100 * places.foot:g} % of it. Inspect them before you "
            "glue."
        )
    return out


def _cost_notes(found: Plan) -> list[str]:
    """State the cost of the layout, and of that without costs."""
    if "without costs" not in found.cost:
        return []
    plain = number(found.cost["without costs"])
    return [
        f"The sensors cost {number(cost_of(found))}; a layout that regards no costs would cost "
        f"{plain}. The information of each place was divided by its cost."
    ]


def _rattle_notes(found: Plan) -> list[str]:
    """List vetoed shaker places, and pairs of parts that the mesh leaves undetermined."""
    out, force = [], found.settings.force
    if rattling := int((found.rattle.force < force).sum()):
        out.append(
            f"{rattling} places would rattle below {force:g} N: they are not used for a shaker."
        )
    if not np.isfinite(found.actuators.condition).any():
        out.append(
            "No single place drives all modes: some share a frequency, or are at rest where "
            "others move. Use two shakers (--shakers 2), or measure from two places."
        )
    if blocked := int((~found.places.straight).sum()):
        out.append(f"A straight rod cannot reach {blocked} places: they are for sensors only.")
    if not found.actuators.allowed[found.together].all():
        out.append(
            "The named shaker places are excluded too, but no better place remains. Lower the "
            "force (--force)."
        )
    if found.openings.touching:
        pairs = ", ".join(f"{a} and {b}" for a, b in found.openings.touching)
        out.append(
            f"Away from their joints these parts may touch: {pairs}. Their gap is below the "
            "uncertainty of the facets; half of this uncertainty was used, so the force at which "
            "they rattle is a guess (marked ~). Test these places first."
        )
    return out


def sections(found: Plan, result: PlanSummary, shown: Shown, built: Structure) -> list[Section]:
    """The sections of the page."""
    return [
        Section("Sensors", _sensors(found, result, shown)),
        *_apart(found),
        Section("Modes", _modes(found, result, shown, built)),
        Section(f"Shaker{' and cords' * bool(len(result.hangers))}", _shaker(found, result, shown)),
        Section("Lines and duration", [Text([_test(result.test)])]),
    ]


def _sensors(found: Plan, result: PlanSummary, shown: Shown) -> list[Block]:
    outputs = [_marker(s.at, str(s.rank)) for s in result.sensors]
    shakers = [_marker(at, "shaker") for at in result.actuators_together]
    cords = [_hanger(found, int(g)) for g in result.hangers]
    placed = replace(shown, outputs=outputs, inputs=shakers, cords=cords)
    caption = "Sensors by rank (blue), shaker (orange)."
    moves = [
        f"Mode {m.mode} was barely visible ({number(m.before, 2)} of its largest motion): the "
        f"sensor at {m.given_up} moves to {m.taken} ({number(m.after, 2)})."
        for m in result.moves
    ]
    return [
        layout("where", placed, "sensors", caption, "the layout"),
        *_allowed(found, shown),
        _layout(result),
        Text([_compared(found)]),
        Items(moves or ["All modes were visible, so no sensor was moved."]),
    ]


def _allowed(found: Plan, shown: Shown) -> list[Block]:
    """Draw where sensors may be, where the settings say it."""
    rules, faces = found.rules, len(shown.seen.faces)
    some, cost = rules.allowed[-faces:], rules.cost[-faces:]
    if not faces or (some.all() and np.ptp(cost) == 0):
        return []
    limits = (0.0, float(cost[some].max(initial=1.0)))
    caption = "Coloured: sensors and shakers may be there, at this cost. Grey: not allowed."
    values = np.where(some, cost, np.nan)
    return [field(shown, values, limits, "allowed", "cost of a sensor", caption, "YlGnBu")]


def _compared(found: Plan) -> str:
    """The layout next to those of other methods, by the errors of the modal coordinates."""
    last = list(found.log_det)[-1]
    r = len(found.modal)
    worse = [
        f"{name} {percent(float(np.exp((found.log_det[last] - value) / (2 * r))), 1.0)}"
        for name, value in found.log_det.items()
        if name != last
    ]
    return (
        "Mean standard deviation of the modal coordinates at equal noise, other layouts relative "
        f"to this one ({last}): {', '.join(worse)}."
    )


def _layout(result: PlanSummary) -> Table:
    """Tabulate the sensors by rank."""
    rows = [
        (str(s.rank), s.at.label, *_where(s.at), direction(s.at.direction.tolist()), s.at.mounted)
        for s in result.sensors
    ]
    return Table(
        ("rank", "label", "grid", "place [m]", "direction", "mounted"),
        rows,
        words=("label", "place [m]", "direction", "mounted"),
        caption="The most informative place is first; the last is the first to give up. A place "
        "without a grid is the centre of a shell.",
    )


def _where(at: PlannedPlace) -> tuple[str, str]:
    return "" if at.grid is None else str(at.grid), ", ".join(fixed(x, 3) for x in at.point_m)


def _marker(at: PlannedPlace, text: str) -> annotations.Marker:
    return _arrow(at.point_m, at.direction, text)


def _arrow(point: np.ndarray, direction: np.ndarray, text: str) -> annotations.Marker:
    x, y, z = (float(v) for v in point)
    a, b, c = (float(v) for v in direction)
    return annotations.Marker((x, y, z), (a, b, c), text)


def _modes(found: Plan, result: PlanSummary, shown: Shown, built: Structure) -> list[Block]:
    rows = [
        (
            str(m.mode),
            hertz(m.frequency_hz),
            f"{m.visibility:.2f}",
            "yes" if m.seen else "hardly",
            "yes" if m.seen_by_normals else "no, moves along the sheets",
            percent(found.loaded[k], m.frequency_hz),
        )
        for k, m in enumerate(result.modes)
    ]
    table = Table(
        ("mode", "Hz", "visibility", "seen", "seen by normals", "shift by sensors"),
        rows,
        words=("seen", "seen by normals"),
        caption="Visibility: largest motion at a sensor, relative to the largest anywhere.",
        opens="shapes",
        at=range(len(rows)),
    )
    sweep = [(str(n), f"{100 * share:.0f} %") for n, share in found.sweep]
    steps = Table(
        ("target modes", "layout kept"),
        sweep,
        caption="Share of the sensors that stay when the number of target modes changes from the "
        "row above to this one.",
    )
    f, moved = found.modal.frequency, motion(built, found.modal)
    numbers = [found.first + 1 + k for k in range(len(f))]
    auto = charts.mac(f, {"model": (found.auto_mac, f, [])}, "model", "shapes")
    said = (
        "AutoMAC at the sensors: similarity of each mode to each other one. High values off the "
        "diagonal are modes that these sensors cannot distinguish. Click one to see both."
    )
    return [
        table,
        *mode_shapes(shown, moved, f, numbers, _SHOWN, "the target modes", "modes",
                     {"model|model": found.auto_mac}),
        Drawing("mac", auto, said, {"auto_mac": still(auto)}, "AutoMAC at the sensors"),
        steps,
    ]  # fmt: skip


def _shaker(found: Plan, result: PlanSummary, shown: Shown) -> list[Block]:
    best = [_marker(a.at, str(k + 1)) for k, a in enumerate(result.actuators[:10])]
    rows = [
        (
            str(k + 1),
            a.at.label,
            *_where(a.at),
            number(rounded(a.condition)),
            f"{number(100 * a.weakest_mode, 2)} %",
            _rattling(a),
            "no" if a.vetoed else "yes",
            "yes" if a.is_sensor else "",
        )
        for k, a in enumerate(result.actuators[:10])
    ]
    s, free = result.scores, len(result.hangers) > 0
    facts = [
        ("Seen by the sensors", f"{s.observability_rank} of {s.states} states (rank of the "
         "observability matrix)"),
        ("Best and worst seen state", f"{_ratio(s.gramian_quotient)} apart in amplitude (square "
         "root of the quotient of the observability Gramian)"),
        *([("Cords at grids", ", ".join(map(str, result.hangers)))] if free else []),
    ]  # fmt: skip
    caption = (
        "Condition: best driven mode over the one driven least (Hankel singular values), the lower "
        "the better. Weakest mode: response of the one driven least, of that at the place where it "
        "responds most. The rank counts both. Rattles "
        "from: force at resonance at which two sheets first touch. Allowed: a straight rod "
        f"reaches the place, and nothing rattles at {found.settings.force:g} N."
    )
    columns = ("rank", "label", "grid", "place [m]", "condition", "weakest mode")
    words = ("rattles from", "allowed", "also a sensor")
    table = Table((*columns, *words), rows, words=("label", "place [m]", *words), caption=caption)
    cords = [_hanger(found, int(g)) for g in result.hangers]
    placed = replace(shown, inputs=best, cords=cords)
    what = f"Ten best shaker places (orange){', cords (green)' * free}."
    return [
        Facts(facts),
        layout("shaker", placed, "shaker", what, "shaker and cords", "shaker, by rank"),
        table,
    ]


def _ratio(quotient: float) -> str:
    """A factor between amplitudes, of a quotient of energies."""
    return f"a factor of {number(rounded(quotient**0.5))}"


def _rattling(actuator: PlannedActuator) -> str:
    if actuator.rattles_between is None or actuator.rattles_from_n is None:
        return "none predicted"
    a, b = actuator.rattles_between
    about = "" if actuator.rattle_gap_known else "~"
    return f"{about}{number(rounded(actuator.rattles_from_n))} N: {a} / {b}"


def _hanger(found: Plan, grid: int) -> annotations.Marker:
    k = int(np.flatnonzero(found.places.ids == grid)[0])
    return _arrow(found.places.points[k], found.places.normals[k], "")


def _test(t: Durations) -> str:
    low, high = t.band_hz
    return (
        f"Stepped sine from {number(low)} to {number(high)} Hz needs {t.lines} lines "
        f"({number(t.lines_per_octave, 3)} per octave, {PER_BANDWIDTH} in every half-bandwidth) "
        f"and {number(t.stepped_sine_s / 60, 3)} minutes a sweep. This includes a wait of up to "
        f"{t.longest_wait_cycles:.0f} cycles until a transient falls to 1 %. Burst random with "
        f"{AVERAGES} averages of {number(t.burst_random_resolution_hz, 3)} Hz needs "
        f"{number(t.burst_random_s / 60, 3)} minutes."
    )
