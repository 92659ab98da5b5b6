"""Chapters 3 and 4.1 of the thesis: table 1 of the model, table 2 and figures of the plan."""

import csv
from io import StringIO
from typing import Any

from chladni.dynamics.modes import rigid_modes
from chladni.fem.energy import mass_properties
from chladni.fem.modelled import modelled
from chladni.io.dyna import write_keyword
from chladni.io.nastran import write_assembly
from chladni.io.tables.csv_table import csv_text, unescaped
from chladni.model.properties import BeamSection, Isotropic, Part, ShellSection, SolidSection
from chladni.output import write_text
from chladni.parallel import one_blas_thread
from chladni.progress import Progress
from chladni.report.blocks import Block, Facts, Picture, Section, Table, Text
from chladni.report.words import hertz, number, rounded
from chladni.units import units
from chladni.view import annotations, scene
from chladni.workflows.loaded_model import on_faces
from chladni_bench import AccelerometerType, BenchSetup
from chladni_planning import PlanSettings, plan, sensors_csv, summary

from .thesis_chapter import Chapter
from .thesis_desk import DECK, FORMED, SENSORS, UNITS, Desk
from .thesis_numbers import MAPPED_MASS, MODES_300, QUOTIENT, TABLE_1, TABLE_2, TABLE_14

KINDS = {ShellSection: "shell", SolidSection: "solid", BeamSection: "bar"}
BEST = 5  # actuators of table 2


def model_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Write deck and forming simulation; compare the deck's properties with table 1."""
    system = units(UNITS)
    write_assembly(desk.specimen.deck(), desk.folder / DECK, system)
    progress("the forming simulation", 0.3)
    write_keyword(desk.folder / FORMED, desk.specimen.formed(), system)
    progress("modes of the deck", 0.6)
    model = desk.deck()
    with one_blas_thread():
        modes = modelled(model.assembly, 300.0).modes
    f = modes.frequency[~rigid_modes(modes)]
    mass = mass_properties(model.assembly)[0]
    rows = [_part(part) for part in model.assembly.parts]
    below = [int((f < top).sum()) for top in (200.0, 300.0)]
    nominal = [b for _, b, _ in TABLE_14]
    readings = [
        ("mass [kg]", number(MAPPED_MASS[0], 5), number(mass, 5)),
        ("modes below 200 Hz", str(len(nominal)), str(below[0])),
        ("modes below 300 Hz", str(MODES_300), str(below[1])),
        ("first modes [Hz]", ", ".join(hertz(x) for x in nominal[:5]),
         ", ".join(hertz(x) for x in f[:5])),
    ]  # fmt: skip
    columns = ("part", "element", "E [GPa]", "nu", "rho [kg/m³]", "t [mm]",
               "thesis: E, nu, rho, t")  # fmt: skip
    seen = model.seen
    gauge = on_faces(seen, model.assembly.thickness())
    picture = scene.thickness_map(desk.folder / "figure_5.png", seen, gauge)
    blocks: list[Block] = [
        Picture(picture, "Figures 5 and 6: the parts by their gauge."),
        Table(columns, rows, ("part", "element"), "Read back from the deck."),
        Table(("", "thesis", "ours"), readings, ("",)),
        Text([
            "Values, gauges and kinds of element are those of the thesis. Its drawing is not "
            "public, so the shape is ours: mass and first modes are near, not equal. A coarse "
            "mesh is stiffer than the thesis' converged one; deck and article share it, so the "
            "mesh makes no difference between them.",
        ]),
    ]  # fmt: skip
    numbers: dict[str, Any] = {
        "table_1": {row[0]: row[1:6] for row in rows},
        "model": {"mass_kg": mass, "modes_below_200_300": below, "frequency_hz": f},
    }
    lead = (
        f"{len(model.assembly.shells)} shells, {number(mass, 4)} kg (thesis: "
        f"{MAPPED_MASS[0]:.3f}), {below[0]} modes below 200 Hz (thesis: {len(nominal)})"
    )
    files = ((DECK, f"the nominal deck, {UNITS}"), (FORMED, "the forming simulation"))
    return Chapter(lead, (Section("Table 1: the model", blocks),), numbers, files)


def _part(part: Part) -> tuple[str, ...]:
    """A row of table 1 with the thesis' values."""
    s = part.section
    m = (s.membrane or s.bending) if isinstance(s, ShellSection) else s.material
    assert isinstance(m, Isotropic)
    t = 1e3 * s.thickness if isinstance(s, ShellSection) else None
    own = (m.E / 1e9, m.nu, m.rho or None, t)
    theirs = TABLE_1.get(part.name)
    return (
        part.name, KINDS[type(s)], *map(_value, own),
        "–" if theirs is None else ", ".join(map(_value, theirs)),
    )  # fmt: skip


