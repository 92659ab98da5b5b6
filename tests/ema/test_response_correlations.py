"""Responses to a white force alone tell the natural frequencies, and nothing else is claimed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter, ss2tf

from chladni.ema.identification import identify
from chladni.ema.response_correlations import LINES, free_decays, one_sided, responses
from chladni.ema.setup import Function

F = np.array([11.0, 17.0, 31.0])
ZETA = np.array([0.008, 0.01, 0.006])
SHAPES = np.array([[1.0, 0.7, 0.5], [0.6, -0.9, 0.8], [0.9, 0.4, -0.7]])  # (outputs, modes)
RATE = 128.0


def simulated(seconds, seed, noise=0.02):
    """Displacements of three modes under white noise, 2 % noise on every sensor."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    force = rng.normal(size=n)
    q = []
    for f, zeta in zip(F, ZETA, strict=True):
        w = 2 * np.pi * f
        A, B = np.array([[0.0, 1.0], [-(w**2), -2 * zeta * w]]), np.array([[0.0], [w**1.5]])
        made = cont2discrete((A, B, np.array([[1.0, 0.0]]), np.zeros((1, 1))), 1 / RATE)
        b, a = ss2tf(*made[:4])
        q.append(lfilter(b[0], a, force))
    y = SHAPES @ np.array(q)
    y += noise * y.std(axis=1, keepdims=True) * rng.normal(size=y.shape)
    t = np.arange(n) / RATE
    return tuple(Function("time", f"{k + 1}:+Z", "", t, row, "m/s^2") for k, row in enumerate(y))


def frequencies(functions, band=(5.0, 45.0)):
    frf, sigma = one_sided(functions)
    found = identify(frf, band)
    return np.abs(found.poles + sigma) / (2 * np.pi), found


@pytest.mark.parametrize("seed", [3, 4])
def test_natural_frequencies_of_time_histories(seed):
    """As well as T seconds tell, sd f = f sqrt(ζ / (2π f T)) (Au 2014, MSSP 48, 15-33)."""
    T = 240.0
    known, found = frequencies(simulated(T, seed))
    for f, zeta in zip(F, ZETA, strict=True):
        k = np.abs(known - f).argmin()
        assert abs(known[k] - f) < 4 * f * np.sqrt(zeta / (2 * np.pi * f * T))
        assert found.relative_delta_chi2[k] > 3


def test_auto_spectra_alone_have_the_same_poles():
    """The exact spectrum of one mode under white noise, |H|²: its pole comes back."""
    f = np.arange(0, 64, 0.02)
    w, w0 = 2 * np.pi * f, 2 * np.pi * 17.0
    S = 1 / np.abs(w0**2 - w**2 + 2j * 0.01 * w * w0) ** 2
    known, _ = frequencies((Function("auto spectrum", "1:+Z", "", f, S),), (8.0, 40.0))
    assert np.abs(known - 17.0).min() < 1e-3 * 17.0


def test_a_record_with_a_force_is_left_to_others():
    some = simulated(10, 1)
    assert len(responses(some)) == 3
    assert responses((*some, replace(some[0], unit="N"))) == ()
    jumps = replace(some[0], x=np.cumsum(np.random.default_rng(0).uniform(1, 2, len(some[0].x))))
    assert responses((jumps,)) == ()
    assert responses(()) == ()
    rounded = [replace(f, x=np.round(f.x + 50.0, 4)) for f in some]  # as files write the time
    assert len(responses(rounded)) == 3


def ringing(strengths, seconds, seed, noise=0.01, offset=0.3, quiet=40):
    """Free decays of the three modes after some quiet, each block begun otherwise."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE)) / RATE
    found = []
    for begun in strengths:
        w = 2 * np.pi * F
        q = begun * np.exp(-ZETA * w * t[:, None]) * np.cos(w * np.sqrt(1 - ZETA**2) * t[:, None])
        y = np.vstack([np.zeros((quiet, 3)), q @ SHAPES.T])[: len(t)].T
        y = y + offset + noise * np.abs(y).max() * rng.normal(size=y.shape)
        found += [Function("time", f"{k + 1}:+Z", "", t, row, "m/s^2") for k, row in enumerate(y)]
    return tuple(found)


@pytest.mark.parametrize("strengths", [[(1.0, 0.8, 0.6)], [(1.0, 0.1, 0.4), (0.2, 1.0, 0.7)]])
def test_free_decays_have_their_poles_at_once(strengths):
    """Of one block or of several, frequency and damping; what the window added is taken off."""
    decays = ringing(np.array(strengths), 12.0, 3)
    assert free_decays(responses(decays))
    known, found = frequencies(decays)
    frf, sigma = one_sided(decays)
    assert frf.values.shape[1:] == (3, len(strengths))
    for f, zeta in zip(F, ZETA, strict=True):
        k = np.abs(known - f).argmin()
        assert abs(known[k] - f) < 2e-4 * f
        assert -(found.poles[k].real + sigma) / (2 * np.pi * f) == pytest.approx(zeta, rel=0.05)


def test_a_wide_record_is_cut_to_the_lines_that_are_asked_for():
    """A quarter of an hour is no better than what the band needs."""
    frf, _ = one_sided(ringing(np.ones((1, 3)), 900.0, 1), (15.0, 25.0))
    inside = (frf.frequency >= 15.0) & (frf.frequency <= 25.0)
    assert abs(int(inside.sum()) - LINES) < 5


def test_what_goes_on_is_no_decay():
    """White noise drives it all the time, or hits come one after another."""
    assert not free_decays(simulated(60, 2))
    hits = [ringing(np.ones((1, 3)), 4.0, k) for k in range(3)]
    t = np.arange(3 * len(hits[0][0].x)) / RATE
    whole = tuple(
        replace(one, x=t, values=np.concatenate([h[k].values for h in hits]))
        for k, one in enumerate(hits[0])
    )
    assert not free_decays(whole)
