"""Sensors of known mass are on the structure that was measured, and on nothing that is written."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.case import load_case
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly, read_deck
from chladni.io.tables.write_tables import write_npz
from chladni.search.preparation import prepare
from chladni.units import UNITS
from chladni.workflows.calibrate import calibrate
from chladni.workflows.case_model import model_frf
from chladni.workflows.frf import frf, placed_layout
from chladni.workflows.loaded_model import as_model
from chladni.workflows.question_of_case import question_of
from chladni_bench.accelerometers import AccelerometerType
from chladni_bench.article_scatter import Scatter
from chladni_bench.bench_page import _facts
from chladni_bench.bench_workflow import BenchSettings, virtual_test
from chladni_bench.benched_article import benched, true_places

from .test_case import deck

CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01
[test]
recordings = ["a.npz"]
sensors = "sensors.csv"
mass = {mass}
mass_sd = 0.0005
[band]
fit = [5.0, 60.0]
[[parameter]]
field = "rho"
"""
HEAD = "label,grid,x,y,z,direction,role,mass\n"
SENSORS = HEAD + (
    "3:+Z,3,,,,+Z,output,0.020\n"
    "3b:+Z,3,,,,+Z,output,0.020\n"  # the same device as the row before
    "16:+Z,,0.35,0.2,0,+Z,output,0.030\n"
    "22:+Z,22,,,,+Z,output,\n"
    "8:+Z,8,,,,+Z,input,0.040\n"
)
LABELS = ("3:+Z", "3b:+Z", "16:+Z", "22:+Z")


@pytest.fixture
def folder(tmp_path):
    """A plate, and its recording with the sensors on it."""
    (tmp_path / "plate.bdf").write_text(deck())
    (tmp_path / "sensors.csv").write_text(SENSORS)
    made = assembly(read_deck(tmp_path / "plate.bdf"), UNITS["mm-t-s"])
    (tmp_path / "case.toml").write_text(CASE.format(mass=f"{mass_properties(made)[0]:.6f}"))
    f = np.arange(4.0, 65.0, 0.1)
    blank = FRF(np.ones((len(f), 4, 1), complex), f, LABELS, ("8:+Z",), "accelerance")
    write_npz(tmp_path / "a.npz", blank)
    case = load_case(tmp_path)
    from chladni.fem.modelled import modelled

    loaded = modelled(case.tested(case.assembly), 200.0)
    noise = np.random.default_rng(0).normal(size=(2, len(f), 4, 1))
    clean = model_frf(case, loaded, 0.01, blank)
    values = clean.values * (1 + 0.01 * (noise[0] + 1j * noise[1]))
    write_npz(tmp_path / "a.npz", FRF(values, f, LABELS, ("8:+Z",), "accelerance"))
    return tmp_path


def test_mass_and_centre_are_those_of_the_devices(folder):
    """Three devices; one beside the grids keeps its mass and its place."""
    case = load_case(folder)
    before, at = mass_properties(case.assembly)
    after, centre = mass_properties(case.tested(case.assembly))
    assert_allclose(after - before, 0.09, rtol=1e-9)
    grids = case.assembly.points[case.assembly.rows([3, 8])]
    moment = 0.02 * grids[0] + 0.04 * grids[1] + 0.03 * np.array([0.35, 0.2, 0])
    assert_allclose(after * centre - before * at, moment, atol=1e-9)
    said = "The model carries sensors of 50 g in all and 40 g at the drive point (sensors.csv)"
    assert any(note.startswith(f"{said}, at 5 grids") for note in case.said("calibrate"))
    layout = placed_layout(as_model(case, "modes"), folder / "sensors.csv")[0]
    assert f"{said}." in layout.notes  # frf of a deck says of the same table the same


def test_a_bench_that_the_case_is_put_on_weighs_them_as_the_case_does(folder):
    """Rows of one device share its mass."""
    case = load_case(folder)
    settings = BenchSettings(band=(5.0, 60.0), resolution=1.0, averages=2, sweeps=1)
    found = virtual_test(case, settings)
    facts = dict(_facts(found))
    assert facts["Sensors"] == "3, 55 g in all"  # one that was not weighed is of the usual 5 g
    assert facts["Channels"] == "4"
    at = case.outputs, case.inputs
    places = true_places(case.assembly, *at, AccelerometerType(), np.random.default_rng(1))
    none = Scatter(0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0)
    article = benched(case.assembly, *at, (), places, 60.0, none, np.random.default_rng(1))
    assert (article.masses / article.channels).tolist() == [0.01, 0.01, 0.03, 0.0]


def test_they_lower_the_frequencies_the_model_is_compared_by(folder):
    case = load_case(folder)
    reduced = prepare(question_of(case)).problem.reduced
    due = normal_modes(structure(case.tested(case.assembly)).system, 12).frequency[6:]
    bare = normal_modes(structure(case.assembly).system, 12).frequency[6:]
    assert_allclose(reduced.frequency[6:12], due, rtol=1e-6)
    assert np.all(due < bare)
    peaks = frf(case).frfs[0]
    assert_allclose(peaks.values, model_frf_of(case, peaks), rtol=1e-6)


def model_frf_of(case, test):
    from chladni.fem.modelled import modelled

    return model_frf(case, modelled(case.tested(case.assembly), 200.0), 0.01, test).values


def test_calibration_leaves_an_article_that_is_right_as_it_is(folder):
    """The deck's own rho, and its own weight: without the sensors both would be 6 % off."""
    found = calibrate(load_case(folder))
    assert found.calibrated[0].estimate.value == pytest.approx(7850.0, rel=2e-3)
    assert found.mass.model_kg == pytest.approx(found.mass.weighed_kg, rel=2e-3)
    assert not any("CONM2" in repr(change) for change in found.models.final.changes or ())
    json.dumps([n for n in found.notes])


def test_rows_no_recording_has_are_named_and_weigh_nothing(folder):
    (folder / "sensors.csv").write_text(SENSORS + "30:+Z,30,,,,+Z,output,0.5\n")
    case = load_case(folder)
    assert sum(m for _, m in case.sensor_masses) == pytest.approx(0.09)
    assert any("30:+Z" in note and "no recording" in note for note in case.notes)
