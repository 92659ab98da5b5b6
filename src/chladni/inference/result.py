"""The parts of a diagnosis as types: one a key of ``diagnosis.json`` (SI)."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..effects.estimate import Estimate, Location


@dataclass(frozen=True)
class NamedEffect:
    """Physics that was found missing, or the fault of a channel."""

    # name, claim: of the effect in the catalogue
    name: str
    claim: str = ""
    log_evidence: float | None = None  # ln evidence of all named effects together
    where: Location = field(default_factory=Location)  # its place
    parameters: tuple[Estimate, ...] = ()  # its numbers, as they were found
    # increase of -2 ln evidence without this one, all others fitted again
    gain: float | None = None
    # its numbers in the updated deck, which is a fit without nuisances
    written: tuple[float, ...] = ()


@dataclass(frozen=True)
class Alternative:
    """An explanation that was tried and is not the answer."""

    name: str  # of the effect, or "calibration only"
    log_evidence: float | None = None  # its ln evidence
    why_not: str = ""  # why it is less probable, or was refused
    where: Location | None = None  # its place; no key where it has none


@dataclass(frozen=True)
class Scores:
    """Q, mean |log10(H_model/H_test)|² over channels and lines, of one set of samples.

    The first three belong to decks as they are written.  Each deck is a fit of its own.
    """

    nominal: float | None = None  # the deck as it was given
    calibrated: float | None = None  # the deck with calibration parameters fitted, no effect in it
    with_effect: float | None = None  # the updated deck
    floor: float | None = None  # what the noise of the recording alone leaves
    # the last explanation with all errors that no deck contains: mesh, joints, folds, scatter
    with_nuisances: float | None = None

    @property
    def after(self) -> float | None:
        """Q of the updated deck; without a search, of the calibrated deck."""
        return self.calibrated if self.with_effect is None else self.with_effect

    def last_step(self, named: bool) -> dict[str, float | None]:
        """Q by deck: the last one, and the one before it that it must beat."""
        if named:
            return {"calibrated": self.calibrated, "updated": self.after}
        return {"given": self.nominal, "calibrated": self.after}


@dataclass(frozen=True)
class RecordingScore:
    """Q of the decks on a recording that was not fitted, over all lines and channels."""

    name: str  # of the recording
    relation: str  # to the recording that was fitted: repeat, article, level
    # Q of the fitted recording itself on this one: no deck is asked to do better
    apart: float | None = None
    # nominal, calibrated, with_effect: of the decks as they are written
    nominal: float | None = None
    calibrated: float | None = None
    with_effect: float | None = None


@dataclass(frozen=True)
class Agreement:
    """How well the decks agree with the recording."""

    fitted: Scores = Scores()
    held_out: Scores = Scores()
    what: str = ""  # the held-out data in words
    # 2 ln Bayes factor of the named effect over calibration; None: none is named
    two_log_bayes_factor: float | None = None
    # the largest one of any effect that was tried
    largest_two_log_bayes_factor: float | None = None
    threshold: float | None = None  # 2 ln Bayes factor from which an effect is named


@dataclass(frozen=True)
class NextMeasurement:
    """A further measurement, made after those listed before it.

    It would tell tied explanations apart, or narrow the interval of a quantity of the only one.
    """

    kind: str  # sensor, drive, mass, band or weighing
    what: str  # in words
    label: str = ""  # dof; "" where it has no place
    point_m: tuple[float, float, float] | None = None  # its place [m]
    amount: float = 0.0  # [kg] of a mass, [Hz] of the top of a band
    bits: float = 0.0  # information that all of them are expected to bring together
    settles: float = 0.0  # probability that the true explanation is then tied with no other
    misleads: float = 0.0  # probability that a wrong one has
    about: str = ""  # the quantity; "" where explanations are tied
    narrows: float = 1.0  # width of its interval after them, of that before


@dataclass(frozen=True)
class CalibratedParameter:
    """A fitted calibration parameter, and its values in the decks."""

    where: str  # the parts or the material; one of several parameters has its name before them
    estimate: Estimate  # fitted together with all errors of known size
    deck_value: float | None = None  # of the deck that was given
    # of the deck that is written, which has no scatter, joints and folds of its own to stand for
    # and may need another value
    written_value: float | None = None


@dataclass(frozen=True)
class MassComparison:
    """Weighed mass and mass of the updated deck."""

    weighed_kg: float | None = None  # the mass in ``[test]`` of the case; None: it was not weighed
    model_kg: float | None = None  # mass of the updated deck


@dataclass(frozen=True)
class FrequencyRow:
    """A frequency of the test and its partner in every deck [Hz]; None: it has none."""

    test_hz: float  # natural frequency of the test
    # before_hz, calibrated_hz, after_hz: of the given, the calibrated and the updated deck
    before_hz: float | None = None
    # mac_before, mac_calibrated, mac_after: MAC of each with the shape of the test
    mac_before: float | None = None
    calibrated_hz: float | None = None
    mac_calibrated: float | None = None
    after_hz: float | None = None
    mac_after: float | None = None
    damping: float | None = None  # the damping ratio that was identified


@dataclass(frozen=True)
class FrequencyError:
    """Root mean square of ln(model/test) over the first paired frequencies [%]."""

    # before, calibrated, after: of the given, the calibrated and the updated deck
    before: float | None = None
    calibrated: float | None = None
    after: float | None = None


@dataclass(frozen=True)
class Remainder:
    """The residual of calibration: structured, or noise."""

    structured: bool  # True if it is more than known errors leave
    # left, known: Q that calibration leaves, and Q of known errors
    left: float
    known: float
    sentence: str  # the same in words


@dataclass(frozen=True)
class FitStatistic:
    """A statistic of what an explanation leaves, and its range over draws of the model itself."""

    name: str  # the statistic in words
    value: float  # of the recording
    # median, low, high: of the draws; ``low`` to ``high`` holds 99 % of them
    median: float
    low: float
    high: float

    @classmethod
    def of(cls, name: str, value: float, draws: np.ndarray) -> Self:
        """The statistic among its draws (n,)."""
        return cls(name, float(value), *map(float, np.quantile(draws, (0.5, 0.005, 0.995))))


@dataclass(frozen=True)
class LeftPlace:
    """Where what an explanation leaves sits: in words, by mode, by part and on the mesh."""

    text: str  # in words
    modes_hz: tuple[float, ...] = ()  # frequencies of the modes that show it [Hz]
    parts: tuple[str, ...] = ()  # names of parts
    grid: int | None = None  # id of the nearest grid
    point_m: tuple[float, ...] | None = None  # its place in the basic frame [m]


@dataclass(frozen=True, eq=False)
class Adequacy:
    """The absolute test of the best explanation."""

    passes: bool  # True if the recording could come from this explanation
    p: float  # rank of the recording among draws of the explanation's own predictions
    what: str  # the result in words
    where: tuple[LeftPlace, ...] = ()  # places that do not fit
    statistics: tuple[FitStatistic, ...] = ()  # what was compared
    # largest posterior odds of a cause outside the catalogue, by p
    something_else: float | None = None
    # what to do about complex modes that it does not explain; "" where there is nothing
    step: str = ""
