"""Faults of the signals of a time recording: dropouts, spikes, drift, steps, a gain that changes.

Each is a claim about what no linear structure and no sound sensor can do. Times are counted from
the first sample, through all blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..dynamics.frf import FRF
from ..units import number
from .finding import Check, Finding
from .frf_estimate import excitation_of
from .identification import DERIVATIVES
from .time_record import TimeRecord

CHANCE = 1e-6  # expected number of false alarms of one test in one recording
NEAR = 32  # samples on either side of a run that say how often neighbours are equal
EDGE = 4  # differences on either side of a run
ACTIVE = 0.1  # of the rms difference about a run: less and the signal comes to rest by itself
STEPS = 4.0  # quantisation steps: less is no jump
MANY = 50_000_000  # samples of all channels: more take too much memory
LAGS = 16  # samples by which one is predicted
PIECE = 512  # samples over which a signal is as loud as it is
SPIKE = 12.0  # robust standard deviations: a Gaussian signal of 1e9 samples has none
OUTSTANDING = 3.0  # times the rms of its signal
STRUCK = 0.01  # of the largest force
QUIET = 6.0  # the same for the other channels at that instant
ORDER = 3  # of the polynomial of a drift
COARSE = 8192  # means of the signal, of which a drift is seen
LINES = (5, 45)  # of the whole record, with which a drift is compared
SWING = 0.1  # m: no article on its cords goes farther than that
LONG = 30.0  # s: slower than any swing on cords is what lasts that long
LEAST_BLOCKS = 6  # for two levels and their scatter
GAIN = 1.25  # factor within a recording; a sensor's gain differs by percents
SURE = 6.0  # standard deviations
CALM = 0.3  # of that change may the other channels show


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel: (b, n) samples, its words and whether it is an input."""

    name: str
    label: str
    x: np.ndarray
    drives: bool


def signal_checks(record: TimeRecord, frf: FRF | None = None) -> tuple[list[Finding], list[Check]]:
    """All checks of the signals of a recording.

    Parameters
    ----------
    frf : estimated from the recording, for what a response has to be
    """
    signals = np.concatenate([record.force, record.response], axis=1)
    labels = (*record.inputs, *record.outputs)
    drives = len(record.inputs)
    channels = [
        _Channel(name, label, signals[:, c], c < drives)
        for c, (name, label) in enumerate(zip(record.channels, labels, strict=True))
    ]
    found, checks = [], []
    for check in (dropouts, spikes, drifts):
        more, one = check(record, channels)
        found += more
        checks.append(one)
    if frf is not None:
        more, one = changed_gains(record, frf, [f.channels[0] for f in found if f.channels])
        found += more
        checks.append(one)
    return found, checks


def dropouts(record: TimeRecord, channels: Sequence[_Channel]) -> tuple[list[Finding], Check]:
    """Runs of equal samples in the midst of a signal.

    Neighbours are equal with a probability p: that of the samples about the run, or of a Gaussian
    difference within a step of the converter. So N samples hold N p^(m-1) runs of m by chance. A
    signal that dies out gets there by small steps; a channel that is interrupted stops at full
    swing. The inputs of hammer and burst rest between blocks.
    """
    rests = excitation_of(record) in ("hammer", "burst")
    found, longest = [], 0
    for c in channels:
        if c.drives and rests:
            continue
        x = c.x.ravel()
        runs = _frozen(x)
        if not runs:
            continue
        first, last = max(runs, key=lambda r: r[1] - r[0])
        longest = max(longest, last - first)
        whole = sum(z - a for a, z in runs)
        more = f", and {len(runs) - 1} more such runs" if len(runs) > 1 else ""
        text = (
            f"{c.name} does not move for {last - first} samples from {first / record.rate:.4g} s "
            f"on (each is {number(x[first], 4)}){more}; its signal was interrupted."
        )
        mend = "check its cable and the storage, and measure again"
        found.append(Finding("dropout", text, "fault", (c.label,), mend, whole / record.rate))
    said = f"the longest lasts {longest} samples" if found else "no signal stands still"
    return found, Check("dropouts", said, not found)


