"""No word of a case is read and dropped: whatever accepted value changes, what is asked changes."""

import hashlib
import runpy
from pathlib import Path

import numpy as np
import pytest
from tests.builders.quick_runs import identified_once

from chladni.case import load_case
from chladni.case.schema import COLUMNS, COMMANDS, PLANNED, SCHEMA, SECTIONS, unread
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.effects.effect import Effect, FieldChange, MatrixTerm, of
from chladni.effects.registry import families
from chladni.errors import ChladniError
from chladni.fem.assemble import structure
from chladni.fem.modelled import modelled
from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.dyna import write_keyword
from chladni.io.nastran import assembly, read_deck
from chladni.io.tables.csv_table import read_table
from chladni.io.tables.sensor_table import _OPTIONAL
from chladni.io.tables.write_tables import write_npz
from chladni.search.preparation import prepare
from chladni.units import UNITS
from chladni.view.surface import surface
from chladni.workflows.case_model import model_frf
from chladni.workflows.question_of_case import question_of
from chladni_planning import PlanSettings, with_places_of

from .test_case import deck

CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01
allow = ["CSEAM"]
outside = false
thickness = "formed.k"
thickness_units = "mm-t-s"
thickness_place = "as it lies"
[test]
recordings = ["a.npz", "b.npz"]
use = "a.npz"
quantity = "accelerance"
gain = "known"
factor = 1.0
delay = 0.0
frequency_unit = "Hz"
conjugated = false
sensors = "sensors.csv"
mass = 1.413
mass_sd = 0.002
gain_sd = 0.01
direction_sd = 1.0
position_sd = 0.0015
shape_sd = 0.02
hangers = [1, 35]
[[recording]]
file = "b.npz"
article = "B"
level = 2.0
control = "force"
state = ""
mass = 1.4
[band]
fit = [5.0, 60.0]
exclude = [[20.0, 21.0]]
[held_out]
sensors = ["16:+Z"]
band = [50.0, 60.0]
[search]
effects = ["point-mass"]
[plan]
regions = ["sheet"]
fixed = ["12:+Z"]
forbidden = ["3:+Z"]
cost = ["sheet=2"]
[[parameter]]
name = "E of the sheet"
parts = ["sheet"]
field = "E"
sd = 0.05
low = 0.8
high = 1.3
"""
SENSORS = """\
label,grid,x,y,z,direction,nx,ny,nz,role,mass,position_sd,gain,use
3:+Z,3,,,,+Z,,,,output,0.003,,1.1,
12:+Z,12,,,,,0,0.1,1,output,,,,yes
16:+Z,,0.31,0.07,0.0,+Z,,,,output,0.004,0.001,,
22:+Z,22,,,,+Z,,,,output,,,,
8:+Z,8,,,,+Z,,,,input,,,,
"""
OTHER = {  # another accepted value of every word
    ("model", "deck"): '"softer.bdf"',
    ("model", "units"): '"mm-kg-ms"',
    ("model", "thickness"): '"thinner.k"',
    ("model", "thickness_units"): '"SI"',
    ("model", "thickness_place"): '"aligned"',
    ("model", "damping"): "0.02",
    ("model", "allow"): '["RJOINT"]',
    ("model", "outside"): "true",
    ("test", "recordings"): '["b.npz"]',
    ("test", "use"): '"b.npz"',
    ("test", "quantity"): '"mobility"',
    ("test", "gain"): '"unknown"',
    ("test", "factor"): "1.1",
    ("test", "delay"): "0.0001",
    ("test", "frequency_unit"): '"rad/s"',
    ("test", "conjugated"): "true",
    ("test", "sensors"): '"others.csv"',
    ("test", "mass"): "1.42",
    ("test", "mass_sd"): "0.003",
    ("test", "gain_sd"): "0.02",
    ("test", "direction_sd"): "2.0",
    ("test", "position_sd"): "0.001",
    ("test", "shape_sd"): "0.03",
    ("test", "hangers"): "[1]",
    ("recording", "file"): '"a.npz"',
    ("recording", "article"): '"C"',
    ("recording", "level"): "3.0",
    ("recording", "control"): '"response"',
    ("recording", "state"): '"with the bracket"',
    ("recording", "mass"): "1.5",
    ("band", "fit"): "[5.0, 59.0]",
    ("band", "exclude"): "[[20.0, 22.0]]",
    ("held_out", "sensors"): "1",
    ("held_out", "band"): "[48.0, 60.0]",
    ("search", "effects"): '["point-mass", "crack"]',
    ("plan", "regions"): '["box 0 0 -1 0.2 1 1"]',
    ("plan", "fixed"): '["12:+X"]',
    ("plan", "forbidden"): '["4:+Z"]',
    ("plan", "cost"): '["sheet=3"]',
    ("parameter", "name"): '"stiffness"',
    ("parameter", "parts"): '["CELAS2 99"]',
    ("parameter", "field"): '"nu"',
    ("parameter", "sd"): "0.06",
    ("parameter", "low"): "0.7",
    ("parameter", "high"): "1.2",
}
CELLS = {  # column: (a row as it stands, the same row with another accepted cell)
    "label": ("22:+Z,22,,", "21:+Z,22,,"),
    "grid": ("22:+Z,22,,", "22:+Z,21,,"),
    "x": ("0.31,", "0.32,"),
    "y": ("0.07,", "0.08,"),
    "z": ("0.07,0.0,", "0.07,0.001,"),
    "direction": ("22,,,,+Z,", "22,,,,-Z,"),
    "nx": (",,0,0.1,1,", ",,0.1,0.1,1,"),
    "ny": (",,0,0.1,1,", ",,0,0.2,1,"),
    "nz": (",,0,0.1,1,", ",,0,0.1,2,"),
    "role": ("8,,,,+Z,,,,input", "8,,,,+Z,,,,output"),
    "mass": ("output,0.003", "output,0.005"),
    "position_sd": ("0.004,0.001", "0.004,0.002"),
    "gain": ("0.003,,1.1", "0.003,,1.2"),
    "use": (",,,,yes", ",,,,no"),
}


DRIVE = "8:+Z,8,,,,+Z,,,,input,,,,"
DRIVEN = {  # column: the row of the shaker with another cell
    "label": "9:+Z,8,,,,+Z,,,,input,,,,",
    "grid": "8:+Z,9,,,,+Z,,,,input,,,,",
    "place": "8:+Z,,0.31,0.07,0.0,+Z,,,,input,,,,",
    "direction": "8:+Z,8,,,,-Z,,,,input,,,,",
    "vector": "8:+Z,8,,,,,0,0.1,1,input,,,,",
    "mass": "8:+Z,8,,,,+Z,,,,input,0.02,,,",
    "position_sd": "8:+Z,8,,,,+Z,,,,input,,0.002,,",
    "gain": "8:+Z,8,,,,+Z,,,,input,,,1.1,",
    "use": "8:+Z,8,,,,+Z,,,,input,,,,no",
}


@pytest.fixture(scope="module", autouse=True)
def _identified_once():
    with identified_once():
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case of a plate that uses every word, with two recordings of it."""
    place = tmp_path_factory.mktemp("case")
    spring = deck().replace("ENDDATA", "CELAS2,99,0.1,17,3\nENDDATA")
    (place / "plate.bdf").write_text(spring)
    (place / "softer.bdf").write_text(spring.replace("210000.", "200000."))
    made = assembly(read_deck(place / "plate.bdf"), "mm-t-s")
    for name, t in (("formed.k", 0.95e-3), ("thinner.k", 0.9e-3)):
        write_keyword(place / name, pressed(made, t))
    (place / "sensors.csv").write_text(SENSORS)
    (place / "others.csv").write_text(SENSORS.replace("0.31,0.07", "0.33,0.07"))
    built = structure(assembly(read_deck(place / "plate.bdf"), UNITS["mm-t-s"]))
    modal = normal_modes(built.system, 30)
    for name, factor in (("a.npz", 1.01), ("b.npz", 1.03)):
        write_npz(place / name, measured(built, modal, factor))
    return place


