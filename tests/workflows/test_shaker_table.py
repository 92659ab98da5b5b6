"""A plate held along an edge on a virtual shaker table: transmissibilities as theory has them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.commands import ran, refused
from tests.builders.plate_recordings import labels as labels_at
from tests.builders.structures import held_along_x0

import chladni
from chladni.errors import FileError, ModelError
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni_bench.accelerometers import AccelerometerType
from chladni_bench.article_scatter import fitted
from chladni_bench.bench_recording import BenchTest, record
from chladni_bench.bench_rig import BenchSetup, bench_rig
from chladni_bench.benched_article import benched, true_places
from chladni_bench.front_end import FrontEnd
from chladni_bench.shaker import Shaker
from chladni_specimens.plates import plate

PLACES = [(0.09, 0.05), (0.12, 0.2), (0.24, 0.0), (0.3, 0.05), (0.3, 0.175)]
PERFECT = AccelerometerType(
    mass=0.0, resonance=1e7, noise=0.0, gain_sd=0.0, tilt_sd=0.0, place_sd=0.0
)
QUIET = FrontEnd(bits=52, noise=0.0, volts=1e6)
BAND = (15.0, 300.0)


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A clamped plate whose table and five sensors were recorded once."""
    folder = tmp_path_factory.mktemp("table")
    made = held_along_x0(plate(0.3, 0.2, 8, 6, 1.2e-3))
    write_assembly(made, folder / "plate.bdf")
    labels = list(labels_at(made, PLACES))
    model = chladni.load(folder / "plate.bdf", "SI")
    frf = chladni.frf(model, labels, ["base:+Z"], np.linspace(*BAND, 400)).frfs[0]
    write_npz(folder / "once.npz", frf)
    (folder / "case.toml").write_text(
        '[model]\ndeck = "plate.bdf"\nunits = "SI"\ndamping = 0.01\n'
        '[test]\nrecordings = ["once.npz"]\n[band]\nfit = [15.0, 300.0]\n'
    )
    return chladni.load_case(folder)


@pytest.fixture(scope="module")
def article(case):
    """On the table, with the damping of the case."""
    rng = np.random.default_rng(565)
    places = true_places(case.assembly, case.outputs, case.inputs, PERFECT, rng)
    made = benched(case.assembly, case.outputs, case.inputs, (), places, BAND[1], fitted(), rng)
    return replace(made, damping=np.full(len(made.frequency), 0.01))


def setup(**changes):
    return BenchSetup(**{"accelerometer": PERFECT, "shaker": None, "front_end": QUIET, **changes})


def test_the_rig_has_the_transmissibility_of_the_model(case, article):
    """Modes, residual vectors and what the base carries make up X/ξ'' of the whole model."""
    due = case.frfs[0]
    assert due.quantity == "transmissibility"
    H = bench_rig(article, setup()).frf(due.frequency)
    assert_allclose(H, due.values[:, :, 0], atol=2e-4 * np.abs(due.values).max())


def test_heavy_sensors_ride_on_the_table_as_well(case, article):
    """A sensor's mass is carried by the base, too: as a point mass of the deck would be."""
    from chladni.model.point_masses import with_masses

    grids = [int(g.partition(":")[0]) for g in case.outputs.labels]
    heavy = with_masses(case.assembly, tuple(grids), 0.02)
    rng = np.random.default_rng(565)
    places = true_places(heavy, case.outputs, case.inputs, PERFECT, rng)
    other = benched(heavy, case.outputs, case.inputs, (), places, 2 * BAND[1], fitted(), rng)
    other = replace(other, damping=np.full(len(other.frequency), 1e-9))
    light = replace(article, damping=np.full(len(article.frequency), 1e-9))
    f = np.array([3.0, 5.0, 20.0, 25.0])  # about the first mode, at 11 Hz
    due = bench_rig(other, setup()).frf(f)
    found = bench_rig(light, setup(accelerometer=replace(PERFECT, mass=0.02))).frf(f)
    assert_allclose(found, due, rtol=3e-3, atol=2e-3)
    assert np.abs(found / bench_rig(light, setup()).frf(f) - 1).max() > 0.02


def test_a_recording_is_that_of_the_rig(article):
    rig = bench_rig(article, setup())
    test = BenchTest("multisine", BAND, 1.0, 0.5, averages=3)
    found = record(rig, test, np.random.default_rng(1))
    assert found.frf.quantity == "transmissibility"
    assert found.frf.inputs == ("base:+Z",)
    assert_allclose(found.frf.values[:, :, 0], found.truth, atol=1e-3 * np.abs(found.truth).max())


def test_what_a_table_has_not(case, article):
    with pytest.raises(ModelError, match="neither a shaker nor local forces"):
        bench_rig(article, setup(shaker=Shaker()))
    with pytest.raises(ModelError, match="a hammer test has no shaker"):
        record(
            bench_rig(article, setup()), BenchTest("hammer", BAND, 1.0), np.random.default_rng(1)
        )
    for words in ({"excitation": "hammer"}, {"local": ("clearance",)}, {"keep_time": True}):
        asked = chladni.BenchSettings(**words)
        with pytest.raises(FileError, match="shaker table, which has no --"):
            chladni.virtual_test(case, asked)


