"""Intervals widen what data say, and never what was known before."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.effect import WIDER, Effect, Parameter

PRIOR = 0.06
EFFECT = Effect((Parameter("E", "Pa", 0.0, PRIOR, scale=2e11), Parameter("K", "N/m", 0.0, 3.0)))


def known(sd_of_data):
    """Deviations of both parameters after data of these deviations."""
    prior = np.array([p.sd for p in EFFECT.parameters])
    return 1 / np.sqrt(1 / prior**2 + 1 / np.asarray(sd_of_data) ** 2)


@pytest.mark.parametrize("sd", [1e-4, 0.01, 0.06, 1.0, 100.0])
def test_data_that_are_less_certain_than_was_believed_leave_the_prior(sd):
    """What a fit would have found, had it known how certain its data are."""
    believed = np.full(2, sd)
    assert_allclose(EFFECT.widened(known(believed)), known(WIDER * believed), rtol=1e-9)


def test_nothing_is_less_certain_than_before():
    assert_allclose(EFFECT.widened(np.array([PRIOR, 3.0])), [PRIOR, 3.0])
    assert_allclose(EFFECT.widened(np.array([2 * PRIOR, 9.0])), [PRIOR, 3.0])
    assert_allclose(EFFECT.widened(np.zeros(2)), 0.0)


def test_a_calibration_is_known_as_its_fit_says():
    own = type("Own", (Effect,), {"kind": "calibration"})(EFFECT.parameters)
    assert_allclose(own.widened(np.array([0.01, 9.0])), [0.01, 3.0])


def test_intervals_are_of_these():
    x, sd = np.array([0.02, -1.0]), known(np.array([0.02, 0.5]))
    for p, row, at, wide in zip(
        EFFECT.parameters, EFFECT.reported(x, sd), x, EFFECT.widened(sd), strict=True
    ):
        assert_allclose((row.low, row.high), p.value(at) * np.exp(1.96 * wide * np.array([-1, 1])))
