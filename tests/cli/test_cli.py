"""The command line: what it writes; one sentence and exit 2 for whatever is wrong with a file."""

import inspect
import json
import re
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import typer
from tests.builders.cases import case_text
from tests.builders.commands import call, ran, refused
from tests.builders.decks import flat_sheet

import chladni
from chladni.case import load_case
from chladni.cli.app import guarded
from chladni.errors import AccuracyError, FileError
from chladni.fem.modelled import modelled
from chladni.io.formed_files import read_formed
from chladni.io.nastran import write_assembly
from chladni.units import UNITS
from chladni.view import scene
from chladni.workflows.decks_of_diagnosis import _deck
from chladni.workflows.question_of_case import question_of
from chladni_specimens.plates import box, folded_panel, plate
from chladni_specimens.tailgate.design import TailgateDesign

OSCILLATOR = """SOL 108
CEND
DLOAD = 5
FREQ = 6
BEGIN BULK
GRID,1,,0.,0.,0.,,23456
GRID,2,,1.,0.,0.,,123456
CELAS2,1,4000.,1,1,2,1
CDAMP2,2,2.0,1,1,2,1
CONM2,3,1,,0.1
RLOAD1,5,7,,,8
DAREA,7,1,1,3.0
TABLED1,8
,0.,1.,100.,1.,ENDT
FREQ1,6,5.,5.,9
ENDDATA
"""


def deck_text(n=2, side=0.3, t=1e-3, width=None):
    """A free steel plate of n by n CQUAD4, square unless told, SI."""
    lines = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", f"PSHELL,1,1,{t},1,,1"]
    return "\n".join([*lines, *flat_sheet(n, n, side, width or side), "ENDDATA", ""])


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "plate.bdf"
    path.write_text(deck_text(6))
    return path


def test_modes(tmp_path):
    """Six rigid modes, then f = λ²/(2π a²) √(D/ρt) with λ² = 13.47 (Leissa 1973, free square)."""
    deck = tmp_path / "plate.bdf"
    deck.write_text(deck_text(14))
    done = ran("modes", deck, "--count", 8, "--units", "SI", "--out", tmp_path / "out")
    result = json.loads((tmp_path / "out" / "modes.json").read_text())
    assert result["mass_kg"] == pytest.approx(7850 * 1e-3 * 0.09)
    np.testing.assert_allclose(result["centre_of_gravity_m"], [0.15, 0.15, 0], atol=1e-9)
    D = 2.1e11 * 1e-9 / 12 / (1 - 0.09)
    f = 13.47 / (2 * np.pi * 0.09) * np.sqrt(D / 7.85)
    assert max(result["frequency_hz"][:6]) < 0.01
    assert result["frequency_hz"][6] == pytest.approx(f, rel=0.02)
    np.testing.assert_allclose(result["generalized_mass"], 1, rtol=1e-8)
    (share,) = (part["strain_energy"] for part in result["parts"].values())
    np.testing.assert_allclose(share[6:], 1, rtol=1e-6)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    due = {"modes.json", "modes.unv", "modes.vtu", "report.html", "run.json"}
    assert names == due
    assert "\n   7  " in done.output  # the table of modes, on the terminal too


@pytest.mark.parametrize("count", [2, 5, 6])
def test_rigid_motions_are_told_where_no_other_mode_is_asked_for(tmp_path, count):
    """Among the six alone rounding would pass for elastic modes, with shares of an energy of 0."""
    deck = tmp_path / "plate.bdf"
    deck.write_text(deck_text(6))
    done = ran("modes", deck, "--count", count, "--units", "SI", "--out", tmp_path / "out")
    result = json.loads((tmp_path / "out" / "modes.json").read_text())
    assert len(result["frequency_hz"]) == count
    (share,) = (part["strain_energy"] for part in result["parts"].values())
    assert share == [None] * count
    assert "6 modes are rigid motions" in done.output


