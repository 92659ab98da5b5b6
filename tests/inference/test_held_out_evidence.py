"""Predictive densities: as the joint Gaussian has them, and silent where nothing can be felt."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.channels import sensor_fault
from chladni.inference.held_out_evidence import held_out_evidence
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.inference.map_fit import MassMeasurement, unknowns
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


def density(data, hypothesis, use):
    """-2 ln p of the samples in use from their joint Gaussian, up to a constant per sample."""
    fit, data = hypothesis.fit, data.using(use)
    r, J = data.scaled(evaluate(hypothesis.model, fit.effects, fit.x), True)
    p = unknowns(fit.effects)
    J = np.concatenate([J, fit.state.dweight[None] / SCALES.sd])
    r = np.append(r, (fit.state.weight - SCALES.mass) / SCALES.sd)
    r = r - J @ (fit.x - [q.mean for q in p])
    C = np.eye(len(r)) + (J * [q.sd**2 for q in p]) @ J.T
    return np.linalg.slogdet(C)[1] + r @ np.linalg.solve(C, r)


def test_news_are_those_of_the_joint_gaussian(reduced, faulty):
    """P(held | fitted) = P(both) / P(fitted), with the covariance of all residuals."""
    data, *_ = faulty
    E, plain = calibration_parameter(reduced.groups, "E", [0]), data.exactly()
    every = [E], [E, sensor_fault("c", 2, 4, 1, 0.2)]
    null, fault = (
        HypothesisFit(e[-1], fitted(reduced.model, e, plain, SCALES, x), reduced.model)
        for e, x in zip(every, ([0.0], [0.0, 0.2]), strict=True)
    )
    both = np.ones_like(data.use)
    news = [density(plain, h, both) - density(plain, h, data.use) for h in (null, fault)]
    found = held_out_evidence(search_of(plain), ~data.use, null, fault)
    assert_allclose(found, news[0] - news[1], rtol=1e-6)


def test_a_fault_shows_on_the_lines_held_out(faulty):
    data, null, fault = faulty
    assert held_out_evidence(search_of(data), ~data.use, null, fault) > 10


def test_data_that_cannot_feel_it_do_not_speak_against_it(faulty):
    """Other channels on the lines held out; they may only gain by a smaller error of the model."""
    data, null, fault = faulty
    others = ~data.use
    others[:, 2] = False
    assert held_out_evidence(search_of(data), others, null, fault) > -0.5


def test_what_does_nothing_changes_no_prediction(faulty):
    data, null, fault = faulty
    assert_allclose(held_out_evidence(search_of(data), ~data.use, null, null), 0.0, atol=1e-9)
    assert held_out_evidence(search_of(data), np.zeros_like(data.use), null, fault) == 0.0


def test_an_effect_that_is_none_brings_nothing(reduced, faulty):
    """A fault of another channel predicts held-out data no better."""
    data, null, _ = faulty
    E = calibration_parameter(reduced.groups, "E", [0])
    wrong = fit_of(reduced, data, [E, sensor_fault("a", 0, 4, 1, 0.0)], [0.0, 0.0])
    assert held_out_evidence(search_of(data), ~data.use, null, wrong) < 5
