"""What a decision knows: hypotheses as rows of numbers and flags, and what was measured of each.

A number that was not measured is None. :func:`~chladni.decision.decide.decide` asks for it by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from .decision_rules import DecisionRules, gain_due

NULL = "calibration"  # key of the row without any effect


class Ask(Enum):
    """What a decision may ask for of one row."""

    TEST = "the test of fit"
    VOTES = "what data that no fit saw say of it against calibration"
    LEFT = "Q with it as a deck can hold it"
    RENEWAL = "the same fitted again on a model that bears it"
    AFTER = "whether its damping follows what the leader changes"
    DECK = "Q of a calibration as a deck can hold it"


@dataclass(frozen=True)
class Wanted:
    """One more number, or fit: what, of which row, beside which."""

    ask: Ask
    key: str
    beside: str = ""


class Missing(Exception):
    """A number that is not in the table; it never leaves this room."""

    def __init__(self, wanted: Wanted) -> None:
        super().__init__(wanted)
        self.wanted = wanted


@dataclass(frozen=True)
class Votes:
    """Gains in 2 ln predictive density over calibration; None: nothing was asked there."""

    held_out: float | None = None
    sensors: float | None = None
    lines: float | None = None

    @property
    def given(self) -> tuple[float, ...]:
        """Those that there are."""
        return tuple(v for v in (self.held_out, self.sensors, self.lines) if v is not None)

    @property
    def news(self) -> float:
        """Of the data held out."""
        return self.held_out or 0.0

    @property
    def all_for(self) -> bool:
        """Whether every one speaks for the effect."""
        return all(v > 0 for v in self.given)


@dataclass(frozen=True)
class Left:
    """Q of plain calibration and with an effect as a deck has it, fitted and held out."""

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
    physics, channels : whether it changes the model; whether it concerns some channels alone
    expected : whether what the deck is made of has it as a rule
    becomes, nearly : the simpler effect that it is as it was fitted, and within its intervals
    sound : whether its values are such as the thing can have
    strained : whether a family of joints took more than joints scatter
    fitted : False where the fit failed
    p, p_damping : of the test of fit, and of damping that follows an elastic change; NaN: no test
    votes, left : what data that no fit saw say; Q with it
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
    votes: Votes | None = None
    left: Left | None = None

    @property
    def name(self) -> str:
        """Its names in words."""
        return " and ".join(self.names)

    @property
    def verdict(self) -> str:
        """The public verdict where it is named."""
        return "missing physics" if self.physics else "measurement fault"

    def fit(self, rules: DecisionRules) -> float:
        """P of the test of fit, and of damping where it is refused by that and less likely."""
        if self.p is None:
            raise Missing(Wanted(Ask.TEST, self.key))
        follows = self.p_damping
        if follows is None or not follows < min(self.p, rules.fits_damping):
            return self.p
        return follows

    def fits(self, rules: DecisionRules) -> bool:
        """Whether it fits; where there is no test it does."""
        p = self.fit(rules)
        return not p < (rules.fits if p == self.p else rules.fits_damping)

    def heard(self) -> Votes:
        """The votes, which are asked for where they are not known."""
        if self.votes is None:
            raise Missing(Wanted(Ask.VOTES, self.key))
        return self.votes

    def leaves(self) -> Left:
        """Q, which is asked for where it is not known."""
        if self.left is None:
            raise Missing(Wanted(Ask.LEFT, self.key))
        return self.left


@dataclass(frozen=True)
class Rival:
    """Another family that would do in the place of a member of a set.

    Attributes
    ----------
    name : of the family
    behind : how far it stays behind, in -2 ln evidence
    implausible : why its value is none such a thing can have; "" where it may
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
    gains : in -2 ln evidence, of each beside the others
    due : gain that each has to bring
    ahead : of the best effect alone, in -2 ln evidence
    rivals : of each member
    """

    key: str
    members: tuple[str, ...]
    gains: tuple[float, ...]
    due: float
    ahead: float
    rivals: tuple[tuple[Rival, ...], ...]

    @property
    def pays(self) -> bool:
        """Whether what was fitted pays the whole price, of each beside the others and of all."""
        return min(*self.gains, self.ahead) > self.due

    def member(self, k: int) -> str:
        """Key of the row that holds what data that no fit saw say of one beside the others."""
        return f"{self.key}/{k}"


class CalibratedDeck(Enum):
    """The numbers of a calibration that is the answer."""

    FOUND = "as the null found them"
    WRITTEN = "as the null found them, fitted anew without scatter"
    PLAIN = "of plain calibration"
    GIVEN = "the deck's own"


@dataclass(frozen=True)
class HypothesisTable:
    """All hypotheses of a diagnosis.

    Attributes
    ----------
    rows : by key; ``NULL`` is calibration alone, ``renewed(key)`` a row after its fit was renewed
    singles : keys of the best of every family, best first
    sets : of several effects, in the order in which they grew
    nominal : -2 ln evidence of the deck as it was given, scatter allowed
    poles : whether natural frequencies are compared
    enough : whether the data are enough to bear a name
    leaning : whether plain calibration has numbers that no structure of this deck has
    decks : of a calibration, Q with and without what the mesh hides; () where there is no such fit;
        of ``GIVEN`` the deck as it was given
    families : how many are known, where none was tried
    """

    rows: Mapping[str, Row]
    singles: tuple[str, ...] = ()
    sets: tuple[SetRow, ...] = ()
    nominal: float = 0.0
    poles: bool = False
    enough: bool = True
    leaning: bool = False
    decks: Mapping[CalibratedDeck, tuple[float, ...]] = field(default_factory=dict)
    families: int = 1

    @property
    def null(self) -> Row:
        """Calibration alone."""
        return self.rows[NULL]

    def gain(self, row: Row) -> float:
        """In -2 ln evidence over calibration alone."""
        return self.null.neg2_log_evidence - row.neg2_log_evidence

    def renewal(self, key: str) -> Row:
        """A row after its fit was renewed, which is asked for where it was not."""
        if renewed(key) not in self.rows:
            raise Missing(Wanted(Ask.RENEWAL, key))
        return self.rows[renewed(key)]

    def after(self, row: Row, leader: Row) -> float:
        """P that the damping a row leaves follows what the leader changes."""
        known = self.rows.get(after(row.key, leader.key))
        if known is None or known.p_damping is None:
            raise Missing(Wanted(Ask.AFTER, row.key, leader.key))
        return known.p_damping

    def deck(self, which: CalibratedDeck) -> tuple[float, ...]:
        """Q of a calibration as a deck can hold it."""
        if which not in self.decks:
            raise Missing(Wanted(Ask.DECK, which.name))
        return self.decks[which]

    def having(self, *rows: Row) -> "HypothesisTable":
        """The table with some rows put in or replaced."""
        return replace(self, rows={**self.rows, **{r.key: r for r in rows}})


def renewed(key: str) -> str:
    """Key of a row after its fit was renewed."""
    return f"{key}, renewed"


def after(key: str, leader: str) -> str:
    """Key of what is asked of a row beside a leader."""
    return f"{key} after {leader}"


def needed(table: HypothesisTable, row: Row | None, tried: int, rules: DecisionRules) -> float:
    """The gain in -2 ln evidence that is needed to name a row where so many families were tried.

    What a material has as a rule (wood is stiffer along its grain) is no false alarm where it is
    named: it has to be told apart from calibration, as two explanations are.
    """
    chance = rules.chance_of_poles if table.poles else rules.chance_of_responses
    due = gain_due(tried or table.families, chance)
    return min(due, rules.expected_due) if row is not None and row.expected else due