def test_frf_holds_what_higher_modes_contribute(deck, tmp_path):
    """Modes to 3 f and a two-term rest: direct inversion to (1/3)⁴ of the rest, so 1.2 %."""
    from chladni.workflows.loaded_model import load_model

    out = tmp_path / "out"
    ends = ["--input", "1:+Z", "--output", "1:+Z", "--output", "30:+Z"]
    band = ["--band", "5:30", "--lines", 6, "--damping", 0.0]
    options = [*ends, *band, "--units", "SI", "--quantity", "receptance", "--out", out]
    ran("frf", deck, *options)
    system = load_model(deck, "SI").structure.system
    rows = [system.dofs.tolist().index([grid, 3]) for grid in (1, 30)]
    K, M = system.K.toarray(), system.M.toarray()
    Z = [K - (2 * np.pi * f) ** 2 * M for f in np.linspace(5, 30, 6)]
    exact = np.linalg.inv(Z)[:, rows, rows[0]][:, :, None]
    with np.load(out / "frf.npz", allow_pickle=False) as held:
        np.testing.assert_allclose(held["values"], exact, rtol=3**-4)


def test_frf_runs_what_the_deck_asks_for(tmp_path):
    """One mass: u = F / (k - ω² m + i ω c), as SOL 108 has it."""
    deck, out = tmp_path / "one.bdf", tmp_path / "out"
    deck.write_text(OSCILLATOR)
    ran("frf", deck, "--quantity", "receptance", "--out", out)
    with np.load(out / "frf.npz", allow_pickle=False) as held:
        w = 2 * np.pi * held["frequency_hz"]
        assert held["outputs"].tolist() == ["1:+X"]
        exact = 3.0 / (4000 - 0.1 * w**2 + 2j * w)
        np.testing.assert_allclose(w, 2 * np.pi * 5 * np.arange(1, 11))
        np.testing.assert_allclose(held["values"][:, 0, 0], exact, rtol=1e-9)


def test_transmissibility_of_a_base(tmp_path):
    """One mass on a moving base without dashpot: T = 1 / (1 - f²/f₀²)."""
    deck, out = tmp_path / "one.bdf", tmp_path / "out"
    deck.write_text(OSCILLATOR.replace("CDAMP2,2,2.0,1,1,2,1\n", ""))
    ends = ["--input", "base:+X", "--output", "1:+X", "--band", "5:20", "--lines", 4]
    ran("frf", deck, *ends, "--damping", 0.0, "--out", out)
    with np.load(out / "frf.npz", allow_pickle=False) as held:
        assert str(held["quantity"]) == "transmissibility"
        f, f0 = held["frequency_hz"], np.sqrt(4000 / 0.1) / (2 * np.pi)
        np.testing.assert_allclose(held["values"][:, 0, 0], 1 / (1 - (f / f0) ** 2), rtol=1e-9)


def test_render(deck, tmp_path, monkeypatch):
    """Modes are counted with the rigid ones, as everywhere, so the plate's seventh is elastic."""
    monkeypatch.setattr(scene, "mode_gif", partial(scene.mode_gif, frames=3))  # twenty take long
    out = tmp_path / "out"
    options = ["--modes", "7-9", "--gif", 7, "--thickness", "--energy", 8]
    ran("render", deck, *options, "--units", "SI", "--out", out)
    due = {"structure.png", "modes.png", "mode_7.gif", "thickness.png", "energy_8.png"}
    assert {p.name for p in out.iterdir()} == due | {"report.html", "run.json"}
    assert "the first elastic is 7" in (out / "report.html").read_text()
    assert "mode 3 is a rigid motion" in refused(
        "render", deck, "--energy", 3, "--units", "SI", "--out", tmp_path / "rigid"
    )


