"""The case that the bench leaves says all that its user said, and can be diagnosed."""

import json
import shutil

import numpy as np
import pytest
from tests.builders.commands import ran, refused

import chladni
from chladni.case.schema import SCHEMA
from chladni.io.package_files import mesh_path
from chladni.workflows.question_of_case import prepared
from chladni_bench.bench_folder import RENEWED

QUICK = ("--resolution", "1", "--averages", "2", "--exact")


def bench(source, out, *words):
    ran("bench", source, *QUICK, *words, "--out", out)
    return chladni.load_case(out / "case")


@pytest.fixture(scope="module")
def demo():
    return mesh_path("demo/case.toml").parent


@pytest.fixture(scope="module")
def deck(demo, tmp_path_factory):
    """A bare deck with a card that nobody understands, and where it is measured."""
    folder = tmp_path_factory.mktemp("bare")
    text = (demo / "deck.bdf").read_text(encoding="latin-1")
    (folder / "deck.bdf").write_text(text.replace("ENDDATA", "CSEAM,99,1\nENDDATA"), "latin-1")
    rows = [r for r in (demo / "sensors.csv").read_text().splitlines() if r]
    rows = [f"{rows[0]},position_sd", *(f"{r},0.002" for r in rows[1::2])]
    (folder / "sensors.csv").write_text("\n".join(rows) + "\n")
    return folder / "deck.bdf"


BARE = ("--units", "mm-t-s", "--allow", "CSEAM")


def test_a_plan_keeps_the_sensors_that_its_drive_moves(tmp_path):
    """A straight bar bends along two axes apart; a plan sees both, and one drive moves one."""
    cards = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,70.+9,,.3,2700.",
             "PBARL,1,1,,BAR", ",.02,.03"]  # fmt: skip
    cards += [f"GRID,{k},,{(k - 1) / 12},0.,0." for k in range(1, 14)]
    cards += [f"CBAR,{k},1,{k},{k + 1},0.,0.,1." for k in range(1, 13)]
    (tmp_path / "bar.bdf").write_text("\n".join([*cards, "SPC1,1,123456,1", "ENDDATA", ""]))
    words = ("--units", "SI", "--band", "5:600")
    made = bench(tmp_path / "bar.bdf", tmp_path / "o", *words)
    (drive,) = made.inputs.labels
    assert {label[-2:] for label in made.outputs.labels} == {drive[-2:]}
    prepared(made)


@pytest.mark.parametrize(
    "words",
    [
        ("--band", "20:90", "--excitation", "stepped-sine", "--sweeps", "1"),
        ("--excitation", "hammer"),
        ("--excitation", "multisine", "--levels", "1,2", "--articles", "2"),
        ("--room", "0.001", "--rubber", "--time", "--finer", "--hide", "point-mass"),
    ],
    ids=" ".join,
)
def test_a_bare_deck_leaves_a_case_that_can_be_diagnosed(deck, tmp_path, words):
    """Options that the deck needs to be read stand in the case, and so does the band."""
    band = () if "--band" in words else ("--band", "15:80")
    table = deck.with_name("sensors.csv")
    made = bench(deck, tmp_path / "o", *BARE, "--sensors", str(table), *band, *words)
    low, high = map(float, (*band, *words)[1].split(":"))
    assert made.band == pytest.approx((low, high), abs=1.0)  # to a line
    assert (made.outputs.sd == 0.002).all()
    assert prepared(made).identified.order > 2


def test_the_case_keeps_every_word_that_still_holds(demo, tmp_path):
    """What is not made anew by the test stands as it stood; thickness stands in the deck."""
    case = tmp_path / "mine"
    shutil.copytree(demo, case)
    base = chladni.load_case(demo)
    named = [p.name for p in base.assembly.parts][:1]
    (case / "t.csv").write_text(
        "x,y,z,t\n" + "\n".join(f"{x},{y},{z},1.25" for x, y, z in 1e3 * base.assembly.points)
    )
    words = {
        "model": {"deck": "deck.bdf", "units": "mm-t-s", "thickness": "t.csv", "damping": 0.02,
                  "thickness_units": "mm-t-s", "thickness_place": "as it lies",
                  "allow": ["CSEAM"], "outside": False},
        "test": {"recordings": ["recording.uff"], "use": "recording.uff", "gain": "unknown",
                 "quantity": "accelerance", "factor": 1.0, "delay": 0.0,
                 "frequency_unit": "Hz", "conjugated": False, "sensors": "sensors.csv",
                 "mass": 1.9, "mass_sd": 0.1, "gain_sd": 0.02, "direction_sd": 2.0,
                 "position_sd": 0.002, "shape_sd": 0.03, "hangers": [1, 620]},
        "band": {"fit": [15.0, 110.0], "exclude": [[50.0, 51.0]]},
        "held_out": {"sensors": ["240:+Y"], "band": [110.0, 119.0]},
        "search": {"effects": ["point-mass"]},
        "plan": {"regions": named, "fixed": ["240:+Y"], "forbidden": ["1:n"],
                 "cost": ["2:n=2", "costs.csv"]},
        "[parameter]": {"name": "mine", "parts": named, "field": "E", "sd": 0.1, "low": 0.5,
                        "high": 2.0},
    }  # fmt: skip
    held = {(s.strip("[]"), k) for s, all in words.items() for k in all}
    assert held == {(k.section, k.name) for k in SCHEMA if k.section != "recording"}
    lines = [
        line
        for name, values in words.items()
        for line in (f"[{name}]", *(f"{k} = {json.dumps(v)}" for k, v in values.items()))
    ]
    (case / "case.toml").write_text("\n".join(lines))
    (case / "costs.csv").write_text("label,cost\n3:n,2\n")
    before = chladni.load_case(case)
    made = bench(case, tmp_path / "o", "--band", "12:120")
    copy = made.path.parent / made.asked.said.words["cost"][1]
    assert copy.read_text() == "label,cost\n3:n,2\n"
    refined = {(s, k) for s, all in RENEWED.items() for k in all}
    assert {w for w in before.given if w not in refined} <= set(made.given)
    for name in (
        "damping",
        "band",
        "held_sensors",
        "held_band",
        "parameters",
        "gain_known",
        "shape_sd",
    ):
        assert getattr(made, name) == getattr(before, name), name
    assert made.setup.accuracy == before.setup.accuracy
    assert made.setup.hangers == before.setup.hangers
    assert made.exclude[:1] == before.exclude
    thickness = made.assembly.shells.thickness
    np.testing.assert_allclose(thickness, before.assembly.shells.thickness, rtol=1e-4)
    assert np.abs(thickness / base.assembly.shells.thickness - 1).max() > 0.01


def test_a_recording_of_too_few_lines_is_refused_before_it_is_made(demo, tmp_path):
    words = ["bench", str(demo), "--band", "20:21", "--resolution", "0.5"]
    assert "3 lines between 20 and 21 Hz are too few" in refused(*words, "--out", tmp_path / "o")
