"""Estimate FRFs from a time recording: detect the excitation, cut, apply windows and average.

Ewins (2000), Modal Testing, sections 3.7 to 3.11 (excitation, windows, averages); Bendat and
Piersol (2010), chapters 7 and 9; Pintelon and Schoukens (2012), System Identification, section 7.2.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from ..arguments import refuse_fields
from ..dynamics.frf import FRF
from ..errors import FileError, LabelError
from .local_polynomial import local_polynomial
from .periodic_signals import is_periodic, of_periods
from .signals import Estimator, estimated, spectra, window
from .stepped_sine import demodulated
from .time_record import TimeRecord

Excitation = Literal["hammer", "burst", "random", "sine", "multisine"]
Method = Literal["H1", "H2", "Hv", "LPM"]

PULSE = 0.02  # share of samples above a tenth of the peak: a hammer's at most
SILENT = 0.03  # rms of the end of a block of burst random over that of the block
DECAYED = 0.01  # a response that falls below this share of its largest rms has rung down
DOUBLE = 0.1  # a second hit of this share of the first spoils the block
BLOCKS = 20  # of continuous random, where no resolution is asked for
OVERLAP = 0.5  # of Hann windows
WEAK = 1e-3  # of the largest power of a hammer's force: beyond, it drives nothing


@dataclass(frozen=True)
class EstimateSettings:
    """How FRFs are estimated; None: what suits the recording.

    Attributes
    ----------
    excitation : hammer, burst, random, sine (stepped) or multisine (blocks are its periods)
    method : H1 (noise at the response), H2 (at the force), Hv (at both), LPM (no window)
    resolution : distance of lines [Hz], of continuous random
    exponential : what the exponential window falls to at the end of a hammer's block, in (0, 1]
    band : (low, high) [Hz] kept
    """

    excitation: Excitation | None = None
    method: Method = "H1"
    resolution: float | None = None
    exponential: float | None = None
    band: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        refuse_fields(self)


@dataclass(frozen=True, eq=False)
class FrfEstimate:
    """FRFs of a time recording, and the method of their estimation."""

    frf: FRF  # with coherence and variance where there are averages
    # excitation, method: as used
    excitation: Excitation
    method: Method
    averages: float  # independent ones
    added_damping: float = 0.0  # that an exponential window added to every pole [1/s]
    # (n_f, n_out) harmonics 2 to 5 over the fundamental, of a stepped sine
    distortion: np.ndarray | None = None
    notes: tuple[str, ...] = ()


def refuse_unknown(settings: EstimateSettings) -> None:
    """Refuse an excitation or a method of no such name."""
    for word, known in ((settings.excitation, Excitation), (settings.method, Method)):
        if word is not None and word not in get_args(known):
            raise LabelError(f"no {word!r}; there are {', '.join(get_args(known))}")


def estimate(record: TimeRecord, settings: EstimateSettings = EstimateSettings()) -> FrfEstimate:
    """Estimate FRFs by the method that suits the excitation."""
    refuse_unknown(settings)
    if not record.force.any():
        raise FileError("the inputs are zero throughout, so nothing was excited")
    if not record.response.any():
        raise FileError("the outputs are zero throughout, so nothing was measured")
    if settings.exponential is not None and not 0 < settings.exponential <= 1:
        raise LabelError(f"an exponential window falls to (0, 1], not {settings.exponential:g}")
    kind = settings.excitation or excitation_of(record)
    if settings.method == "LPM" and kind == "hammer":
        raise LabelError(
            "LPM needs a rough force spectrum to separate FRF and leakage, and that of a hit is "
            "smooth; use H1, H2 or Hv"
        )
    if settings.method == "LPM" and kind not in ("sine", "multisine"):
        frf, averages = local_polynomial(record)  # leakage is fitted, not windowed
        said = (
            f"{kind}: local polynomials (LPM) over {len(record.force)} whole blocks of "
            f"{record.duration:.3g} s; the leakage is fitted, no window"
        )
        found = FrfEstimate(frf, kind, "LPM", averages, notes=(said,))
    else:
        road = {"hammer": _hammer, "burst": _burst, "random": _random, "sine": _sine,
                "multisine": _multisine}[kind]  # fmt: skip
        found = road(record, settings)
    f = found.frf.frequency
    low, high = settings.band or (0.0, np.inf)
    keep = (low <= f) & (f <= high)
    if keep.sum() < 2:
        raise FileError(
            f"{low:g} to {high:g} Hz holds {int(keep.sum())} of its lines, which go from {f[0]:g} "
            f"to {f[-1]:g} Hz"
        )
    distortion = None if found.distortion is None else found.distortion[keep]
    return replace(found, frf=found.frf.sel(band=(low, high)), distortion=distortion)


def excitation_of(record: TimeRecord) -> Excitation:
    """Classify the excitation by the input of largest power."""
    powers = (record.force**2).mean(axis=(0, 2))
    x = record.force[:, int(powers.argmax())]
    if (np.abs(x) > 0.1 * np.abs(x).max()).mean() < PULSE:
        return "hammer"
    if _is_sine(x[0]):
        return "sine"
    if is_periodic(record):
        return "multisine"
    tail = x[:, -max(1, x.shape[1] // 20) :]
    silent = np.sqrt((tail**2).mean()) < SILENT * np.sqrt((x**2).mean())
    return "burst" if silent or len(_onsets(x)) > 2 else "random"


def _is_sine(x: np.ndarray) -> bool:
    """Return True if most short stretches contain a single frequency."""
    n = max(256, min(4096, len(x) // 50))
    pieces = x[: len(x) // n * n].reshape(-1, n) * np.hanning(n)
    power = np.abs(np.fft.rfft(pieces)) ** 2
    at = power[:, 1:].argmax(axis=1) + 1
    near = np.abs(np.arange(power.shape[1]) - at[:, None]) <= 2
    share = (power * near).sum(axis=1) / np.maximum(power[:, 1:].sum(axis=1), 1e-300)
    return bool(len(share) > 0 and np.median(share) > 0.9)


def _onsets(x: np.ndarray) -> np.ndarray:
    """Return the samples of a single stretch (1, n) at which the input starts after silence."""
    if len(x) != 1:
        return np.zeros(0, int)
    size = np.abs(x[0])
    loud = size > 0.1 * size.max()
    at = np.flatnonzero(loud)
    gap = max(16, len(size) // 500)
    return at[np.concatenate([[True], np.diff(at) > gap])]


def _cut(record: TimeRecord, what: str) -> TimeRecord:
    """Blocks of a single stretch, each from just before an onset to the next."""
    if len(record.force) > 1:
        return record
    powers = (record.force**2).mean(axis=(0, 2))
    starts = _onsets(record.force[:, int(powers.argmax())])
    n_all = record.force.shape[2]
    if len(starts) < 2:
        return record
    step = int(np.median(np.diff(starts)))
    lead = min(int(starts[0]), step // 100)
    starts = starts - lead
    n, rest = int(np.diff(starts).min()), int(n_all - starts[-1])
    n = rest if 0.9 * n < rest < n else n  # the last block may be a little shorter
    whole = starts[starts + n <= n_all]
    if n < 64 or len(whole) == 0:
        raise FileError(f"its {len(starts)} {what} follow each other too fast to be separated")
    return record.cut(whole, n)


def _averaged(
    record: TimeRecord, settings: EstimateSettings, shape: str | np.ndarray, overlap: float = 0.0
) -> tuple[FRF, float]:
    s = spectra(record.force, record.response, record.rate, shape, overlap)
    method: Estimator = settings.method  # type: ignore[assignment]
    frf = estimated(s, record.outputs, record.inputs, record.quantity, method)
    return frf.sel(band=(0.5 * float(frf.frequency[1]), np.inf)), s.averages


def _hammer(record: TimeRecord, settings: EstimateSettings) -> FrfEstimate:
    """Window the force about each pulse; add an exponential window if the response is cut off."""
    record = _cut(record, "hits")
    force, spoilt = _pulses(record.force)
    notes = []
    if spoilt.any():
        notes.append(f"{int(spoilt.sum())} of {len(spoilt)} hits are double hits and are left out")
    if spoilt.all():
        raise FileError("all hits are double hits, so none is left to average")
    record = replace(record.sel(~spoilt), force=force[~spoilt])
    fall = settings.exponential or min(1.0, DECAYED / max(_left_at_end(record.response), 1e-300))
    w = window("exponential", record.force.shape[2], fall)
    frf, averages = _averaged(record, settings, w)
    added = float(-np.log(fall) / record.duration) if fall < 1 else 0.0
    notes.insert(0, f"{len(record.force)} hits of {record.duration:.3g} s, force window, "
                 + (f"exponential window to {fall:.2g}, which adds a damping of {added:.3g} 1/s"
                    if fall < 1 else "no exponential window"))  # fmt: skip
    power = (np.abs(np.fft.rfft(record.force)) ** 2).mean(axis=(0, 1))[1:]
    weak = np.flatnonzero(power < WEAK * power.max())
    weak = weak[weak > power.argmax()]
    top = int(weak[0]) - 1 if len(weak) else len(power) - 1
    if settings.band is None and top < len(power) - 1:
        high = float(frf.frequency[top])
        frf = frf.sel(band=(0.0, high))
        notes.append(f"above {high:.5g} Hz the hits hold less than 1/1000 of their power density")
    return FrfEstimate(frf, "hammer", settings.method, averages, added, notes=tuple(notes))


def _pulses(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Set forces to zero outside their pulse and mark blocks that contain a second one (b,)."""
    out, spoilt = np.zeros_like(force), np.zeros(len(force), bool)
    n = force.shape[2]
    for b, block in enumerate(force):
        x = block[int(np.abs(block).max(axis=1).argmax())]
        peak = int(np.abs(x).argmax())
        above = np.abs(x) > 0.5 * np.abs(x[peak])
        right = peak + int(np.argmin(above[peak:])) if not above[peak:].all() else n
        left = peak - int(np.argmin(above[: peak + 1][::-1])) if not above[: peak + 1].all() else 0
        width = max(right - left, 4)
        first, last = max(0, peak - 4 * width), min(n, peak + 6 * width)
        rest = block[:, last:]
        zero = np.median(rest, axis=1, keepdims=True) if rest.shape[1] else 0.0
        taper = np.ones(last - first)
        soft = min(3 * width, last - peak)
        taper[-soft:] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(soft) + 0.5) / soft)
        out[b, :, first:last] = (block[:, first:last] - zero) * taper
        after = np.abs(x[last:] - np.ravel(zero)[0] if rest.shape[1] else x[last:])
        spoilt[b] = bool(len(after) and after.max() > DOUBLE * np.abs(x[peak]))
    return out, spoilt


