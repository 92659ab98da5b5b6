"""States fitted together: what is shared is known from all, what is a state's own from it alone."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.channels import channel_gain
from chladni.effects.effect import Effect
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import PointMass
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.inference.joint_fit import informed, joint_fit, of_the_object, with_priors
from chladni.inference.map_fit import MassMeasurement, fit
from chladni.reduced.reduced_model import evaluate

WEIGHED = MassMeasurement(1.413, 0.002)


def base(reduced):
    """Effects as each state makes them: alike, never the same objects."""
    return [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]


def measured(reduced, responses, effects, x, lines):
    """Noiseless data of a structure with these effects, on some of the lines."""
    use = np.zeros_like(responses.use)
    use[lines] = True
    data = replace(responses, use=use)
    return replace(data, values=data.model(evaluate(reduced.model, effects, x, False)))


@pytest.fixture
def alone(reduced, responses):
    """Two states of one plate 4 % stiffer than the model, each seen on other lines."""
    out = []
    for lines in (slice(0, 20), slice(20, 40)):
        effects = base(reduced)
        data = measured(reduced, responses, effects, np.array([0.04, 0.0]), lines)
        found = fit(reduced.model, effects, data, WEIGHED, np.zeros(2), tol=1e-8)
        out.append(HypothesisFit(Effect(), found, reduced.model))
    return out


def test_one_state_is_its_own_fit(alone):
    joint = joint_fit(alone[:1], [WEIGHED], tol=1e-8)
    assert_allclose(joint.x, alone[0].fit.x, atol=1e-6)
    assert_allclose(joint.covariance, alone[0].fit.covariance, rtol=1e-3)


def test_information_adds_and_the_prior_counts_once(alone):
    """Precision of all = Σ (precision of each - prior) + prior."""
    joint = joint_fit(alone, [WEIGHED, WEIGHED], tol=1e-8)
    assert len(joint.x) == 2
    P = np.diag([1 / p.sd**2 for e in alone[0].fit.effects for p in e.parameters])
    due = sum(np.linalg.inv(one.fit.covariance) - P for one in alone) + P
    assert_allclose(np.linalg.inv(joint.covariance), due, rtol=2e-2)
    for one in joint.fits:
        assert_allclose(one.fit.x, joint.x)


def test_an_effect_is_of_its_state(reduced, responses):
    """A mass in one state and another elsewhere in the second; E comes from both."""
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 1.41, 200.0)
    )
    truth = ((20, -0.5), (41, 0.3))
    states = []
    for k, strength in truth:
        effects = [*base(reduced), PointMass.near(where, k)]
        x = np.array([0.04, 0.0, strength, 0.0, 0.0])
        data = measured(reduced, responses, effects, x, slice(0, 40))
        found = fit(reduced.model, effects, data, None, x + 0.05)
        states.append(HypothesisFit(effects[-1], found, reduced.model))
    joint = joint_fit(states, [None, None], tol=1e-6)
    assert len(joint.x) == 2 + 3 + 3
    assert len(joint.shared) == 2
    for one, (_, strength) in zip(joint.fits, truth, strict=True):
        assert_allclose(one.fit.of(one.effect)[0], strength, atol=0.02)
        assert one.fit.x[0] == joint.fits[0].fit.x[0]
    sd = np.sqrt(joint.covariance[0, 0])
    assert sd < min(np.sqrt(s.fit.covariance[0, 0]) for s in states)


def test_a_gain_is_of_the_test_and_not_of_the_object(reduced):
    assert of_the_object(calibration_parameter(reduced.groups, "E", [0]))
    assert not of_the_object(channel_gain(4, 0.5))


def test_what_others_say_is_a_prior_that_is_never_wider(reduced):
    effects = base(reduced)
    key = lambda e: (e.name, e.text, 0)  # noqa: E731
    narrow, wide = 0.004, 5.0
    found = informed(effects, {key(effects[0]): (0.03, narrow), key(effects[1]): (0.01, wide)})
    E, rho = (e.parameters[0] for e in found)
    assert E.mean == 0.03
    assert E.sd == narrow
    assert (rho.mean, rho.sd) == (0.01, effects[1].parameters[0].sd)
    assert E.nominal == 0.0  # the deck's own value stays what it was
    again = with_priors(base(reduced), found)
    assert [e.parameters for e in again] == [e.parameters for e in found]
