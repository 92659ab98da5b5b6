"""Free decays: poles from ring-down, and frequency and damping as functions of the amplitude.

Feldman (2011), Hilbert Transform Applications in Mechanical Vibration, chapter 6 (FREEVIB).
"""

from dataclasses import dataclass

import numpy as np

from .time_record import TimeRecord

PEAK = 0.05  # of the largest resonance of the decay; less is left to the FRF
APART = 0.03  # ln f between two resonances of which one is filtered out
FLOOR = 3.0  # times the noise: a decay is followed down to there
LEVELS = 6  # steps of amplitude at which frequency and damping are given


@dataclass(frozen=True, eq=False)
class RingDown:
    """Decay of one mode at one output."""

    output: str
    # frequency, damping: over the whole decay [Hz], fraction of critical
    frequency: float
    damping: float
    amplitude: np.ndarray  # (k,) levels, falling, in the unit of the response
    # frequency_at, damping_at: (k,) about these levels
    frequency_at: np.ndarray
    damping_at: np.ndarray

    @property
    def moves(self) -> float:
        """Largest damping over the smallest, of the levels."""
        return float(self.damping_at.max() / max(self.damping_at.min(), 1e-12))


def ring_downs(record: TimeRecord, count: int = 6) -> tuple[RingDown, ...]:
    """Follow the strongest modes of the free decay of the first block, each at its largest output.

    The decay begins where every input has ended. The result is empty if the inputs never stop.
    """
    start = _free_from(record.force)
    n = record.response.shape[2] - start
    if n < 256:
        return ()
    x = record.response[0, :, start:]  # the first block: hits differ in size and place in time
    x = x - x[:, -n // 10 :].mean(axis=1, keepdims=True)
    X = np.abs(np.fft.rfft(x * np.hanning(2 * n)[n:], 2 * n))
    f = np.fft.rfftfreq(2 * n, 1 / record.rate)
    found: list[RingDown] = []
    taken: list[float] = []
    at = _peaks(X.max(axis=0))
    for k in at[np.argsort(-X.max(axis=0)[at])]:
        low = X.max(axis=0)[k] < PEAK * X.max() or f[k] < 10 * record.rate / n
        if low or any(abs(np.log(f[k] / g)) < APART for g in taken):
            continue
        taken.append(float(f[k]))
        others = [abs(f[j] - f[k]) for j in at if j != k and X.max(axis=0)[j] > PEAK * X.max()]
        wide = min([0.5 * min(others)] if others else [], default=0.2 * f[k])
        output = int(X[:, k].argmax())
        one = _followed(x[output], record.rate, f[k], min(wide, 0.2 * f[k]), record.outputs[output])
        found += [one] if one is not None else []
        if len(found) == count:
            break
    return tuple(sorted(found, key=lambda r: r.frequency))


def _free_from(force: np.ndarray) -> int:
    """First sample after which no input of the first block exceeds a twentieth of its peak.

    The drift of a force sensor after a hit is not an input: values below a twentieth are ignored.
    """
    x = np.abs(force[0] - np.median(force[0], axis=1, keepdims=True)).max(axis=0)
    loud = np.flatnonzero(x > 0.05 * x.max())
    return int(loud[-1]) + 1


def _peaks(X: np.ndarray) -> np.ndarray:
    """Local maxima with a prominence of half of ``PEAK`` times the largest."""
    from scipy.signal import find_peaks

    at, _ = find_peaks(X, prominence=0.5 * PEAK * X.max())
    return np.asarray(at)


def _followed(x: np.ndarray, rate: float, f0: float, half: float, name: str) -> RingDown | None:
    """Amplitude and phase of the band f0 ± half, followed down to the noise."""
    n = len(x)
    f = np.fft.rfftfreq(2 * n, 1 / rate)
    inside = np.exp(-0.5 * ((f - f0) / (0.5 * half)) ** 2)
    spectrum = np.fft.rfft(x, 2 * n) * inside
    whole = np.zeros(2 * n, complex)
    whole[: len(f)] = 2 * spectrum
    z = np.fft.ifft(whole)[:n]
    settle = int(rate / half)  # the filter's own rise, and the other end
    a, phase = np.abs(z), np.unwrap(np.angle(z))
    end = n - settle // 4
    noise = float(np.median(a[max(0, end - max(8, n // 20)) : end])) if n > settle else 0.0
    last = n - settle
    below = np.flatnonzero(a[settle:last] < max(FLOOR * noise, 1e-3 * a.max()))
    last = settle + int(below[0]) if len(below) else last
    if last - settle < 8 * rate / f0:
        return None
    t = np.arange(n) / rate
    pieces = np.array_split(np.arange(settle, last), LEVELS)
    rows = [_slopes(t[p], a[p], phase[p]) for p in pieces if len(p) > 8]
    if len(rows) < 2:
        return None
    omega, sigma, _ = _slopes(t[settle:last], a[settle:last], phase[settle:last])
    each = np.array(rows)
    return RingDown(
        name, omega / (2 * np.pi), sigma / np.hypot(omega, sigma), each[:, 2],
        each[:, 0] / (2 * np.pi), each[:, 1] / np.hypot(each[:, 0], each[:, 1]),
    )  # fmt: skip


def _slopes(t: np.ndarray, a: np.ndarray, phase: np.ndarray) -> tuple[float, float, float]:
    """dφ/dt, -d ln a/dt and the mean level of a stretch of a decay."""
    omega = float(np.polyfit(t - t[0], phase, 1)[0])
    sigma = -float(np.polyfit(t - t[0], np.log(np.maximum(a, 1e-300)), 1)[0])
    return omega, sigma, float(np.exp(np.log(np.maximum(a, 1e-300)).mean()))
