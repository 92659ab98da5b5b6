"""Choice of spectral lines for a test, and the duration of the test.

Echaniz Granado (2015), section 4.2.5 and table 3.
"""

import numpy as np

from chladni.errors import ShapeError


def half_bandwidth(frequency: np.ndarray, damping: np.ndarray | float) -> np.ndarray:
    """Width 2 ζ f of a resonance between its half-power points [Hz]."""
    return 2 * np.asarray(damping) * np.asarray(frequency)


def even_lines(low: float, high: float, damping: float, per_bandwidth: float = 3.0) -> np.ndarray:
    """Lines f_k+1 = f_k (1 + 2ζ/n) [Hz]: n in every half-bandwidth 2ζf of any resonance.

    The last line is the first at or above ``high``.

    Examples
    --------
    >>> even_lines(10.0, 11.0, 0.1, 4)
    array([10.  , 10.5 , 11.025])
    """
    if not 0 < low < high or damping <= 0 or per_bandwidth <= 0:
        raise ShapeError(f"no lines from {low} to {high} Hz with damping {damping}")
    step = np.log1p(2 * damping / per_bandwidth)
    count = int(np.ceil(np.log(high / low) / step - 1e-9))
    return low * np.exp(step * np.arange(count + 1))


def lines_for_poles(
    low: float,
    high: float,
    frequency: np.ndarray,
    damping: np.ndarray,
    *,
    per_bandwidth: float = 4.0,
    reach: float = 2.0,
    between: float = 0.02,
) -> np.ndarray:
    """Lines [Hz] that are dense near each predicted pole and sparse between poles.

    Within ``reach`` half-bandwidths of a pole there are ``per_bandwidth`` lines per 2ζf.  Elsewhere
    the relative step is ``between``; it grows by at most 1.3 from line to line.
    """
    lines, step = [low], between * low
    width = half_bandwidth(frequency, damping)
    while lines[-1] < high:
        f = lines[-1]
        away = np.maximum(np.abs(f - frequency) / width - reach, 0.0)
        due = np.min(width * (1 / per_bandwidth + away / 2), initial=between * f)
        step = min(due, between * f, 1.3 * step)
        lines.append(f + step)
    return np.array(lines)


def lines_per_bandwidth(
    lines: np.ndarray, frequency: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """Measured lines within the half-bandwidth f_r (1 ± ζ_r) of each mode (r,) int."""
    low, high = frequency * (1 - damping), frequency * (1 + damping)
    return np.searchsorted(lines, high, side="right") - np.searchsorted(lines, low, side="left")


def burst_random_time(resolution: float, averages: int) -> float:
    """Duration averages / Δf of a burst random test [s].

    >>> burst_random_time(0.05, 20)
    400.0
    """
    return averages / resolution


def delay_at(
    lines: np.ndarray, frequency: np.ndarray, damping: np.ndarray, residual: float = 0.01
) -> np.ndarray:
    """Cycles to wait at every line until the slowest transient near it has decayed (n,).

    A transient of mode r at line f decays by e^(-2π ζ_r f_r / f) a cycle.  Modes farther away than
    five half-bandwidths are hardly excited by a step and are left out.
    """
    f = np.asarray(lines)[:, None]
    width = half_bandwidth(frequency, damping)
    cycles = -np.log(residual) * f / (2 * np.pi * damping * frequency)
    near = np.abs(f - frequency) <= 5 * width
    return np.ceil(np.where(near, cycles, 5.0).max(axis=1))


def lines_time(lines: np.ndarray, delay: np.ndarray, measure: float = 20.0) -> float:
    """Duration Σ (delay_k + measure) / f_k of one stepped-sine sweep over any lines [s]."""
    return float(((np.asarray(delay) + measure) / np.asarray(lines)).sum())
