"""The noise of an equalised response, foretold from the recording's own, against drawn noise."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_frf, modal_sum, noisy

from chladni.ema.identification import equalised, identify
from chladni.ema.recording_noise import equalised_error, equalised_noise, sample_noise

F = np.arange(5, 120, 0.25)
POLES = np.array([12.0, 31.0, 44.0, 80.0, 101.0])
S = 2 * np.pi * np.geomspace(8, 115, 60) * (0.02 + 1j)
DRAWS = 24


PHI = np.random.default_rng(7).normal(size=(3, len(POLES)))
EXACT = modal_frf(F, POLES, PHI, 0.008)
EVERY = np.ones(len(F), bool)


@pytest.fixture(scope="module")
def drawn():
    """|Δ log10 H|² of many recordings of the same structure, and what is foretold of each.

    Last, χ² of Δ ln H within the columns of its error, and their number.
    """
    true = modal_sum(S, POLES, PHI, PHI[:1], 0.0)
    found, due, within = [], [], []
    for k in range(DRAWS):
        frf = noisy(EXACT, 0.01, 1e-3, k)
        modal = identify(frf)
        log = np.log(equalised(modal, S) / true)
        found.append(np.abs(log / np.log(10)) ** 2)
        due.append(equalised_noise(modal, frf, S, EVERY))
        within.append(chi2(-log, equalised_error(modal, frf, S, EVERY)))
    return np.array(found), np.array(due), np.array(within)


def chi2(delta, error):
    """δᵀ C⁺ δ of a complex deviation (n_s, n_out, n_in), and the rank of its covariance C."""
    own, common = error
    each = [own * (np.arange(3) == o)[:, None] for o in range(3)]
    V = np.concatenate([*each, common]).reshape(-1, delta.size).T
    V = np.concatenate([V.real, V.imag])
    r = np.concatenate([delta.real.ravel(), delta.imag.ravel()])
    U, sd, _ = np.linalg.svd(V, full_matrices=False)
    kept = sd > 1e-3 * sd[0]  # beyond, second order is larger than the noise
    return ((U[:, kept].T @ r / sd[kept]) ** 2).sum(), kept.sum()


def test_is_the_mean_square_of_what_is_drawn(drawn):
    """Complex errors: |Δ|² over its mean has sd 1 at most √2, so a mean of 24 has 0.29 at most.

    All samples of a channel may be as one, so each channel's mean is held to three of these.
    """
    found, due, _ = drawn
    ratio = (found / due).mean(axis=(0, 1, 3))
    np.testing.assert_allclose(ratio, 1.0, atol=3 * np.sqrt(2 / DRAWS))


def test_columns_of_the_error_hold_its_whole_covariance(drawn):
    """Dependence included: χ² over the number of columns has mean 1 and sd √(2 / columns)."""
    found, columns = drawn[2].T
    np.testing.assert_allclose(found.sum() / columns.sum(), 1, atol=4 * np.sqrt(2 / columns.sum()))


def test_is_in_proportion_to_the_variance_of_the_recording():
    """First order: four times the variance, four times the mean square.

    The 1e-4 of |H| that is added to any variance is 1e-4 of this one.
    """
    frf = replace(EXACT, variance=noisy(EXACT, 0.01, 1e-3).variance)
    modal, use = replace(identify(frf), chi=1.0), EVERY
    twice = replace(frf, variance=4 * frf.variance)
    one, four = (equalised_noise(modal, f, S, use) for f in (frf, twice))
    np.testing.assert_allclose(four / one, 4.0, rtol=1e-3)
    doubled = equalised_noise(replace(modal, chi=2.0), frf, S, use)
    np.testing.assert_allclose(doubled / one, 4.0, rtol=1e-9)


def test_samples_summed_as_independent_know_no_more_than_the_lines_they_come_from():
    """By the half-bandwidth: half as many lines, half the information; so has a fit its intervals.

    The exact noise of a sample is smaller, for it is that of all lines of a mode at once.
    """
    frf = replace(EXACT, variance=(0.01 * np.abs(EXACT.values)) ** 2)
    modal = replace(identify(frf), chi=1.0)
    high = S[S.imag > 2 * np.pi * 60]  # where a half-bandwidth holds lines enough
    dense = sample_noise(modal, frf, high)
    half = replace(frf, values=frf.values[::2], frequency=F[::2], variance=frf.variance[::2])
    sparse = sample_noise(modal, half, high)
    np.testing.assert_allclose((sparse / dense) ** 2, 2.0, rtol=0.1)
    exact = np.sqrt(equalised_noise(modal, frf, high, EVERY))
    assert np.median(exact) < np.median(dense)


def test_poles_far_below_the_band_are_as_sure_together_as_what_they_stand_for() -> None:
    """What far poles and L/s² share out among them cancels: noise of 1 % leaves no more than that.

    Bodies that bounce at 2 to 4 Hz, lines from 16 Hz: moved to the imaginary axis one by one, they
    made the noise of the equalised response a thousand times as large as its errors.
    """
    rng = np.random.default_rng(0)
    f = np.geomspace(16, 310, 400)
    hertz = np.concatenate([[2.0, 3.1, 4.2], 27.0 * 1.4 ** np.arange(8)])
    frf = modal_frf(f, hertz, rng.normal(size=(7, len(hertz))))
    frf = noisy(frf.sel(frf.outputs[1:]), 0.01, seed=0, stated=False)
    found = identify(frf)
    far = np.append(found.poles, 2 * np.pi * np.array([2.1, 4.0]) * (-0.01 + 1j))
    order = np.argsort(np.abs(far))
    more = 1e-6 * np.ones((2, 6, 1), complex)
    beside = replace(
        found, poles=far[order], residues=np.concatenate([found.residues, more])[order],
    )  # fmt: skip
    at = 2 * np.pi * np.geomspace(20, 200, 30) * (0.08 + 1j)
    noise = equalised_noise(beside, frf, at, np.ones(len(f), bool))
    assert np.sqrt(np.median(noise)) < 0.01
