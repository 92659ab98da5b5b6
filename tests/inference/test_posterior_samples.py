"""Draws of the posterior against cases whose posterior is known in closed form."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.errors import FileError
from chladni.inference.posterior_samples import ENOUGH, sampled

MEAN = np.array([1.0, -2.0, 0.5])
ROOT = np.array([[0.3, 0.0, 0.0], [0.4, 0.2, 0.0], [-0.1, 0.3, 0.8]])
KNOWN = ROOT @ ROOT.T


def test_a_package_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(FileError, match=r"emcee cannot be imported .*chladni\[posterior\]"):
        sampled(lambda x: 0.0, MEAN, KNOWN)


def gaussian(x):
    off = x - MEAN
    return -0.5 * off @ np.linalg.solve(KNOWN, off)


@pytest.mark.parametrize("scale", [1.0, 0.7, 2.0])
def test_draws_of_a_gaussian_have_its_mean_and_covariance(scale):
    """Also where the Gaussian that scales the steps is too narrow, too wide or off its place."""
    pytest.importorskip("emcee")
    off = MEAN + (0.0 if scale == 1.0 else 0.3) * ROOT.sum(axis=1)
    found = sampled(gaussian, off, scale**2 * KNOWN)
    assert found.converged.all()
    white = np.linalg.solve(ROOT, (found.draws - MEAN).T)
    error = 5 / np.sqrt(found.effective.min())  # of a mean in standard deviations, of a variance
    assert_allclose(white.mean(axis=1), 0.0, atol=error)
    assert_allclose(np.cov(white), np.eye(3), atol=np.sqrt(2) * error)


def test_the_effective_number_foretells_the_scatter_of_a_mean():
    """Means of the walkers, which are independent, scatter by sd √(τ / steps)."""
    pytest.importorskip("emcee")
    found = sampled(gaussian, MEAN, 4 * KNOWN)
    means = found.x.mean(axis=0)
    due = np.sqrt(np.diag(KNOWN) * found.autocorrelation_time / len(found.x))
    assert_allclose(means.std(axis=0) / due, 1.0, atol=0.5)


def test_chains_that_are_too_short_are_not_converged():
    pytest.importorskip("emcee")
    found = sampled(gaussian, MEAN, 1e-4 * KNOWN, most=200)
    assert found.steps < ENOUGH * found.autocorrelation_time.max()
    assert not found.converged.any()


def test_where_there_is_no_structure_nothing_is_drawn():
    """A Gaussian cut at its mean: half of it is left, with the mean and sd of a half normal."""
    pytest.importorskip("emcee")

    def cut(x):
        return -0.5 * x[0] ** 2 if x[0] >= 0 else -np.inf

    found = sampled(cut, np.zeros(1), np.eye(1))
    assert (found.draws >= 0).all()
    assert_allclose(found.draws.mean(), np.sqrt(2 / np.pi), atol=0.05)
    assert_allclose(found.draws.std(), np.sqrt(1 - 2 / np.pi), atol=0.05)
