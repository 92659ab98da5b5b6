"""Estimators on records of a known system; a hammer test whose FRFs others computed."""

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.builders.refusals import says

from chladni.ema.signals import estimated, spectra, window
from chladni.io.uff.read_uff import read_uff

RATE = 1000.0
B, A = [0.0, 0.2, 0.1], [1.0, -1.7, 0.95]  # a damped resonance


def burst(seed, n_blocks=60, n=1024, n_in=1):
    """Noise in the first quarter, silence after: the response has died when the block ends."""
    force = np.random.default_rng(seed).normal(size=(n_blocks, n_in, n))
    force[:, :, n // 4 :] = 0
    return force


def true_frf(f):
    z = np.exp(-2j * np.pi * f / RATE)
    return np.polyval(B[::-1], z) / np.polyval(A[::-1], z)


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_without_noise_every_estimator_is_the_truth(estimator):
    force = burst(0, 5)
    s = spectra(force, lfilter(B, A, force), RATE)
    frf = estimated(s, ["1:+Z"], ["1:+Z"], estimator=estimator)
    np.testing.assert_allclose(frf.values[:, 0, 0], true_frf(frf.frequency), rtol=1e-6)
    assert frf.coherence.min() > 1 - 1e-8


def test_bias_of_h1_and_h2_and_the_middle():
    """Noise at the force lowers H1 by S_ff / (S_ff + S_mm), noise at the response raises H2."""
    rng = np.random.default_rng(99)
    force = burst(1, 400)
    response = lfilter(B, A, force)
    power = force.var()
    noisy_force = force + np.sqrt(0.1 * power) * rng.normal(size=force.shape)
    s = spectra(noisy_force, response, RATE)
    due = true_frf(s.frequency)
    ratio = {}
    for e in ("H1", "H2", "Hv"):
        frf = estimated(s, ["1:+Z"], ["1:+Z"], estimator=e)
        ratio[e] = float(np.median(np.abs(frf.values[:, 0, 0] / due)))
    assert ratio["H1"] == pytest.approx(1 / 1.1, rel=0.02)
    assert ratio["H2"] == pytest.approx(1.0, rel=0.02)
    assert ratio["H1"] < ratio["Hv"] < ratio["H2"] * 1.01


def test_variance_is_the_scatter_of_repeats():
    """E|ΔH|² from one estimate agrees with the scatter of 200 estimates, two inputs."""
    found, claimed = [], []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        force = burst(seed, 12, 256, 2)
        response = lfilter(B, A, force[:, :1]) + 0.5 * force[:, 1:]
        response = response + 0.3 * rng.normal(size=response.shape)
        frf = estimated(spectra(force, response, RATE), ["3:+Z"], ["1:+Z", "2:+Z"])
        found.append(frf.values[:, 0])
        claimed.append(frf.variance[:, 0])
    scatter = np.var(found, axis=0)
    np.testing.assert_allclose(np.mean(claimed, axis=0).mean(0) / scatter.mean(0), 1, rtol=0.15)


def test_two_inputs_are_told_apart():
    force = burst(3, 40, 512, 2)
    response = np.concatenate([lfilter(B, A, force[:, :1]), 2 * force[:, 1:]], axis=1)
    s = spectra(force, response, RATE)
    for e in ("H1", "Hv"):
        frf = estimated(s, ["1:+Z", "2:+Z"], ["1:+Z", "2:+Z"], estimator=e)
        H = true_frf(frf.frequency)
        np.testing.assert_allclose(frf.values[:, 0, 0], H, atol=1e-3 * np.abs(H).max())
        np.testing.assert_allclose(frf.values[:, 1, 1], 2, rtol=1e-6)
        np.testing.assert_allclose(frf.values[:, 0, 1], 0, atol=1e-3)


def test_overlapping_windows_count_for_less():
    """Hann windows with 50 % overlap: each average is worth 1 / (1 + 2/36) of a free one."""
    record = np.random.default_rng(0).normal(size=8192)
    x = np.lib.stride_tricks.sliding_window_view(record, 256)[::128, None]
    s = spectra(x, x, RATE, "hann", overlap=0.5)
    assert s.averages == pytest.approx(len(x) / (1 + 2 / 36), rel=0.01)
    assert spectra(x[::2], x[::2], RATE).averages == 32


def test_a_hammer_test_is_reproduced(recordings):
    """Five hits, H1, both records under e^{-t / 1 s}: the accelerance and coherence of the file."""
    for plate in ("2L", "5L", "5R"):
        with np.load(recordings / f"spruce_plates/time_plate_{plate}.npz") as z:
            force, response = z["force"][:, None], z["acceleration"][:, None]
            rate = float(z["fs"])
        n = force.shape[-1]
        decay = window("exponential", n, np.exp(-n / rate))
        frf = estimated(spectra(force, response, rate, decay), ["2:+Z"], ["1:+Z"])
        file = read_uff(recordings / f"spruce_plates/plate_{plate}.uff").frf
        assert frf.coherence is not None
        k = file.frequency > 20
        same = frf.sel(band=(0.0, file.frequency[-1]))
        scale = np.abs(file.values[k]).max()
        np.testing.assert_allclose(same.values[k], file.values[k], atol=1e-6 * scale)
        np.testing.assert_allclose(same.coherence[k], file.coherence[k], atol=1e-5)


def test_what_cannot_be_estimated():
    says("no window 'flat'; there are rectangular, hann", window, "flat", 8)
    says("blocks, channels, samples", spectra, burst(0), burst(0)[:3], RATE)
    force, two = burst(0, 5, 64, 2), ["1:+Z", "2:+Z"]
    made = spectra(force, force, RATE)
    says("H2 needs one input, there are 2", estimated, made, two, two, estimator="H2")