def pressed(made, t: float) -> FormedMesh:
    """The sheet after forming: t at its left edge, a tenth more at its right one [m]."""
    nodes, x = made.shells.nodes, made.points[:, 0]
    thickness = t * (1 + 0.1 * x / x.max())
    return FormedMesh(made.ids, made.points, nodes, np.ones(len(nodes), int), thickness[nodes])


def measured(built, modal, factor: float) -> FRF:
    """Accelerances of the plate with all its frequencies times a factor, 1 % noise."""
    f = np.arange(4.0, 65.0, 0.2)
    phi_o = built.rows(np.array([(g, 3) for g in (3, 12, 16, 22)])) @ modal.shapes
    phi_i = built.rows(np.array([(8, 3)])) @ modal.shapes
    s, w = 2j * np.pi * f[:, None], 2 * np.pi * factor * modal.frequency
    d = s**2 / (s**2 + 0.02 * w * s + w**2)
    H = np.einsum("or,fr,ir->foi", phi_o, d, phi_i)
    noise = np.random.default_rng(0).normal(size=(2, *H.shape))
    values = H * (1 + 0.01 * (noise[0] + 1j * noise[1]))
    labels = tuple(f"{g}:+Z" for g in (3, 12, 16, 22))
    return FRF(values, f, labels, ("8:+Z",), "accelerance")


def effect_bytes(effect: Effect) -> bytes:
    """What an ordinary effect is and does on either side of the deck's value."""
    said = [effect.name, effect.text, getattr(effect, "called", ""), *map(str, effect.parameters)]
    for shift in (-0.3, 0.3):
        x = np.array([shift] * len(effect.parameters))
        terms = effect.terms(x)
        said += [f"{c.field}{c.value.tolist()}" for c in of(FieldChange, terms)]
        said += [f"{t.matrix}{t.coefficient}{t.operator.sum()}" for t in of(MatrixTerm, terms)]
    return repr(said).encode()


