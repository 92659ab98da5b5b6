"""Layouts at which no two modes look alike."""

import numpy as np
import pytest

from chladni.ema.correlation import auto_mac
from chladni_planning import (
    Rules,
    best_layout,
    candidates,
    distinct,
    excess,
    likeness,
    log_det_fisher,
    too_near,
)


def shapes(n=80, p=8, draws=1, seed=0):
    """Modes that resemble each other: two of them mostly."""
    rng = np.random.default_rng(seed)
    phi = rng.normal(size=(draws, n, p))
    phi[:, :, 1] += 0.7 * phi[:, :, 0]
    return phi[0] if draws == 1 else phi


def highest(phi, kept):
    return (auto_mac(phi[kept]) - np.eye(phi.shape[1])).max()


def test_likeness_is_the_auto_mac():
    phi = shapes()
    due = auto_mac(phi) - np.eye(8)
    np.testing.assert_allclose(likeness(phi.T @ phi), due, atol=1e-14)


def test_excess_is_the_mean_over_draws_of_what_is_above():
    phi = shapes(draws=3)
    F = phi.mT @ phi
    due = np.mean([np.triu(np.maximum(auto_mac(x) - 0.1, 0), 1).sum() for x in phi])
    assert excess(F, 0.1) == pytest.approx(due)
    assert excess(F, 1.0) == 0


def test_a_ceiling_of_one_is_plain_exchange():
    """From an optimum of single exchange nothing moves."""
    phi = shapes()
    best = best_layout(phi, 12)
    np.testing.assert_array_equal(distinct(phi, best, ceiling=1.0), best)


@pytest.mark.parametrize("seed", range(5))
def test_modes_are_told_apart_and_information_is_paid(seed):
    phi = shapes(seed=seed)
    best = best_layout(phi, 12)
    told = distinct(phi, best, ceiling=0.1)
    assert len(np.unique(told)) == 12
    assert highest(phi, told) < min(0.13, highest(phi, best))
    assert log_det_fisher(phi[told]) <= log_det_fisher(phi[best]) + 1e-9


def test_no_single_move_is_better():
    """The end is a local optimum of log det F - 30 excess, by brute force."""
    phi = shapes(30, 5)
    told = distinct(phi, best_layout(phi, 8), ceiling=0.1)

    def worth(kept):
        F = phi[kept].T @ phi[kept]
        return np.linalg.slogdet(F)[1] - 30 * excess(F[None], 0.1)

    others = np.setdiff1d(np.arange(30), told)
    moved = [worth(np.r_[np.delete(told, k), j]) for k in range(8) for j in others]
    assert max(moved) <= worth(told) + 1e-8


def test_rules_are_obeyed():
    phi = shapes()
    points = np.random.default_rng(1).uniform(size=(80, 2))
    rules = Rules([3], [5, 6], too_near(points, 0.08))
    told = distinct(phi, best_layout(phi, 12, rules=rules), ceiling=0.1, rules=rules)
    rules.checked(80, 12).obeyed(told)


def test_draws_are_judged_together():
    """A layout for all draws looks less alike over them than one for the first alone."""
    phi = shapes(draws=4)
    c = candidates(phi)
    one, every = (distinct(x, best_layout(x, 12), ceiling=0.1) for x in (phi[0], phi))
    F = [phi[:, k].mT @ phi[:, k] for k in (one, every)]
    assert excess(F[1], 0.1) < 0.5 * excess(F[0], 0.1)
    assert c.rows.shape[0] == 4
