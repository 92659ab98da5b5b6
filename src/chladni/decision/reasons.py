"""Why a diagnosis says what it says: every step of a decision, as an enum and numbers."""

from dataclasses import dataclass
from enum import Enum, auto

from .hypothesis_table import CalibratedDeck, Row, SetRow, Votes

ALONE = "calibration alone"
BEYOND = "something that the catalogue does not hold"


class Reason(Enum):
    """One step, or what ends in a name or refuses one; ``decision_in_words`` has the sentences."""

    # what ends a decision
    NAMED = auto()  # one effect
    TOGETHER = auto()  # several effects
    NOTHING_DUE = auto()  # no effect gains what is due
    # what refuses a name
    TOO_FEW = auto()  # modes or numbers
    UNFIT = auto()  # the test of fit
    AGAINST = auto()  # data that no fit saw speak against it
    TOO_LITTLE = auto()  # gained, of all data together
    WORSE = auto()  # on data that no fit saw, as a deck has it
    LEAVES_MORE = auto()  # than it explains
    NOT_FITTED = auto()  # again, on a model that bears it
    REFUTED = auto()  # by a leader that is refused itself
    DAMPING = auto()  # follows what the leader changes
    NOT_BORNE = auto()  # a member of a set, by data that no fit saw
    BARELY_FITS = auto()  # a set, where one effect alone does not fit
    # what was done on the way
    TESTED = auto()  # against what it predicts itself
    RENEWED = auto()  # the fit, on a model that bears it
    BORNE_BY_ALL = auto()  # data together
    HEARD = auto()  # data that no fit saw, which let the name stand
    FOUND_TOGETHER = auto()
    HEARD_BESIDE = auto()  # the same of a member of a set
    SET_REFUSED = auto()
    PERHAPS_BESIDE = auto()  # an effect that pays a part of its price
    RIVAL_OF_MEMBER = auto()
    ALL_DATA = auto()  # refute calibration alone
    WHAT_WAS_FITTED = auto()  # refutes calibration alone
    USUAL_LEFT = auto()  # no more is left than errors of the model's form leave
    NEXT = auto()  # what comes behind a refused leader
    TIED = auto()  # explains the data as well
    DOUBT = auto()  # calibration or the leader
    DECK_STAYS = auto()


@dataclass(frozen=True)
class Step:
    """One step of a decision.

    Attributes
    ----------
    reason : what was found or done
    key : of the row
    why : what refused it
    member : of a set, which effect
    names : of what it is compared with
    """

    reason: Reason
    key: str = ""
    why: Reason | None = None
    member: int = 0
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """What a diagnosis says.

    Attributes
    ----------
    verdict : one of the public verdicts
    order : keys of the rows, the one that is named or would be first
    reason : what ended the decision
    due : gain that is needed to name the first
    named : whether the first is
    one_of : what the data cannot tell apart
    tested : key of the row whose test of fit is the absolute one
    refuting : what refutes calibration alone where no row is tested, and the p of that
    votes : what data that no fit saw say of the first
    whole : the set that is named
    passed_over : names that were asked before the first, and what refused each
    deck : numbers of a calibration
    steps : how it came to that
    """

    verdict: str
    order: tuple[str, ...] = ()
    reason: Reason = Reason.NOTHING_DUE
    due: float = 0.0
    named: bool = False
    one_of: tuple[str, ...] = ()
    tested: str | None = None
    refuting: tuple[Reason, float] | None = None
    votes: Votes | None = None
    whole: SetRow | None = None
    passed_over: tuple[tuple[str, Reason], ...] = ()
    deck: CalibratedDeck = CalibratedDeck.PLAIN
    steps: tuple[Step, ...] = ()

    @property
    def refused(self) -> bool:
        """Whether a leader that gained what is due is not named."""
        return not self.named and self.reason is not Reason.NOTHING_DUE


def steps(decision: Decision, *more: Step) -> tuple[Step, ...]:
    """The steps so far and some more."""
    return (*decision.steps, *more)


def names_of(rows: tuple[Row, ...]) -> tuple[str, ...]:
    """The name of each."""
    return tuple(r.name for r in rows)
