"""Natural frequencies of a test: identified poles that are modes, and their uncertainty."""

from collections.abc import Sequence

import numpy as np

from ..dynamics.frf import FRF
from ..ema.identification import Identified, identify
from ..errors import FileError
from ..fem.modelled import Modelled
from ..inference.channel_screening import FAR_BELOW, first_elastic
from ..progress import Progress, silent
from ..reduced.pole_assignment import FAINTEST
from .question import Question


def frequencies(
    question: Question, uncertain: bool, progress: Progress = silent
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Identified | None, tuple[str, ...]]:
    """Natural frequencies of the test, standard deviations [Hz], relative peak heights."""
    frf = question.frf
    if frf is None:
        assert question.frequency is not None
        at = listed(question)
        f, sd = np.asarray(question.frequency, float)[at], question.frequency_sd
        sd = np.full(len(f), np.nan) if sd is None else sd[at]
        sd = np.where(np.isnan(sd), 1e-3 * f, sd)
        note = "no FRF exists: natural frequencies were compared"
        return f, sd, np.ones(len(f)), None, () if question.shapes is not None else (note,)
    band, use = band_of(question, frf), kept(frf.frequency, question.exclude)
    found = identify(frf, widened(frf, band), use=use, progress=progress)
    f, keep = found.frequency, _prominent(found, band)
    why = ["the gain is unknown"] * (not question.gain_known)
    why += ["the places of the sensors are uncertain"] * uncertain
    note = (
        f"{' and '.join(why).capitalize() or 'as the case requests'}, so natural frequencies were "
        f"compared, not FRFs: {int(keep.sum())} modes of {found.order} identified between "
        f"{band[0]:g} and {band[1]:g} Hz; model modes that the sensors can hardly see may stay "
        "without a partner"
    )
    peak = _peaks(found)[keep]
    sd = np.maximum(found.frequency_sd[keep], 1e-4 * f[keep])
    return f[keep], sd, peak / peak.max(), found, (note,)


def listed(question: Question, above: float = 0.0) -> np.ndarray:
    """Positions of the given poles in the band and above a frequency [Hz], in increasing order."""
    f = np.asarray(question.frequency, float)
    inside = (f >= question.band[0]) & (f <= question.band[1]) & kept(f, question.exclude)
    if not inside.any():
        raise FileError(
            f"none of the {len(f)} poles, {f.min():g} to {f.max():g} Hz, lies in the band "
            f"{question.band[0]:g}-{question.band[1]:g} Hz"
        )
    found = np.flatnonzero(inside & (f > above))
    return found[np.argsort(f[found])]


LEAST_DELTA_CHI2 = 3.0  # least drop of χ² over the penalty of a pole for it to count as a mode
TWIN = 0.012  # ln f within which a weaker pole belongs to the stronger one's resonance
SHADOW = 0.04, 5.0  # ln f and ratio of heights: the same for a much weaker pole


def significant(found: Identified, low: float, high: float) -> np.ndarray:
    """Poles between two frequencies [Hz] that count as modes (r,) bool."""
    inside = (found.frequency >= low) & (found.frequency <= high)
    return inside & (found.relative_delta_chi2 > LEAST_DELTA_CHI2)


def _peaks(found: Identified) -> np.ndarray:
    """Height of each resonance in the accelerance, |R| ω / ζ up to a constant (r,)."""
    return (
        np.abs(found.residues).max(axis=(1, 2)) * found.frequency / np.maximum(found.damping, 1e-4)
    )


def _prominent(found: Identified, band: tuple[float, float]) -> np.ndarray:
    """Poles of the band with a clear share of χ² and usual damping, the strongest of each peak."""
    f, peak = found.frequency, _peaks(found)
    keep = significant(found, *band) & (found.damping < 0.05)
    if not keep.any():
        raise FileError(
            f"no mode is above the noise of the recording between {band[0]:g} and {band[1]:g} Hz"
        )
    usual = float(np.median(found.damping[keep & (peak > 0.1 * peak[keep].max())]))
    keep &= found.damping < max(0.005, 4 * usual)
    for i in np.flatnonzero(keep):
        apart = np.abs(np.log(f / f[i]))
        over = (apart < TWIN) & (peak > peak[i])
        over |= (apart < SHADOW[0]) & (peak > SHADOW[1] * peak[i])
        keep[i] = not np.any(over & keep) and peak[i] > FAINTEST * peak[keep].max()
    return keep


def band_of(question: Question, frf: FRF) -> tuple[float, float]:
    """The band to fit, within the recording [Hz]."""
    low = max(question.band[0], float(frf.frequency[frf.frequency > 0][0]))
    high = min(question.band[1], float(frf.frequency[-1]))
    if high <= low:
        raise FileError(
            f"the band {question.band[0]:g}-{question.band[1]:g} Hz holds no line of the recording "
            f"({frf.frequency[0]:g}-{frf.frequency[-1]:g} Hz)"
        )
    return low, high


def widened(frf: FRF, band: tuple[float, float]) -> tuple[float, float]:
    """The band [Hz], widened a little so that resonances at its ends are complete.

    The lower end moves by a fifth of itself at most, whatever the width of the band.
    """
    (low, high), width = band, 0.04 * (band[1] - band[0])
    low = max(float(frf.frequency[0]), low - min(width, 0.2 * low))
    return low, min(float(frf.frequency[-1]), high + width)


def kept(f: np.ndarray, exclude: Sequence[tuple[float, float]]) -> np.ndarray:
    """Frequencies outside the excluded intervals (n,) bool."""
    use = np.ones(len(f), bool)
    for a, b in exclude:
        use &= (f < a) | (f > b)
    return use


def suspended_below(
    question: Question, nominal: Modelled, frequency: np.ndarray, high: float
) -> float:
    """Frequency between the modes on a suspension and those of a free deck [Hz]; 0 without both.

    The deck holds neither the cords nor, without hangers, their places. Its responses follow the
    modes of the test, ``frequency``, from halfway (in the logarithm) to the first elastic one on.
    """
    first = 0.0 if question.hangers or question.base is not None else first_elastic(nominal.modes)
    slow = frequency[frequency < first / FAR_BELOW]
    if not len(slow) or first > high:
        return 0.0
    fast = frequency[frequency > slow.max()]
    return float(np.sqrt(slow.max() * min(first, fast.min(initial=first))))


def suspension_note(above: float) -> list[str]:
    """Sentence on the range that is left out, where there is one."""
    said = (
        "the deck is free and names no hangers, and the test has modes far below the first elastic "
        f"one; these are of a suspension, and the range below {above:.3g} Hz is not compared"
    )
    return [said] if above else []
