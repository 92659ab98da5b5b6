"""Every rule between the last fit and the verdict; the numbers are those of ``docs/method.md``."""

import math
from dataclasses import dataclass, field
from typing import Any


def _rule(value: float, why: str) -> Any:
    """A number and the purpose of its rule."""
    return field(default=value, metadata={"why": why})


@dataclass(frozen=True)
class DecisionRules:
    """All numbers of the decision; gains are in -2 ln evidence, ``due`` is the required gain."""

    chance_of_responses: float = _rule(
        1e-5,
        "chance of a false alarm from responses: null cases gained up to 24, a chance of 1e-3 "
        "requires 18",
    )
    chance_of_poles: float = _rule(1e-3, "chance of a false alarm from natural frequencies")
    expected_due: float = _rule(
        10.0, "gain required of a property that the material usually has (grain of wood)"
    )
    changed: float = _rule(6.0, "gain of E, rho and t from which the deck counts as calibrated")
    something_else: float = _rule(
        1 / 8,
        "prior odds of a cause outside the catalogue: with p = 0.01 of the test of fit it is even",
    )
    good_part: float = _rule(
        0.5, "part of the required gain that fitted responses bring if other data agree"
    )
    tied: float = _rule(10.0, "gap up to which two explanations are one answer")


RULES = DecisionRules()


def odds_of_something_else(p: float, prior: float) -> float:
    """Largest posterior odds of a cause outside the catalogue, from p of a test of fit.

    For p < 1/e the Bayes factor against the tested hypothesis is 1 / (-e p ln p) at most. NaN (no
    test) leaves the prior. Source: Sellke, Bayarri and Berger 2001, The American Statistician 55,
    62-71.

    >>> round(odds_of_something_else(0.01, 1 / 8), 2), odds_of_something_else(0.5, 1 / 8)
    (1.0, 0.125)
    """
    if not p < 1 / math.e:
        return prior
    p = max(p, 1e-300)
    return prior / (-math.e * p * math.log(p))


def gain_due(tried: int, chance: float) -> float:
    """Gain in -2 ln evidence required to name one of so many families: 2 ln(tried / chance).

    Under the null hypothesis a Bayes factor has mean one. It exceeds B with probability 1/B at most
    (Markov). The families that were tried share the chance of a false alarm.
    """
    return 2 * math.log(tried / chance)


def required_gain(poles: bool, tried: int, expected: bool = False) -> float:
    """Gain in -2 ln evidence required to name one of so many families, from poles or responses.

    A property that a material usually has is no false alarm (wood is stiffer along its grain). It
    only has to be separated from calibration, as two explanations are.
    """
    due = gain_due(tried, RULES.chance_of_poles if poles else RULES.chance_of_responses)
    return min(due, RULES.expected_due) if expected else due


def fits(p: float) -> bool:
    """True if a test of fit with this p leaves a cause outside the catalogue less than even odds.

    NaN is no test.
    """
    return odds_of_something_else(p, RULES.something_else) < 1
