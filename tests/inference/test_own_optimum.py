"""Where the base is linear, the optimum of an effect alone is that of the joint fit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.recorded_plate import with_attachments
from tests.inference.test_map_fit import EXACT, MEAN, Offsets, linear, model

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import PointMass
from chladni.effects.stiffener import GridLines, Stiffener
from chladni.inference.linear_model import LinearModel
from chladni.inference.map_fit import MassMeasurement, fit
from chladni.inference.own_optimum import Base, own_optimum
from chladni.reduced.local_effect import LocalEffect
from chladni.reduced.reduced_model import evaluate

__all__ = ["model"]

A = np.random.default_rng(2).normal(size=(6, 3))
WEIGHTS = np.array([0.3, -0.2, 0.5])


@pytest.mark.parametrize("weighed", [None, MassMeasurement(0.4, 0.05)])
def test_it_is_the_joint_fit_of_linear_responses(model, weighed):
    """Parameters, base and evidence, wherever the base is linearised."""
    base, effect = linear(A, WEIGHTS, which=[0, 2]), linear(A, WEIGHTS, 7, which=[1])
    data = Offsets(np.array([1.0, -0.4, 0.2, 0.7, -1.1, 0.3]))
    due = fit(model, [base, effect], data, weighed, np.zeros(3), **EXACT)
    x = MEAN[[0, 2]] + 0.4
    slopes = data.scaled(evaluate(model, [base], x), True)[1]
    about = Base(LinearModel(None, slopes, np.zeros((0, 2))), x)
    found = own_optimum(model, [base], effect, data, weighed, [about], np.zeros(1))
    assert_allclose(found.x, due.x, atol=1e-2)
    assert_allclose(found.covariance, due.covariance, rtol=1e-6)
    assert found.misfit == pytest.approx(due.misfit, rel=1e-2)
    assert found.neg2_log_evidence == pytest.approx(due.neg2_log_evidence, abs=1e-6)


def test_a_strong_effect_is_sought_about_the_base_that_it_did_not_spoil(reduced, responses):
    """A calibration without the mass is far off; about the deck the base is the right one."""
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 1.41, 200.0)
    )
    base = [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]
    effect, x = PointMass.near(where, 20), np.array([0.5, 0.0, 0.0])
    model = with_attachments(reduced, effect.basis_rows(x, reduced.shapes))
    data = responses.rebased(model)
    data = replace(data, values=data.model(evaluate(model, [effect], x, False)))
    ways = []
    for there in (np.array([-0.4, 0.3]), np.zeros(2)):
        J = data.scaled(evaluate(model, base, there), True)[1]
        ways.append(Base(LinearModel(None, J, np.zeros((0, 2))), there))
    start = np.array([-0.5, 0.0, 0.0])
    found = own_optimum(model, base, effect, data, None, ways, start)
    assert_allclose(found.of(effect)[0], x[0], atol=0.02)
    assert_allclose(found.x[:2], 0.0, atol=0.01)
    alone = own_optimum(model, base, effect, data, None, ways[:1], start)
    assert alone.neg2_log_evidence > found.neg2_log_evidence


def test_an_effect_on_few_dofs_may_be_added_to_a_state(reduced, responses):
    """With slopes by differences it has the optimum of evaluations, where its basis is there."""
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 1.41, 200.0)
    )
    base = [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]
    lines = GridLines.of(reduced.structure.assembly)
    effect = Stiffener.along(where, lines.through(30, np.array([1.0, 0.0, 0.0]), 0.08), 5)
    assert effect is not None
    x, start, there = np.array([-1.0, -1.3]), np.array([-0.5, -1.0]), np.array([0.01, 0.0])
    grown = replace(reduced, model=(model := reduced.model_for(effect, start)))
    data, weighed = responses.rebased(model), MassMeasurement(1.4, 0.01)
    data = replace(data, values=data.model(evaluate(model, [effect], x, False)))
    state = evaluate(model, base, there)
    linear = LinearModel(None, data.scaled_slopes(state), np.zeros((0, 2)))
    about = [Base(linear, there, state.without_slopes())]
    local = LocalEffect.of(grown, base, effect, state, there, start)
    assert local is not None
    due = own_optimum(model, base, effect, data, weighed, about, start)
    found = own_optimum(model, base, effect, data, weighed, about, start, local)
    assert_allclose(found.x, due.x, atol=1e-3)
    assert_allclose(found.sd(effect), due.sd(effect), rtol=1e-3)
    assert_allclose(found.x[:2], due.x[:2], atol=1e-4)
    assert found.misfit == pytest.approx(due.misfit, rel=1e-3)
    assert found.neg2_log_evidence == pytest.approx(due.neg2_log_evidence, abs=0.01)
