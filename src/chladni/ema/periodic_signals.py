"""FRFs of periodic excitation: whole periods, only the lines that are driven, no window.

A response at undriven lines comes from the structure. With an odd multisine, even lines contain
even distortion (Pintelon and Schoukens 2012, System Identification, section 4.3).
"""

import numpy as np

from ..dynamics.frf import FRF
from ..errors import FileError
from .signals import Estimator, estimated, spectra
from .time_record import TimeRecord

ALIKE = 0.9  # share of the force's power that is the same in every block, at least
DRIVEN = 1e-3  # of the power of the strongest of the lines about it
ABOUT = 9  # lines


def is_periodic(record: TimeRecord) -> bool:
    """Return True if every block of the recording is a period of one signal."""
    if len(record.force) < 2:
        return False
    F = np.fft.rfft(record.force)[:, :, 1:]
    power = (np.abs(F) ** 2).mean(axis=0)
    alike = np.abs(F.mean(axis=0)) ** 2
    return bool(alike.sum() > ALIKE * power.sum())


def of_periods(record: TimeRecord, method: Estimator) -> tuple[FRF, float, str]:
    """Estimate the FRF at the driven lines; return averages and a sentence on the others too."""
    from scipy.ndimage import maximum_filter1d

    if len(record.inputs) > 1:
        raise FileError("periodic excitation drives one input at a time; give each its own file")
    s = spectra(record.force, record.response, record.rate)
    power = s.ff[:, 0, 0].real
    driven = power > DRIVEN * maximum_filter1d(power, ABOUT)
    driven &= power > 1e-6 * power.max()
    driven[0] = False
    if driven.sum() < 5:
        raise FileError(f"{int(driven.sum())} lines of the period are driven; five are needed")
    H = estimated(s, record.outputs, record.inputs, record.quantity, method)
    at = np.flatnonzero(driven)
    assert H.coherence is not None
    frf = FRF(
        H.values[at], H.frequency[at], H.outputs, H.inputs, H.quantity,
        variance=None if H.variance is None else H.variance[at], coherence=H.coherence[at],
    )  # fmt: skip
    return frf, s.averages, _between(s.frequency, np.abs(s.yy), at)


def _between(f: np.ndarray, power: np.ndarray, driven: np.ndarray) -> str:
    """Describe the response at undriven lines within the driven band."""
    inside = np.arange(driven[0], driven[-1] + 1)
    idle = np.setdiff1d(inside, driven)
    said = f"{len(driven)} driven lines from {f[driven[0]]:.4g} to {f[driven[-1]]:.4g} Hz"
    if not len(idle):
        return said
    ratio = power[idle].mean(axis=0) / power[driven].mean(axis=0)
    worst = 10 * np.log10(max(float(ratio.max()), 1e-30))
    return (
        f"{said}; the {len(idle)} lines between them are {-worst:.3g} dB lower, from noise or "
        "distortion"
    )
