"""Result of a calibration beyond its values: what could be known, where the fits ended, how sure.

Every class is a part of ``calibration.json``.  Logarithms are natural: 0.06 is 6 %.
"""

from dataclasses import dataclass
from math import log, sqrt


@dataclass(frozen=True)
class ValueAndSpread:
    """Standard deviation of ln value from the data alone, at one value of a parameter.

    ``sd_data`` is None where the data know nothing; ``known`` tells whether they know more than
    the prior.
    """

    value: float
    sd_data: float | None
    known: bool


@dataclass(frozen=True)
class ParameterKnowledge:
    """Information of the data on one parameter, before any fit."""

    name: str
    # value, unit: of the deck
    value: float
    unit: str
    prior_sd: float  # of ln value
    # from the data alone, if all other parameters were known; None: not at all
    sd_single: float | None
    sd_data: float | None  # from the data alone, all parameters free; None: not at all
    sd_after: float  # from data and priors, the frozen parameters held
    frozen: bool  # whether it is held at its prior mean
    why: str = ""  # reason why it is frozen, or what settles it
    # low, high: values beyond which it stands for something else
    low: float | None = None
    high: float | None = None
    reason: str = ""  # for its prior
    along: tuple[ValueAndSpread, ...] = ()  # what the data know of it at other values


@dataclass(frozen=True)
class Identifiability:
    """Information of the data on all parameters, before any fit."""

    parameters: tuple[ParameterKnowledge, ...] = ()
    # (p, p) of all parameters, with data and priors
    correlation: tuple[tuple[float, ...], ...] = ()
    # index of Brun, Reichert and Künsch (2001) of the data alone; None: infinite
    collinearity: float | None = None
    # of which the data tell less than the priors, as (parameter, change in %)
    directions: tuple[tuple[tuple[str, float], ...], ...] = ()
    weighed: bool = False  # whether a weighed mass was among the data

    @property
    def frozen(self) -> tuple[str, ...]:
        """Names of the parameters that are held at their prior mean."""
        return tuple(p.name for p in self.parameters if p.frozen)


@dataclass(frozen=True)
class NamedValue:
    """A fitted parameter: physical value, and ln(value / deck's value) where it is a factor."""

    name: str
    value: float
    unit: str
    x: float


@dataclass(frozen=True)
class Basin:
    """A place where fits from several starts ended."""

    above: float  # -2 ln evidence above the best basin
    starts: int  # number of starts that ended here
    values: tuple[NamedValue, ...]  # of the free parameters


