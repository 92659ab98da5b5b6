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
        "chance of a false alarm from responses: null cases gained up to 24, a chance of 1e-3 "
        "requires 18",
    )
    chance_of_poles: float = _rule(1e-3, 1.0, "chance of a false alarm from natural frequencies")
    expected_due: float = _rule(
        TIED, math.inf, "gain required of a property that the material usually has (grain of wood)"
    )
    changed: float = _rule(
        6.0, 0.0, "gain of E, rho and t from which the deck counts as calibrated"
    )
    fits: float = _rule(0.01, 0.0, "p below which an explanation does not fit")
    fits_damping: float = _rule(
        0.01, 0.0, "p below which damping follows an elastic change, which is then incomplete"
    )
    enough_data: bool = _rule(
        True, False, "few modes or numbers name an effect only if no other is tied with it"
    )
    good_part: float = _rule(
        GOOD_PART, 1.0, "part of the required gain that fitted responses bring if other data agree"
    )
    poles_together: bool = _rule(
        True, False, "fitted and predicted natural frequencies reach the required gain together"
    )
    opposed: float = _rule(
        1.0, math.inf, "times the required gain: from there on held-out data refuse a name"
    )
    sets: bool = _rule(True, False, "several effects may be named together")
    sets_in_part: bool = _rule(
        True, False, "sets that reach a part of the required gain on fitted data are tested too"
    )
    plainly: float = _rule(0.05, 0.0, "p required of a set if one effect alone does not fit")
    harm: float = _rule(
        1.5, math.inf, "times the held-out Q of calibration: above it a deck counts as worse"
    )
    faint: float = _rule(
        2.0, 0.0, "times the required gain: below it a deck must improve held-out data"
    )
    most_left: float = _rule(
        0.5, math.inf, "share of the Q of calibration: above it a name leaves more than it explains"
    )
    conflict: float = _rule(
        2.0, math.inf, "times the required gain: fitted data alone refute calibration"
    )
    all_data: float = _rule(
        1.0, math.inf, "times the required gain: all data together refute calibration"
    )
    usual: float = _rule(
        0.9, 1.0, "p above which the residual is no more than the model's form error"
    )
    most_usual_left: float = _rule(
        0.8, 0.5, "share of Q that may remain if the residual is a usual form error"
    )
    alternatives: bool = _rule(
        True, False, "if the leader is refused, the next explanation is tested"
    )
    running: float = _rule(
        2.0,
        math.inf,
        "times the required gain: an alternative further behind the leader is not tested",
    )
    refuted: float = _rule(
        1.0,
        math.inf,
        "times the required gain: a refused leader this far ahead refutes an alternative",
    )
    tied: float = _rule(TIED, 0.0, "gap up to which two explanations are one answer")
    doubt: bool = _rule(
        True, False, "if the leader gains too little, calibration is one of several answers"
    )
    strained: bool = _rule(
        True, False, "joints that changed by more than joints scatter are calibrated, or in doubt"
    )
    prudent: bool = _rule(
        True, False, "calibrated numbers must not fit worse than those of the deck"
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
