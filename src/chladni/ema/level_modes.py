"""Modes of one object at several levels: natural frequency and damping against amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.special import chdtrc

from ..dynamics.frf import FRF
from .coincident_poles import alike_shapes, twins_joined
from .identification import DERIVATIVES, Identified, evaluate
from .pole_search import STEADY
from .response_variance import frf_variance, left_scatter
from .setup import Control

PARTNER = 0.05  # of a frequency: farther away is another mode
STANDS_OUT = 3.0  # fall of χ² due to a pole over its required gain, for a mode to be followed
KNOWN = 0.5  # standard deviation over its damping: a mode of which less is known is not followed
NEAR_BANDWIDTHS = 5.0  # half-bandwidths of the level's own pole: lines beyond are another mode's
ABOUT = 0.75  # of a peak: lines above are averaged; there D is known best
CHANCE = 1e-5  # of a linear mode: moves less probable than that, and larger than these, are moves
MOVED_FREQUENCY = 1e-3  # largest over smallest - 1; a few kelvin of temperature do half of that
MOVED_DAMPING = 0.15  # likewise; damping of a clamped object repeats to about 5 %


@dataclass(frozen=True, eq=False)
class AtLevel:
    """A recording, its modes, and what was held at which level while it was taken."""

    level: float | None  # [N], or [m/s²] where a base or a response was held
    frf: FRF
    modes: Identified
    # whether that is the amplitude of the force, or of the response of the drive point
    control: Control = "force"
    averages: int = 1  # of the estimate, where the noise comes from the coherence

    @cached_property
    def variance(self) -> np.ndarray:
        """Variance of every FRF sample (n_f, n_out, n_in), computed once for all modes."""
        return frf_variance(self.frf, self.averages)

    @property
    def stated(self) -> bool:
        """True if the recording states its noise, as a variance or a coherence."""
        return self.frf.variance is not None or self.frf.coherence is not None

    @cached_property
    def left(self) -> tuple[np.ndarray, np.ndarray]:
        """a², b² (n_out, n_in) of the noise a²|H|² + b², from the residual of the modes."""
        low, high = self.modes.band
        f, H = self.frf.frequency, self.frf.values
        near = (low <= f) & (f <= high)
        model = evaluate(self.modes, 2j * np.pi * f[near])
        flat = (int(near.sum()), -1)
        rest, fit = (H[near] - model).reshape(flat), model.reshape(flat)
        a2, b2 = left_scatter(rest, fit, np.isfinite(rest))
        return a2.reshape(H.shape[1:]), b2.reshape(H.shape[1:])


@dataclass(frozen=True, eq=False)
class ModeLevels:
    """One mode at every level where it was found, by increasing level."""

    output: str  # the output whose displacement is the amplitude
    level: np.ndarray  # (k,) [N] or [m/s²]
    amplitude: np.ndarray  # (k,) at which the mode was seen [m]
    # frequency, frequency_sd: (k,) [Hz]
    frequency: np.ndarray
    frequency_sd: np.ndarray
    # damping, damping_sd: (k,) of critical
    damping: np.ndarray
    damping_sd: np.ndarray
    # frequency_own, damping_own: (k,) of these the part that is a level's own: the rest moves all
    # levels together, for one level is the reference of all
    frequency_own: np.ndarray
    damping_own: np.ndarray
    amplitude_sd: np.ndarray  # (k,) of the lines that were averaged [m]; 0 where all have one

    def sel(self, rows: np.ndarray) -> Self:
        """Some of the levels."""
        names = [name for name in vars(self) if name != "output"]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    @property
    def p_frequency(self) -> float:
        """Probability of such a scatter of frequencies if they were equal."""
        return _p(self.frequency, self.frequency_own)

    @property
    def p_damping(self) -> float:
        """Probability of such a scatter of damping ratios if they were equal."""
        return _p(self.damping, self.damping_own)

    @property
    def frequency_moves(self) -> bool:
        """True if the natural frequency changes with the level."""
        return self.p_frequency < CHANCE and _range(self.frequency) > MOVED_FREQUENCY

    @property
    def damping_moves(self) -> bool:
        """True if the damping changes with the level."""
        return self.p_damping < CHANCE and _range(self.damping) > MOVED_DAMPING

    @property
    def moves(self) -> bool:
        """True if frequency or damping changes with the level."""
        return self.frequency_moves or self.damping_moves


def chi2_about_mean(value: np.ndarray, sd: np.ndarray) -> float:
    """Σ (x - x̄)² / σ² about the weighted mean, of n - 1 degrees of freedom."""
    w = 1 / np.maximum(sd, 1e-9 * np.abs(value)) ** 2
    mean = (w * value).sum() / w.sum()
    return float((w * (value - mean) ** 2).sum())


def _p(value: np.ndarray, sd: np.ndarray) -> float:
    """Chance of such differences of one value; nan of a single one."""
    free = len(value) - 1
    return float(chdtrc(free, chi2_about_mean(value, sd))) if free else float("nan")


def _range(value: np.ndarray) -> float:
    return float(value.max() / value.min() - 1)


def modes_over_levels(recordings: Sequence[AtLevel]) -> tuple[ModeLevels, ...]:
    """Follow the modes of the lowest level; return the modes found at two levels or more."""
    known = sorted((r for r in recordings if r.level), key=lambda r: r.level or 0.0)
    if len({r.level for r in known}) < 2:
        return ()
    first = known[0]
    lowest = twins_joined(first.modes)
    noise = [_noise(first, one) for one in known]
    tracks = [_track(lowest, int(k), known, noise) for k in np.flatnonzero(_clear(lowest))]
    return tuple(t for t in tracks if t is not None and len(set(t.level)) > 1)


def _clear(found: Identified) -> np.ndarray:
    """Modes that stand out, with a damping that is known (r,)."""
    sure = found.damping_sd < KNOWN * found.damping
    return found.inside & (found.relative_delta_chi2 > STANDS_OUT) & sure


def _track(
    first: Identified, mode: int, known: Sequence[AtLevel], noise: Sequence[np.ndarray]
) -> ModeLevels | None:
    """A mode of the lowest level at every level where it has a partner."""
    R = np.abs(first.residues[mode])
    i, j = np.unravel_index(int(R.argmax()), R.shape)
    output = first.outputs[i]
    rows = []
    for one, variance in zip(known, noise, strict=True):
        alike = (one.frf.outputs, one.frf.inputs) == (first.outputs, first.inputs)
        if not alike or (k := _partner(first, mode, one.modes)) is None:
            continue
        if one.control == "response":
            row = _pole(one, k, int(i), int(j))
        else:
            row = _lines(first, mode, one, variance, one.modes.poles[k], int(i), int(j))
        if row[4] < KNOWN * row[3]:
            rows.append((one.level, *row))
    return ModeLevels(output, *np.array(rows, dtype=float).T) if len(rows) > 1 else None


def _partner(first: Identified, mode: int, other: Identified) -> int | None:
    """Return the partner at another level: each is the nearest mode of the other with its shape."""
    alike = alike_shapes(first, other) & _clear(first)[:, None] & _clear(other)[None, :]
    far = np.abs(np.log(other.frequency[None, :] / first.frequency[:, None]))
    far = np.where(alike & (far < PARTNER), far, np.inf)
    k = int(far[mode].argmin()) if far.shape[1] else 0
    found = far.size and np.isfinite(far[mode, k]) and int(far[:, k].argmin()) == mode
    return k if found else None


Seen = tuple[float, float, float, float, float, float, float, float]  # as `ModeLevels` has them


def _pole(one: AtLevel, k: int, i: int, j: int) -> Seen:
    """Amplitude, frequency and damping under a held response; all lines share amplitude and pole.

    The held response is that of the drive point, otherwise that of the first output.
    """
    m, drive = one.modes, one.modes.inputs[j]
    held = m.outputs.index(drive) if drive in m.outputs else 0
    share = np.abs(m.residues[k, i, j] / m.residues[k, held, j])
    A = (one.level or 0.0) * share / np.abs(m.poles[k]) ** DERIVATIVES[m.quantity]
    f, sd_f = float(m.frequency[k]), float(m.frequency_sd[k])
    zeta, sd_z = float(m.damping[k]), float(m.damping_sd[k])
    return float(A), f, sd_f, zeta, sd_z, sd_f, sd_z, 0.0


def _lines(
    first: Identified, mode: int, one: AtLevel, noise: np.ndarray, pole: complex, i: int, j: int
) -> Seen:
    """Estimate a mode at a level from the lines about its peak; the amplitude is that of output i.

    Under a constant force every line has its own amplitude. The peak leans, and one pole would
    represent this as damping. Therefore each line is evaluated by itself. Residue R and all other
    modes are those of the lowest level. With y = Rᴴ (H - rest) of input j, D = 2i ω_d RᴴR / y.
    It equals ω_r² (1 + κ') - ω² + i (2 ζ ω_r ω + ω_r² κ'') at the amplitude of that line (inverse
    of the FRF: Worden and Tomlinson 2001, section 2.2). The result averages the lines about the
    peak and their amplitudes.
    The spread of every level includes the uncertainty of the lowest one.
    """
    omega, y, variance = _modal_lines(first, mode, one, noise, pole, j)
    size = np.abs(y)
    top = np.argsort(-size)[: max(3, int((size > ABOUT * size.max()).sum()))]
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
    own = spread / np.sqrt((1 / sd**2).sum(axis=1))
    turned = np.array([[D.real, -D.imag], [D.imag, D.real]]) / (2 * omega_r)  # D δ ln D, as ω_r
    slopes = np.array([turned[0] / (2 * np.pi), turned[1] / omega - each[1] * turned[0] / omega_r])
    by = (slopes * w).sum(axis=2) / w.sum()
    shared = np.sqrt(np.einsum("ia,ab,ib->i", by, _spread_of_reference(first, mode, j), by))
    sd_f, sd_z = np.hypot(own, shared)
    mean = float((A * w).sum() / w.sum())
    apart = float(np.sqrt(((A - mean) ** 2 * w).sum() / w.sum()))
    return mean, float(f), float(sd_f), float(z), float(sd_z), float(own[0]), float(own[1]), apart


def _spread_of_reference(first: Identified, mode: int, j: int) -> np.ndarray:
    """Covariance (2, 2) of real and imaginary part of δ ln D = Rᴴ δR / RᴴR + δω_d / ω_d.

    It is the error of D = 2i ω_d RᴴR / y, y = Rᴴ (H - rest), at any level. The cause is the error
    of pole and residues R of the lowest level. It is zero for modes without a covariance. The
    error of ``rest`` is small compared with the peak.
    """
    if first.covariance is None:
        return np.zeros((2, 2))
    n_in = len(first.inputs)
    R, known = first.by_channel[mode][j::n_in], first.covariance
    turn = np.array([[R.real, R.imag], [-R.imag, R.real]]) / float((np.abs(R) ** 2).sum())
    root = np.einsum("abc,cbm->am", turn, known.shared[mode][j::n_in])
    root[0] += known.pole[mode][1] / first.poles[mode].imag
    local = np.einsum("abc,cbd,edc->ae", turn, known.local[mode][j::n_in], turn)
    return np.asarray(root @ root.T + local)


def _noise(lowest: AtLevel, one: AtLevel) -> np.ndarray:
    """Variance of every sample of a level (n_f, n_out, n_in).

    It is at least the residual of the lowest level, where the object is nearest to linear. If the
    recordings state no noise, it equals that residual.
    """
    if one.stated and lowest.stated:
        return max(1.0, lowest.modes.chi) ** 2 * one.variance
    a2, b2 = lowest.left
    alike = a2.shape == one.variance.shape[1:]
    left = a2 * np.abs(one.frf.values) ** 2 + b2 if alike else one.variance
    return np.maximum(left, STEADY**2 * one.variance)


def _modal_lines(
    first: Identified, mode: int, one: AtLevel, noise: np.ndarray, pole: complex, j: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """ω, y and the variance of y at the lines near a pole, all but the mode taken off (n,) each."""
    away = np.abs(2 * np.pi * one.frf.frequency - np.abs(pole))
    near = away <= max(-NEAR_BANDWIDTHS * pole.real, np.sort(away)[2])
    frf, s = one.frf, 2j * np.pi * one.frf.frequency[near]
    rest = first.sel(np.arange(first.order) != mode)
    q = np.abs(s[:, None] ** DERIVATIVES[first.quantity]) ** 2
    H = (frf.values[near] - evaluate(rest, s))[:, :, j] / s[:, None] ** DERIVATIVES[first.quantity]
    R = first.residues[mode, :, j]
    return s.imag, H @ R.conj(), (noise[near][:, :, j] / q) @ np.abs(R) ** 2


def _scatter(amplitude: np.ndarray, each: np.ndarray, sd: np.ndarray) -> float:
    """How much more lines scatter about a straight line over amplitude than their noise; >= 1."""
    n, flat = len(amplitude), np.ptp(amplitude) < 1e-6 * amplitude.max()
    X = np.ones((n, 1)) if flat else np.stack([np.ones(n), amplitude / amplitude.max()], axis=1)
    left, free = 0.0, 2 * (n - X.shape[1])
    for y, s in zip(each, sd, strict=True):
        fit = np.linalg.lstsq(X / s[:, None], y / s, rcond=None)[0]
        left += float((((y - X @ fit) / s) ** 2).sum())
    return max(1.0, float(np.sqrt(left / max(free, 1))))
