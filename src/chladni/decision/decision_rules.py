"""Every rule between the last fit and the verdict: a number, and its value with the rule off.

``replay`` switches them off one at a time. The numbers are those of ``docs/method.md``.
"""

import math
from dataclasses import Field, dataclass, field, fields, replace
from typing import Any

TIED = 10.0  # in -2 ln evidence (odds of e^5): explanations within this gap are tied
GOOD_PART = (
    0.5  # of the required gain, which fitted responses must bring if held-out data add the rest
)


def _rule(value: Any, off: Any, why: str) -> Any:
    """A number, the value that switches its rule off, and the purpose of the rule."""
    return field(default=value, metadata={"off": off, "why": why})


@dataclass(frozen=True)
class DecisionRules:
    """All numbers of the decision; gains are in -2 ln evidence, ``due`` is the required gain."""

    chance_of_responses: float = _rule(
        1e-5,
        1.0,
        "chance of a false alarm, of responses: nulls gained up to 24, where 1e-3 asks 18",
    )
    chance_of_poles: float = _rule(1e-3, 1.0, "chance of a false alarm, of natural frequencies")
    expected_due: float = _rule(
        TIED, math.inf, "gain that is enough for what a material has as a rule (grain of wood)"
    )
    changed: float = _rule(6.0, 0.0, "gain that E, rho and t must bring to be called calibrated")
    fits: float = _rule(0.01, 0.0, "p below which an explanation does not fit")
    fits_damping: float = _rule(
        0.01, 0.0, "p below which damping follows an elastic change: it is not the whole truth"
    )
    enough_data: bool = _rule(True, False, "too few modes or numbers bear no name")
    good_part: float = _rule(
        GOOD_PART, 1.0, "part of the gain due that fitted responses bring where other data agree"
    )
    poles_together: bool = _rule(
        True, False, "fitted and predicted natural frequencies reach the required gain together"
    )
    opposed: float = _rule(
        1.0, math.inf, "times the gain due: data that no fit saw refuse a name from there on"
    )
    sets: bool = _rule(True, False, "several effects may be named together")
    sets_in_part: bool = _rule(
        True, False, "sets whose fitted data pay a part of the price are asked as well"
    )
    plainly: float = _rule(0.05, 0.0, "p of a set where one effect alone does not fit")
    harm: float = _rule(
        1.5, math.inf, "times held-out Q of calibration: a deck with more is no better"
    )
    faint: float = _rule(
        2.0, 0.0, "times the gain due, below which a deck must be better on held-out data at all"
    )
    most_left: float = _rule(
        0.5, math.inf, "of Q of calibration: beyond it a name leaves more than it explains"
    )
    conflict: float = _rule(
        2.0, math.inf, "times the gain due: what was fitted refutes calibration by itself"
    )
    all_data: float = _rule(
        1.0, math.inf, "times the gain due: all data together refute calibration"
    )
    usual: float = _rule(0.9, 1.0, "p above which what is left is what the model's form errs by")
    most_usual_left: float = _rule(0.8, 0.5, "of Q: so much may be left where that is usual")
    alternatives: bool = _rule(
        True, False, "where the leader is refused, what comes behind it is asked"
    )
    running: float = _rule(
        2.0, math.inf, "times the gain due: a rival further behind the leader is not asked"
    )
    refuted: float = _rule(
        1.0, math.inf, "times the gain due: a refused leader so far ahead refutes a rival"
    )
    tied: float = _rule(TIED, 0.0, "gap up to which two explanations are one answer")
    doubt: bool = _rule(
        True, False, "a leader that gains too little makes calibration one of several"
    )
    strained: bool = _rule(
        True, False, "joints that took more than joints scatter are calibrated, or in doubt"
    )
    prudent: bool = _rule(
        True, False, "numbers of a calibration must not serve worse than those of the deck"
    )

    def without(self, name: str) -> "DecisionRules":
        """A copy with one rule switched off."""
        return replace(self, **{name: rule(name).metadata["off"]})


def rule(name: str) -> Field[Any]:
    """The field of a rule, with its purpose."""
    return next(f for f in fields(DecisionRules) if f.name == name)


def gain_due(tried: int, chance: float) -> float:
    """Gain in -2 ln evidence required to name one of so many families: 2 ln(tried / chance).

    Under the null hypothesis a Bayes factor has mean one. It exceeds B with probability 1/B at most
    (Markov). The families that were tried share the chance of a false alarm.
    """
    return 2 * math.log(tried / chance)
