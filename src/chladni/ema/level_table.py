"""Study of levels as plain numbers for report pages and JSON (SI, Hz)."""

from dataclasses import dataclass

import numpy as np

from .level_fit import ElementFit
from .level_study import LevelStudy, ModeStudy
from .level_words import mode_sentence

DRAWN = 60  # points of a fitted curve
NORMAL_95 = 1.96  # standard deviations of a 95 % interval


@dataclass(frozen=True)
class LevelRow:
    """A mode at one level: measured, by the best element, and predicted if it was held out."""

    level: float  # of excitation or response, as the case controls it
    amplitude_m: float  # displacement of the output [m]
    # frequency_hz, frequency_sd_hz, damping, damping_sd: measured
    frequency_hz: float
    frequency_sd_hz: float
    damping: float
    damping_sd: float
    # fitted_hz, fitted_damping: by the best element
    fitted_hz: float | None = None
    fitted_damping: float | None = None
    # foretold_hz, foretold_damping: predicted, if the level was held out
    foretold_hz: float | None = None
    foretold_damping: float | None = None
    # stiffness, loss: κ' and κ'' of the element at that amplitude, over the mode's stiffness
    stiffness: float | None = None
    loss: float | None = None
    # frequency_low_hz, frequency_high_hz, damping_low, damping_high: 95 % interval due to noise
    frequency_low_hz: float | None = None
    frequency_high_hz: float | None = None
    damping_low: float | None = None
    damping_high: float | None = None


@dataclass(frozen=True)
class ElementNumber:
    """A number of an element with its 95 % interval."""

    # name, value, unit: of the number
    name: str
    value: float
    unit: str
    # low, high: its interval
    low: float
    high: float


@dataclass(frozen=True)
class TriedElement:
    """An element that was fitted to all levels of a mode."""

    name: str  # of the element
    # chi2, data: what it leaves, and the number of data
    chi2: float
    data: int
    bic: float  # Bayesian information criterion; the lowest is best
    p: float | None  # of its χ²
    numbers: tuple[ElementNumber, ...] = ()  # of the element


@dataclass(frozen=True)
class LevelTable:
    """One mode over levels."""

    output: str  # label of the output at which it was seen
    signature: str  # the kind of change: linear, drift, or a nonlinearity
    # its change with level and the nonlinearity indicated; "" if it does not change
    sentence: str = ""
    # p_frequency, p_damping: chance of such differences of a mode with one frequency, one damping
    p_frequency: float | None = None
    p_damping: float | None = None
    explained: bool = False  # True if the first element explains it
    # rows, elements: levels rising; elements, best first
    rows: tuple[LevelRow, ...] = ()
    elements: tuple[TriedElement, ...] = ()
    foretold_by: str = ""  # the element chosen and fitted without the levels that were held out
    # mean_hz, mean_damping: of the levels it was fitted to: one linear model
    mean_hz: float | None = None
    mean_damping: float | None = None
    # (amplitude [m], frequency [Hz], damping) of the first element
    curve: tuple[tuple[float, float, float], ...] = ()


def level_tables(study: LevelStudy) -> tuple[LevelTable, ...]:
    """Every mode that was followed."""
    return tuple(_table(one, study.drift) for one in study.modes)


def _table(one: ModeStudy, drift: bool) -> LevelTable:
    m, held = one.mode, one.held_out
    calm = one.signature == "linear"
    signature = "drift" if drift and not calm else one.signature
    return LevelTable(
        m.output,
        signature,
        "" if calm or drift else mode_sentence(one),
        m.p_frequency,
        m.p_damping,
        one.explained is not None,
        _rows(one),
        tuple(_tried(fit) for fit in one.fits),
        "" if held is None else held.fit.element.name,
        None if held is None else held.mean[0],
        None if held is None else held.mean[1],
        _curve(one),
    )


def _rows(one: ModeStudy) -> tuple[LevelRow, ...]:
    m, held = one.mode, one.held_out
    measured = (m.level, m.amplitude, m.frequency, m.frequency_sd, m.damping, m.damping_sd)
    columns = [c.tolist() for c in measured]
    n = len(m.level)
    fitted: list[list[float | None]] = [[None] * n for _ in range(6)]
    if one.fits:
        best = one.fits[0]
        kappa = best.element.kappa(m.amplitude / best.largest, best.values)
        fitted[:2] = [x.tolist() for x in best.at(m.amplitude, m.amplitude_sd)]
        fitted[4:] = [kappa.real.tolist(), kappa.imag.tolist()]
    if held is not None:
        for k, f, zeta in zip(held.rows, held.frequency, held.damping, strict=True):
            fitted[2][k], fitted[3][k] = float(f), float(zeta)
    half = NORMAL_95 * m.frequency_sd
    ends = (m.frequency - half, m.frequency + half, *damping_range(m.damping, m.damping_sd))
    ranges = [x.tolist() for x in ends]
    return tuple(LevelRow(*row) for row in zip(*columns, *fitted, *ranges, strict=True))


def damping_range(damping: np.ndarray, sd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval of 95 % of ln ζ, as ζ (n,): above zero, and up to 1, where nothing oscillates."""
    log, half = np.log(damping), NORMAL_95 * sd / damping
    return np.exp(log - half), np.exp(np.minimum(log + half, np.maximum(log, 0.0)))


def _tried(fit: ElementFit) -> TriedElement:
    numbers = []
    for n, value, sd in zip(fit.element.numbers, fit.values, fit.sd, strict=True):
        with np.errstate(over="ignore"):  # no data says how large it may be: no upper end
            factor = np.exp(2 * sd)
        ends = (value - 2 * sd, value + 2 * sd) if n.signed else (value / factor, value * factor)
        scale = fit.largest**n.metres
        low, value, high = (float(scale * x) for x in (ends[0], value, ends[1]))
        numbers.append(ElementNumber(n.name, value, n.unit, low, high))
    p = float(fit.p) if np.isfinite(fit.p) else None
    return TriedElement(fit.element.name, fit.chi2, fit.data, fit.bic, p, tuple(numbers))


def _curve(one: ModeStudy) -> tuple[tuple[float, float, float], ...]:
    if not one.fits:
        return ()
    low, high = one.mode.amplitude.min(), one.mode.amplitude.max()
    A = np.geomspace(0.8 * low, 1.1 * high, DRAWN)
    return tuple(zip(A.tolist(), *(x.tolist() for x in one.fits[0].at(A)), strict=True))
