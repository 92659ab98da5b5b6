"""The input of a decision: one row of numbers and flags for each hypothesis.

A number that is not yet computed is None. :func:`~chladni.decision.decide.decide` requests it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

from .decision_rules import DecisionRules, gain_due, odds_of_something_else

NULL = "calibration"  # key of the row without any effect


class Ask(Enum):
    """Quantities of one row that a decision may request."""

    TEST = "the test of fit"
    NEWS = "evidence of held-out data for it compared with calibration"
    LEFT = "Q with it as a deck can hold it"
    RENEWAL = "the same fitted again on a model that bears it"
    AFTER = "whether its damping follows what the leader changes"


@dataclass(frozen=True)
class Wanted:
    """A request for one number or fit: the quantity, the row and the row to compare with."""

    ask: Ask
    key: str
    after: str = ""


class Missing(Exception):
    """A number is not in the table; the exception never leaves this package."""

    def __init__(self, wanted: Wanted) -> None:
        super().__init__(wanted)
        self.wanted = wanted


@dataclass(frozen=True)
class Left:
    """Q of plain calibration and of the deck with an effect, on fitted and held-out data."""

    fitted: tuple[float, float]
    held_out: tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One hypothesis.

    Attributes
    ----------
    key : name in the table
    names : of its effects, the one with most gain first
    neg2_log_evidence : float
    physics, channels : whether it changes the model; whether it concerns some channels only
    expected : whether the materials of the deck usually have it
    becomes, nearly : simpler effect to which it reduces at the fitted values, within its intervals
    sound : whether its fitted values are physically possible
    strained : whether the factor of a joint family exceeds the usual scatter of joints
    fitted : False where the fit failed
    p, p_damping : of the test of fit, and of damping that follows an elastic change; NaN: no test
    news : gain over calibration on the held-out data, in 2 ln predictive density; 0 without any
    left : Q with the effect
    """

    key: str
    names: tuple[str, ...]
    neg2_log_evidence: float
    physics: bool = True
    channels: bool = False
    expected: bool = False
    becomes: str = ""
    nearly: str = ""
    sound: bool = True
    strained: bool = False
    fitted: bool = True
    p: float | None = None
    p_damping: float | None = None
    news: float | None = None
    left: Left | None = None

    @property
    def name(self) -> str:
        """Its names in words."""
        return " and ".join(self.names)

    @property
    def verdict(self) -> str:
        """The public verdict if the row is named."""
        return "missing physics" if self.physics else "measurement fault"

    def fits(self, rules: DecisionRules) -> bool:
        """True if it is more probable than a cause outside the catalogue, or has no test.

        Modal damping that follows an elastic change is a second test of the same row.
        """
        if self.p is None:
            raise Missing(Wanted(Ask.TEST, self.key))
        return fits(self.p, rules) and (self.p_damping is None or fits(self.p_damping, rules))

    def foretold(self) -> float:
        """Gain on the held-out data; raise ``Missing`` if it is not known."""
        if self.news is None:
            raise Missing(Wanted(Ask.NEWS, self.key))
        return self.news

    def leaves(self) -> Left:
        """Q with the effect; raise ``Missing`` if it is not known."""
        if self.left is None:
            raise Missing(Wanted(Ask.LEFT, self.key))
        return self.left


@dataclass(frozen=True)
class AlternativeRow:
    """A family that could replace one member of a set.

    Attributes
    ----------
    name : of the family
    behind : gap to the member, in -2 ln evidence
    implausible : why its value is physically impossible; "" if it is possible
    """

    name: str
    behind: float
    implausible: str = ""


@dataclass(frozen=True)
class SetRow:
    """Several effects together.

    Attributes
    ----------
    key : of its row in the table
    members : names, most gain first
    gains : in -2 ln evidence, of each with the others in place
    due : gain required of each
    ahead : lead over the best single effect, in -2 ln evidence
    rivals : of each member
    """

    key: str
    members: tuple[str, ...]
    gains: tuple[float, ...]
    due: float
    ahead: float
    alternatives: tuple[tuple[AlternativeRow, ...], ...]

    @property
    def pays(self) -> bool:
        """True if every member, and the set as a whole, exceed the required gain when fitted."""
        return min(*self.gains, self.ahead) > self.due

    def member(self, k: int) -> str:
        """Key of the row with the held-out evidence for member k, with the others in place."""
        return f"{self.key}/{k}"


@dataclass(frozen=True)
class HypothesisTable:
    """All hypotheses of a diagnosis.

    Attributes
    ----------
    rows : by key; ``NULL`` is calibration alone, ``refined(key)`` a row that was fitted again
    singles : keys of the best of every family, best first
    sets : of several effects, in the order in which they grew
    nominal : -2 ln evidence of the given deck, scatter allowed
    poles : whether natural frequencies are compared
    enough : whether there are data enough to separate explanations as a rule
    contradicted : whether there are more numbers than any effect has unknowns
    families : number of known families, used where none was tried
    """

    rows: Mapping[str, Row]
    singles: tuple[str, ...] = ()
    sets: tuple[SetRow, ...] = ()
    nominal: float = 0.0
    poles: bool = False
    enough: bool = True
    contradicted: bool = True
    families: int = 1

    @property
    def null(self) -> Row:
        """Calibration alone."""
        return self.rows[NULL]

    def gain(self, row: Row) -> float:
        """Gain over calibration alone, in -2 ln evidence."""
        return self.null.neg2_log_evidence - row.neg2_log_evidence

    def refinement(self, key: str) -> Row:
        """The row fitted again on a refined basis; raise ``Missing`` if it was not."""
        if refined(key) not in self.rows:
            raise Missing(Wanted(Ask.RENEWAL, key))
        return self.rows[refined(key)]

    def after(self, row: Row, leader: Row) -> float:
        """P of the test that the damping left by a row follows the change by the leader."""
        known = self.rows.get(after(row.key, leader.key))
        if known is None or known.p_damping is None:
            raise Missing(Wanted(Ask.AFTER, row.key, leader.key))
        return known.p_damping

    def having(self, *rows: Row) -> "HypothesisTable":
        """The table with some rows added or replaced."""
        return replace(self, rows={**self.rows, **{r.key: r for r in rows}})


def fits(p: float, rules: DecisionRules) -> bool:
    """True if a test of fit with this p leaves a cause outside the catalogue less than even odds.

    NaN is no test.
    """
    return odds_of_something_else(p, rules.something_else) < 1


def refined(key: str) -> str:
    """Key of a row that was fitted again."""
    return f"{key}, refined"


def after(key: str, leader: str) -> str:
    """Key of the comparison of a row with a leader."""
    return f"{key} after {leader}"


def needed(table: HypothesisTable, row: Row | None, tried: int, rules: DecisionRules) -> float:
    """Gain in -2 ln evidence required to name a row, if so many families were tried.

    A property that a material usually has is no false alarm (wood is stiffer along its grain). It
    only has to be separated from calibration, as two explanations are: ``rules.expected_due``.
    """
    chance = rules.chance_of_poles if table.poles else rules.chance_of_responses
    due = gain_due(tried or table.families, chance)
    return min(due, rules.expected_due) if row is not None and row.expected else due