def _frozen(x: np.ndarray) -> list[tuple[int, int]]:
    """Runs [first, last) of equal samples beyond chance, bounded by a moving signal."""
    d = np.diff(x)
    if not d.any():
        return []
    step, top, low = float(np.abs(d[d != 0]).min()), x.max(), x.min()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], d == 0, [False]])))
    out = []
    for a, z in zip(edges[::2], edges[1::2], strict=True):  # samples a to z are equal
        if z - a < EDGE or x[a] in (top, low):
            continue
        sides = d[max(0, a - NEAR) : a], d[z : z + NEAR]
        if not len(sides[0]) or not all(_swings(s, step) for s in (sides[0][::-1], sides[1])):
            continue
        near = np.concatenate(sides)
        usual = float(np.median(np.abs(near))) / 0.6745
        p = max((np.count_nonzero(near == 0) + 1) / (len(near) + 2), 0.4 * step / max(usual, step))
        if np.log(len(x)) + (z - a) * np.log(p) < np.log(CHANCE):
            out.append((int(a), int(z) + 1))
    return out


def _swings(d: np.ndarray, step: float) -> bool:
    """True where the differences next to a run (n,), the nearest first, show a moving signal.

    There is nothing to show at the end of the record.
    """
    if not len(d):
        return True
    usual = float(np.sqrt((d[1:] ** 2).mean())) if len(d) > 1 else 0.0
    return bool(np.abs(d[:EDGE]).max() > max(ACTIVE * usual, STEPS * step))


def spikes(record: TimeRecord, channels: Sequence[_Channel]) -> tuple[list[Finding], Check]:
    """Lone samples that neither their neighbours nor another channel explain.

    The error of predicting a sample from ``LAGS`` on either side (least squares) is the channel's
    innovation. A blow, an impact within the structure or the end of a burst shows in several
    channels; a spike of a cable or a converter in one.
    """
    if sum(c.x.size for c in channels) > MANY:
        return [], Check("spikes", f"is tried on up to {MANY:.0e} samples", None)
    errors = [_innovations(c.x) for c in channels]
    unlikely = np.array([e / _local_scale(e) for e in errors])
    struck = _struck(record)
    found = []
    for k, c in enumerate(channels):
        others = np.delete(unlikely, k, axis=0).max(axis=0, initial=0.0)
        quiet = (_running_max(others, LAGS) < QUIET) & ~struck
        size = errors[k] / max(float(c.x.std()), 1e-300)
        at = np.flatnonzero((unlikely[k] > SPIKE) & (size > OUTSTANDING) & quiet)
        if c.drives or not len(at) or len(at) > len(size) / 1000:
            continue
        groups = np.split(at, np.flatnonzero(np.diff(at) > LAGS) + 1)
        lone = [int(g[size[g].argmax()]) for g in groups]
        first, most = lone[0] / record.rate, float(size[lone].max())
        text = (
            f"{c.name} has {len(lone)} lone spikes, the first at {first:.4g} s; the largest is "
            f"{number(most, 3)} times the rms of the signal, and no other channel shows it."
        )
        mend = "check cable, connector and range of the front end"
        found.append(Finding("spikes", text, "warning", (c.label,), mend, float(len(lone))))
    return found, Check("spikes", f"{len(found)} channels have lone spikes", not found)


def _innovations(x: np.ndarray) -> np.ndarray:
    """|error| of predicting each sample from those on both sides of it (b n,)."""
    s = x.ravel() - x.mean()
    n = len(s)
    if n < 20 * LAGS or not s.any():
        return np.zeros(n)
    r = np.array([s[: n - k] @ s[k:] for k in range(2 * LAGS + 1)])
    offsets = np.concatenate([np.arange(-LAGS, 0), np.arange(1, LAGS + 1)])
    R = r[np.abs(offsets[:, None] - offsets)]
    a = np.linalg.lstsq(R + 1e-10 * r[0] * np.eye(len(R)), r[np.abs(offsets)], rcond=None)[0]
    kernel = np.zeros(2 * LAGS + 1)
    kernel[LAGS + offsets] = a
    e = np.abs(s - np.convolve(s, kernel[::-1], "same"))
    e[:LAGS] = e[-LAGS:] = 0.0
    return np.asarray(e)