def plates(heights):
    """Free plates of 80 x 80 x 1 mm over each other, tied rigidly at one corner."""
    lines = ["CEND", "BEGIN BULK", "MAT1,1,2.1+11,,.3,7850."]
    for p, z in enumerate(heights, start=1):
        lines.append(f"PSHELL,{p},1,.001,1,,1")
        for i, j in np.ndindex(5, 5):
            lines.append(f"GRID,{100 * p + 10 * i + j},,{0.02 * i},{0.02 * j},{z}")
        for n, (i, j) in enumerate(np.ndindex(4, 4)):
            a = 100 * p + 10 * i + j
            lines.append(f"CQUAD4,{100 * p + n},{p},{a},{a + 10},{a + 11},{a + 1}")
        if p > 1:
            lines.append(f"RBE2,{900 + p},100,123456,{100 * p}")
    return "\n".join([*lines, "ENDDATA", ""])


def test_clearance_of_two_plates(tmp_path):
    """Two plates of 1 mm at a distance of 3 mm leave 2 mm, and a force that closes them.

    Modes 1 to 8 are drawn, and contacts are of the two elastic ones.
    """
    deck, out = tmp_path / "two.bdf", tmp_path / "out"
    deck.write_text(plates([0.0, 0.003]))
    ran("render", deck, "--clearance", "--modes", "1-8", "--units", "SI", "--out", out)
    (pair,) = json.loads((out / "clearance.json").read_text())
    assert pair["least"] == pytest.approx(2e-3, abs=1e-6)
    assert not pair["touching"]
    page = (out / "report.html").read_text()
    assert "A rigid motion closes no gap" in page
    table = page.split("first contact")[1].split("</table>")[0]
    assert re.findall(r"<td[^>]*>(\d)</td>", table) == ["7", "8"]


