"""Frequencies of response that follow the modes (Nastran's FREQ3, FREQ4, FREQ5).

MSC Nastran Quick Reference Guide, remarks to these entries.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

SAME = 1e-5  # of their range: frequencies at a smaller distance are duplicates (PARAM,DFREQ)


Following = Callable[[np.ndarray], np.ndarray]  # from modal frequencies to those of response [Hz]


@dataclass(frozen=True)
class Between:
    """f = (a + b)/2 + (b - a)/2 |x|^(1/c) sgn x, x = -1 ... 1: ``count`` from mode to mode.

    a, b are neighbours among low, the modes between, and high [Hz]. c > 1 concentrates the
    frequencies at the ends.
    """

    low: float
    high: float
    count: int = 10
    cluster: float = 1.0
    logarithmic: bool = False

    def __call__(self, modes: np.ndarray) -> np.ndarray:
        """Frequencies of every range, its ends included."""
        inside = modes[(modes > self.low) & (modes < self.high)]
        ends = np.unique(np.concatenate([[self.low], inside, [self.high]]))
        ends = np.log(ends) if self.logarithmic else ends
        x = np.linspace(-1, 1, self.count)
        position = np.sign(x) * np.abs(x) ** (1 / self.cluster)
        a, b = ends[:-1, None], ends[1:, None]
        f = np.append(((a + b) / 2 + (b - a) / 2 * position).ravel(), ends)
        return np.exp(f) if self.logarithmic else f


@dataclass(frozen=True)
class Times:
    """f = m f_r within low ... high [Hz]: factors m of every modal frequency."""

    low: float
    high: float
    factors: tuple[float, ...]

    def __call__(self, modes: np.ndarray) -> np.ndarray:
        """Products within the band."""
        f = np.outer(modes, self.factors).ravel()
        return f[(f >= self.low) & (f <= self.high) & (f > 0)]


def merged(lists: Sequence[np.ndarray]) -> np.ndarray:
    """Merge lists of frequencies, increasing, without duplicates within ``SAME`` of the range."""
    f = np.unique(np.concatenate([np.zeros(0), *lists]))
    if not len(f):
        return f
    near = np.diff(f) < SAME * (f[-1] - f[0])
    return f[np.append(True, ~near)]
