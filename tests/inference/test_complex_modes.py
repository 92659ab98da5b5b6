"""Damping makes modes complex within a bound and with one sign; what spins knows neither."""

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.ema.identification import identify
from chladni.inference.complex_modes import ModeCoupling, mode_coupling

MODES, OUTPUTS = 9, 14
OMEGA = 2 * np.pi * np.array([20, 27, 36, 44, 57, 68, 81, 97, 112.0])
LINES = np.linspace(12.0, 125.0, 600)


def recorded(B, seed, noise=0.003):
    """Receptance at many outputs to one force, of modes that forces B q' couple."""
    rng = np.random.default_rng(seed)
    phi, drive = rng.normal(size=(OUTPUTS, MODES)), rng.normal(size=MODES)
    s = 2j * np.pi * LINES
    D = (s**2)[:, None, None] * np.eye(MODES) + np.diag(OMEGA**2) + s[:, None, None] * B
    H = phi @ np.linalg.solve(D, drive[None, :, None])
    H = H * (1 + noise * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)))
    return FRF(H, LINES, tuple(f"{k}:+Z" for k in range(OUTPUTS)), ("99:+Z",), "receptance")


def light(rng):
    return np.diag(2 * 0.006 * OMEGA * np.exp(0.3 * rng.normal(size=MODES)))


def screened(B, seed):
    coupling = mode_coupling(identify(recorded(B, seed)), 15.0, 120.0)
    assert coupling is not None
    return coupling.tested()


def damper(rng):
    """One dashpot at one place: as much coupling as damping may have."""
    b = rng.normal(size=MODES)
    return 4.0 * np.outer(b, b) / (b @ b) * MODES


def layer(rng):
    """Many of them, spread."""
    b = rng.normal(size=(MODES, 3 * MODES))
    return 4.0 * b @ b.T / (3 * MODES)


def rotor(rng):
    """Two turns of one place, coupled by its spin."""
    u, v = rng.normal(size=(2, MODES))
    return 12.0 * (np.outer(u, v) - np.outer(v, u))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", [damper, layer])
def test_damping_wherever_it_is_explains_what_it_makes(kind, seed):
    rng = np.random.default_rng(seed)
    assert screened(light(rng) + kind(rng), seed)[0] > 0.05


@pytest.mark.parametrize("seed", range(2))
def test_a_rotor_is_recognised_by_its_complex_modes(seed):
    rng = np.random.default_rng(seed)
    p, row, what, modes = screened(light(rng) + rotor(rng), seed)
    assert p < 0.01
    assert "damping" in what
    assert len(modes)
    assert row.name == "complex modes"


@pytest.mark.parametrize(
    ("alike", "word"), [(9, "rotating part"), (2, "damping in one place"), (5, "or for a rotating")]
)
def test_the_step_names_what_may_couple_modes_with_their_frequencies(alike, word):
    f = np.array([20.0, 35.0, 50.0])
    step = ModeCoupling(f, np.array([0.2, 0.0, 0.4]), np.full(3, 0.05), alike, 10).step
    assert word in step
    assert "20, 50 Hz" in step
    assert ("damping in one place" in step) == (alike < 9)


def test_real_modes_need_no_step():
    assert ModeCoupling(np.array([20.0]), np.zeros(1), np.ones(1), 0, 0).step == ""


def test_modes_that_are_real_are_silent():
    p, row, _, _ = screened(light(np.random.default_rng(5)), 5)
    assert p == 1.0
    assert row.value == 0


def test_two_outputs_or_two_modes_say_nothing():
    frf = recorded(light(np.random.default_rng(1)), 1)
    identified = identify(frf)
    assert mode_coupling(identified, 15.0, 30.0) is None
    few = FRF(frf.values[:, :2], LINES, frf.outputs[:2], frf.inputs, frf.quantity)
    assert mode_coupling(identify(few), 15.0, 120.0) is None
