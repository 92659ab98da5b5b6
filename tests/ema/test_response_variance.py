"""Noise that nobody states, taken from the recording itself."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, identify
from chladni.ema.response_variance import faint_scatter, left_variance
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
    w, wr = 2 * np.pi * f[:, None], 2 * np.pi * np.array([30.0, 60.0, 95.0, 150.0])
    h = -(w**2) / (wr**2 - w**2 + 2j * np.array([0.01, 0.006, 0.004, 0.008]) * wr * w)
    shapes = np.random.default_rng(3).normal(size=(5, 4)) * [1, 1, 1e-3, 1]
    H = (h @ shapes.T)[:, :, None]
    labels = tuple(f"{k}:+Z" for k in range(5))
    return FRF(H, f, labels, ("9:+Z",), "accelerance")


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