@dataclass(frozen=True)
class LikelihoodProfile:
    """-2 ln of the profile of likelihood and priors of a parameter, above the best fit.

    Every other parameter is fitted again at each value.  ``quadratic`` is what the covariance
    predicts: where both agree, the interval of the table holds.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    neg2_log_likelihood: tuple[float, ...]
    quadratic: tuple[float, ...]


@dataclass(frozen=True)
class ResponseBand:
    """Magnitude of the response of one channel as the posterior predicts it, and the test."""

    label: str
    held_out: bool  # whether the fit never saw the channel
    frequency: tuple[float, ...]  # (n,) Hz, with the damping of the search on both sides
    # measured, low, high: (n,) |H|; 90 % of the draws lie between the last two
    measured: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class SampledParameter:
    """A parameter over the draws of the posterior, and over the Gaussian of its Hessian."""

    name: str
    unit: str
    # median, low, high: of the draws; 95 % lie between the last two
    median: float
    low: float
    high: float
    # mode, gaussian_low, gaussian_high: the most probable value, 95 % interval of the Gaussian
    mode: float
    gaussian_low: float
    gaussian_high: float
    sd_ratio: float  # standard deviation of x of the draws over that of the Gaussian
    autocorrelation_time: float  # steps between independent draws
    effective: float  # number of independent draws that tell as much


@dataclass(frozen=True)
class PosteriorSample:
    """Draws from the posterior of all unknowns; frozen parameters are free with their priors."""

    parameters: tuple[SampledParameter, ...] = ()  # of the calibration
    # walkers, steps, discarded: independent chains, their length, and the part that is left out
    walkers: int = 0
    steps: int = 0
    discarded: int = 0
    converged: bool = False  # whether chains are fifty autocorrelation times long in every unknown
    autocorrelation_time: float = 0.0  # longest of all unknowns, nuisances included [steps]
    draws: tuple[tuple[float, ...], ...] = ()  # (kept, p) of x of the parameters, thinned
    # gaussian_mean, gaussian_covariance: (p,), (p, p) of x
    gaussian_mean: tuple[float, ...] = ()
    gaussian_covariance: tuple[tuple[float, ...], ...] = ()

    @property
    def sentence(self) -> str:
        """Length and convergence of the chains in words."""
        least = min((p.effective for p in self.parameters), default=0.0)
        made = (
            f"{self.walkers} chains of {self.steps} steps sample the posterior: autocorrelation "
            f"time {self.autocorrelation_time:.3g} steps at most, {least:.0f} effective draws of a "
            "parameter at least"
        )
        if self.converged:
            return made
        return f"{made}; not converged: chains shorter than 50 autocorrelation times mislead"


@dataclass(frozen=True)
class ArticleValue:
    """A parameter of one article."""

    article: str
    # value, low, high: with its 95 % interval
    value: float
    low: float
    high: float
    # away, reach: x less that of the mean of all articles, and half of its own 95 % interval; ln
    # value where it is a factor
    away: float
    reach: float


@dataclass(frozen=True)
class ArticleParameter:
    """A parameter of nominally equal articles: θ_a = μ + δ_a, δ_a ~ N(0, τ²)."""

    name: str
    unit: str
    # mean, low, high: μ with its 95 % interval
    mean: float
    low: float
    high: float
    spread: float  # τ of x, one for all parameters of this quantity; ln value where it is a factor
    # spread_low, spread_high: its 95 % interval; None where the tests do not bound it
    spread_low: float
    spread_high: float | None
    articles: tuple[ArticleValue, ...]  # θ_a


@dataclass(frozen=True)
class WorstMode:
    """A mode of the test, its partner in the calibrated deck [Hz] and their MAC."""

    test_hz: float
    model_hz: float
    mac: float | None = None


@dataclass(frozen=True)
class PartDamping:
    """Loss factor η of a part and its 95 % interval, from the damping of the modes."""

    part: str
    loss_factor: float
    low: float
    high: float


@dataclass(frozen=True)
class RegionShare:
    """A part in the strain energy of the modes that still deviate."""

    part: str
    # worst, good: its mean share in the strain energy of these modes, and of the others
    worst: float
    good: float
    factor: float  # on its stiffness that fits the deviations of all frequencies best alone
    removed: float  # share of Σ ln(f_model / f_test)² that this removes
    state: str = ""  # "free" or "frozen" where its stiffness was a parameter of the calibration
    field: str = "E"  # word of [[parameter]] for its stiffness


@dataclass(frozen=True)
class RegionsToFree:
    """Where the modes that the calibrated deck misses most store their strain energy."""

    # worst, good: modes with the largest deviation or the lowest MAC, and the others
    worst: tuple[WorstMode, ...] = ()
    good: tuple[WorstMode, ...] = ()
    # all parts, the one first that explains most of the deviations
    regions: tuple[RegionShare, ...] = ()

    @property
    def rms(self) -> float:
        """Root mean square of ln(f_model / f_test) over all of these modes."""
        every = [log(m.model_hz / m.test_hz) ** 2 for m in (*self.worst, *self.good)]
        return sqrt(sum(every) / len(every)) if every else 0.0

    @property
    def proposed(self) -> tuple[RegionShare, ...]:
        """At most three that are not free and explain more than a direction at random would."""
        chance = 1 / max(len(self.worst) + len(self.good), 1)
        return tuple(r for r in self.regions if not r.state and r.removed > chance)[:3]

    @property
    def words(self) -> tuple[str, ...]:
        """Lines for the next case.toml that free the proposed parts."""
        return tuple(
            line
            for r in self.proposed
            for line in (
                "[[parameter]]",
                *([] if r.field == "K" else [f'parts = ["{r.part}"]']),
                f'field = "{r.field}"',
            )
        )


@dataclass(frozen=True)
class CalibrationStudy:
    """Information, basins, covariance and profiles of a calibration."""

    identifiability: Identifiability = Identifiability()  # before the fit
    starts: int = 0  # number of starts of a Latin hypercube
    basins: tuple[Basin, ...] = ()  # the ten best places where they ended, best first
    # names, mean, covariance: of the free parameters x after the fit, frozen ones at their priors
    names: tuple[str, ...] = ()
    mean: tuple[float, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()
    profiles: tuple[LikelihoodProfile, ...] = ()  # of the free parameters
    bands: tuple[ResponseBand, ...] = ()  # responses that the posterior predicts
    # reasons why the values stand for something else; empty where none does
    compensating: tuple[str, ...] = ()
    # draws from the posterior; None where none were asked for
    sample: PosteriorSample | None = None
    # parameters of several articles fitted together; empty with one
    articles: tuple[ArticleParameter, ...] = ()
    # parts that a next calibration could free; None with fewer than three paired modes
    guidance: RegionsToFree | None = None
    # loss factors of the parts; empty without identified damping
    damping: tuple[PartDamping, ...] = ()
