"""Modes of the three articles, identified as in chapter 5.1 of the thesis, and their pairing."""

from dataclasses import dataclass

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.correlation import mac
from chladni.ema.identification import Identified, identify
from chladni.ema.mode_pairing import pair
from chladni.ema.shapes import driven_shapes
from chladni.ema.stabilisation import ghosts, stabilisation
from chladni_bench import BenchRecording

BAND = (10.0, 195.0)  # [Hz], section 5.1
CORDS = (23.0, 27.5)  # [Hz] excluded, section 5.1.1
NEAR_CORD, CORD_DAMPING = (
    0.01,
    0.014,
)  # a cord's pole: this near to its resonance and damped by more
SAME = 0.9  # MAC of a pole with a stronger one in whose bandwidth it lies: the same mode twice


@dataclass(frozen=True, eq=False)
class ArticleIdentified:
    """Modes of one article."""

    frf: FRF  # of the recording
    use: np.ndarray  # (n_f,) bool: lines of the identification
    whole: Identified  # with poles that no peak confirms and poles outside the band
    modes: Identified  # the article's own modes within the band
    doubles: np.ndarray  # (k,) poles next to a mode with the same shape, or without a peak [Hz]
    cords: np.ndarray  # (l,) poles of the cords [Hz]

    @property
    def raw(self) -> FRF:
        """The recording on the lines of the identification."""
        f = self.frf
        return FRF(f.values[self.use], f.frequency[self.use], f.outputs, f.inputs, f.quantity)


def used_lines(frequency: np.ndarray) -> np.ndarray:
    """Mask of lines of the band without the cords' band (n_f,) bool."""
    inside = (BAND[0] <= frequency) & (frequency <= BAND[1])
    return inside & ((frequency < CORDS[0]) | (frequency > CORDS[1]))


def article_identified(recording: BenchRecording, rings: np.ndarray) -> ArticleIdentified:
    """Poles of 10 to 195 Hz without the cords' band.

    Parameters
    ----------
    rings : known resonances of the cords [Hz]
    """
    frf = recording.frf
    use = used_lines(frf.frequency)
    found = identify(frf, BAND, use=use)
    struck = ghosts(found, stabilisation(frf, found, use)) | ~found.firm | doubled(found)
    near = np.abs(found.frequency[:, None] / rings - 1).min(axis=1) < NEAR_CORD
    of_cord = near & (found.damping > CORD_DAMPING)
    inside, f = found.inside, found.frequency
    return ArticleIdentified(
        frf, use, found, found.sel(inside & ~struck & ~of_cord), f[inside & struck & ~of_cord],
        f[inside & of_cord],
    )  # fmt: skip


def doubled(found: Identified) -> np.ndarray:
    """True for poles within the bandwidth of a stronger one of the same shape (r,)."""
    half = found.damping * found.frequency
    psi = driven_shapes(found)
    peak = np.linalg.norm(psi, axis=0) / half
    together = np.abs(found.frequency[:, None] - found.frequency) < half[:, None] + half
    weaker = peak[:, None] < peak
    return (together & weaker & (mac(psi, psi) > SAME)).any(axis=1)


@dataclass(frozen=True, eq=False)
class ModesOfArticles:
    """Modes of A with their partners in B and C; every mode has at least one partner."""

    rows: np.ndarray  # (r,) of A's modes
    alone: np.ndarray  # (k,) frequencies of A's poles that neither B nor C shows [Hz]
    # frequency, damping: (r, 3) [Hz], [-]; nan where an article has no partner
    frequency: np.ndarray
    damping: np.ndarray
    mac: np.ndarray  # (r, 2) of A with B and with C


def paired(found: tuple[ArticleIdentified, ...]) -> ModesOfArticles:
    """Pair modes of A with the modes of similar shape of the other articles."""
    first = found[0].modes
    f, zeta = (np.full((first.order, len(found)), np.nan) for _ in range(2))
    alike = np.full((first.order, len(found) - 1), np.nan)
    f[:, 0], zeta[:, 0] = first.frequency, first.damping
    for k, other in enumerate(found[1:], start=1):
        M = mac(driven_shapes(first), driven_shapes(other.modes))
        p = pair(first.frequency, other.modes.frequency, M, farthest=0.1)
        f[p.model, k] = other.modes.frequency[p.test]
        zeta[p.model, k] = other.modes.damping[p.test]
        alike[p.model, k - 1] = p.mac
    both = np.isfinite(alike).any(axis=1)
    rows = np.flatnonzero(both)
    return ModesOfArticles(rows, f[~both, 0], f[rows], zeta[rows], alike[rows])


def spread(x: np.ndarray) -> np.ndarray:
    """(largest - smallest) / mean of every row (r,): "highest difference" of tables 5 and 6."""
    return np.ptp(x, axis=1) / x.mean(axis=1)


def errors(found: Identified, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of frequency and of damping ratio against the nearest true pole (r,)."""
    near = poles[np.abs(found.poles[:, None] - poles).argmin(axis=1)]
    zeta = -near.real / np.abs(near)
    return np.abs(found.poles / near).real - 1, found.damping / zeta - 1