SENSORS = [x for grid in (2, 4, 7, 18, 30, 43) for x in ("--output", f"{grid}:+Z")]
RECORDED = ["--input", "2:+Z", *SENSORS, "--band", "20:200", "--lines", 700, "--units", "SI"]


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A test of the model itself: six sensors, one shaker, 1 % damping; nothing is written here."""
    folder = tmp_path_factory.mktemp("case")
    deck = folder / "plate.bdf"
    deck.write_text(deck_text(6, width=0.22))  # no two modes alike, none with a node at the shaker
    ran("frf", deck, *RECORDED, "--out", folder)
    (folder / "case.toml").write_text(case_text(25.0, 180.0))
    return folder


@pytest.fixture(scope="module")
def identified(case, tmp_path_factory):
    """The folder of what is identified, and its only recording."""
    out = tmp_path_factory.mktemp("identified") / "out"
    ran("identify", case, "--out", out)
    (entry,) = json.loads((out / "identified.json").read_text())["recordings"]
    return out, entry


@pytest.fixture
def copied(case, tmp_path):
    """The case, to be changed."""
    return Path(shutil.copytree(case, tmp_path / "case"))


def test_frf_of_a_case_is_what_its_recording_holds(case, tmp_path):
    """Of the same model: its lines, labels and values; the function gives the same arrays."""
    ran("frf", case, "--out", tmp_path / "out")
    (same,) = chladni.frf(load_case(case)).frfs
    with np.load(tmp_path / "out" / "frf.npz") as here, np.load(case / "frf.npz") as there:
        assert here["outputs"].tolist() == there["outputs"].tolist()
        H, due = here["values"], there["values"]
    np.testing.assert_array_equal(H, same.to("accelerance").values)
    np.testing.assert_allclose(H, due, atol=1e-4 * np.abs(due).max())


def test_identify_finds_the_modes_and_damping_of_the_model(case, identified, tmp_path):
    out, entry = identified
    ran("modes", case, "--count", 12, "--out", tmp_path / "modes")
    page = (out / "report.html").read_text()
    assert all(word in page for word in ("MPC", "orders [%]", "state_space.mat"))
    f = np.array(json.loads((tmp_path / "modes" / "modes.json").read_text())["frequency_hz"])
    f = f[(f > 25) & (f < 180)]
    found = np.array(entry["frequency_hz"])[entry["firm"]]
    near = np.abs(found[:, None] / f - 1).min(axis=1)
    assert near.max() < 1e-3
    assert len(found) == len(f)
    np.testing.assert_allclose(np.array(entry["damping"])[entry["firm"]], 0.01, rtol=0.02)
    assert (out / "poles.csv").read_text().startswith("mode,frequency_hz")
    assert np.load(out / "state_space.npz")["A"].shape[0] >= 2 * len(found)
    assert not any(entry["struck_out"])


def test_a_pole_is_dropped_by_its_frequency_and_only_a_pole(case, identified, tmp_path):
    """The recording still shows the mode, so that the exit code is 3."""
    (_, entry), out = identified, tmp_path / "out"
    f = entry["frequency_hz"][2]
    ran("identify", case, "--drop", f"{f:.4g}", "--out", out, code=3)
    (left,) = json.loads((out / "identified.json").read_text())["recordings"]
    assert len(left["frequency_hz"]) == len(entry["frequency_hz"]) - 1
    assert "Taken out by hand" in (out / "report.html").read_text()
    refused("identify", case, "--drop", 1e4, "--out", tmp_path / "no")


def test_how_to_estimate_is_known_and_told_where_nothing_is_estimated(case, tmp_path):
    refused("test", case / "frf.uff", "--excitation", "shock", "--out", tmp_path / "no")
    done = ran("test", case / "frf.uff", "--excitation", "hammer", "--out", tmp_path / "out")
    assert "Nothing was estimated" in done.output
    assert "Nothing was estimated" not in call("test", case, "--out", tmp_path / "plain").output


def test_a_recording_of_the_model_itself_lacks_nothing(copied, tmp_path):
    """The model's own responses are explained by the model; the answer is whole and readable."""
    few = '[search]\neffects = ["point-mass", "sensor-mass"]\n'
    (copied / "case.toml").write_text(case_text(20.0, 170.0) + few)
    ran("diagnose", copied, "--out", tmp_path / "answer")
    d = json.loads((tmp_path / "answer" / "diagnosis.json").read_text())
    assert d["verdict"] in ("nothing missing", "calibration only")
    assert d["effects"] == []
    assert all("why_not" in a for a in d["alternatives"])
    names = {p.name for p in (tmp_path / "answer").iterdir()}
    assert {"report.html", "updated.bdf", "diagnosis.json"} < names
    options = ["--units", "SI", "--count", 14, "--out", tmp_path / "modes"]
    ran("modes", tmp_path / "answer" / "updated.bdf", *options)


LAMINATE = "PCOMP,1,,,,,,,SYM\n,1,2.5e-4,0.,,1,2.5e-4,45."


def calibrated(case, out):
    """A laminated plate calibrated to the recording of one so much stiffer."""
    out.mkdir()
    text = deck_text(6, width=0.22)
    (case / "plate.bdf").write_text(text.replace("2.1+11", f"{2.1e11 * 1.21:.4e}"))
    ran("frf", case / "plate.bdf", *RECORDED, "--out", case)
    (case / "plate.bdf").write_text(text.replace("PSHELL,1,1,0.001,1,,1", LAMINATE))
    ran("calibrate", case, "--out", out)
    return json.loads((out / "diagnosis.json").read_text())


def first_elastic(deck, folder):
    ran("modes", deck, "--units", "SI", "--count", 8, "--out", folder / "m")
    return json.loads((folder / "m" / "modes.json").read_text())["frequency_hz"][6]


def test_calibrated_laminate_is_written_into_its_layers(copied, tmp_path):
    """Stiffness over mass of the plies moves by what was concealed; the deck is read again."""
    out = tmp_path / "answer"
    d = calibrated(copied, out)
    assert d["files"]["deck"] == "calibrated.bdf"
    assert any("of 2 starts of a Latin hypercube ended in the best" in n for n in d["notes"])
    assert "missing physics was not searched" in (out / "report.html").read_text()
    f, before = (
        first_elastic(deck, tmp_path) for deck in (out / "calibrated.bdf", copied / "plate.bdf")
    )
    assert f / before == pytest.approx(1.1, rel=0.01)


