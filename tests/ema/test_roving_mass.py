"""An accelerometer that is moved: exact FRFs of a structure with a mass at each output in turn."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_frf, noisy

from chladni.ema.identification import identify
from chladni.ema.recording_screening import screened
from chladni.ema.roving_mass import roving_mass
from chladni.ema.setup import Recording

F = np.linspace(20, 260, 800)
HERTZ = np.array([45.0, 78.0, 121.0, 187.0, 226.0])


def shapes(outputs=7, seed=2):
    return np.random.default_rng(seed).normal(size=(outputs, len(HERTZ)))


@cache
def moved(m=0.02, seed=0):
    """Output k with the mass at k alone: H_k1 / (1 + A_kk m), A the accelerance without it."""
    phi = shapes()
    n = len(phi)
    A = modal_frf(F, HERTZ, phi, 0.006, drives=range(n)).values
    H = np.stack([A[:, k, :1] / (1 + m * A[:, k, [k]]) for k in range(n)], axis=1)
    plain = modal_frf(F, HERTZ, phi, 0.006)
    return noisy(replace(plain, values=H), 0.005, 1e-4, seed)


@cache
def identified(frf):
    return identify(frf, (25.0, 250.0))


def found_in(frf):
    return roving_mass(frf, identified(frf))


def test_the_mass_that_moved_is_said():
    """Up to some per cent: its size comes from the drive point."""
    (fault,), check = found_in(moved())
    assert (fault.kind, fault.severity, check.passed) == ("roving mass", "fault", False)
    assert "moved from place to place" in fault.text
    assert fault.value == pytest.approx(0.02, rel=0.3)


def test_a_mass_that_stays_is_none():
    """All outputs share the modes with it, also where two modes lie side by side."""
    for hertz in (HERTZ, [45.0, 78.0, 79.0, 187.0, 226.0]):
        frf = noisy(modal_frf(F, hertz, shapes(), 0.006), 0.005, 1e-4)
        findings, check = found_in(frf)
        assert (findings, check.passed) == ([], True)


def test_outputs_of_scattered_modes_are_no_mass():
    """Modes that differ without regard to the motion: another cause, for example temperature."""
    phi, rng = shapes(), np.random.default_rng(5)
    parts = [modal_frf(F, HERTZ * np.exp(rng.normal(0, 0.01)), phi, 0.006) for _ in phi]
    H = np.stack([part.values[:, k] for k, part in enumerate(parts)], axis=1)
    findings, check = found_in(noisy(replace(parts[0], values=H), 0.005, 1e-4))
    assert (findings, check.passed) == ([], True)
    assert "differ by up to" in check.result


def test_the_screening_of_a_recording_says_it():
    frf = moved()
    kinds = [f.kind for f in screened(Recording("x", frf), identified(frf)).findings]
    assert "roving mass" in kinds
