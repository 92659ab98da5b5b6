"""A bolted beam at five held responses: friction by name, two levels foretold from three.

The recording stays in the folder of recordings; what a user has is read here: force, acceleration
and phase at the drive point, line by line.
"""

import numpy as np
import pytest

import chladni
from chladni.dynamics.frf import FRF
from chladni.ema.level_fit import foretold
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.properties import Isotropic
from chladni_specimens.plates import grid, sheet

CASE = """
[model]
deck = "beam.bdf"
units = "SI"
[test]
quantity = "accelerance"
"""


@pytest.fixture(scope="module")
def beam(recordings, tmp_path_factory):
    """Five recordings and a monolithic bar as long as its first bending mode asks for."""
    folder = tmp_path_factory.mktemp("beam")
    points, nodes = grid(np.linspace(0, 1.26, 31), np.linspace(-0.0127, 0.0127, 3))
    write_assembly(
        sheet(points, nodes, 0.0254, Isotropic(194e9, 0.29, 8000.0)), folder / "beam.bdf"
    )
    path = recordings / "brake_reuss_beam" / "stepped_sine.csv"
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    text = CASE
    for k in np.unique(table["level"]):
        rows = table[table["level"] == k]
        a, turn = rows["acceleration_m_s2"], np.exp(1j * rows["phase_rad"])
        H = -a / rows["force_n"] * turn  # it lags from 0 on: the sensor points against the force
        frf = FRF(H[:, None, None], rows["frequency_hz"], ("2:+Z",), ("2:+Z",), "accelerance")
        write_npz(folder / f"level_{k}.npz", frf)
        text += f'[[recording]]\nfile = "level_{k}.npz"\nlevel = {np.median(a):.4g}\n'
        text += 'control = "response"\n'
    (folder / "case.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def mode(beam):
    (study,) = chladni.identify(chladni.load_case(beam)).levels
    (found,) = study.modes
    return found


def test_damping_goes_with_amplitude_as_the_recording_says(mode):
    """From 0.15 % to 0.6 % of critical (the README beside the recording)."""
    z = mode.mode.damping
    assert np.all(np.diff(z) > 0)
    assert 0.0013 < z[0] < 0.0017
    assert 0.0055 < z[-1] < 0.007
    assert np.all(np.diff(mode.mode.amplitude) > 0)


def test_friction_is_its_signature(mode):
    assert mode.signature == "friction"
    assert "micro-slip" in mode.explained.element.name
    assert mode.fits[-1].p < 1e-6  # linear, or a spring alone, explains nothing


def test_two_levels_are_foretold_from_the_other_three(mode):
    """What no fit saw: half the miss of one linear model, or less."""
    f, zeta, f_linear, zeta_linear = mode.held_out.misses(mode.mode)
    assert zeta < 0.5 * zeta_linear
    assert f < f_linear


@pytest.mark.parametrize("held", [(0, 1), (0, 4), (3, 4)])
def test_damping_is_foretold_better_below_between_and_above(mode, held):
    _, zeta, _, zeta_linear = foretold(mode.mode, held).misses(mode.mode)
    assert zeta < zeta_linear


def test_diagnosis_says_nonlinear_and_names_friction(beam):
    found = chladni.diagnose(chladni.load_case(beam))
    assert found.verdict == "nonlinear"
    assert [e.name for e in found.effects] == ["joint-friction"]
    assert "levels alone do not show where" in found.effects[0].where.text
