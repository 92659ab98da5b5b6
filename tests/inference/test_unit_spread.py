"""Articles whose tests are linear: their spread and places are what was drawn, as often as said."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.inference.unit_spread import KNOWN, unit_spread

TAU = np.array([0.03, 0.2])
SEEDS = 50


def drawn(seed, articles=3, tau=TAU, form=50.0, samples=24):
    """Slopes, tests with one error of form and noise of 1, and the true θ_a less their mean."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(samples, 2)) * (60.0, 12.0)
    theta = (0.4, -0.7) + tau * rng.normal(size=(articles, 2))
    y = form * rng.normal(size=samples) + theta @ J.T + rng.normal(size=(articles, samples))
    return J, y, theta - theta.mean(axis=0)


@pytest.fixture(scope="module")
def found():
    return [(unit_spread(*drawn(s)[:2], np.arange(2), np.ones(2) / 2), drawn(s)[2])
            for s in range(SEEDS)]  # fmt: skip


def test_intervals_of_the_spread_hold_it_as_often_as_they_say(found):
    """Three articles leave two degrees of freedom: a profile holds 93 % there, not 95."""
    holds = np.mean([(f.low <= TAU) & (f.high >= TAU) for f, _ in found], axis=0)
    assert ((holds >= 0.85) & (holds <= 0.99)).all()


def test_the_spread_is_not_biased(found):
    """Restricted likelihood: τ² is right in the mean, though the mean of all is fitted too."""
    mean = np.mean([f.tau**2 for f, _ in found], axis=0)
    assert_allclose(mean, TAU**2, rtol=4 * np.sqrt(1 / SEEDS))


def test_intervals_of_each_article_hold_its_place(found):
    inside = [np.abs(f.away - true) <= 1.96 * np.sqrt(np.diag(f.covariance)) for f, true in found]
    holds = np.mean(inside, axis=(0, 1))
    assert ((holds >= 0.92) & (holds <= 1.0)).all()


def test_what_all_tests_share_changes_nothing():
    """An error of form, however large, is in the mean alone."""
    J, y, _ = drawn(1)
    shared = 1e3 * np.linspace(-1, 1, y.shape[1])
    one, other = (unit_spread(J, v, np.arange(2), np.ones(2) / 2) for v in (y, y + shared))
    assert_allclose(one.tau, other.tau, rtol=1e-4)
    assert_allclose(one.away, other.away, atol=1e-6)


def test_equal_articles_have_no_spread():
    J, y, _ = drawn(1, tau=np.zeros(2))
    noiseless = np.repeat(y[:1], 3, axis=0)
    found = unit_spread(J, noiseless, np.arange(2), np.ones(2) / 2)
    assert_allclose(found.tau, 0.0, atol=1e-6)
    assert_allclose(found.away, 0.0, atol=1e-9)
    assert (found.low == 0).all()
    assert (found.high < 0.5).all()


def test_what_the_tests_cannot_see_has_no_upper_end():
    J, y, _ = drawn(2)
    J[:, 1] = 0.0
    found = unit_spread(J, y, np.arange(2), np.ones(2) / 2)
    assert (found.low[1], found.high[1]) == (0.0, np.inf)
    assert np.isfinite(found.high[0])


def test_a_known_spread_takes_its_share():
    """A nuisance of each article along the same slope, of the true spread, leaves nothing to τ."""
    J, y, _ = drawn(3, articles=6, tau=np.array([0.2, 0.0]))
    both = np.stack([J[:, 0], J[:, 0]], axis=1)
    alone = unit_spread(both[:, :1], y, np.array([0]), np.array([0.5]))
    shared = unit_spread(both, y, np.array([0, KNOWN]), np.array([0.5, 0.2]))
    assert shared.tau[0] < 0.6 * alone.tau[0]
