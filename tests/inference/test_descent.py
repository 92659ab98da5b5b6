"""The descent on curved residuals with known slopes, under a covariance."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.inference.discrepancy import Discrepancy
from chladni.inference.linear_model import LinearModel, cost
from chladni.inference.map_fit import LinearPosterior, Point, Status, descend

T = np.linspace(0, 2, 15)
TRUE = np.array([1.4, -0.8, 0.5])
U = np.linalg.qr(np.random.default_rng(1).normal(size=(len(T), 4)))[0]
ERROR = Discrepancy(U, np.array([1.0, 2.0, 3.0, 4.0]) * 1e3, 0.01)
LIMIT = np.array([0.5, 0.5, 0.5])


def decay(x):
    """Residuals of a exp(b t) + c, and their slopes."""
    e = np.exp(x[1] * T)
    return x[0] * e + x[2], np.stack([e, x[0] * T * e, np.ones_like(T)], axis=1)


def objective(calls):
    """Squares of the decay under the error, counting the values and the slopes computed."""

    def at(x):
        r, J = decay(x)
        r = r - decay(TRUE)[0]
        r0, linear = x - TRUE, LinearModel(ERROR, J, np.eye(3))
        calls[0] += 1

        def sloped():
            calls[1] += 1
            return linear.squares(r, r0), LinearPosterior(None, linear, r, r0)

        return Point(cost(ERROR, r, r0), sloped)

    return at


def test_the_minimum_is_found_and_its_slopes_are_its_own():
    start = np.array([0.4, 0.3, 1.5])
    x, found, here, status = descend(objective([0, 0]), start, LIMIT, 40, 1e-12)
    assert status is Status.CONVERGED
    assert_allclose(x, TRUE, atol=1e-5)
    assert_allclose(here.model.J, decay(x)[1])
    C = np.eye(len(T)) + 1e-4 * (U * ERROR.s) @ U.T
    expected = here.model.J.T @ np.linalg.solve(C, here.model.J) + np.eye(3)
    assert_allclose(found.information, expected)


def test_no_slopes_are_computed_where_no_step_pays():
    """A start at the minimum."""
    calls = [0, 0]
    assert descend(objective(calls), TRUE + 1e-9, LIMIT, 40, 1e-6)[3] is Status.CONVERGED
    assert calls == [1, 1]


def test_an_accepted_step_is_evaluated_once():
    """Each point is one value, and slopes are computed at accepted points alone."""
    calls = [0, 0]
    steps = 6
    descend(objective(calls), TRUE + 0.1, LIMIT, steps, 1e-300)
    assert calls[0] == calls[1] == 1 + steps


def test_a_descent_without_steps_says_so():
    assert descend(objective([0, 0]), TRUE + 0.3, LIMIT, 1, 1e-6)[3] is Status.OUT_OF_STEPS
