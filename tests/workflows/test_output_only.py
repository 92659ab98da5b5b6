"""Responses to a force nobody measured: natural frequencies are compared, and it is said."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.ema.setup import Function, Recording
from chladni.errors import FileError
from chladni.fem.assemble import structure
from chladni_specimens.plates import plate

RATE, SECONDS = 1024.0, 40.0


@pytest.fixture(scope="module")
def ambient(case):
    """A plate 4 % thicker than the deck under white noise at its corner, heard by four sensors."""
    article = structure(plate(0.3, 0.22, 6, 6, 1.04e-3))
    modal = normal_modes(article.system, 14)
    f = modal.frequency[6:]
    ends = np.array([[g, 3] for g in (2, 7, 18, 43)])
    phi, drive = (article.rows(d) @ modal.shapes[:, 6:] for d in (ends, np.array([[1, 3]])))
    n = int(RATE * SECONDS)
    force = np.random.default_rng(5).normal(size=n)
    y = np.zeros((4, n))
    for k, one in enumerate(f):
        pole = np.exp((-0.008 + 1j) * 2 * np.pi * one / RATE)
        q = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
        y += np.outer(phi[:, k] * drive[0, k], q)
    t = np.arange(n) / RATE
    channels = tuple(
        Function("time", f"{g}:+Z", "", t, row, "m/s^2")
        for (g, _), row in zip(ends, y, strict=True)
    )
    recording = Recording("ambient.uff", functions=channels)
    mass = replace(case.setup, mass=None)
    return replace(case, recordings=(recording,), setup=mass, notes=())


def test_frequencies_are_paired_with_the_models(ambient):
    """4 % of thickness is 4 % of every frequency of a flat plate."""
    case = ambient
    found = chladni.correlate(case)
    at = found.pairs
    ratio = found.f_test[at.test] / found.f_model[at.model]
    assert len(at) >= 4
    np.testing.assert_allclose(ratio, 1.04, rtol=0.01)
    assert any("the force was not measured" in note for note in found.notes)


def test_they_are_calibrated_with(ambient):
    case = ambient
    found = chladni.calibrate(case)
    assert found.compared == "frequencies"
    assert found.frequency_error.calibrated < 0.5 * found.frequency_error.before
    assert any("the force was not measured" in note for note in found.notes)


def test_identify_says_who_can_use_them(ambient):
    with pytest.raises(FileError, match="without a force: correlate, calibrate and diagnose"):
        chladni.identify(ambient)


def test_poles_of_free_decays_are_identified(ambient):
    """Frequency and damping of what it was made of; nothing is said of a drive point or delay."""
    t, f, zeta = np.arange(6144) / RATE, np.array([40.0, 71.0, 110.0]), 0.004
    rows = np.random.default_rng(2).normal(size=(2, 3)) @ np.array(
        [np.exp(-zeta * 2 * np.pi * g * t) * np.sin(2 * np.pi * g * t) for g in f]
    )
    rows = rows + 0.002 * np.random.default_rng(3).normal(size=rows.shape)
    channels = tuple(
        Function("time", label, "", t, row, "m/s^2")
        for label, row in zip(("2:+Z", "7:+Z"), rows, strict=True)
    )
    case = replace(ambient, recordings=(Recording("ring.csv", functions=channels),), band=(20, 150))
    found = chladni.identify(case)
    (one,) = found.recordings
    np.testing.assert_allclose(one.poles.frequency, f, rtol=1e-4)
    np.testing.assert_allclose(one.poles.damping, zeta, rtol=0.05)
    assert not one.screening.findings
    assert any("no force was measured" in note for note in found.notes)


def test_noise_has_no_natural_frequencies(ambient):
    """White noise on every sensor: one sentence, no table."""
    case = ambient
    rng = np.random.default_rng(1)
    (channels,) = case.recordings
    hiss = tuple(replace(g, values=rng.normal(size=len(g.x))) for g in channels.functions)
    with pytest.raises(FileError, match=r"ambient.uff: no natural frequency is above the noise"):
        chladni.calibrate(replace(case, recordings=(replace(channels, functions=hiss),)))


def test_records_that_are_no_use_are_refused_in_a_sentence(ambient):
    """A force beside the responses, and no FRF: nothing is compared with anything."""
    (channels,) = ambient.recordings
    force = replace(channels.functions[0], unit="N")
    odd = replace(ambient, recordings=(replace(channels, functions=(*channels.functions, force)),))
    for workflow in (chladni.correlate, chladni.calibrate, chladni.diagnose):
        with pytest.raises(FileError, match="neither FRFs nor a table of poles"):
            workflow(odd)
