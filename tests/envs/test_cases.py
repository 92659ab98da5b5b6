"""Every environment on a case folder: the panel, recorded with one modulus off."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.ema.tables_write import write_npz
from chladni.fem.assemble import structure
from chladni.meshing.nastran import write_assembly
from chladni.model.plates import folded_panel
from chladni_envs import agents, cases

SOFT = 0.98  # of the panel's modulus in the article: its peaks move by half a half-bandwidth
SENSORS = ("34:+Z", "100:+Z", "187:+Z", "239:+Z", "313:+Z", "402:+Z", "470:+Z", "555:+Z")
CASE = """
[model]
deck = "panel.bdf"
units = "SI"
damping = 0.01

[test]
recordings = ["article.npz"]
quantity = "accelerance"

[[parameter]]
name = "E"
field = "E"

[[parameter]]
name = "rho"
field = "rho"
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    panel = folded_panel()
    write_assembly(panel, folder / "panel.bdf")
    (folder / "case.toml").write_text(CASE)
    write_npz(folder / "article.npz", _recorded(panel))
    return str(folder)


def _recorded(panel):
    """Accelerance of an article that is softer than the deck, with a little noise."""
    steel = panel.parts[0].section.membrane
    soft = replace(steel, E=SOFT * steel.E)
    parts = tuple(p.with_section(membrane=soft, bending=soft, shear=soft) for p in panel.parts)
    built = structure(panel.with_parts(parts))
    modal = normal_modes(built.system, 60).with_damping(0.01)
    phi = modal.at(SENSORS)
    f = np.arange(10.0, 130.0, 0.2)
    omega, omega_r = 2 * np.pi * f[:, None], 2 * np.pi * modal.frequency
    h = -(omega**2) / (omega_r**2 - omega**2 + 0.02j * omega_r * omega)
    H = np.einsum("ir,kr,jr->kij", phi, h, phi[2:3])
    rng = np.random.default_rng(0)
    H *= 1 + 1e-3 * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
    return FRF(H, f, SENSORS, (SENSORS[2],), "accelerance")


def test_sensors_of_a_case(case):
    env = gym.make("chladni_envs:chladni/SensorPlacement-v0", case=case, modes=8, n_sensors=10)
    efi, best = (agents.play(env, a) for a in (agents.efi, agents.exchange(env)))
    assert efi["log_det"] <= best["log_det"]


def test_actuators_of_a_case(case):
    env = gym.make("chladni_envs:chladni/ActuatorPlacement-v0", case=case, modes=8)
    assert agents.play(env, agents.best_actuators(env))["condition"] < 1e3


@pytest.fixture(scope="module")
def recorded(case):
    """The case made ready for updating, once for both environments."""
    return cases.Recorded(case)


@pytest.fixture
def ready(recorded, monkeypatch):
    monkeypatch.setattr(cases, "Recorded", lambda path: recorded)
    return recorded


def test_selection_of_a_case(ready, case):
    """Freeing the modulus that is off improves the held-out data and is learned."""
    env = gym.make("chladni_envs:chladni/ParameterSelection-v0", case=case)
    problem = env.unwrapped.given
    assert ready.names[0].startswith("E")
    assert len(problem) == 2
    assert problem.improvement([0]) > 0.5
    assert problem.unlearned([0]) < 0.05
    assert agents.play(env, agents.held_back())["score"] > 0.3


def test_calibration_of_a_case(ready, case):
    """The textbook agent finds the modulus of the article, to a quarter of what it is off."""
    env = gym.make("chladni_envs:chladni/Calibration-v0", case=case)
    end = agents.play(env, agents.gauss_newton(env))
    assert env.unwrapped.question.names == ready.names
    found = ready.mean[0] + cases.REACH * ready.sd[0] * end["x"][0]
    assert found == pytest.approx(np.log(SOFT), rel=0.25)
    assert end["score"] > 0.1
