"""A concealed case is a folder a user could have written, and the seal lies outside of it."""

import json

import numpy as np
import pytest

from chladni.case import load_case
from chladni.fem.energy import mass_properties
from chladni_evidence.concealed import Specimen, made, write
from chladni_specimens.plates import folded_panel


def panel(times):
    """A small panel; cut by ``times`` the points of the deck are points of the article."""
    return folded_panel(0.4, 0.2, 0.04, 0.01, 0.02 / times, 1e-3)


SMALL = Specimen("small panel", panel, 200.0, (15.0, 150.0), sensors=8)


@pytest.fixture(scope="module")
def case():
    return made(SMALL, "point-mass", 5)


def test_folder_is_read_as_a_case(case, tmp_path):
    folder, seal = tmp_path / "cases" / "one", tmp_path / "sealed" / "one.json"
    write(case, folder, seal)
    read = load_case(folder)
    assert read.setup.mass == pytest.approx(case.mass, rel=1e-4)
    assert len(read.assembly.shells) == len(case.deck.shells)
    (recording,) = read.recordings
    assert recording.frf.outputs == case.frf.outputs
    np.testing.assert_allclose(
        recording.frf.values, case.frf.values, atol=1e-6 * np.abs(case.frf.values).max()
    )


def test_truth_is_sealed_outside_the_folder(case, tmp_path):
    folder, seal = tmp_path / "cases" / "one", tmp_path / "sealed" / "one.json"
    write(case, folder, seal)
    assert folder not in seal.parents
    assert json.loads(seal.read_text())["effect"] == "point-mass"
    assert sorted(p.name for p in folder.iterdir()) == ["case.toml", "deck.bdf", "recording.uff"]
    for path in folder.iterdir():
        assert b"point-mass" not in path.read_bytes()


def test_the_article_weighs_what_was_put_on_it(case):
    """Weighed: the deck's mass, E and rho off by about 1 %, and the mass that is concealed."""
    plain = mass_properties(case.deck)[0]
    assert case.mass - case.truth["value"] == pytest.approx(plain, rel=0.06)
    assert 0.015 * 0.9 < case.truth["value"] / plain < 0.08 * 1.1


def test_seeds_repeat(case):
    again, other = made(SMALL, "point-mass", 5), made(SMALL, "point-mass", 6)
    np.testing.assert_array_equal(again.frf.values, case.frf.values)
    assert again.truth == case.truth
    assert other.truth["point_m"] != case.truth["point_m"]


def test_a_faulty_sensor_is_in_the_recording_only():
    """One channel times a factor; the truth names the channel."""
    fault = made(SMALL, "sensor-fault", 2)
    assert fault.truth["channel"] in fault.frf.outputs
    assert fault.truth["value"] != 1.0
    assert fault.mass == pytest.approx(mass_properties(fault.deck)[0], rel=0.06)
