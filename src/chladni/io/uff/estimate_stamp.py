"""How an FRF was estimated, in the first line of its dataset 58, which has no field for it."""

import re
from dataclasses import replace

import numpy as np

from ...dynamics.frf import FRF

_STAMP = re.compile(r"chladni test: ([\d.e+-]+) averages(?:, exponential window ([\d.e+-]+) 1/s)?")


def stamp(averages: float, added_damping: float) -> str:
    """The line.

    >>> stamp(5.0, 0.0), read_stamp(stamp(18.9, 3.25))
    ('chladni test: 5 averages', (18.9, 3.25))
    """
    window = f", exponential window {added_damping:.8g} 1/s" if added_damping else ""
    return f"chladni test: {averages:.6g} averages{window}"


def read_stamp(line: str) -> tuple[float, float]:
    """(averages, damping that a window added [1/s]); 0 where the line says nothing."""
    found = _STAMP.search(line)
    if not found:
        return 0.0, 0.0
    try:
        return float(found[1]), float(found[2] or 0.0)
    except ValueError:
        return 0.0, 0.0


def with_variance(frf: FRF, averages: float) -> FRF:
    """The FRF with E|ΔH|² = (1 - γ²) |H|² / (γ² (n - n_in)), which H1 had from its averages.

    ``coherence`` is γ² (Bendat and Piersol 2010, eq. 9.81).
    """
    freedom = averages - len(frf.inputs)
    if frf.coherence is None or frf.variance is not None or freedom < 0.5:
        return frf
    gamma = np.clip(frf.coherence, 1e-6, 1.0)
    return replace(frf, variance=(1 - gamma) / gamma * np.abs(frf.values) ** 2 / freedom)
