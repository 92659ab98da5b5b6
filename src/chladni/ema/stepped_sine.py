"""Stepped sine: amplitude, phase and harmonics of every dwell.

Sine fit of known and of unknown frequency: IEEE Std 1057-2017, annex B.
"""

from itertools import pairwise

import numpy as np

from ..dynamics.frf import FRF
from ..errors import FileError
from .time_record import TimeRecord

SPAN = 8  # cycles on either side of a step, by which its frequency is known
LEAST_CYCLES = 12  # cycles of a dwell: less is a passage
SETTLED = 0.5  # share of a dwell that is left to settle
PARTS = 4  # of the rest, for the scatter
HARMONICS = 5
SAME = 1e-4  # dwells this near in frequency are repeats


def demodulated(record: TimeRecord) -> tuple[FRF, np.ndarray, tuple[str, ...]]:
    """FRF with its variance, harmonic distortion of every output (n_f, n_out), notes."""
    if len(record.inputs) > 1:
        raise FileError("a stepped sine drives one input at a time; give each a file of its own")
    rows = []
    for force, response in zip(record.force, record.response, strict=True):
        for first, last in dwells(force[0]):
            settle = first + int(SETTLED * (last - first))
            dwell = [force[:, settle:last], response[:, settle:last]]
            rows.append(_line(np.vstack(dwell), record.rate))
    if len(rows) < 5:
        raise FileError(f"{len(rows)} dwells of constant frequency are found; five are needed")
    rows.sort(key=lambda row: row[0])
    f = np.array([row[0] for row in rows])
    H, variance, thd = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
    starts = np.flatnonzero(np.concatenate([[True], np.diff(f) > SAME * f[1:]]))
    count = np.diff(np.append(starts, len(f)))
    mean = np.add.reduceat(H, starts) / count[:, None]
    within = np.add.reduceat(variance, starts) / count[:, None] ** 2
    away = np.abs(H - np.repeat(mean, count, axis=0)) ** 2
    between = np.add.reduceat(away, starts) / (np.maximum(count - 1, 1) * count)[:, None]
    spread = np.where(count[:, None] > 1, np.maximum(between, within), within)
    frf = FRF(
        mean[:, :, None], np.add.reduceat(f, starts) / count, record.outputs, record.inputs,
        record.quantity, variance=spread[:, :, None],
    )  # fmt: skip
    said = f"stepped sine: {len(rows)} dwells at {len(starts)} frequencies, the last half of each"
    return frf, np.add.reduceat(thd, starts) / count[:, None], (said,)


def dwells(x: np.ndarray) -> list[tuple[int, int]]:
    """Stretches of constant frequency of a sine (n,), as first and last sample.

    The frequency before and after every cycle is the mean over ``SPAN`` cycles. A step is where
    both differ by more than their scatter.
    """
    phase = np.unwrap(np.angle(_analytic(x - x.mean())))
    cycle = np.arange(np.ceil(phase[0] / (2 * np.pi)), np.floor(phase[-1] / (2 * np.pi)))
    if len(cycle) < 3 * SPAN:
        return []
    rising = np.maximum.accumulate(phase)
    at = np.interp(2 * np.pi * cycle, rising, np.arange(len(x)))
    period = (at[SPAN:] - at[:-SPAN]) / SPAN
    before, after = period[:-SPAN], period[SPAN:]  # about cycle SPAN + k
    jump = np.abs(after / before - 1)
    calm = np.median(jump)
    step = jump > max(8 * calm, 1e-4)
    edges = [0]
    k = 0
    while k < len(jump):
        if not step[k]:
            k += 1
            continue
        stop = k
        while stop < len(jump) and step[stop]:
            stop += 1
        edges.append(SPAN + k + int(jump[k:stop].argmax()))
        k = stop
    edges.append(len(at) - 1)
    return [(int(at[a]), int(at[b])) for a, b in pairwise(edges) if b - a >= LEAST_CYCLES]


def _analytic(x: np.ndarray) -> np.ndarray:
    from scipy.signal import hilbert

    return np.asarray(hilbert(x))


def _line(signals: np.ndarray, rate: float) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Frequency [Hz], H (n_out,), its variance and distortion, of all signals (1 + n_out, n)."""
    f = _frequency(signals[0], rate)
    n = signals.shape[1]
    c = _harmonics(signals, f, rate)
    H = c[1:, 0] / c[0, 0]
    distortion = np.sqrt((np.abs(c[1:, 1:]) ** 2).sum(axis=1)) / np.maximum(
        np.abs(c[1:, 0]), 1e-300
    )
    parts = np.array_split(np.arange(n), PARTS)
    each = []
    for part in parts:
        piece = _harmonics(signals[:, part], f, rate)[:, 0]
        each.append(piece[1:] / piece[0])
    scatter = np.abs(np.array(each) - H) ** 2
    return f, H, scatter.sum(axis=0) / (PARTS * (PARTS - 1)), distortion


def _frequency(x: np.ndarray, rate: float) -> float:
    """Frequency of a sine (n,) [Hz], by Gauss-Newton on a, b, c and f from its phase slope."""
    t = np.arange(len(x)) / rate
    phase = np.unwrap(np.angle(_analytic(x - x.mean())))
    inner = slice(len(x) // 10, -max(1, len(x) // 10))
    f = float(np.polyfit(t[inner], phase[inner], 1)[0] / (2 * np.pi))
    for _ in range(4):
        w = 2 * np.pi * f * t
        a, b, _ = np.linalg.lstsq(_columns(w, 1), x, rcond=None)[0]
        slope = 2 * np.pi * t * (b * np.cos(w) - a * np.sin(w))
        f += float(np.linalg.lstsq(np.column_stack([_columns(w, 1), slope]), x, rcond=None)[0][3])
    return f


def _columns(w: np.ndarray, harmonics: int) -> np.ndarray:
    """cos hw, sin hw of every harmonic, then one."""
    waves = [wave(h * w) for h in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    return np.column_stack([*waves, np.ones_like(w)])


def _harmonics(x: np.ndarray, f: float, rate: float) -> np.ndarray:
    """Complex amplitudes of the harmonics below the Nyquist frequency (channels, h)."""
    count = int(np.clip(0.45 * rate / f, 1, HARMONICS))
    A = _columns(2 * np.pi * f * np.arange(x.shape[1]) / rate, count)
    a = np.linalg.lstsq(A, x.T, rcond=None)[0]
    c = np.zeros((len(x), HARMONICS), complex)
    c[:, :count] = (a[0 : 2 * count : 2] - 1j * a[1 : 2 * count : 2]).T
    return c
