"""Lines of a long recording that its screening needs: dense at resonances, sparse between them.

Screening asks for the shapes of strong modes, which a few lines in each half-bandwidth know; the
identification of all lines only makes them surer. No grid need be even.
"""

import numpy as np

from ..dynamics.frf import FRF

LONG = 30_000  # values of a recording, 30 channels of a thousand lines: of fewer all are taken
STANDS_OUT = np.log(4.0)  # 6 dB in the mean of the channels: a resonance
WITHIN = 8  # lines kept between the half-power points of a resonance, four in a half-bandwidth
AWAY = 6  # lines kept up to any distance from it, from half of that on
BETWEEN = 400  # lines kept at least, were there no resonance


def screening_lines(frf: FRF) -> np.ndarray:
    """Lines to identify from where a screening is all that follows (n_f,) bool.

    A resonance as narrow as the lines are apart keeps them all. Noise may look like one, never the
    other way about: noisier recordings keep more lines.
    """
    from scipy.signal import find_peaks

    n = len(frf.frequency)
    if frf.values.size <= LONG:
        return np.ones(n, bool)
    square = np.abs(np.nan_to_num(frf.values.reshape(n, -1))) ** 2
    power = (square / np.maximum(square.mean(axis=0), 1e-300)).mean(axis=1)
    level = np.log(np.maximum(power, 1e-300))
    peaks, _ = find_peaks(level, prominence=STANDS_OUT)
    step = np.full(n, max(1, n // BETWEEN))
    i = np.arange(n)
    for peak in peaks:
        least = _half_power_lines(level, int(peak)) / WITHIN
        step = np.minimum(step, np.maximum(least, np.abs(i - peak) / AWAY))
    kept = np.zeros(n, bool)
    at = 0
    while at < n:
        kept[at] = True
        at += max(1, int(step[at]))
    kept[peaks] = True
    return kept


def _half_power_lines(level: np.ndarray, peak: int) -> int:
    """How many lines about a peak lie within 3 dB of it."""
    lower = np.flatnonzero(level < level[peak] - np.log(2.0))
    k = int(np.searchsorted(lower, peak))
    first = lower[k - 1] if k > 0 else -1
    last = lower[k] if k < len(lower) else len(level)
    return int(last - first - 1)
