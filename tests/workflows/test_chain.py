"""The chain closes: a plan drives the model, and the case made of it finds no difference."""

import json

import numpy as np
import pytest
from tests.builders.commands import ran, refused

import chladni
from chladni.io.nastran import write_assembly
from chladni_specimens.plates import plate


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A deck and the folder of its plan."""
    folder = tmp_path_factory.mktemp("chain")
    deck = write_assembly(plate(0.3, 0.22, 6, 6, 1e-3), folder / "plate.bdf", "mm-t-s")
    words = ["--units", "mm-t-s", "--sensors", 8, "--modes", 5, "--drawn", 0]
    ran("plan", deck, *words, "--mass", 0.004, "--out", folder / "plan")
    return deck, folder / "plan"


def test_a_planned_test_of_the_model_finds_the_model(planned, tmp_path):
    """The sensors' mass is in both: Q of the case that init drafts is that of the identification.

    The plan and its table of sensors are one layout.
    """
    deck, plan = planned
    words = ["--units", "mm-t-s", "--band", "10:220", "--lines", 500]
    ran("frf", deck, *words, "--sensors", plan / "plan.json", "--out", tmp_path / "frf")
    ran("frf", deck, *words, "--sensors", plan / "sensors.csv", "--out", tmp_path / "table")
    one, other = (np.load(tmp_path / name / "frf.npz") for name in ("frf", "table"))
    np.testing.assert_allclose(one["values"], other["values"], rtol=1e-9)
    assert {k: one[k].tolist() for k in ("outputs", "inputs")} == {
        k: other[k].tolist() for k in ("outputs", "inputs")
    }
    words = [deck, tmp_path / "frf" / "frf.uff", "--sensors", plan / "sensors.csv"]
    ran("init", *words, "--out", tmp_path / "case")
    ran("correlate", tmp_path / "case", "--out", tmp_path / "out")
    found = json.loads((tmp_path / "out" / "correlation.json").read_text())
    assert found["Q"]["mean"] < 1e-5
    assert found["alone_test_hz"] == []
    assert max(abs(pair["deviation"]) for pair in found["modes"]) < 1e-3
    assert [pair["mac"] > 0.999 for pair in found["modes"]][:5] == [True] * 5, "the planned modes"
    sensors = json.loads((plan / "plan.json").read_text())["sensors"]
    assert set(found["comac"]) == {s["label"] for s in sensors}


def test_the_plan_says_what_its_sensors_weigh(planned, tmp_path):
    """8 sensors of 4 g: the first elastic frequency is that of the loaded plate."""
    deck, plan = planned
    model = chladni.load(deck, "mm-t-s")
    from chladni.workflows.frf import placed_layout

    loaded, outputs, _ = placed_layout(model, plan / "plan.json")
    assert len(outputs.labels) == 8
    mass = chladni.modes(loaded, 7).mass - chladni.modes(model, 7).mass
    assert mass == pytest.approx(0.032, rel=1e-6)


def test_a_place_inside_a_shell_moves_as_its_corners_do(planned, tmp_path):
    """At the centre of a shell, two triangles at its diagonal: the mean of the diagonal's grids.

    Its label is a number no grid has.
    """
    deck, _ = planned
    model = chladni.load(deck, "mm-t-s")
    shells = model.assembly.shells
    corners = shells.nodes[8]
    x, y, z = model.assembly.points[corners].mean(axis=0)
    table = tmp_path / "sensors.csv"
    table.write_text(
        "label,grid,x,y,z,nx,ny,nz,role\n"
        f"11195:n,,{x:.7f},{y:.7f},{z:.7f},0,0,1,output\n"
        "2:+Z,2,,,,0,0,1,input\n"
    )
    words = ["--units", "mm-t-s", "--sensors", table, "--band", "20:150", "--lines", 30]
    ran("frf", deck, *words, "--out", tmp_path / "out")
    f = np.linspace(20, 150, 30)
    ids = model.assembly.ids[corners[[0, 2]]]
    due = model.frf([f"{i}:+Z" for i in ids], "2:+Z", f).values.mean(axis=1)[:, 0]
    with np.load(tmp_path / "out" / "frf.npz", allow_pickle=False) as held:
        assert held["outputs"].tolist() == ["11195:n"]
        np.testing.assert_allclose(held["values"][:, 0, 0], due, rtol=1e-4)


def test_a_sensor_may_have_a_name(planned, tmp_path):
    """What no universal file can hold is left out of it and said; the others have it."""
    table = tmp_path / "sensors.csv"
    rows = ["label,grid,nx,ny,nz,role", "A1:+Z,9,0,0,1,output", "shaker:+Z,2,0,0,1,input"]
    table.write_text("\n".join(rows))
    words = ["--units", "mm-t-s", "--sensors", table, "--band", "20:150", "--lines", 5]
    ran("frf", planned[0], *words, "--out", tmp_path / "out")
    with np.load(tmp_path / "out" / "frf.npz", allow_pickle=False) as held:
        assert held["outputs"].tolist() == ["A1:+Z"]
    assert not (tmp_path / "out" / "frf.uff").exists()


@pytest.mark.parametrize(
    ("text", "name", "told"),
    [
        (None, "none.json", "no file"),
        ("{}", "plan.json", "is not a plan.json"),
        ("[1, 2]", "plan.json", "is not a plan.json"),
        ("label,role\n2:+Z,output\n", "sensors.csv", "names no input"),
        ("label,role\n2:+Z,output\n999:+Z,input\n", "sensors.csv", "no grid 999"),
        ("label,role\n2:+Z,output\n", "two.csv", "leave out --output"),
    ],
)
def test_what_is_no_layout_is_told(planned, tmp_path, text, name, told):
    """Nor is a layout and an output beside it."""
    if text is not None:
        (tmp_path / name).write_text(text)
    words = ["frf", planned[0], "--units", "mm-t-s", "--sensors", tmp_path / name]
    more = ["--output", "2:+Z"] if "--output" in told else []
    assert told in refused(*words, *more, "--out", tmp_path / "out")


def test_a_plan_tells_what_it_would_find(planned, tmp_path):
    """The table on the page, a map, and JSON place by place."""
    deck, _ = planned
    words = ["--units", "mm-t-s", "--sensors", 8, "--modes", 5, "--drawn", 0, "--detect"]
    done = ran("plan", deck, *words, "--pictures", "--out", tmp_path)
    assert "Smallest effects this layout can find" in done.output
    assert "\nsoftening " in done.output  # the table, on the terminal too
    rows = json.loads((tmp_path / "smallest.json").read_text())["mass"]
    weight = chladni.modes(chladni.load(deck, "mm-t-s"), 7).mass
    assert all(row["mass_kg"] is None or 0 < row["mass_kg"] < weight for row in rows)
    assert (tmp_path / "smallest_mass.png").is_file()
    assert "Smallest effects this layout can find" in (tmp_path / "report.html").read_text()
