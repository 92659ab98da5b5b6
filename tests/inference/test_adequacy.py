"""P values of a test of fit: uniform where the model is true, small where it is not."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import binom, chi2, kstest

from chladni.effects.effect import Effect
from chladni.inference.adequacy import (
    _along_lines,
    _drawn,
    _Linear,
    adequacy,
    at_least,
    of_poles,
    ranked,
)
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.inference.map_fit import MassMeasurement, prior_residuals
from chladni.inference.pole_data import Poles
from chladni.reduced.reduced_model import State, evaluate

SCALES = MassMeasurement(1.413, 1.4e-3)


def answered(reduced, data, effects):
    state = evaluate(reduced.model, effects, np.zeros(2))
    fit = fitted(reduced.model, effects, data.allowing_errors(state), SCALES, np.zeros(2))
    return adequacy(HypothesisFit(Effect(), fit, reduced.model), SCALES, tuple("abcd"), 200)


def test_draws_of_the_model_itself_have_uniform_p(reduced, damped):
    data, effects = damped
    state = evaluate(reduced.model, effects, np.zeros(2))
    data = replace(data, values=data.model(state)).allowing_errors(state)
    _, J = data.scaled(state, True)
    r0, J0 = prior_residuals(effects, SCALES, np.zeros(2), state)
    model, rng = _Linear(data.error, J, J0, data.use, 2), np.random.default_rng(1)
    sd = np.array([e.parameters[0].sd for e in effects])
    drawn = np.array([_drawn(model, sd, len(r0), rng) for _ in range(600)])
    p = [ranked(drawn[k], drawn[300:])[0] for k in range(300)]
    assert kstest(p, "uniform").statistic < 1.63 * np.sqrt(2 / 300)  # 1 %, both samples random


def test_a_model_that_is_right_fits(reduced, damped):
    data, effects = damped
    truth = evaluate(reduced.model, effects, np.array([0.03, 0.0]))
    assert answered(reduced, replace(data, values=data.model(truth)), effects).passes


@pytest.mark.parametrize(("share", "passes"), [(0.002, True), (0.15, True), (1.5, False)])
def test_the_size_of_the_residual_refuses_where_it_is_too_large(reduced, damped, share, passes):
    """Noise of the usual share of the spread fits, less does too; ten times as much does not."""
    data, effects = damped
    state = evaluate(reduced.model, effects, np.zeros(2))
    H, rng = data.model(state), np.random.default_rng(4)
    noise = _along_lines(rng.normal(size=(*H.shape, 2))) @ [1, 1j]
    spread = np.minimum(data.allowing_errors(state).std(), 1.0)
    found = answered(reduced, replace(data, values=H * 10 ** (share * spread * noise)), effects)
    assert found.passes is passes
    assert (found.against > 0.05) is passes
    assert (found.p > 0.05) is (share == 0.15)


def test_a_channel_of_another_structure_does_not_fit_and_is_named(reduced, damped):
    data, effects = damped
    H = data.model(evaluate(reduced.model, effects, np.zeros(2)))
    H[:, 2] *= np.exp(2j * np.sin(np.arange(24)))[:, None]
    found = answered(reduced, replace(data, values=H), effects)
    assert not found.passes
    assert found.where.endswith("on c")


def test_without_errors_of_form_there_is_nothing_to_test(reduced, damped):
    data, effects = damped
    data = replace(data, values=data.model(evaluate(reduced.model, effects, np.zeros(2))))
    fit = fitted(reduced.model, effects, data, SCALES, np.zeros(2))
    assert adequacy(HypothesisFit(Effect(), fit, reduced.model), SCALES, ()) is None


def modes(*hertz):
    lam = (2 * np.pi * np.array(hertz)) ** 2
    n, none = len(lam), np.zeros(0)
    return State(lam, np.eye(n), np.zeros((0, n)), none, none, 0.0, none, None, None)


def listed(**changed):
    f = np.array([10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    poles = Poles(f, np.full(6, 1e-4), np.ones(6, bool), np.ones(6), (5.0, 70.0), spurious=0.05)
    return replace(poles, **changed)


def test_poles_fit_as_closely_as_models_do_or_not_at_all():
    """The median spread is met by half of all models; six times that by hardly one."""
    every = modes(10, 20, 30, 40, 50, 60)
    assert_allclose(of_poles(listed(), every).p, 0.5)
    assert of_poles(listed(), every).passes
    assert not of_poles(listed(scale=6 * listed().scale), every).passes


def test_poles_without_partner_are_counted_and_said():
    """Of six listed modes one may be spurious by chance, three are not."""
    assert of_poles(listed(), modes(10, 20, 30, 40, 50, 75)).passes
    wide = of_poles(listed(scale=1.3 * listed().scale), modes(10, 20, 30, 40, 50, 75))
    assert wide.passes
    assert "5 of 6 natural frequencies (60 Hz without a partner) agree" in wide.what
    found = of_poles(listed(), modes(10, 25, 35, 45, 60))
    assert not found.passes
    assert "have no partner" in found.what
    assert "20" in found.where


def test_shapes_that_agree_excuse_no_frequencies():
    """Deviations of the learned spread pass as χ² says; of three times it they are no scatter."""
    rng, f = np.random.default_rng(5), listed().frequency
    draws = [of_poles(listed(), modes(*f * np.exp(0.01 * rng.normal(size=6)))) for _ in range(300)]
    assert sum(not test.passes for test in draws) <= binom.isf(1e-3, 300, 0.01)
    off = 3 * np.array([1, -1, 1, -1, 1, -1])
    found = of_poles(listed(), modes(*f * np.exp(0.01 * off)))
    assert_allclose(found.p, chi2.sf(np.sum(off**2) * 0.01**2 / (0.01**2 + 1e-8), 6))
    assert not found.passes
    assert "differ by 3.0 % (rms)" in found.what


def test_equal_chances_are_binomial():
    for count in range(7):
        expected = binom.sf(count - 1, 6, 0.3)
        assert_allclose(at_least(count, np.full(6, 0.3)), expected, atol=1e-12)


def test_of_a_raw_recording_more_poles_may_be_the_rigs():
    assert of_poles(listed(spurious=0.4), modes(10, 25, 40, 60)).passes
