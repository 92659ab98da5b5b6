"""A steel strip on its shaker table: two causes at once and one sensor bear no name.

The recording stays in the folder of recordings; nothing of it, and no truth, is read but here what
a user has: size, material, the sensor's place, the curve.
"""

import json

import numpy as np
import pytest

import chladni
from chladni.dynamics.frf import FRF
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.properties import Isotropic
from chladni_specimens.plates import grid, sheet

EVERY = 6  # lines that are kept: half a hertz apart
CASE = """
[model]
deck = "strip.bdf"
units = "SI"
[test]
recordings = ["tip.npz"]
sensors = "sensors.csv"
[band]
fit = [40.0, 1200.0]
"""


@pytest.fixture(scope="module")
def strip(recordings, tmp_path_factory):
    """The bare strip, ideally clamped, and the curve of the accelerometer at its free end."""
    source = recordings / "strips_accelerometer"
    folder = tmp_path_factory.mktemp("strip")
    told = json.loads((source / "strip_steel.json").read_text())
    length, width = told["Lx_m"], told["Ly_m"]
    points, nodes = grid(np.linspace(0, length, 21), np.linspace(-width / 2, width / 2, 5))
    edge = np.flatnonzero(np.isclose(points[:, 0], length))
    held = np.array([(k, c) for k in edge for c in range(1, 7)])
    steel = Isotropic(told["E_nominal"], 0.3, told["rho"])
    write_assembly(sheet(points, nodes, told["h_m"], steel, supports=held), folder / "strip.bdf")
    curve = np.genfromtxt(source / "transmissibility_steel.csv", delimiter=",", names=True)[::EVERY]
    T = curve["magnitude"] * np.exp(1j * np.deg2rad(curve["phase_deg"]))
    frf = FRF(T[:, None, None], curve["frequency_hz"], ("1:+Z",), ("base:+Z",), "transmissibility")
    write_npz(folder / "tip.npz", frf)
    x, y = told["response_at_m"]
    (folder / "sensors.csv").write_text(f"label,x,y,z,direction,role\n1:+Z,{x},{y},0,+Z,output\n")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("exclude", ["", "exclude = [[620.0, 700.0], [950.0, 1000.0]]\n"])
def test_nothing_is_named_and_nothing_is_called_right(strip, exclude):
    """Whether or not the user knows the bumps of the rig."""
    (strip / "case.toml").write_text(CASE + exclude)
    found = chladni.diagnose(chladni.load_case(strip))
    assert found.compared == "responses"
    assert not found.effects
    assert found.verdict == "not in catalogue"
    assert any("do not separate the explanations" in why for why in found.distrust)


def test_its_modes_are_a_cantilevers(strip):
    """f₂/f₁ = 6.27 of a clamped beam; a mass at the end raises it, a soft clamp as well."""
    (strip / "case.toml").write_text(CASE + "exclude = [[620.0, 700.0], [950.0, 1000.0]]\n")
    (found,) = chladni.identify(chladni.load_case(strip)).recordings
    f = found.poles.frequency
    assert 6.0 < f[-1] / f[0] < 7.0
