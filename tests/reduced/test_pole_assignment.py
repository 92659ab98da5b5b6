"""Pairing of two lists in order: the cheapest of all monotone ones."""

from itertools import combinations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from chladni.reduced.pole_assignment import (
    FAINTEST,
    SPURIOUS,
    assigned,
    paired,
    price_missed,
    price_spurious,
    share_spurious,
)

PRICE = st.floats(0.0, 40.0)


def frequencies(most):
    return st.lists(st.floats(10.0, 100.0), min_size=1, max_size=most, unique=True).map(sorted)


def cost(test, model, sd, alone, missed, at_test, at_model):
    pair = ((np.log(model[at_model] / test[at_test]) / sd[at_test]) ** 2).sum()
    return pair + np.delete(alone, at_test).sum() + np.delete(missed, at_model).sum()


def all_pairings(n, m):
    """Every monotone pairing of n with m."""
    for k in range(min(n, m) + 1):
        for at_test in combinations(range(n), k):
            for at_model in combinations(range(m), k):
                yield np.array(at_test, int), np.array(at_model, int)


@given(frequencies(4), frequencies(5), st.data())
def test_is_the_cheapest_of_all(test, model, data):
    n, m = len(test), len(model)
    test, model = np.array(test), np.array(model)
    sd = np.array(data.draw(st.lists(st.floats(0.005, 0.5), min_size=n, max_size=n)))
    alone = np.array(data.draw(st.lists(PRICE, min_size=n, max_size=n)))
    missed = np.array(data.draw(st.lists(PRICE, min_size=m, max_size=m)))
    at_test, at_model, unpaired = paired(test, model, sd, alone, missed)
    assert np.all(np.diff(at_test) > 0)
    assert np.all(np.diff(at_model) > 0)
    got = cost(test, model, sd, alone, missed, at_test, at_model)
    best = min(cost(test, model, sd, alone, missed, *both) for both in all_pairings(n, m))
    assert_allclose(got, best, rtol=1e-9, atol=1e-9)
    assert_allclose(unpaired, np.delete(missed, at_model).sum(), atol=1e-9)


@given(frequencies(8), st.floats(0.1, 20.0))
def test_identical_lists_pair_themselves(both, price):
    f = np.array(both)
    n = len(f)
    sd, prices = np.full(n, 0.01), np.full(n, price)
    at_test, at_model, unpaired = paired(f, f, sd, prices, prices)
    assert at_test.tolist() == at_model.tolist() == list(range(n))
    assert unpaired == 0.0


def test_a_spurious_pole_is_left_alone_and_shifts_nothing():
    model = np.array([10.0, 20.0, 40.0, 80.0])
    test = np.array([10.1, 20.1, 28.0, 40.1, 80.1])
    at_test, at_model, unpaired = paired(
        test, model, np.full(5, 0.02), np.full(5, 20.0), np.full(4, 12.0)
    )
    assert at_test.tolist() == [0, 1, 3, 4]
    assert at_model.tolist() == [0, 1, 2, 3]
    assert unpaired == 0.0


def test_nothing_pairs_where_being_alone_is_free():
    f = np.array([10.0, 20.0])
    at_test, at_model, unpaired = paired(f, 1.3 * f, np.full(2, 0.01), np.zeros(2), np.zeros(2))
    assert len(at_test) == len(at_model) == unpaired == 0


@given(st.floats(1e-8, 1.0), st.floats(1e-8, 1.0))
def test_what_shows_more_costs_more_to_leave_alone(a, b):
    low, high = price_missed(np.sort([a, b]))
    assert 0 < low <= high


@given(st.floats(0.01, 0.6), st.floats(0.01, 0.6))
def test_the_commoner_spurious_poles_are_the_cheaper_they_are(a, b):
    low, high = np.sort([a, b])
    assert price_spurious(low) >= price_spurious(high)


@given(st.floats(FAINTEST, 1.0), st.floats(FAINTEST, 1.0))
def test_the_higher_a_peak_the_less_it_may_be_spurious(a, b):
    low, high = share_spurious(np.sort([a, b]))
    assert 1 > low >= high > 0


def test_a_peak_of_middling_height_says_nothing():
    """Midway in decades both densities are alike, so that what is known beforehand stays."""
    assert_allclose(share_spurious(np.array([np.sqrt(FAINTEST)])), SPURIOUS)


def test_a_spurious_pole_never_earns_anything():
    """A price below nothing at the widest spread of a fit would have no square root."""
    widest = 0.2
    assert np.all(price_spurious(share_spurious(np.array([FAINTEST, 1.0]))) > 2 * np.log(widest))


def test_no_rounding_makes_the_price_of_unpaired_modes_negative():
    """All are paired: 0, whatever the order of the sum."""
    prices = np.array([0.1, 0.2, 0.3])
    assert prices.sum() != prices[::-1].sum()  # as sums differ by their order
    cost = np.where(np.eye(3)[::-1] > 0, 0.0, 100.0)
    assert assigned(cost, np.full(3, 50.0), prices)[2] == 0.0
