"""The mass of an accelerometer that is moved from place to place: each output has its own modes.

A small mass m at output o lowers mode r by Δf/f = -½ m φ_or², with φ of unit modal mass (Rayleigh
1877, The Theory of Sound, 90). The poles of each output alone show this. In every mode they are the
lower, the larger the residue of the output is. Fixed sensors have the same poles at all outputs.
"""

from dataclasses import dataclass

import numpy as np

from ..dynamics.frf import FRF
from ..errors import ChladniError
from .channel_checks import drive_points
from .finding import Check, Finding
from .identification import DERIVATIVES, Identified, identify
from .screening_lines import screening_lines

NAME = "one mass at all outputs"
CROWDED = 5.0  # half-bandwidths: a mode that each output has elsewhere gives poles that near
MANY = 0.5  # of the poles that have such a neighbour, from which outputs are looked at alone
UNFIT = 3.0  # times the noise that one set of poles leaves: then as well
FEWEST = 4  # outputs that show a mode
MOST = 8  # outputs that are identified alone
SAME = 0.1  # of a frequency: poles of two outputs farther apart are of two modes
FLOOR = 2e-4  # of a frequency: errors of form of a pole beyond its deviation
SURE = 9.0  # χ² over its degrees of freedom, from which outputs have poles of their own
EXPLAINED = 0.8  # of that χ² by residues
FALLING = 0.8  # of the modes are the lower, the larger the residue


@dataclass(frozen=True, eq=False)
class OwnPoles:
    """One mode as each of some outputs shows it.

    Attributes
    ----------
    outputs : (k,) int
    log_f, sd : (k,)     ln f and its deviation
    level : (k,)         |R| of the receptance, times 2ω
    half : of its bandwidth, over its frequency
    """

    outputs: np.ndarray
    log_f: np.ndarray
    sd: np.ndarray
    level: np.ndarray
    half: float

    def fitted(self) -> tuple[float, float, float]:
        """χ² of one frequency; χ² and slope s of ln f = c - s level²."""
        w, q = 1 / self.sd**2, self.level**2
        f = self.log_f - np.average(self.log_f, weights=w)
        q = q - np.average(q, weights=w)
        slope = -float((w * f * q).sum() / max(float((w * q * q).sum()), 1e-300))
        return float((w * f**2).sum()), float((w * (f + slope * q) ** 2).sum()), slope


def roving_mass(frf: FRF, found: Identified | None) -> tuple[list[Finding], Check]:
    """Outputs whose modes are the lower, the more they move in them.

    Parameters
    ----------
    found : modes of all outputs together
    """
    if len(frf.outputs) < FEWEST or frf.quantity not in DERIVATIVES or found is None:
        return [], Check(NAME, f"needs {FEWEST} outputs and their modes", None)
    if not _doubtful(found):
        return [], Check(NAME, "all outputs share their modes", True)
    modes = _modes(frf, found)
    if not modes:
        return [], Check(NAME, "no mode is seen by enough outputs alone", None)
    fits = [mode.fitted() for mode in modes]
    one, own, slopes = (np.array(v) for v in zip(*fits, strict=True))
    freedom = sum(len(mode.outputs) - 1 for mode in modes)
    shift = [float(np.ptp(mode.log_f)) for mode in modes]
    largest = int(np.argmax(shift))
    said = f"poles of single outputs differ by up to {100 * shift[largest]:.2g} %"
    sure = one.sum() > SURE * freedom and own.sum() < (1 - EXPLAINED) * one.sum()
    if not (sure and np.mean(slopes > 0) >= FALLING):
        return [], Check(NAME, said, True)
    mass = _mass(frf, modes, slopes)
    about = f", of about {1e3 * mass:.2g} g" if mass else ""
    text = (
        f"the same modes lie at other frequencies in each output, up to {100 * shift[largest]:.2g} "
        "% apart, and the lower, the more the output moves in them: the article carried the mass "
        f"of an accelerometer{about} that was moved from place to place."
    )
    mend = (
        "leave the accelerometer at one place and move the hammer, or put dummies of its mass at "
        "all other places"
    )
    severe = any(s > mode.half for s, mode in zip(shift, modes, strict=True))
    finding = Finding(
        "roving mass", text, "fault" if severe else "warning", (), mend, mass or shift[largest]
    )
    return [finding], Check(NAME, said, False)


def _doubtful(found: Identified) -> bool:
    """True if one set of poles leaves more than the noise, or is crowded."""
    p = found.poles[found.inside]
    if not len(p):
        return False
    near = np.abs(p[:, None] - p) < CROWDED * np.abs(p.real)[:, None]
    crowded = near.sum(axis=1) > 1
    return bool(found.chi > UNFIT or crowded.mean() > MANY)


def _modes(frf: FRF, found: Identified) -> list[OwnPoles]:
    """Modes that several outputs show when each is identified alone."""
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=(0, 2)))
    chosen = np.sort(np.argsort(-rms)[:MOST])
    rows: list[tuple[int, float, float, float, float]] = []
    for o in chosen.tolist():
        one = frf.sel(outputs=[frf.outputs[o]])
        try:
            alone = identify(one, found.band, use=screening_lines(one))
        except ChladniError:
            continue
        level = 2 * np.abs(alone.poles) * np.linalg.norm(alone.residues[:, 0, :], axis=1)
        for r in np.flatnonzero(alone.inside & (alone.frequency_sd < FLOOR**0.5 * alone.frequency)):
            f = float(alone.frequency[r])
            sd = float(np.hypot(alone.frequency_sd[r] / f, FLOOR))
            rows.append((o, np.log(f), sd, float(level[r]), float(alone.damping[r])))
    return _gathered(rows)


def _gathered(rows: list[tuple[int, float, float, float, float]]) -> list[OwnPoles]:
    """Poles by modes: those about the output with most of them, at most one of each output."""
    if not rows:
        return []
    output, log_f, sd, level, half = (np.array(v) for v in zip(*rows, strict=True))
    seen, count = np.unique(output, return_counts=True)
    centres = np.sort(log_f[output == seen[count.argmax()]])
    out = []
    for k, c in enumerate(centres):
        gap = min([SAME, *(np.abs(np.delete(centres, k) - c) / 2)])
        near = np.flatnonzero(np.abs(log_f - c) < gap)
        nearest = [near[output[near] == o][np.abs(log_f[near[output[near] == o]] - c).argmin()]
                   for o in np.unique(output[near])]  # fmt: skip
        if len(nearest) >= FEWEST:
            at = np.array(nearest)
            out.append(
                OwnPoles(output[at], log_f[at], sd[at], level[at], float(np.median(half[at])))
            )
    return out


def _mass(frf: FRF, modes: list[OwnPoles], slopes: np.ndarray) -> float:
    """m [kg] by the median of the modes, from ½ m φ_o² = s (φ_o φ_d)²; 0 without a drive point."""
    points = {o for o, j, _ in drive_points(frf) if len(frf.inputs) == 1}
    found = []
    for mode, slope in zip(modes, slopes, strict=True):
        at = np.flatnonzero(np.isin(mode.outputs, list(points)))
        if len(at) and slope > 0:
            found.append(2 * slope * float(mode.level[at[0]]))
    return float(np.median(found)) if found else 0.0
