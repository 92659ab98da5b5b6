"""The map of what is left: highest where something was changed, grey where no sensor feels it."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect, FieldChange, Parameter
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.inference.map_fit import MassMeasurement
from chladni.inference.residual_localisation import residual_localisation
from chladni.reduced.reduced_model import evaluate

SCALES = MassMeasurement(1.413, 1.4e-3)
HALF_WAVE = 0.5 * np.sqrt(1.8 * 1.5e-3 * 5200 / 200)  # [m] of steel at 200 Hz: no map is sharper
PLACE = np.array([0.3, 0.1, 0.0])  # [m], on a plate of 0.4 by 0.3


@dataclass(frozen=True, eq=False)
class Local(Effect):
    """A patch has a field of its own."""

    name = "local"
    quantity = "E"
    centre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def terms(self, x):
        slope = (np.linalg.norm(self.centre - PLACE, axis=1) < 0.06).astype(float)[:, None]
        return (FieldChange(self.quantity, slope[:, 0] * x[0], slope),)


class Heavy(Local):
    quantity = "rho"


def answered(reduced, responses, recorded):
    """The map of E and rho alone, of a recording made with other effects."""
    s = 2 * np.pi * np.linspace(25, 200, 24) * (0.08 + 1j)
    data = replace(responses, s=s, use=np.ones((24, 4), bool), values=np.ones((24, 4, 2), complex))
    values = data.model(evaluate(reduced.model, *recorded, False))
    effects = [
        calibration_parameter(reduced.groups, "E", [0]),
        calibration_parameter(reduced.groups, "rho", [0]),
    ]
    base = evaluate(reduced.model, effects, np.zeros(2))
    data = replace(data, values=values).allowing_errors(base, 1e-3)
    fit = fitted(reduced.model, effects, data, SCALES, np.zeros(2))
    return residual_localisation(HypothesisFit(Effect(), fit, reduced.model), SCALES)


@pytest.mark.parametrize(("kind", "amount"), [(Local, -0.4), (Local, 0.3), (Heavy, 0.3)])
def test_it_is_highest_where_the_article_differs(reduced, responses, kind, amount):
    a = Parameter("a", "-", 0.0, 1.0, kind="linear")
    effect = kind((a,), centre=reduced.groups.centre)
    found = answered(reduced, responses, ([effect], np.array([amount])))
    assert found.best > 10
    assert np.linalg.norm(np.array(found.point_m) - PLACE) < HALF_WAVE
    assert found.parts == ("plate",)


def test_where_nothing_is_left_nothing_gains(reduced, responses):
    effect = calibration_parameter(reduced.groups, "E", [0])
    found = answered(reduced, responses, ([effect], np.array([0.02])))
    assert found.best < 3


def test_few_noisy_lines_are_blind(reduced, responses):
    """With noise a hundred times the signal no place is known: there is no map."""
    data = replace(responses, noise=np.full(responses.values.shape, 30.0))
    effects = [
        calibration_parameter(reduced.groups, "E", [0]),
        calibration_parameter(reduced.groups, "rho", [0]),
    ]
    base = evaluate(reduced.model, effects, np.zeros(2))
    data = replace(data, values=data.model(base)).allowing_errors(base)
    fit = fitted(reduced.model, effects, data, SCALES, np.zeros(2))
    assert residual_localisation(HypothesisFit(Effect(), fit, reduced.model), None) is None


def test_frequencies_alone_have_no_map(reduced, responses):
    effects = [calibration_parameter(reduced.groups, "E", [0])]
    fit = fitted(reduced.model, effects, responses, SCALES, np.zeros(1))
    assert residual_localisation(HypothesisFit(Effect(), fit, reduced.model), SCALES) is None
