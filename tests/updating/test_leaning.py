"""What a fit took into its nuisances is said where joints could not be that far off."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Parameter
from chladni.effects.model_families import ADHESIVE, ModelFamily
from chladni.effects.ordinary import PartScale
from chladni.updating.leaning import FAR, in_doubt, strained


def fitted(text, away):
    family = ModelFamily((Parameter("k", "-", 0.0, ADHESIVE),), text)
    x = np.array([away * ADHESIVE])
    return SimpleNamespace(effects=(family,), of=lambda effect: x)


@pytest.mark.parametrize("sign", [-1, 1])
def test_adhesive_that_took_more_than_it_scatters_is_told(sign):
    assert strained(fitted("adhesive", 0.9 * FAR * sign)) == []
    (said,) = strained(fitted("adhesive", 1.2 * FAR * sign))
    assert f"{np.exp(1.2 * FAR * sign * ADHESIVE):.2g} of the deck's" in said
    assert "3.6 standard deviations" in said


def test_the_shear_of_a_sheet_is_no_joint():
    assert strained(fitted("shear of inner", 2 * FAR)) == []


@pytest.mark.parametrize("sign", [-1, 1])
def test_calibration_that_took_what_no_deck_is_off_by_is_in_doubt(sign):
    """A number far from the deck's may hold what is missing; one that scatters so may not."""
    E = PartScale((Parameter("E", "Pa", 0.0, 0.06),), "E of strip")
    for away in (0.9 * FAR, 1.2 * FAR):
        x = np.array([sign * away * 0.06])
        found = SimpleNamespace(effects=(E,), of=lambda effect, x=x: x)
        said = in_doubt(found, found)
        assert bool(said) == (away > FAR)
    assert "E of strip" in said[0]
    assert "measure it first" in said[0]


def test_joints_that_no_joint_is_like_leave_calibration_in_doubt():
    """Whether a deck holds them or the null alone; said once."""
    idle, null = fitted("welds", 0.0), fitted("adhesive", 1.2 * FAR)
    assert in_doubt(idle, fitted("adhesive", 0.9 * FAR)) == ()
    for deck in (idle, null):
        (said,) = in_doubt(deck, null)
        assert said.count("the stiffness of adhesive as a whole") == 1
