"""The evidence of a family is the sum over its places; a place knows of its likely neighbours."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from chladni.effects.effect import Effect, Parameter
from chladni.effects.estimate import Location
from chladni.inference.hypothesis_fit import NEARLY, HypothesisFit
from chladni.search.result_parts import _located, _reported

MASS = (Parameter("M", "kg", 0.0, 1.0, kind="linear"),)


@dataclass(frozen=True, eq=False)
class Lump(Effect):
    """A mass at a place along x [m], known to 10 mm."""

    name = "lump"
    at: float = 0.0

    def location(self, x, sd=None):
        return Location(self.text, point_m=(self.at, 0.0, 0.0), radius_m=0.01)


@dataclass
class Fitted:
    """What a family needs of a fit."""

    neg2_log_evidence: float
    x: np.ndarray
    data: Any = None

    def of(self, effect):
        return self.x

    def sd(self, effect):
        return np.array([0.01])


def lump(at: float, S: float, mass: float = 0.1) -> HypothesisFit:
    fit: Any = Fitted(S, np.array([mass]))
    return HypothesisFit(Lump(MASS, f"near {1e3 * at:.0f} mm", at=at), fit, None)  # type: ignore[arg-type]


def test_equal_places_add_their_evidence():
    """Each of k equal places has 1/k of the prior: their sum is -2 ln k below that of one."""
    family = lump(0.0, 50.0)
    for k in range(1, 4):
        family = family.among(lump(0.1 * k, 50.0))
        assert family.neg2_log_evidence == pytest.approx(50.0 - 2 * np.log(k + 1))


def test_one_optimum_counts_once():
    """Two fits that end within the uncertainty of the place are one optimum."""
    family = lump(0.0, 50.0).among(lump(0.005, 50.5)).among(lump(0.0, 51.0))
    assert family.neg2_log_evidence == pytest.approx(50.0)
    assert not family.optima


def test_the_sum_does_not_depend_on_the_order():
    a, b, c = lump(0.0, 50.0), lump(0.1, 52.0), lump(0.2, 51.0)
    one, other = a.among(b).among(c), a.among(c.among(b))
    assert one.neg2_log_evidence == pytest.approx(other.neg2_log_evidence)


def test_intervals_include_likely_neighbours_and_no_others():
    alone, likely = lump(0.0, 50.0, 0.1), lump(0.1, 51.0, 0.3)
    unlikely = lump(-0.4, 50.0 + NEARLY + 1, 0.9)
    family = alone.among(likely).among(unlikely)
    place, (mass,) = _located(family, family.effect), _reported(family, family.effect)
    assert place.radius_m == pytest.approx(0.1 + 0.01)
    (before,), (there,) = (_reported(h, h.effect) for h in (alone, likely))
    assert (mass.value, mass.low, mass.high) == (before.value, before.low, there.high)


def test_another_fit_keeps_the_odds_of_the_places():
    """Errors that spread from another state change all places of a family alike."""
    family = lump(0.0, 50.0).among(lump(0.1, 53.0))
    again: Any = replace(family.fit, neg2_log_evidence=20.0)
    assert family.refitted(again).neg2_log_evidence == pytest.approx(
        family.neg2_log_evidence - 30.0
    )