def _value(x: float | None) -> str:
    return "–" if x is None else number(x, 4)


def plan_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Plan the test on the nominal deck: table 2, figures 8 and 9, the table of sensors."""
    model = desk.deck()
    settings = PlanSettings(sensors=desk.sensors)
    found = plan(model, settings, progress=progress)
    write_text(desk.folder / SENSORS, with_drive_sensor(sensors_csv(found)))
    result = summary(found)
    every = sorted(result.actuators, key=lambda a: a.condition)
    best = every[:BEST]
    conditions = [a.condition for a in best]
    columns = ("", *"abcde"[: len(best)])
    rows = [
        ("balanced realisation, thesis", *map(number, TABLE_2[: len(best)])),
        ("balanced realisation, ours", *(number(rounded(c)) for c in conditions)),
        ("at", *(a.at.label for a in best)),
        ("straight way for the stinger", *("yes" if a.straight_way_to_it else "no" for a in best)),
        ("rattles from [N]", *map(_rattle, best)),
    ]  # fmt: skip
    s = result.scores
    readings = [
        ("observability", "fully ranked", f"rank {s.observability_rank} of {s.states}"),
        ("quotient of its gramian", number(QUOTIENT), number(s.gramian_quotient)),
        ("target modes", "24", str(len(found.modal))),
        ("sensors", "30", str(len(found.layout))),
        ("shaker", "c: a and b rattle", result.actuators_together[0].label),
    ]
    sensors = [_marker(q.at, str(q.rank)) for q in result.sensors]
    shakers = [_marker(a.at, "abcde"[k]) for k, a in enumerate(best)]
    pictures = [
        Picture(scene.sensors(desk.folder / "figure_8.png", model.seen, sensors),
                "Figure 8: sensors by rank."),
        Picture(scene.sensors(desk.folder / "figure_9.png", model.seen, (), shakers),
                "Figure 9: the five best shaker places."),
    ]  # fmt: skip
    blocks: list[Block] = [
        Table(("", "thesis", "ours"), readings, ("", "thesis", "ours")),
        Table(columns, rows, columns),
        *pictures,
        Facts([("Sensors moved to see a mode", str(len(result.moves)))]),
        Text([
            "The quotient grows with the spread of the frequencies and with the least visible "
            "mode, so it differs between two structures. The thesis found by experiment that "
            "places a and b rattle. The planner predicts it from the clearances of the mesh and "
            "takes the best place that a straight stinger reaches and that does not rattle.",
        ]),
    ]  # fmt: skip
    numbers = {
        "table_2": {
            "thesis": {"quotient": QUOTIENT, "conditions": TABLE_2},
            "quotient": s.gramian_quotient, "conditions": conditions,
            "labels": [a.at.label for a in best], "rank": [s.observability_rank, s.states],
            "shaker": result.actuators_together[0].label,
        }
    }  # fmt: skip
    lead = (
        f"{len(found.layout)} sensors, rank {s.observability_rank} of {s.states}; best condition "
        f"{number(conditions[0], 3)} (thesis: {TABLE_2[0]}); shake at "
        f"{result.actuators_together[0].label}"
    )
    files = ((SENSORS, "sensors and shaker"),)
    return Chapter(lead, (Section("Table 2: the plan", blocks),), numbers, files)


def _rattle(a: Any) -> str:
    return "never" if a.rattles_from_n is None else number(rounded(a.rattles_from_n))


def _marker(at: Any, text: str) -> annotations.Marker:
    x, n = (tuple(float(v) for v in values) for values in (at.point_m, at.direction))
    return annotations.Marker(x, n, text)  # type: ignore[arg-type]


def with_drive_sensor(text: str) -> str:
    """The table of sensors with an accelerometer next to the shaker, and masses of all devices."""
    head, *rows = ([unescaped(c) for c in row] for row in csv.reader(StringIO(text)))
    role, mass, label = (head.index(name) for name in ("role", "mass", "label"))
    drive = next(row for row in rows if row[role] == "input")
    outputs = [row for row in rows if row[role] == "output"]
    if drive[label] not in [row[label] for row in outputs]:
        outputs.append([*drive[:role], "output", *drive[role + 1 :]])
    for row in outputs:
        row[mass] = f"{AccelerometerType().mass:g}"
    shaker = BenchSetup().shaker
    assert shaker is not None
    drive[mass] = f"{shaker.gauge.mass * shaker.gauge.beyond:g}"
    return csv_text([head, *outputs, drive])
