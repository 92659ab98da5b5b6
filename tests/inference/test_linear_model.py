"""Sums of squares under errors of form equal those with the whole covariance written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.inference.discrepancy import Discrepancy
from chladni.inference.linear_model import LinearModel, Squares

N, PARAMETERS, WIDE = 40, 3, 6
RNG = np.random.default_rng(8)
U = np.linalg.qr(RNG.normal(size=(N, WIDE)))[0]
ERROR = Discrepancy(U, RNG.uniform(1e2, 1e5, WIDE), 0.02)
J, J0 = RNG.normal(size=(N, PARAMETERS)), np.eye(PARAMETERS)
R, R0 = RNG.normal(size=N), RNG.normal(size=PARAMETERS)


@pytest.mark.parametrize("delta", [None, 1e-3, 0.1])
def test_squares_are_those_under_the_inverse_covariance(delta):
    C = np.eye(N) + (delta or 0.02) ** 2 * (U * ERROR.s) @ U.T
    found = LinearModel(ERROR, J, J0).squares(R, R0, delta)
    assert found.cost == pytest.approx(R @ np.linalg.solve(C, R) + R0 @ R0)
    assert_allclose(found.gradient, J.T @ np.linalg.solve(C, R) + J0.T @ R0)
    assert_allclose(found.information, J.T @ np.linalg.solve(C, J) + J0.T @ J0)


def test_without_an_error_of_form_they_are_plain_sums():
    found = LinearModel(None, J, J0).squares(R, R0)
    r, A = np.append(R, R0), np.concatenate([J, J0])
    plain = Squares(r @ r, A.T @ r, A.T @ A)
    assert found.cost == pytest.approx(plain.cost)
    assert_allclose(found.gradient, plain.gradient)
    assert_allclose(found.information, plain.information)
    some = found.of_some(np.array([2, 0]))
    assert some.information[0, 1] == found.information[2, 0]


def test_a_refitted_residual_is_the_least_there_is():
    """No step of the parameters makes whitened data and priors smaller."""
    model = LinearModel(ERROR, J, J0)
    z = model.refitted(R, R0, 0.05)
    error = ERROR.with_delta(0.05)
    both = np.concatenate([error.whitened(J), J0])
    dx = np.linalg.lstsq(both, -np.append(error.whitened(R), R0), rcond=None)[0]
    assert_allclose(z, error.whitened(R + J @ dx))


@pytest.mark.parametrize("error", [None, ERROR])
def test_products_of_the_first_columns_are_reused(error):
    plain = LinearModel(error, J, J0)
    inner = LinearModel(error, J[:, :2], J0[:, :2])
    for model in (LinearModel(error, J, J0, within=inner), LinearModel(error, J, J0, within=plain)):
        assert_allclose(model.squares(R, R0).gradient, plain.squares(R, R0).gradient)
        assert_allclose(model.squares(R, R0).information, plain.squares(R, R0).information)


def test_profiled_squares_have_the_best_first_parameters():
    """They are those of a fit of these at every value of the others."""
    whole = LinearModel(ERROR, J, J0).squares(R, R0)
    alone = whole.profiled(2)
    for z in (0.0, 0.3, -1.2):
        moved = LinearModel(ERROR, J[:, :2], J0[:, :2]).squares(R + J[:, 2] * z, R0 + J0[:, 2] * z)
        due = moved.cost - moved.further
        assert alone.cost + 2 * alone.gradient[0] * z + alone.information[0, 0] * z**2 == (
            pytest.approx(due)
        )
