"""Predictive densities: as the joint Gaussian has them, and silent where nothing can be felt."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.channels import sensor_fault
from chladni.inference.held_out_evidence import held_out_evidence, predictive
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.inference.map_fit import MassMeasurement
from chladni.reduced.reduced_model import evaluate

SCALES = MassMeasurement(1.413, 1.4e-3)
HELD = slice(20, 24)  # lines


@pytest.fixture(scope="module")
def seen(reduced, responses):
    """A plate seen with 8 % damping, its upper lines held out."""
    s = 2 * np.pi * np.linspace(25, 200, 24) * (0.08 + 1j)
    use = np.ones((24, 4), bool)
    use[HELD] = False
    return replace(responses, s=s, use=use, values=np.ones((24, 4, 2), complex))


def search_of(data):
    return SimpleNamespace(data=data, mass_measurement=SCALES)


def fit_of(reduced, data, effects, x):
    state = evaluate(reduced.model, effects[:1], np.zeros(1))
    fit = fitted(reduced.model, effects, data.allowing_errors(state), SCALES, np.asarray(x))
    return HypothesisFit(effects[-1], fit, reduced.model)


@pytest.fixture(scope="module")
def faulty(reduced, seen):
    """A level of one channel 20 % high, on every line."""
    E = calibration_parameter(reduced.groups, "E", [0])
    H = seen.model(evaluate(reduced.model, [E], np.array([0.02])))
    H[:, 2] *= 1.2
    data = replace(seen, values=H)
    fault = sensor_fault("c", 2, 4, 1, 0.2)
    null = fit_of(reduced, data, [E], [0.0])
    return data, null, fit_of(reduced, data, [E, fault], [0.0, 0.2])


def test_predictive_density_is_that_of_the_joint_gaussian(reduced, faulty):
    """Every fold given the others, from the covariance of all residuals."""
    data, null, _ = faulty
    fit, data = null.fit, null.data
    r, J = data.scaled(evaluate(null.model, fit.effects, fit.x), True)
    folds = np.arange(len(r)) % 5
    p = fit.effects[0].parameters[0]
    J = np.concatenate([J, fit.state.dweight[None] / SCALES.sd])
    r = np.append(r, (fit.state.weight - SCALES.mass) / SCALES.sd) - J @ (fit.x - p.mean)
    C = np.eye(len(r)) + p.sd**2 * J @ J.T
    error = data.error
    C[:-1, :-1] += (error.U * error.delta**2 * error.s) @ error.U.T
    due = 0.0
    for k in range(5):
        b = np.flatnonzero(np.append(folds, -1) == k)
        o = np.setdiff1d(np.arange(len(r)), b)
        gain = np.linalg.solve(C[np.ix_(o, o)], C[np.ix_(o, b)]).T
        V = C[np.ix_(b, b)] - gain @ C[np.ix_(o, b)]
        e = r[b] - gain @ r[o]
        due -= np.linalg.slogdet(V)[1] + e @ np.linalg.solve(V, e)
    assert_allclose(predictive(search_of(data), null, folds), due, rtol=1e-8)


def test_a_fault_is_heard_on_the_lines_held_out(faulty):
    """Its own channel tells; other channels are not asked of it."""
    data, null, fault = faulty
    unseen = np.zeros_like(data.use)
    unseen[HELD] = True
    evidence = held_out_evidence(search_of(data), unseen, null, fault)
    assert evidence.held_out > 10
    assert evidence.lines > 10
    assert evidence.sensors is None


def test_data_that_cannot_feel_it_do_not_speak_against_it(faulty):
    """Other channels on the lines held out; they may only gain by a smaller error of the model."""
    data, null, fault = faulty
    others = ~data.use
    others[:, 2] = False
    assert held_out_evidence(search_of(data), others, null, fault).held_out > -0.5


def test_what_does_nothing_changes_no_prediction(faulty):
    data, null, _ = faulty
    evidence = held_out_evidence(search_of(data), ~data.use, null, null)
    assert_allclose(list(evidence.votes.values()), 0.0, atol=1e-9)


def test_nothing_held_out_is_not_asked(faulty):
    data, null, fault = faulty
    evidence = held_out_evidence(search_of(data), np.zeros_like(data.use), null, fault)
    assert evidence.held_out is None
    assert "the data held out" not in evidence.votes


def test_an_effect_that_is_none_is_not_borne_out(reduced, faulty):
    """A fault of another channel predicts lines and held-out data no better."""
    data, null, _ = faulty
    E = calibration_parameter(reduced.groups, "E", [0])
    wrong = fit_of(reduced, data, [E, sensor_fault("a", 0, 4, 1, 0.0)], [0.0, 0.0])
    evidence = held_out_evidence(search_of(data), ~data.use, null, wrong)
    assert evidence.lines < 5
