"""Noise that nobody states, taken from the recording itself."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_frf, modal_sum, noisy

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, equalised, identify
from chladni.ema.response_variance import faint_scatter, frf_variance, left_variance
from chladni_evidence.__main__ import main
from chladni_evidence.identification_evidence import held_against, recording, structure


def test_faint_lines_show_the_additive_noise() -> None:
    """2 % of the rms at every line of a log grid; without noise nothing worth speaking of."""
    known = structure(0, 8, 6)
    frf, variance = recording(known, "floor", 0)
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    np.testing.assert_allclose(faint_scatter(frf), np.sqrt(variance[0]), rtol=0.25)
    exact = replace(frf, values=known.accelerance(frf.frequency)[:, :, None])
    assert (faint_scatter(exact) < 1e-4 * rms).all()


def test_what_is_faint_is_not_noise_where_it_does_not_scatter() -> None:
    """1 % of |H| over three decades is a few per cent on its faintest lines; of few lines unknown.

    The scatter is that of the faintest quarter, whose upper end is (400/10)^½ times its lower.
    """
    rng = np.random.default_rng(2)
    f = np.geomspace(10, 400, 300)
    H = (f / 400) ** 2 * np.exp(0.01j * f)
    H = H * (1 + 0.01 / np.sqrt(2) * (rng.normal(size=300) + 1j * rng.normal(size=300)))
    frf = FRF(H[:, None, None], f, ("1:+Z",), ("2:+Z",), "accelerance")
    share = np.sqrt(frf_variance(frf)[:, 0, 0]) / np.abs(H)
    assert share[:75].max() < 0.01 * 40**0.5
    few = frf.sel(band=(10, 10.8))
    assert len(few.frequency) < 24
    rms = np.sqrt((np.abs(few.values) ** 2).mean())
    assert np.sqrt(frf_variance(few)).min() > 1e-3 * rms


def test_both_parts_of_the_noise_are_told_apart() -> None:
    """E|r|² = a²|H|² + b², to what the median of 500 lines allows."""
    rng = np.random.default_rng(1)
    H = np.geomspace(1e-3, 10, 2000)[:, None] * np.exp(2j * np.pi * rng.random((2000, 3)))
    due = (0.02 * np.abs(H)) ** 2 + 0.01**2
    rest = np.sqrt(due / 2) * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
    found = left_variance(rest, H, np.ones(H.shape, bool))
    np.testing.assert_allclose(found / due, 1, atol=0.35)


def faint_mode(f: np.ndarray) -> FRF:
    """Three strong modes and one a thousand times fainter, known exactly."""
    shapes = np.random.default_rng(3).normal(size=(6, 4)) * [1, 1, 1e-3, 1]
    shapes[0] = 1.0
    return modal_frf(f, [30.0, 60.0, 95.0, 150.0], shapes, [0.01, 0.006, 0.004, 0.008])


def test_exact_data_are_met_exactly_with_a_gap_on_a_log_grid() -> None:
    """A mode far below the noise assumed is found too, for there is no noise."""
    f = np.geomspace(20, 200, 700)
    found = identify(faint_mode(f[(f < 40) | (f > 47)]))
    np.testing.assert_allclose(found.frequency, [30, 60, 95, 150], rtol=1e-10)
    np.testing.assert_allclose(found.damping, [0.01, 0.006, 0.004, 0.008], rtol=1e-8)


def test_noise_that_nobody_states_makes_no_modes_and_is_known_afterwards() -> None:
    """2 % of the rms at every line: nothing invented, errors as large as the spread says."""
    scores: list[float] = []
    for seed in range(3):
        known = structure(seed, 8, 6)
        frf, variance = recording(known, "floor, unsaid", seed, lines=600)
        one = held_against(known, frf, variance, identify(frf))
        assert one.invented == 0
        assert one.missed == 0
        scores += [*one.z_frequency, *one.z_damping]
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(
        1.0, abs=3 / np.sqrt(2 * len(scores))
    )


def test_a_pole_beside_all_modes_counts_as_invented() -> None:
    known = structure(0, 8, 6)
    frf, variance = recording(known, "share", 0)
    found = identify(frf)
    away = 0.5 * (found.frequency[3] + found.frequency[4]) / found.frequency[3]
    factor = np.where(np.arange(found.order) == 3, away, 1)
    moved: Identified = replace(found, poles=factor * found.poles)
    told = held_against(known, frf, variance, moved)
    assert (told.invented, told.missed) == (1, 1)


def test_the_evidence_refuses_a_noise_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "--seeds", "560", "--noise", "loud"]) == 2
    assert "there are 'share'" in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(2))
def test_bodies_that_bounce_below_the_band_are_felt_where_the_recording_is_faint(seed: int) -> None:
    """A body on springs, noise of 1 % of |H|: equalised, every line is known better than that.

    At 20 Hz the accelerance of what bounces at 11 Hz is a hundredth of its rms: taken for noise,
    it was a third off on a tailgate, and the springs a quarter too soft.
    """
    rng = np.random.default_rng(seed)
    f = np.geomspace(16, 310, 500)
    hertz = np.concatenate([[6.3, 10.7, 12.4], 27.0 * 1.35 ** np.arange(9)])
    phi = rng.normal(size=(7, len(hertz))) * np.where(hertz < 16, 0.3, 1.0)
    frf = modal_frf(f, hertz, phi)
    frf = noisy(frf.sel(frf.outputs[1:]), 0.01, seed=seed, stated=False)
    s = 2 * np.pi * np.geomspace(20, 45, 20) * (0.08 + 1j)
    exact = modal_sum(s, hertz, phi[1:], phi[:1], 0.0)[..., 0]
    off = np.linalg.norm(equalised(identify(frf), s)[..., 0] - exact, axis=1)
    assert (off / np.linalg.norm(exact, axis=1)).max() < 0.01