def test_the_command_leaves_a_case_that_identifies(case, tmp_path):
    done = ran(
        "bench", case.path, "--excitation", "stepped-sine", "--seed", "565", "--out", tmp_path / "b"
    )
    assert "level [m/s²]" in done.output
    said = json.loads((tmp_path / "b/bench.json").read_text())
    assert said["input"] == "base:+Z"
    assert said["recordings"][0]["level_m_s2"] > 0
    left = chladni.load_case(tmp_path / "b/case")
    assert [f.quantity for f in left.frfs] == ["transmissibility"]
    found = chladni.identify(left).recordings[0]
    truth = json.loads((tmp_path / "b/sealed/truth.json").read_text())
    f = np.array(truth["frequency_hz"]["A"])
    mine = found.poles.frequency
    assert len(mine) >= 3
    nearest = f[np.abs(f[:, None] / mine - 1).argmin(axis=0)]
    assert_allclose(mine[:3], nearest[:3], rtol=0.15)  # five sensors of 5 g on 190 g of plate


def test_responses_on_a_table_at_the_sensors_of_a_layout(case, tmp_path):
    """--sensors with --input base:+Z, or with that in the table, is --output one by one."""
    deck, table = case.path.parent / "plate.bdf", tmp_path / "places.csv"
    labels = case.outputs.labels
    table.write_text("label\n" + "\n".join(labels))
    rows = "\n".join(f"{name},output" for name in labels)
    (tmp_path / "whole.csv").write_text(f"label,role\n{rows}\nbase:+Z,input\n")
    ask = ["frf", str(deck), "--units", "SI", "--band", "5:300", "--lines", "50"]
    words = {
        "each": ["--input", "base:+Z", *(w for name in labels for w in ("--output", name))],
        "layout": ["--sensors", str(table), "--input", "base:+Z"],
        "table": ["--sensors", str(tmp_path / "whole.csv")],
    }
    found = {}
    for name, more in words.items():
        ran(*ask, *more, "--out", tmp_path / name)
        found[name] = np.load(tmp_path / name / "frf.npz")
        assert str(found[name]["quantity"]) == "transmissibility"
    for name in ("layout", "table"):
        assert found[name]["outputs"].tolist() == list(labels)
        assert_allclose(found[name]["values"], found["each"]["values"], rtol=1e-6, atol=1e-9)
    other = (*ask, *words["layout"], "--input", "20:+Z", "--out", tmp_path / "x")
    assert "must be the only input" in refused(*other)


QUICK = ["--excitation", "stepped-sine", "--band", "15:120", "--exact", "--units", "SI"]


@pytest.fixture
def table(case, tmp_path):
    """The sensors of the case as a table, each of 1 g."""
    rows = "".join(f"{name},0.001\n" for name in case.outputs.labels)
    (tmp_path / "places.csv").write_text(f"label,mass\n{rows}")
    return "--sensors", tmp_path / "places.csv"


@pytest.mark.parametrize("planned", [False, True])
@pytest.mark.parametrize("on_table", [True, False])
def test_a_bare_deck_is_driven_where_input_says(case, table, tmp_path, on_table, planned):
    """The base or a grid, at the sensors of a table or of a plan, whose shaker and cords are none.

    The case that is left has the same input.
    """
    drive, out = "base:+Z" if on_table else case.outputs.labels[-1], tmp_path / "o"
    words = (*(() if planned else table), "--input", drive, "--out", out)
    done = ran("bench", case.path.parent / "plate.bdf", *QUICK, *words)
    left = chladni.load_case(out / "case")
    (frf,) = left.frfs
    assert frf.quantity == ("transmissibility" if on_table else "accelerance")
    assert frf.inputs == left.inputs.labels == (drive,)
    assert frf.outputs == case.outputs.labels or (planned and len(frf.outputs) > 5)
    assert ("level [m/s²]" in done.output) == on_table
    assert not on_table or "hangers" not in (out / "case" / "case.toml").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--input", "base"), "--input: direction 'base'; write +X"),
        (("--input", "base:n"), "--input: label 'base:n': the base has no normal"),
        (("--input", "base:+Q"), "--input: direction 'base:+Q'"),
        (("--input", "999:+Z"), "--input: label '999:+Z': the deck has no grid 999"),
        (("--input", "corner:+Z"), "--input: 'corner:+Z' names no node"),
        (("--input", "base:+Z", "--excitation", "hammer"), "which has no"),
    ],
)
def test_an_input_that_is_none_is_one_sentence(case, table, tmp_path, words, said):
    given = ("bench", case.path.parent / "plate.bdf", *QUICK, *table, *words)
    assert said in refused(*given, "--out", tmp_path / "o")


def test_what_drives_is_said_once(case, tmp_path):
    """A table that names it, a case, and a deck that no SPC holds."""
    deck, table = case.path.parent / "plate.bdf", tmp_path / "places.csv"
    rows = "\n".join(f"{name},output" for name in case.outputs.labels)
    table.write_text(f"label,role\n{rows}\n{case.outputs.labels[0]},input\n")
    write_assembly(plate(0.3, 0.2, 8, 6, 1.2e-3), tmp_path / "free.bdf")
    last = ("--input", "base:+Z", "--out", tmp_path / "o")
    for words, said in (
        ((deck, *QUICK, "--sensors", table), "already names inputs"),
        ((case.path,), "is a case, which already defines sensors, drive point"),
        ((tmp_path / "free.bdf", *QUICK), "has no grid with SPC"),
    ):
        assert said in refused("bench", *words, *last)