def _left_at_end(response: np.ndarray) -> float:
    """Largest rms of the last twentieth over the loudest twentieth, of any channel."""
    n = response.shape[2] // 20
    pieces = response[:, :, : 20 * n].reshape(*response.shape[:2], 20, n)
    pieces = pieces - pieces.mean(axis=3, keepdims=True)
    rms = np.sqrt((pieces**2).mean(axis=(0, 3)))
    return float((rms[:, -1] / np.maximum(rms.max(axis=1), 1e-300)).max())


def _burst(record: TimeRecord, settings: EstimateSettings) -> FrfEstimate:
    """No window: force and response are silent at both ends of each block."""
    record = _cut(record, "bursts")
    frf, averages = _averaged(record, settings, "rectangular")
    notes = [f"{len(record.force)} bursts of {record.duration:.3g} s, no window"]
    if (left := _left_at_end(record.response)) > 0.05:
        notes.append(
            f"the response has not decayed at the end of the blocks ({100 * left:.2g} % remains), "
            "which causes leakage: use longer blocks or shorter bursts"
        )
    return FrfEstimate(frf, "burst", settings.method, averages, notes=tuple(notes))


def _random(record: TimeRecord, settings: EstimateSettings) -> FrfEstimate:
    """Hann windows that overlap by half."""
    n_all = record.force.shape[2]
    n = min(n_all, int(n_all * len(record.force) / (BLOCKS * OVERLAP)))
    n = 2 ** int(np.log2(max(n, 2)))
    if settings.resolution is not None:
        n = round(record.rate / settings.resolution)
    if not 64 <= n <= n_all:
        raise FileError(
            f"lines {record.rate / max(n, 1):.3g} Hz apart need blocks of {n} samples, of 64 at "
            f"least and {n_all} at most"
        )
    starts = np.arange(0, n_all - n + 1, max(1, round(n * (1 - OVERLAP))))
    cut = [record.sel(np.array([b])).cut(starts, n) for b in range(len(record.force))]
    whole = replace(
        record,
        force=np.concatenate([c.force for c in cut]),
        response=np.concatenate([c.response for c in cut]),
    )
    frf, averages = _averaged(whole, settings, "hann", OVERLAP)
    said = (
        f"continuous random: {len(whole.force)} Hann windows of {n / record.rate:.3g} s with 50 % "
        f"overlap, equivalent to {averages:.3g} averages"
    )
    return FrfEstimate(frf, "random", settings.method, averages, notes=(said,))


def _multisine(record: TimeRecord, settings: EstimateSettings) -> FrfEstimate:
    """Whole periods, and only the lines that are driven."""
    if settings.method == "LPM":
        raise LabelError("whole periods have no leakage for LPM to fit; use H1, H2 or Hv")
    frf, averages, said = of_periods(record, settings.method)
    note = f"{len(record.force)} periods of {record.duration:.3g} s, no window; {said}"
    return FrfEstimate(frf, "multisine", settings.method, averages, notes=(note,))


def _sine(record: TimeRecord, settings: EstimateSettings) -> FrfEstimate:
    """The amplitude and phase of every dwell of a stepped sine."""
    if settings.method != "H1":
        raise LabelError(f"a stepped sine is demodulated; {settings.method} is for other signals")
    frf, distortion, notes = demodulated(record)
    return FrfEstimate(frf, "sine", "H1", 1.0, distortion=distortion, notes=notes)
