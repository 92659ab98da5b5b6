"""The reasons of a diagnosis: every step of a decision, as an enum and numbers."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Any

from .hypotheses import EffectSet, Explanation

ALONE = "calibration alone"
BEYOND = "an effect outside the catalogue"


class Reason(Enum):
    """Kinds of steps, ends and refusals of a decision; ``decision_in_words`` has the sentences."""

    # ends of a decision
    NAMED = auto()  # one effect
    TOGETHER = auto()  # several effects
    NOTHING_DUE = auto()  # no effect reaches the required gain
    # refusals of a name
    TOO_FEW = auto()  # modes or numbers
    UNFIT = auto()  # the test of fit
    AGAINST = auto()  # held-out data are against it
    TOO_LITTLE = auto()  # gain of all data together
    WORSE = auto()  # fit of its deck than of the calibrated deck
    NOT_FITTED = auto()  # the second fit, on a refined basis, failed
    DAMPING = auto()  # follows the change by the leader
    NOT_SUPPORTED = auto()  # a member of a set is not supported by held-out data
    # intermediate steps
    TESTED = auto()  # against its own predictions
    RENEWED = auto()  # the fit was repeated on a refined basis
    SUPPORTED_BY_ALL = auto()  # all data together support the name
    HELD_OUT = auto()  # held-out data do not refuse the name
    FOUND_TOGETHER = auto()
    HELD_OUT_OF_SET = auto()  # held-out data do not refuse a member of a set
    SET_REFUSED = auto()
    PERHAPS_PRESENT = auto()  # an effect that reaches a part of its required gain
    RIVAL_OF_MEMBER = auto()
    NEXT = auto()  # explanation after a refused leader
    TIED = auto()  # explains the data equally well
    DOUBT = auto()  # calibration or the leader


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a decision.

    Attributes
    ----------
    reason : kind of step
    of : the hypothesis
    why : reason of a refusal
    whole, member : the set of effects, and index of the effect in it
    names : of the explanations it is compared with
    """

    reason: Reason
    of: Explanation | None = None
    why: Reason | None = None
    whole: EffectSet | None = None
    member: int = 0
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Decision:
    """The outcome of a diagnosis, with its reasons.

    Attributes
    ----------
    verdict : one of the public verdicts
    order : the named hypothesis, or the best candidate, is first
    reason : why the decision ended
    due : gain required to name the first
    named : whether the first is named
    one_of : explanations that the data cannot separate
    tested : the hypothesis whose test of fit is the absolute one
    news : gain of the first on the held-out data
    whole : the set that is named
    passed_over : hypotheses that were tested before the first, and the refusal of each
    steps : the steps that led to the decision
    """

    verdict: str
    order: tuple[Explanation, ...] = ()
    reason: Reason = Reason.NOTHING_DUE
    due: float = 0.0
    named: bool = False
    one_of: tuple[str, ...] = ()
    tested: Explanation | None = None
    news: float | None = None
    whole: EffectSet | None = None
    passed_over: tuple[tuple[Explanation, Reason], ...] = ()
    steps: tuple[Step, ...] = ()

    @property
    def refused(self) -> bool:
        """True if a leader reached the required gain but is not named."""
        return not self.named and self.reason is not Reason.NOTHING_DUE

    def then(self, *more: Step, **changes: Any) -> "Decision":
        """A copy with further steps and changed fields."""
        return replace(self, steps=(*self.steps, *more), **changes)
