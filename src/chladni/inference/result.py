"""The parts of a diagnosis as types: one a key of ``diagnosis.json`` (SI)."""

from dataclasses import dataclass, field

from ..effects.estimate import Estimate, Location


@dataclass(frozen=True)
class NamedEffect:
    """Physics that was found missing, or the fault of a channel.

    Attributes
    ----------
    name, claim : of the effect in the catalogue
    log_evidence : ln evidence of all named effects together
    where : its place
    parameters : its numbers, as they were found
    gain : increase of -2 ln evidence without this one, all others fitted again
    written : its numbers in the updated deck, which is a fit without nuisances
    """

    name: str
    claim: str = ""
    log_evidence: float | None = None
    where: Location = field(default_factory=Location)
    parameters: tuple[Estimate, ...] = ()
    gain: float | None = None
    written: tuple[float, ...] = ()


@dataclass(frozen=True)
class Alternative:
    """An explanation that was tried and is not the answer.

    Attributes
    ----------
    name : of the effect, or "calibration only"
    log_evidence : its ln evidence
    why_not : why it is less probable, or was refused
    where : its place; no key where it has none
    """

    name: str
    log_evidence: float | None = None
    why_not: str = ""
    where: Location | None = None


@dataclass(frozen=True)
class Scores:
    """Q, mean |log10(H_model/H_test)|² over channels and lines, of one set of samples.

    The first three belong to decks as they are written.  Each deck is a fit of its own.

    Attributes
    ----------
    nominal : the deck as it was given
    calibrated : the deck with calibration parameters fitted, no effect in it
    with_effect : the updated deck
    floor : what the noise of the recording alone leaves
    with_nuisances : the last explanation with all errors that no deck contains: mesh, joints,
        folds, scatter
    """

    nominal: float | None = None
    calibrated: float | None = None
    with_effect: float | None = None
    floor: float | None = None
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
    """Q of the decks on a recording that was not fitted, over all lines and channels.

    Attributes
    ----------
    name : of the recording
    relation : to the recording that was fitted: repeat, article, level
    apart : Q of the fitted recording itself on this one: no deck is asked to do better
    nominal, calibrated, with_effect : of the decks as they are written
    """

    name: str
    relation: str
    apart: float | None = None
    nominal: float | None = None
    calibrated: float | None = None
    with_effect: float | None = None


@dataclass(frozen=True)
class Agreement:
    """How well the decks agree with the recording.

    Attributes
    ----------
    fitted, held_out : Scores
    what : the held-out data in words
    two_log_bayes_factor : 2 ln Bayes factor of the named effect over calibration; None: none is
        named
    largest_two_log_bayes_factor : the largest one of any effect that was tried
    threshold : 2 ln Bayes factor from which an effect is named
    """

    fitted: Scores = Scores()
    held_out: Scores = Scores()
    what: str = ""
    two_log_bayes_factor: float | None = None
    largest_two_log_bayes_factor: float | None = None
    threshold: float | None = None


@dataclass(frozen=True)
class NextMeasurement:
    """A further measurement, made after those listed before it.

    It would tell tied explanations apart, or narrow the interval of a quantity of the only one.

    Attributes
    ----------
    kind : sensor, drive, mass, band or weighing
    what : in words
    label : dof; "" where it has no place
    point_m : its place [m]
    amount : [kg] of a mass, [Hz] of the top of a band
    bits : information that all of them are expected to bring together
    settles : probability that the true explanation is then tied with no other
    misleads : probability that a wrong one has
    about : the quantity; "" where explanations are tied
    narrows : width of its interval after them, of that before
    """

    kind: str
    what: str
    label: str = ""
    point_m: tuple[float, float, float] | None = None
    amount: float = 0.0
    bits: float = 0.0
    settles: float = 0.0
    misleads: float = 0.0
    about: str = ""
    narrows: float = 1.0


@dataclass(frozen=True)
class CalibratedParameter:
    """A fitted calibration parameter, and its values in the decks.

    Attributes
    ----------
    where : the parts or the material; one of several parameters has its name before them
    estimate : beside all that is known to err
    deck_value : of the deck that was given
    written_value : of the deck that is written, which has no scatter, joints and folds of its own
        to stand for and may need another value
    """

    where: str
    estimate: Estimate
    deck_value: float | None = None
    written_value: float | None = None


@dataclass(frozen=True)
class MassComparison:
    """Weighed mass and mass of the updated deck.

    Attributes
    ----------
    weighed_kg : the mass in ``[test]`` of the case; None: it was not weighed
    model_kg : mass of the updated deck
    """

    weighed_kg: float | None = None
    model_kg: float | None = None


@dataclass(frozen=True)
class FrequencyRow:
    """A frequency of the test and its partner in every deck [Hz]; None: it has none.

    Attributes
    ----------
    test_hz : natural frequency of the test
    before_hz, calibrated_hz, after_hz : of the given, the calibrated and the updated deck
    mac_before, mac_calibrated, mac_after : MAC of each with the shape of the test
    damping : the damping ratio that was identified
    """

    test_hz: float
    before_hz: float | None = None
    mac_before: float | None = None
    calibrated_hz: float | None = None
    mac_calibrated: float | None = None
    after_hz: float | None = None
    mac_after: float | None = None
    damping: float | None = None


@dataclass(frozen=True)
class FrequencyError:
    """Root mean square of ln(model/test) over the first paired frequencies [%].

    Attributes
    ----------
    before, calibrated, after : of the given, the calibrated and the updated deck
    """

    before: float | None = None
    calibrated: float | None = None
    after: float | None = None


@dataclass(frozen=True)
class Remainder:
    """The residual of calibration: structured, or noise.

    Attributes
    ----------
    structured : True if it is more than what is known to err
    left, known : Q that calibration leaves, and Q that is known to err
    sentence : the same in words
    """

    structured: bool
    left: float
    known: float
    sentence: str


@dataclass(frozen=True)
class FitStatistic:
    """A statistic of what an explanation leaves, and its range over draws of the model itself.

    Attributes
    ----------
    name : the statistic in words
    value : of the recording
    median, low, high : of the draws; ``low`` to ``high`` holds 99 % of them
    """

    name: str
    value: float
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class LeftPlace:
    """Where what an explanation leaves sits: in words, by mode, by part and on the mesh.

    Attributes
    ----------
    text : in words
    modes_hz : frequencies of the modes that show it [Hz]
    parts : names of parts
    grid : id of the nearest grid
    point_m : its place in the basic frame [m]
    """

    text: str
    modes_hz: tuple[float, ...] = ()
    parts: tuple[str, ...] = ()
    grid: int | None = None
    point_m: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False)
class Adequacy:
    """The absolute test of the best explanation.

    Attributes
    ----------
    passes : True if the recording could come from this explanation
    p : rank of the recording among draws of the explanation's own predictions
    what : the result in words
    where : places that do not fit
    statistics : what was compared
    something_else : largest posterior odds of a cause outside the catalogue, by p
    step : what to do about complex modes that it does not explain; "" where there is nothing
    """

    passes: bool
    p: float
    what: str
    where: tuple[LeftPlace, ...] = ()
    statistics: tuple[FitStatistic, ...] = ()
    something_else: float | None = None
    step: str = ""