def _struck(record: TimeRecord) -> np.ndarray:
    """Samples during a blow and just after it (b n,) bool, none in other tests."""
    size = np.abs(record.force).max(axis=1).ravel()
    if excitation_of(record) != "hammer":
        return np.zeros(len(size), bool)
    return _running_max((size > STRUCK * size.max()).astype(float), 2 * LAGS) > 0


def _local_scale(e: np.ndarray) -> np.ndarray:
    """Robust standard deviation about each sample, by pieces, at least a share of the whole's."""
    pieces = np.array_split(e, max(1, len(e) // PIECE))
    local = np.array([np.median(p) for p in pieces]) / 0.6745
    wide = np.maximum(local, np.maximum(np.roll(local, 1), np.roll(local, -1)))
    floor = max(0.05 * float(np.sqrt((e**2).mean())), 1e-300)
    return np.repeat(np.maximum(wide, floor), [len(p) for p in pieces])


def _running_max(x: np.ndarray, half: int) -> np.ndarray:
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(x, 2 * half + 1))


def drifts(record: TimeRecord, channels: Sequence[_Channel]) -> tuple[list[Finding], Check]:
    """A slow polynomial or a step, larger than the signal and beyond its slow noise.

    The energy of each Legendre polynomial of the whole record is of the power of its lowest lines
    by chance. An acceleration that lasts is no motion of the article: over the time T of the
    record it would take it A (T / 3π)² away.
    """
    found, largest = [], 0.0
    power = 0 if record.quantity == "transmissibility" else DERIVATIVES[record.quantity]
    for c in channels:
        x = c.x.ravel()
        every, T = max(1, len(x) // COARSE), len(x) / record.rate
        n = len(x) // every
        if n < 20 * LINES[1] or not x.any():
            continue
        s = x[: n * every].reshape(n, every).mean(axis=1)
        slow, step, energy = _slow(s)
        rest = s - slow
        rms = float(np.sqrt(max(x.var() - slow.var(), 0.0)))
        size = float(np.ptp(slow))
        largest = max(largest, size / max(rms, 1e-300))
        lines = np.abs(np.fft.rfft((rest - rest.mean()) * np.hanning(n))[slice(*LINES)]) ** 2
        chance = float(lines.mean()) * 8 / 3 / n
        away = size * (T / (3 * np.pi)) ** power
        possible = away < SWING and T < LONG if not c.drives else False
        if size < rms or energy < SURE**2 * ORDER * chance or possible:
            continue
        if step is not None:
            what, text = (
                "step",
                f"{c.name} steps by {number(size, 3)} at {step * every / record.rate:.4g} s",
            )
        else:
            what, text = "drift", f"{c.name} drifts by {number(size, 3)} from 0 to {T:.4g} s"
        text += f", {number(size / max(rms, 1e-300), 3)} times the rms of its signal"
        if power and not c.drives:
            text += f"; as a motion it would take the article {away:.2g} m away"
        mend = "let the sensor warm up, check its insulation and coupling, or take off the drift"
        found.append(Finding(what, f"{text}.", "warning", (c.label,), mend, size))
    said = f"at most {number(largest, 2)} times the rms of the signal"
    return found, Check("drift", said, not found)


def _slow(s: np.ndarray) -> tuple[np.ndarray, int | None, float]:
    """The polynomial or the step that explains more (n,), the sample of the step, its energy."""
    n = len(s)
    P = np.polynomial.legendre.legvander(np.linspace(-1, 1, n), ORDER)
    Q, _ = np.linalg.qr(P)
    c = Q.T @ s
    curve, energy = Q @ c, float((c[1:] ** 2).sum())
    ahead = np.cumsum(s)[:-1]
    k = np.arange(1, n)
    jump = (ahead - k * s.mean()) ** 2 * n / (k * (n - k))
    jump[: n // 50] = jump[-(n // 50) :] = 0.0
    at = int(jump.argmax()) + 1
    if jump[at - 1] > energy:
        level = np.where(np.arange(n) < at, s[:at].mean(), s[at:].mean())
        return level, at, float(jump[at - 1])
    return curve, None, energy


def changed_gains(
    record: TimeRecord, frf: FRF, spoilt: Sequence[str] = ()
) -> tuple[list[Finding], Check]:
    """A gain or a unit that changes within the recording: g_k = <HF_k, Y_k> / <HF_k, HF_k>.

    The gains of one output over blocks k have one level before an instant and another after it.
    The gains of all other outputs stay. A nonlinear structure changes all of them.
    """
    if frf.quantity != record.quantity or frf.inputs != record.inputs:
        return [], Check("steady gains", "the FRFs are of another quantity", None)
    made = _gains(record, frf)
    if made is None:
        return [], Check("steady gains", f"needs {LEAST_BLOCKS} blocks", None)
    log, starts = made
    found, largest = [], 1.0
    changes = [_change(log[:, o]) for o in range(log.shape[1])]
    for o, (at, change, sd) in enumerate(changes):
        label = record.outputs[o]
        jumps = np.abs(np.median(log[at:], axis=0) - np.median(log[:at], axis=0))
        alike = float(np.delete(jumps, o).max(initial=0.0))
        factor = float(np.exp(abs(change)))
        if label in spoilt:
            continue
        largest = max(largest, factor)
        if factor > GAIN and abs(change) > SURE * sd and alike < CALM * abs(change):
            text = (
                f"output {label} is {number(np.exp(change), 3)} times as sensitive from about "
                f"{starts[at]:.4g} s on as before, and no other output changes: its gain, range or "
                "unit was changed."
            )
            mend = "split the recording there, or measure again"
            found.append(Finding("changed gain", text, "fault", (label,), mend, np.exp(change)))
    said = f"one changes {number(largest, 3)}-fold at most"
    return found, Check("steady gains", said, not found)


def _gains(record: TimeRecord, frf: FRF) -> tuple[np.ndarray, np.ndarray] | None:
    """ln|g| of each block and output (k, n_out), and the time at which each block starts [s]."""
    b, _, n = record.force.shape
    whole = excitation_of(record) in ("hammer", "burst")  # a part of such a block has no force
    pieces = 1 if whole or b >= LEAST_BLOCKS else 16 // b
    m = n // pieces
    if b * pieces < LEAST_BLOCKS or m < 256:
        return None
    shape = (b, -1, pieces, m)
    force, response = (
        x[:, :, : pieces * m].reshape(shape).transpose(0, 2, 1, 3).reshape(b * pieces, -1, m)
        for x in (record.force, record.response)
    )
    w = np.hanning(m) if pieces > 1 else np.ones(m)
    f = np.fft.rfftfreq(m, 1 / record.rate)
    use = (f >= frf.frequency[0]) & (f <= frf.frequency[-1])
    F, Y = np.fft.rfft(w * force)[..., use], np.fft.rfft(w * response)[..., use]
    flat = frf.values.reshape(len(frf.frequency), -1)
    H = np.stack([np.interp(f[use], frf.frequency, column) for column in flat.T], axis=1)
    H = H.reshape(-1, *frf.values.shape[1:])
    X = np.einsum("foi,kif->kof", H, F)
    own = np.maximum((np.abs(X) ** 2).sum(axis=2), 1e-300)
    g = np.abs((X.conj() * Y).sum(axis=2)) / own
    starts = np.arange(b * pieces) * m / record.rate
    return np.log(np.maximum(g, 1e-12)), starts


def _change(g: np.ndarray) -> tuple[int, float, float]:
    """The block at which two levels meet, their difference, its standard deviation."""
    n = len(g)
    best = (1, 0.0, np.inf)
    least = np.inf
    for at in range(2, n - 1):
        a, z = g[:at], g[at:]
        left = ((a - a.mean()) ** 2).sum() + ((z - z.mean()) ** 2).sum()
        if left < least:
            least = left
            sd = np.sqrt(left / (n - 2) * (1 / at + 1 / (n - at)))
            best = (at, float(z.mean() - a.mean()), float(max(sd, 1e-9)))
    return best
