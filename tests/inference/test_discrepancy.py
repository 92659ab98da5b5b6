"""Errors of the model's form: their slopes, their covariance, and what is learned of their size."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.inference import discrepancy as dis
from chladni.inference.discrepancy import discrepancy, form
from chladni.inference.hypothesis_fit import fitted
from chladni.inference.linear_model import LinearModel
from chladni.inference.map_fit import MassMeasurement, fit, posterior, prior_residuals
from chladni.reduced.reduced_model import evaluate


@pytest.fixture(scope="module")
def softer(reduced, damped):
    """The recording seen from a model that is nearly right."""
    empty, effects = damped
    truth = evaluate(reduced.model, effects, np.array([0.01, 0.005]))
    return replace(empty, values=empty.model(truth)), effects


@pytest.fixture(scope="module")
def state(reduced, softer):
    return evaluate(reduced.model, softer[1], np.zeros(2))


def disturbed(model, effects, about, x):
    """The nominal state with modal stiffness and mass changed by x deviations at δ = 1."""
    (i, j), root, k = about.pairs.T, np.sqrt(about.lam), len(about.lam)
    dK, dM = np.zeros((2, k, k))
    for G, values in zip((dK, dM), x.reshape(2, -1), strict=True):
        G[i, j] = G[j, i] = values * np.where(i == j, 1.0, np.sqrt(0.5))
    dK, dM = (about.rows.T @ G @ about.rows for G in (root[:, None] * dK * root, dM))
    return evaluate(replace(model, K0=model.K0 + dK, M0=model.M0 + dM), effects, np.zeros(2), False)


@pytest.fixture(scope="module")
def about(softer, state):
    return form(state, softer[0].s.imag.max())


@pytest.fixture(scope="module")
def draw(reduced, softer, about):
    """A state with errors of form of a given size, drawn."""

    def drawn(rng, delta):
        x = delta * rng.normal(size=2 * len(about.pairs))
        return x, disturbed(reduced.model, softer[1], about, x)

    return drawn


def test_slopes_leave_a_quadratic_remainder(softer, state, reduced, about):
    data = softer[0]
    x = np.random.default_rng(1).normal(size=2 * len(about.pairs))

    def at(h):
        return data.scaled(disturbed(reduced.model, softer[1], about, h * x), False)[0]

    dr, r = data.form_slopes(state, about) @ x, data.scaled(state, False)[0]
    left = [np.linalg.norm(at(h) - r - h * dr) for h in (1e-3, 5e-4)]
    assert left[0] / left[1] == pytest.approx(4, rel=0.1)


def test_slopes_about_a_change_of_form(softer, reduced, about):
    """The same remainder about G that is not zero."""
    data, rng = softer[0], np.random.default_rng(6)
    held, x = 0.02 * rng.normal(size=(2, 2 * len(about.pairs)))

    def at(h):
        return data.scaled(disturbed(reduced.model, softer[1], about, held + h * x), False)[0]

    state = disturbed(reduced.model, softer[1], about, held)
    dr = data.form_slopes(state, about) @ x
    left = [np.linalg.norm(at(h) - at(0) - h * dr) for h in (4e-2, 2e-2)]
    assert left[0] / left[1] == pytest.approx(4, rel=0.15)


@pytest.mark.parametrize("most", [2000, 60])
def test_low_rank_covariance_is_the_dense_one(softer, state, about, most, monkeypatch):
    data = softer[0]
    W = every = data.form_slopes(state, about)
    if most < W.shape[1]:
        W = W[:, np.argsort(-(W**2).sum(axis=0))[:most]]
    monkeypatch.setattr(dis, "MOST_PAIRS", most)
    error = discrepancy(every).with_delta(0.02)
    C = np.eye(len(W)) + 0.02**2 * W @ W.T
    r = np.random.default_rng(3).normal(size=(len(W), 2))
    z = error.whitened(r)
    assert_allclose(z.T @ z, r.T @ np.linalg.solve(C, r), rtol=2e-2)
    log_det = -np.log1p(-error.share()).sum()
    assert log_det == pytest.approx(np.linalg.slogdet(C)[1], rel=2e-2)


def test_no_error_at_all_is_the_plain_likelihood(softer, state, about):
    data = softer[0]
    tiny = discrepancy(data.form_slopes(state, about)).with_delta(1e-9)
    plain = data.residual(state, True)
    for a, b in zip(replace(data, error=tiny).residual(state, True), plain, strict=True):
        assert_allclose(a, b, atol=1e-9 * np.abs(b).max())


def test_evidence_is_the_sum_over_sizes_of_the_dense_one(softer, state, about):
    data, effects = softer
    error = discrepancy(data.form_slopes(state, about))
    (r, J), (r0, J0) = data.scaled(state, True), prior_residuals(effects, None, np.zeros(2), state)
    U, s, S = error.U, error.s, []
    prior = dis.FORMULATIONS
    for delta in prior.grid:
        C = np.eye(len(r)) + (U * delta**2 * s) @ U.T
        A = J.T @ np.linalg.solve(C, J) + J0.T @ J0
        g = J.T @ np.linalg.solve(C, r) + J0.T @ r0
        cost = r @ np.linalg.solve(C, r) + r0 @ r0 - g @ np.linalg.solve(A, g)
        S.append(cost + np.linalg.slogdet(C)[1] + np.linalg.slogdet(A)[1] + prior.neg2_log(delta))
    total = -2 * np.log(np.exp(-np.array(S) / 2).sum() * np.log(prior.grid[1] / prior.grid[0]))
    assert LinearModel(error, J, J0).learned(r, r0).neg2_log_evidence == pytest.approx(
        total, abs=1e-6
    )


SCALES = MassMeasurement(1.413, 1.4e-3)


def fit_with_errors(reduced, seen, effects, state):
    data = seen.allowing_errors(state)
    return fitted(reduced.model, effects, data, SCALES, np.zeros(2))


def test_size_of_the_error_is_learned(reduced, softer, state, draw):
    """Drawn at 0.5 and 2 %, it is found within a third."""
    data, effects = softer
    for delta in (0.005, 0.02):
        seen = replace(data, values=data.model(draw(np.random.default_rng(4), delta)[1]))
        learned_delta = fit_with_errors(reduced, seen, effects, state).data.error.delta
        assert abs(np.log(learned_delta / delta)) < 0.4


def test_intervals_hold_the_truth_under_errors_of_form(reduced, softer, state, draw):
    """E is 95 % covered when G is drawn at 1 %; taken to be exact, the model is over-confident."""
    data, effects = softer
    rng, inside, believed = np.random.default_rng(5), [], []
    for _ in range(30):
        seen = replace(data, values=data.model(draw(rng, 0.01)[1]))
        plain = fitted(reduced.model, effects, seen, SCALES, np.zeros(2))
        for out, found in (
            (inside, fit_with_errors(reduced, seen, effects, state)),
            (believed, plain),
        ):
            out.append(np.abs(found.x / np.sqrt(np.diag(found.covariance))) < 1.96)
    assert np.mean(inside) > 0.85
    assert np.mean(believed) < 0.5


def test_a_plain_fit_takes_no_notice(reduced, softer):
    data, effects = softer
    a = fit(reduced.model, effects, data, None, np.zeros(2))
    b = fitted(reduced.model, effects, data, None, np.zeros(2))
    assert_allclose(a.x, b.x)
    assert a.neg2_log_evidence == b.neg2_log_evidence


def test_errors_that_spread_from_a_state_are_the_same_however_often_they_spread(responses, reduced):
    """So the evidence of one hypothesis does not depend on the way by which it was reached."""
    effect = calibration_parameter(reduced.groups, "E", [0])
    near, far = (evaluate(reduced.model, [effect], np.array([x]), False) for x in (0.0, 0.3))
    once = responses.allowing_errors(near, 1e-3)
    again = responses.allowing_errors(far, 1e-3).allowing_errors(near, 1e-3)
    assert_allclose(once.bent, again.bent)
    assert_allclose(once.residual(near, False)[0], again.residual(near, False)[0])
    other = responses.allowing_errors(far, 1e-3).residual(near, False)[0]
    assert np.abs(other - once.residual(near, False)[0]).max() > 1e-6


def test_errors_of_another_size_need_no_new_slopes(softer, state, reduced):
    """A fit goes on from what is known at its x as from a posterior made anew."""
    data, effects = softer
    data, x = data.allowing_errors(state, 0.01), np.array([0.02, 0.0])
    weighed = MassMeasurement(1.4, 0.02)
    _, there = posterior(reduced.model, effects, data, weighed, x).sloped()
    error = data.error.with_delta(0.002)
    due = posterior(reduced.model, effects, replace(data, error=error), weighed, x)
    found = there.under(error)
    assert found.cost == pytest.approx(due.cost)
    assert_allclose(found.sloped()[0].gradient, due.sloped()[0].gradient)
    assert_allclose(found.sloped()[0].information, due.sloped()[0].information)