def asked(folder: Path, text: str, sensors: str = SENSORS) -> str:
    """A fingerprint of all that a fit would start from, the notes and the model's responses.

    A sentence of refusal is an answer, too.
    """
    (folder / "case.toml").write_text(text)
    (folder / "sensors.csv").write_text(sensors)
    try:
        case = load_case(folder)
        ready = prepare(question_of(case))
    except ChladniError as error:
        return f"refused: {error}"
    problem, mark = ready.problem, hashlib.sha256()
    for array in (problem.reduced.model.K0, problem.reduced.model.M0, problem.reduced.frequency):
        mark.update(np.ascontiguousarray(array).tobytes())
    for data in (problem.data, ready.score):
        for array in vars(data).values():
            if isinstance(array, np.ndarray):
                mark.update(np.ascontiguousarray(array).tobytes())
    for effect in problem.base:
        if effect.kind == "calibration" or effect.name == "gain":
            mark.update(effect_bytes(effect))
    tried = [family.name for family in problem.families]
    known = (problem.mass_measurement, problem.setup.hangers, problem.setup.sensors, tried)
    mark.update(repr(known).encode())
    mark.update(
        repr(
            ((ready.held.choosing | ready.held.reporting).tolist(), ready.what, ready.notes)
        ).encode()
    )
    mark.update(repr([case.said(c) for c in COMMANDS]).encode())
    rules = with_places_of(case, PlanSettings()).rules(case.assembly, surface(case.assembly))
    for array in (rules.allowed, rules.cost, rules.fixed.grids, rules.fixed.directions):
        mark.update(np.ascontiguousarray(array).tobytes())
    model = modelled(case.tested(case.assembly), 200.0)
    curves = model_frf(case, model, case.damping or 0.01, case.frfs[0])
    mark.update(np.round(curves.values / np.abs(curves.values).max(), 9).tobytes())
    return mark.hexdigest()


@pytest.fixture(scope="module")
def as_it_stands(folder: Path) -> str:
    first = asked(folder, CASE)
    assert not first.startswith("refused"), first
    assert asked(folder, CASE) == first  # the same words ask the same
    return first


def test_every_word_has_another_value_here() -> None:
    """A word added to the schema is not forgotten by this test, nor one to the table of sensors."""
    assert set(OTHER) == {(k.section, k.name) for k in SCHEMA}
    assert set(CELLS) == {k.name for k in COLUMNS} == {"label", *_OPTIONAL}
    for section, name in OTHER:
        assert f"{name} = " in CASE.split(f"[{section}]")[1].split("\n[")[0]


@pytest.mark.parametrize(("section", "name"), OTHER)
def test_no_word_is_dropped(folder: Path, as_it_stands: str, section: str, name: str) -> None:
    head, rest = CASE.split(f"[{section}]", 1)
    lines = rest.split("\n")
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{name} = "))
    lines[at] = f"{name} = {OTHER[section, name]}"
    assert asked(folder, head + f"[{section}]" + "\n".join(lines)) != as_it_stands


@pytest.mark.parametrize("column", CELLS)
def test_no_column_is_dropped(folder: Path, as_it_stands: str, column: str) -> None:
    old, new = CELLS[column]
    assert old in SENSORS
    assert asked(folder, CASE, SENSORS.replace(old, new)) != as_it_stands


@pytest.mark.parametrize("column", DRIVEN)
def test_no_cell_of_the_drive_is_dropped(folder: Path, as_it_stands: str, column: str) -> None:
    assert DRIVE in SENSORS
    assert asked(folder, CASE, SENSORS.replace(DRIVE, DRIVEN[column])) != as_it_stands


def test_sections_know_their_words() -> None:
    names = [(k.section, k.name) for k in (*SCHEMA, *COLUMNS)]
    assert len(set(names)) == len(names)
    assert tuple(dict.fromkeys(section for section, _ in names)) == (*SECTIONS, "sensors.csv")
    assert all(set(k.used) <= set(COMMANDS) and k.used for k in (*SCHEMA, *COLUMNS))


def test_words_a_command_makes_no_use_of_are_named() -> None:
    given = (("model", "deck"), ("test", "hangers"), ("test", "mass"), ("held_out", "band"))
    assert unread(given, "identify") == [
        "Not used by identify: [test] hangers, mass; [held_out] band."
    ]
    assert unread(given, "diagnose") == []


def test_the_page_is_written_from_the_table() -> None:
    """docs/case.md names every word, as docs/case_page.py writes it."""
    docs = Path(__file__).parents[2] / "docs"
    text = (docs / "case.md").read_text(encoding="utf-8")
    assert text == runpy.run_path(str(docs / "case_page.py"))["page"]()
    for k in (*SCHEMA, *COLUMNS):
        assert f"| `{k.name}` |" in text


def test_the_examples_of_the_page_are_accepted(folder: Path) -> None:
    """Every example is a value of the kind its row says."""
    import tomllib

    for k in SCHEMA:
        value = tomllib.loads(f"v = {k.example}")["v"]
        if k.choices:
            assert value in k.choices
    assert read_table(folder / "sensors.csv", ("label",), _OPTIONAL)


def test_what_is_only_planned_has_no_model_behind_it():
    assert not {f.name for f in families()} & set(PLANNED)