def test_answer_stands_where_no_card_holds_the_change(copied, tmp_path):
    """One element of a laminate cannot be thinner than the rest: no deck, and a note says why."""
    text = deck_text(6, width=0.22).replace("PSHELL,1,1,0.001,1,,1", LAMINATE)
    (copied / "plate.bdf").write_text(text)
    opened = load_case(copied)
    shells = opened.assembly.shells
    thickness = shells.thickness * np.where(np.arange(len(shells)) == 3, 0.9, 1.0)[:, None]
    final = replace(opened.assembly, shells=replace(shells, thickness=thickness))
    deck, notes = _deck(opened, question_of(opened), modelled(opened.assembly, 100.0), final)
    assert deck.changes is None
    assert deck.model.assembly is final
    assert len(notes) == 1
    assert notes[0].startswith("no updated deck was written: ")
    assert "changed in a way that its layers cannot" in notes[0]


def test_specimen_comes_back_as_a_deck(tmp_path):
    """What is written weighs what the generator says: ρ t (a b) of a plate."""
    out = tmp_path / "out"
    sides = ["--set", "length=0.4", "--set", "width=0.2", "--set", "t=0.002"]
    ran("specimen", "plate", "--size", 50, *sides, "--out", out)
    modes = tmp_path / "modes"
    ran("modes", out / "plate.bdf", "--count", 7, "--units", "mm-t-s", "--out", modes)
    mass = json.loads((modes / "modes.json").read_text())["mass_kg"]
    assert mass == pytest.approx(7850 * 0.002 * 0.08, rel=1e-5)


def test_plan_sees_every_mode(deck, tmp_path):
    """As many sensors as modes or more, no label twice, no mode unseen."""
    out = tmp_path / "out"
    ran("plan", deck, "--modes", 5, "--sensors", 8, "--units", "SI", "--out", out)
    result = json.loads((out / "plan.json").read_text())
    labels = [s["label"] for s in result["sensors"]]
    assert len(set(labels)) == 8
    assert (out / "sensors.csv").read_text().count("output") == 8


