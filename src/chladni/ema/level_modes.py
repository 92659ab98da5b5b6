"""Modes of one object at several levels: natural frequency and damping against amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.stats import chi2

from ..dynamics.frf import FRF
from .correlation import mac
from .identification import DERIVATIVES, Identified, evaluate
from .response_variance import frf_variance
from .setup import Control

PARTNER = 0.05  # of a frequency: farther away is another mode
SAME_SHAPE = 0.8  # MAC of the residues over three channels or more: less is another mode
STANDS_OUT = 3.0  # of χ² a pole must bring, over what it pays, to be followed
KNOWN = 0.5  # standard deviation over its damping: a mode of which less is known is not followed
NEAR = 5.0  # half-bandwidths of the level's own pole: lines beyond are another mode's
ABOUT = 0.75  # of a peak: lines above are averaged; there D is known best
CHANCE = 1e-5  # of a linear mode: moves less probable than that, and larger than these, are moves
MOVED_FREQUENCY = 1e-3  # largest over smallest - 1; a few kelvin of temperature do half of that
MOVED_DAMPING = 0.15  # likewise; damping of a clamped object repeats to about 5 %


@dataclass(frozen=True, eq=False)
class AtLevel:
    """A recording, its modes, and what was held at which level while it was taken.

    Attributes
    ----------
    level : [N], or [m/s²] where a base or a response was held
    control : whether that is the amplitude of the force, or of the response of the drive point
    averages : of the estimate, where the noise comes from the coherence
    """

    level: float | None
    frf: FRF
    modes: Identified
    control: Control = "force"
    averages: int = 1

    @cached_property
    def variance(self) -> np.ndarray:
        """Of every sample of the FRF (n_f, n_out, n_in), once for all modes that are followed."""
        return frf_variance(self.frf, self.averages)


@dataclass(frozen=True, eq=False)
class ModeLevels:
    """One mode at every level where it was found, by increasing level.

    Attributes
    ----------
    output : the output whose displacement is the amplitude
    level : (k,)                       [N] or [m/s²]
    amplitude : (k,)                   at which the mode was seen [m]
    frequency, frequency_sd : (k,)     [Hz]
    damping, damping_sd : (k,)         of critical
    """

    output: str
    level: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_sd: np.ndarray
    damping: np.ndarray
    damping_sd: np.ndarray

    def sel(self, rows: np.ndarray) -> Self:
        """Some of the levels."""
        names = [name for name in vars(self) if name != "output"]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    @property
    def p_frequency(self) -> float:
        """Chance of frequencies so far apart, were they the same."""
        return _p(self.frequency, self.frequency_sd)

    @property
    def p_damping(self) -> float:
        """Chance of dampings so far apart, were they the same."""
        return _p(self.damping, self.damping_sd)

    @property
    def frequency_moves(self) -> bool:
        """Whether the natural frequency goes with the level."""
        return self.p_frequency < CHANCE and _range(self.frequency) > MOVED_FREQUENCY

    @property
    def damping_moves(self) -> bool:
        """Whether the damping goes with the level."""
        return self.p_damping < CHANCE and _range(self.damping) > MOVED_DAMPING

    @property
    def moves(self) -> bool:
        """Whether either does."""
        return self.frequency_moves or self.damping_moves


def chi2_about_mean(value: np.ndarray, sd: np.ndarray) -> float:
    """Σ (x - x̄)² / σ² about the weighted mean, of n - 1 degrees of freedom."""
    w = 1 / np.maximum(sd, 1e-9 * np.abs(value)) ** 2
    mean = (w * value).sum() / w.sum()
    return float((w * (value - mean) ** 2).sum())


def _p(value: np.ndarray, sd: np.ndarray) -> float:
    return float(chi2.sf(chi2_about_mean(value, sd), len(value) - 1))


def _range(value: np.ndarray) -> float:
    return float(value.max() / value.min() - 1)


def modes_over_levels(recordings: Sequence[AtLevel]) -> tuple[ModeLevels, ...]:
    """The modes that are found at two levels or more; those of the lowest level are followed."""
    known = sorted((r for r in recordings if r.level), key=lambda r: r.level or 0.0)
    if len({r.level for r in known}) < 2:
        return ()
    first = known[0]
    tracks = [_track(first, int(k), known) for k in np.flatnonzero(_clear(first.modes))]
    return tuple(t for t in tracks if t is not None and len(set(t.level)) > 1)


def _clear(found: Identified) -> np.ndarray:
    """Modes that stand out, with a damping that is known (r,)."""
    sure = found.damping_sd < KNOWN * found.damping
    return found.inside & (found.relative_delta_chi2 > STANDS_OUT) & sure


def _track(first: AtLevel, mode: int, known: Sequence[AtLevel]) -> ModeLevels | None:
    """A mode of the lowest level at every level where it has a partner."""
    R = np.abs(first.modes.residues[mode])
    i, j = np.unravel_index(int(R.argmax()), R.shape)
    output = first.modes.outputs[i]
    rows = []
    for one in known:
        alike = (one.frf.outputs, one.frf.inputs) == (first.frf.outputs, first.frf.inputs)
        if not alike or (k := _partner(first.modes, mode, one.modes)) is None:
            continue
        if one.control == "response":
            row = _pole(one, k, int(i), int(j))
        else:
            row = _lines(first.modes, mode, one, one.modes.poles[k], int(i), int(j))
        if row[4] < KNOWN * row[3]:
            rows.append((one.level, *row))
    return ModeLevels(output, *np.array(rows, dtype=float).T) if len(rows) > 1 else None


def _partner(first: Identified, mode: int, other: Identified) -> int | None:
    """The mode of another level that is this one: the nearest of its shape, and it of that."""
    if first is other:
        return mode
    alike = _alike(first, other) & _clear(first)[:, None] & _clear(other)[None, :]
    far = np.abs(np.log(other.frequency[None, :] / first.frequency[:, None]))
    far = np.where(alike & (far < PARTNER), far, np.inf)
    k = int(far[mode].argmin()) if far.shape[1] else 0
    found = far.size and np.isfinite(far[mode, k]) and int(far[:, k].argmin()) == mode
    return k if found else None


def _alike(a: Identified, b: Identified) -> np.ndarray:
    """Whether modes of two levels are of one shape, as far as their channels tell (r_a, r_b)."""
    if (a.outputs, a.inputs) != (b.outputs, b.inputs) or len(a.outputs) * len(a.inputs) < 3:
        return np.ones((a.order, b.order), bool)
    return mac(a.by_channel.T, b.by_channel.T) > SAME_SHAPE


Seen = tuple[float, float, float, float, float]


def _pole(one: AtLevel, k: int, i: int, j: int) -> Seen:
    """Of a mode under a held response, as of its lines below: all have one amplitude and one pole.

    What was held is the response of the drive point, else of the first output.
    """
    m, drive = one.modes, one.modes.inputs[j]
    held = m.outputs.index(drive) if drive in m.outputs else 0
    share = np.abs(m.residues[k, i, j] / m.residues[k, held, j])
    A = (one.level or 0.0) * share / np.abs(m.poles[k]) ** DERIVATIVES[m.quantity]
    rows = (A, m.frequency[k], m.frequency_sd[k], m.damping[k], m.damping_sd[k])
    return float(rows[0]), float(rows[1]), float(rows[2]), float(rows[3]), float(rows[4])


def _lines(first: Identified, mode: int, one: AtLevel, pole: complex, i: int, j: int) -> Seen:
    """Amplitude of output i [m], frequency [Hz], its sd, damping and its sd of a mode at a level.

    Under a constant force every line has an amplitude of its own, a peak leans, and one pole would
    call that damping. So lines are asked, not the pole: with the residue R and all else as the
    lowest level has them, y = Rᴴ (H - rest) of input j gives D = 2i ω_d RᴴR / y, which is
    ω_r² (1 + κ') - ω² + i (2 ζ ω_r ω + ω_r² κ'') at that line's amplitude (inverse of the FRF:
    Worden and Tomlinson 2001, section 2.2). Lines about the peak are averaged, amplitudes too.
    """
    omega, y, variance = _modal_lines(first, mode, one, pole, j)
    top = _about_peak(np.abs(y))
    omega, y, variance = omega[top], y[top], variance[top]
    R = first.residues[mode, :, j]
    power = float((np.abs(R) ** 2).sum())
    D = 2j * first.poles[mode].imag * power / y
    omega_r = np.sqrt(np.maximum(D.real + omega**2, 1.0))
    each = np.array([omega_r / (2 * np.pi), D.imag / (2 * omega * omega_r)])
    sd_D = np.abs(D) * np.sqrt(variance / 2) / np.abs(y)  # of its real and its imaginary part
    sd = sd_D / (2 * omega_r) * np.array([np.full(len(y), 1 / (2 * np.pi)), 1 / omega])
    A = (one.level or 0.0) * np.abs(y) * np.abs(R[i]) / power
    w = 1 / sd[1] ** 2
    (f, z), spread = (each * w).sum(axis=1) / w.sum(), _scatter(A, each, sd)
    sd_f, sd_z = spread / np.sqrt((1 / sd**2).sum(axis=1))
    return float((A * w).sum() / w.sum()), float(f), float(sd_f), float(z), float(sd_z)


def _modal_lines(
    first: Identified, mode: int, one: AtLevel, pole: complex, j: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """ω, y and the variance of y at the lines near a pole, all but the mode taken off (n,) each.

    Noise is no less than what the lowest level leaves, where the object is nearest to linear.
    """
    away = np.abs(2 * np.pi * one.frf.frequency - np.abs(pole))
    near = away <= max(-NEAR * pole.real, np.sort(away)[2])
    frf, s = one.frf, 2j * np.pi * one.frf.frequency[near]
    rest = first.sel(np.arange(first.order) != mode)
    q = np.abs(s[:, None] ** DERIVATIVES[first.quantity]) ** 2
    H = (frf.values[near] - evaluate(rest, s))[:, :, j] / s[:, None] ** DERIVATIVES[first.quantity]
    R = first.residues[mode, :, j]
    variance = max(1.0, first.chi) ** 2 * one.variance[near][:, :, j] / q
    return s.imag, H @ R.conj(), variance @ np.abs(R) ** 2


def _about_peak(size: np.ndarray) -> np.ndarray:
    """Positions of the lines within ABOUT of the largest, three at least."""
    order = np.argsort(-size)
    return np.asarray(order[: max(3, int((size > ABOUT * size.max()).sum()))])


def _scatter(amplitude: np.ndarray, each: np.ndarray, sd: np.ndarray) -> float:
    """How much more lines scatter about a straight line over amplitude than their noise; >= 1."""
    n, flat = len(amplitude), np.ptp(amplitude) < 1e-6 * amplitude.max()
    X = np.ones((n, 1)) if flat else np.stack([np.ones(n), amplitude / amplitude.max()], axis=1)
    left, free = 0.0, 2 * (n - X.shape[1])
    for y, s in zip(each, sd, strict=True):
        fit = np.linalg.lstsq(X / s[:, None], y / s, rcond=None)[0]
        left += float((((y - X @ fit) / s) ** 2).sum())
    return max(1.0, float(np.sqrt(left / max(free, 1))))
