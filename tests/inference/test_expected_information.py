"""Expected information: closed forms for Gaussian pairs, brute force, and what must always hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal, norm

from chladni.inference.expected_information import (
    OpenQuantity,
    Predicted,
    Rivals,
    chosen,
    nothing,
)

RNG = np.random.default_rng(7)


def case(n, sizes, apart=1.0, rng=RNG):
    """F and μ of some hypotheses on n samples, in units of the noise."""
    factors = [rng.normal(size=(n, k)) for k in sizes]
    means = [apart * rng.normal(size=n) for _ in sizes]
    return factors, means


def seen(factors, means):
    return Predicted(np.array(means), tuple(factors))


def even(n):
    return Rivals(np.full(n, 1 / n))


def exact(d, p):
    """I of two hypotheses with one covariance, apart by d in its units: an integral over one axis.

    The log odds are N(±d²/2, d²) under either.
    """
    z = np.linspace(-12, 12, 20001)
    w = norm.pdf(z) * (z[1] - z[0])
    total = 0.0
    for own, other in ((p, 1 - p), (1 - p, p)):
        ratio = d**2 / 2 + d * z  # ln of the density of the true one over the other's
        total += own * w @ -np.log(own + other * np.exp(-ratio))
    return total


@pytest.mark.parametrize(("apart", "p"), [(0.3, 0.5), (1.5, 0.5), (1.5, 0.9), (4.0, 0.2)])
def test_two_of_one_covariance_have_the_information_of_their_distance(apart, p):
    (F, _), _ = case(6, (2, 2))
    shift = np.eye(6)[0]
    S = np.eye(6) + F @ F.T
    shift *= apart / np.sqrt(shift @ np.linalg.solve(S, shift))
    two = Rivals(np.array([p, 1 - p]))
    found = two.forecast(seen([F, F], [np.zeros(6), shift]), 40000)
    assert_allclose(found.information, exact(apart, p), atol=0.015)


def test_density_is_that_of_the_gaussian():
    """Up to a constant common to all hypotheses, whatever their covariance."""
    factors, means = case(5, (1, 2, 3))
    y = RNG.normal(size=(5, 4))
    found = even(3).log_density(seen(factors, means), y)
    due = np.array([
        multivariate_normal(m, np.eye(5) + F @ F.T).logpdf(y.T)
        for m, F in zip(means, factors, strict=True)
    ])  # fmt: skip
    assert_allclose(found - found[0], due - due[0], atol=1e-9)


def test_forecast_is_that_of_brute_force():
    """Data drawn sample by sample, and odds from full covariance matrices."""
    factors, means = case(4, (1, 2), 0.8)
    two = Rivals(np.array([0.7, 0.3]))
    found = two.forecast(seen(factors, means), 20000)
    S = [np.eye(4) + F @ F.T for F in factors]
    every = [multivariate_normal(m, C) for m, C in zip(means, S, strict=True)]
    gain, sure = 0.0, 0.0
    for j, p in enumerate(two.probability):
        y = every[j].rvs(20000, random_state=3)
        weights = np.array([q * g.pdf(y) for q, g in zip(two.probability, every, strict=True)])
        own = weights[j] / weights.sum(axis=0)
        gain += p * np.log(own / p).mean()
        sure += p * (own > 0.9).mean()
    assert_allclose(found.information, gain, atol=0.02)
    assert_allclose(found.settled(9.0), sure, atol=0.02)


def test_fewer_data_hold_the_same_information():
    """What lies outside the span of the factors and of the distances tells nothing."""
    data = seen(*case(60, (2, 3), 0.3))
    assert data.short.mean.shape == (2, 6)
    found = [even(2).forecast(d, 20000).information for d in (data, data.short)]
    assert_allclose(*found, atol=0.01)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.lists(st.floats(0.05, 1.0), min_size=2, max_size=3))
def test_information_is_bounded_and_grows(seed, weights):
    """0 for what tells nothing, at most the entropy, and more with a further measurement."""
    rng = np.random.default_rng(seed)
    p = np.array(weights) / sum(weights)
    some = Rivals(p)
    one, other = (seen(*case(3, (2,) * len(p), 1.0, rng)) for _ in range(2))
    blind = some.forecast(nothing(one))
    assert_allclose(blind.information, 0.0, atol=1e-12)
    assert_allclose(blind.posterior, np.broadcast_to(p[None, :, None], blind.posterior.shape))
    first, both = (some.forecast(data, 4000).information for data in (one, one + other))
    assert first <= -(p @ np.log(p)) + 1e-9
    assert both >= first - 0.05


def test_what_both_do_not_know_hides_what_sets_them_apart():
    """A shared unknown along the difference of the means takes its information away."""
    shift = np.array([3.0, 0.0])
    for unknown, shows in ((np.array([[0.0], [30.0]]), True), (np.array([[30.0], [0.0]]), False)):
        data = seen([unknown, unknown], [np.zeros(2), shift])
        assert (even(2).forecast(data).information > 0.4) == shows


def picked(rivals, every, cost, count):
    """Positions of the chosen measurements."""

    def information(ks):
        return rivals.forecast(sum((every[k] for k in ks), nothing(every[0]))).information

    return chosen(information, cost, count, rivals.entropy)


def test_choice_takes_what_tells_most_for_its_cost():
    two, quiet = even(2), np.zeros((1, 1))
    every = [seen([quiet, quiet], [np.zeros(1), np.array([d])]) for d in (0.0, 1.0, 2.0, 3.0)]
    assert picked(two, every, np.ones(4), 2) == [3, 2]
    assert picked(two, every, np.array([1.0, 1.0, 1.0, np.inf]), 1) == [2]
    assert picked(two, every, np.array([1.0, 0.01, 1.0, 1.0]), 1) == [1]
    assert picked(two, every[:1], np.ones(1), 1) == []
    faint = [seen([quiet, quiet], [np.zeros(1), np.array([d])]) for d in (0.01, 0.02)]
    assert picked(two, faint, np.ones(2), 2) == []


def test_one_quantity_is_narrowed_as_its_posterior_is():
    """x = a z + rest: Var[x | y] from the joint covariance of x and y."""
    F, a, rest = RNG.normal(size=(4, 3)), RNG.normal(size=3), 0.4
    joint = np.block([[np.eye(4) + F @ F.T, (F @ a)[:, None]], [(F @ a)[None], a @ a + rest]])
    due = joint[-1, -1] - joint[-1, :4] @ np.linalg.solve(joint[:4, :4], joint[:4, -1])
    one = OpenQuantity("x", a, rest)
    assert_allclose(one.variance(seen([F], [np.zeros(4)])), due)
    assert_allclose(one.narrowed(seen([F], [np.zeros(4)])), np.sqrt(due / (a @ a + rest)))