def test_a_plan_without_units_says_what_it_took_the_deck_for(deck, tmp_path):
    """Sensors weigh kilograms: a deck in millimetres is planned as the same one in metres."""
    words = ["--sensors", 5, "--modes", 3, "--drawn", 0, "--candidates", 20]
    made = chladni.load(deck, "SI").assembly
    for name in ("SI", "mm-t-s"):
        path = write_assembly(made, tmp_path / f"{name}.bdf", UNITS[name])
        done = ran("plan", path, *words, "--out", tmp_path / name)
        assert f"units = {name}: " in done.output
    a, b = (json.loads((tmp_path / n / "plan.json").read_text()) for n in ("SI", "mm-t-s"))
    hertz = [[m["frequency_hz"] for m in found["modes"]] for found in (a, b)]
    np.testing.assert_allclose(*hertz, rtol=1e-5)
    at = [np.array([s["point_m"] for s in found["sensors"]]) for found in (a, b)]
    np.testing.assert_allclose(*at, atol=1e-6)
    deck.write_text(deck.read_text().replace("7850.", ""))
    assert "--units" in call("plan", deck, *words, "--out", tmp_path / "x").stderr


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["frf", "--input", "999:+Z", "--output", "1:+Z"], "999"),
        (["frf"], "--input"),
        (["frf", "--input", "1:+Z"], "--output"),
        (["frf", "--input", "base:+Z", "--input", "1:+Z", "--output", "1:+Z"], "the only input"),
        (["frf", "--input", "1:up", "--output", "1:+Z"], "1:up"),
        (["frf", "--input", "1:+Z", "--output", "1:+Z", "--band", "9"], "--band"),
        (["frf", "--input", "1:+Z", "--output", "1:+Z", "--band", "1:inf"], "be finite"),
        (["frf", "--input", "1:+Z", "--output", "1:+Z", "--quantity", "force"], "mobility"),
        (["modes", "--units", "cubits"], "mm-t-s"),
        (["render", "--clearance"], "no two parts"),
        (["render", "--modes", "a-b"], "--modes"),
        (["render", "--modes", "0-3"], "from 1"),
        (["render", "--gif", "100000"], "100000"),
        (["plan", "--sensors", "3", "--modes", "9"], "3 sensors"),
        (["plan", "--drawn", "99999999"], "--drawn"),
        (["frf", "--input", "1:+Z", "--output", "1:+Z", "--lines", "99999999"], "--lines"),
        (["study", "--vary", "E=90%:110%", "--lines", "99999999"], "--lines"),
        (["specimen", "teapot"], "tailgate"),
        (["specimen", "plate", "--set", "lenght=1"], "length"),
        (["specimen", "plate", "--set", "length=a"], "number"),
        (["specimen", "tailgate", "--size", "1"], "6 to 32"),
        (["specimen", "panel", "--set", "t"], "KEY=VALUE"),
        (
            ["specimen", "panel", "--set", "lenght=1"],
            "there are length, width, depth, rise, h, t\n",
        ),
        (["specimen", "plate", "--size", "0.1"], "--size is in mm and must be at least 1 mm"),
        (["specimen", "panel", "--size", "0.1"], "--size is in mm"),
        (["specimen", "box", "--set", "h=1e-4"], "--size is in mm"),
    ],
)
def test_a_bad_option_names_itself(deck, tmp_path, arguments, named):
    command, *options = arguments
    given = [] if command == "specimen" else [deck]
    assert named in refused(command, *given, *options, "--out", tmp_path / "x") + "\n"


def test_every_setting_of_a_specimen_is_in_its_help():
    shown = " ".join(call("specimen", "--help").stdout.split())
    for build in (folded_panel, box, plate, TailgateDesign):
        names = [n for n in inspect.signature(build).parameters if n != "material"]
        assert ", ".join(names) in shown


def test_the_panel_comes_with_its_formed_thickness(tmp_path):
    """Forming thins: nowhere above the gauge, thinnest in the folds; its parts are the deck's."""
    ran("specimen", "panel", "--size", 60, "--set", "t=0.8e-3", "--out", tmp_path)
    formed = read_formed(tmp_path / "formed_thickness.k", "mm-t-s")
    assert formed.names == {1: "panel", 2: "flanges"}
    assert formed.nodal.max() <= 0.8e-3 + 1e-7
    y = formed.points[:, 1]
    fold = np.minimum(y, 0.3 - y) < 3e-3
    middle = np.abs(y - 0.15) < 0.1
    assert formed.nodal[fold].min() < 0.95 * formed.nodal[middle].min()
    facts = json.loads((tmp_path / "specimen.json").read_text())
    assert facts["mass_formed_kg"] < facts["mass_kg"]
    assert [part["part"] for part in facts["mapping"]] == ["panel", "flanges"]


def test_out_must_be_a_folder(deck):
    ran("modes", deck, "--out", deck, code=2)


@pytest.mark.parametrize(
    ("raised", "code"),
    [(FileError("a"), 2), (AccuracyError("a"), 3), (OSError(13, "no", "f"), 2),
     (KeyboardInterrupt(), 130)],
)  # fmt: skip
def test_exit_codes(raised, code):
    def command():
        raise raised

    with pytest.raises(typer.Exit) as caught:
        guarded(command)()
    assert caught.value.exit_code == code


def test_version_is_printed():
    done = ran("--version")
    assert done.output.startswith("chladni ")
