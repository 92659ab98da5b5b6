"""Hypotheses as a decision reads them; numbers that cost a fit are computed when they are read."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from .decision_rules import RULES, gain_due, odds_of_something_else


@dataclass(frozen=True)
class Left:
    """Q of the calibrated deck and of the deck with an effect, on fitted and held-out data."""

    fitted: tuple[float, float]
    held_out: tuple[float, float]


class Numbers(Protocol):
    """Numbers of one hypothesis that cost a test or a fit; each is computed once."""

    @property
    def p(self) -> float:
        """P of the test of fit; NaN: no test."""

    @property
    def p_damping(self) -> float:
        """P of modal damping that follows an elastic change; NaN: no test."""

    @property
    def news(self) -> float:
        """Gain over calibration on the held-out data, in 2 ln predictive density; 0 without any."""

    @property
    def left(self) -> Left:
        """Q of its deck."""

    @property
    def refined(self) -> "Explanation":
        """The hypothesis, fitted again on a reduced model that is accurate enough for it."""

    def p_after(self, leader: "Explanation") -> float:
        """P of the test that the damping it leaves follows the change by a leader."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """One hypothesis; calibration alone has no names.

    Attributes
    ----------
    names : of its effects, the one with most gain first
    neg2_log_evidence : float
    costly : its further numbers; None where none is read
    physics, channels : whether it changes the model; whether it concerns some channels only
    in_deck : whether cards can hold one of its effects
    expected : whether the materials of the deck usually have it
    becomes, nearly : simpler effect to which it reduces at the fitted values, within its intervals
    sound : whether its fitted values are physically possible
    strained : whether the factor of a joint family exceeds the usual scatter of joints
    fitted : False where the fit failed
    """

    names: tuple[str, ...]
    neg2_log_evidence: float
    costly: Numbers | None = None
    physics: bool = True
    channels: bool = False
    in_deck: bool = True
    expected: bool = False
    becomes: str = ""
    nearly: str = ""
    sound: bool = True
    strained: bool = False
    fitted: bool = True

    @property
    def name(self) -> str:
        """Its names in words."""
        return " and ".join(self.names)

    @property
    def verdict(self) -> str:
        """The public verdict if it is named."""
        return "missing physics" if self.physics else "measurement fault"

    @property
    def numbers(self) -> Numbers:
        """Its numbers that cost a test or a fit."""
        assert self.costly is not None
        return self.costly

    @property
    def fits(self) -> bool:
        """True if it is more probable than a cause outside the catalogue, or has no test.

        Modal damping that follows an elastic change is a second test of the same hypothesis.
        """
        return fits(self.numbers.p) and fits(self.numbers.p_damping)

    @property
    def worse(self) -> bool:
        """True if the deck with an effect has a larger Q than the calibrated deck.

        Physics must not worsen the fitted data either, and physics that no card holds has no deck
        to compare. A fault of a few channels is compared on the held-out data of these channels.
        """
        if self.physics and not self.in_deck:
            return False
        left = self.numbers.left
        compared = (left.fitted, left.held_out) if self.physics else (left.held_out,)
        return any(with_it > calibrated for calibrated, with_it in compared)


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


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Several effects together.

    Attributes
    ----------
    hypothesis : all of them
    gains : in -2 ln evidence, of each with the others in place
    due : gain required of each
    ahead : lead over the best single effect, in -2 ln evidence
    alternatives : families that could replace each member
    news : gain of member k on the held-out data, with the others in place
    """

    hypothesis: Explanation
    gains: tuple[float, ...]
    due: float
    ahead: float
    alternatives: tuple[tuple[AlternativeRow, ...], ...]
    news: Callable[[int], float]

    @property
    def members(self) -> tuple[str, ...]:
        """Their names, most gain first."""
        return self.hypothesis.names

    @property
    def pays(self) -> bool:
        """True if every member, and the set as a whole, exceed the required gain when fitted."""
        return min(*self.gains, self.ahead) > self.due


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All hypotheses of a diagnosis.

    Attributes
    ----------
    null : calibration alone
    singles : the best of every family, best first
    sets : of several effects, in the order in which they grew
    nominal : -2 ln evidence of the given deck, scatter allowed
    poles : whether natural frequencies are compared
    enough : whether there are data enough to separate explanations as a rule
    contradicted : whether there are more numbers than any effect has unknowns
    families : number of known families, used where none was tried
    """

    null: Explanation
    singles: tuple[Explanation, ...] = ()
    sets: tuple[EffectSet, ...] = ()
    nominal: float = 0.0
    poles: bool = False
    enough: bool = True
    contradicted: bool = True
    families: int = 1

    def gain(self, one: Explanation) -> float:
        """Gain over calibration alone, in -2 ln evidence."""
        return self.null.neg2_log_evidence - one.neg2_log_evidence

    def due(self, one: Explanation | None, more: int = 0) -> float:
        """Gain required to name one; ``more`` sets count in addition to the families tried.

        A property that a material usually has is no false alarm (wood is stiffer along its grain).
        It only has to be separated from calibration, as two explanations are.
        """
        chance = RULES.chance_of_poles if self.poles else RULES.chance_of_responses
        due = gain_due(len(self.singles) + more or self.families, chance)
        return min(due, RULES.expected_due) if one is not None and one.expected else due

    @property
    def calibrated(self) -> str:
        """The verdict where nothing is named; joints beyond their usual scatter are calibrated."""
        changed = self.nominal - self.null.neg2_log_evidence > RULES.changed
        return "calibration only" if changed or self.null.strained else "nothing missing"

    def suffices(self, gain: float, due: float, news: Callable[[], float]) -> bool:
        """True if fitted and held-out data together bring the required gain ``due``.

        P(fitted) P(held out | fitted) = P(both): the evidence of all data is the sum of both gains.
        Fitted responses must bring ``good_part`` of it. Natural frequencies are few, and any part
        will do.
        """
        part = 0.0 if self.poles else RULES.good_part
        return gain > part * due and gain + news() > due


def fits(p: float) -> bool:
    """True if a test of fit with this p leaves a cause outside the catalogue less than even odds.

    NaN is no test.
    """
    return odds_of_something_else(p, RULES.something_else) < 1
