"""Responses to a force nobody measured: what of them a modal identification can use.

Under a force that is white and stationary in the band, correlations of responses at positive lags
decay as the free structure does: r_ij(τ) = Σ_r c_r exp(p_r τ) + conjugate (NExT: James, Carne and
Lauffer 1995, Int. J. Analytical and Experimental Modal Analysis 10, 260-277).  Their one-sided
transform Σ_r c_r / (s - p_r) + ... has the poles of an FRF, and residues of no known scale.
"""

from collections.abc import Sequence

import numpy as np

from ..dynamics.frf import FRF
from .setup import Function
from .signals import window

FORCES = ("N", "kN", "mN", "lbf", "lb", "kgf")
FEWEST = 64  # samples of a record
ROUNDED = 0.2  # of a step: six digits of the time of a long record
SEGMENTS = 8  # of the record: the lags that are used, and the spread of their correlations
DECAY = 0.01  # of the window at the last lag
ALIKE = -np.log(DECAY) / 2  # lines of one noise: the window's equivalent noise bandwidth
REFERENCES = 3  # responses of most energy


def responses(functions: Sequence[Function]) -> tuple[Function, ...]:
    """Records of responses of one kind, where no force stands beside them; none elsewhere.

    Time histories come before cross and auto spectra.
    """
    if any(f.unit.strip() in FORCES for f in functions):
        return ()
    time = tuple(f for f in functions if f.kind == "time" and not f.input)
    spectral = ("auto spectrum", "cross spectrum", "psd")
    found = time or tuple(f for f in functions if f.kind in spectral)
    alike = tuple(f for f in found if len(f.x) == len(found[0].x) and np.allclose(f.x, found[0].x))
    return alike if alike and len(alike[0].x) > FEWEST and _even(alike[0].x) else ()


def _even(x: np.ndarray) -> bool:
    """Whether samples follow each other evenly, as files with few digits have them."""
    due = np.linspace(x[0], x[-1], len(x))
    return bool(x[-1] > x[0] and np.abs(x - due).max() < ROUNDED * _step(x))


def _step(x: np.ndarray) -> float:
    return float(x[-1] - x[0]) / (len(x) - 1)


def one_sided(functions: Sequence[Function]) -> tuple[FRF, float]:
    """Transforms of the correlations at positive lags, and the damping σ [1/s] the window adds.

    Parameters
    ----------
    functions : from :func:`responses`

    The result is called a receptance, for it has that form: Σ R_r / (s - p_r) and residual terms.
    """
    if functions[0].kind == "time":
        return _of_time(functions)
    return _of_spectra(functions)


def _of_time(functions: Sequence[Function]) -> tuple[FRF, float]:
    """Correlations of each segment of the record, their mean and its variance."""
    y = np.array([np.real(f.values) for f in functions])
    y = y - y.mean(axis=1, keepdims=True)
    rate = 1 / _step(functions[0].x)
    order = np.argsort(-(y**2).sum(axis=1), kind="stable")[:REFERENCES]
    n = y.shape[1] // SEGMENTS
    lags = n // 2
    parts = []
    for k in range(SEGMENTS):
        Y = np.fft.rfft(y[:, k * n : (k + 1) * n], 2 * n)
        S = np.einsum("of,rf->for", Y, Y[order].conj())
        parts.append(np.fft.irfft(S, axis=0)[:lags] / (n - np.arange(lags))[:, None, None])
    H = np.array([_transformed(r, rate) for r in parts])
    frequency = np.fft.rfftfreq(lags, 1 / rate)
    labels = tuple(f.output for f in functions)
    variance = H.var(axis=0, ddof=1) / SEGMENTS
    smooth = np.maximum(variance, np.median(variance, axis=0))
    made = FRF(
        H.mean(axis=0), frequency, labels, tuple(labels[k] for k in order), "receptance",
        variance=smooth,
    )  # fmt: skip
    return made, -np.log(DECAY) * rate / lags


def _of_spectra(functions: Sequence[Function]) -> tuple[FRF, float]:
    """Spectra turned into correlations and back; auto spectra alone are a reference each."""
    f = functions[0].x
    step = _step(f)
    n_f = round(float(f[-1]) / step) + 1
    rows = np.zeros((n_f, len(functions)), complex)
    rows[-len(f) :] = np.array([g.values for g in functions]).T
    r = np.fft.irfft(rows, axis=0)
    lags = len(r) // 2
    rate = len(r) * step
    H = _transformed(r[:lags, :, None], rate)
    names = tuple(f"{g.output} {g.input}".strip() for g in functions)
    made = FRF(H, np.fft.rfftfreq(lags, 1 / rate), names, ("responses",), "receptance")
    return made, -np.log(DECAY) * rate / lags


def _transformed(r: np.ndarray, rate: float) -> np.ndarray:
    """Σ w(τ) r(τ) exp(-sτ) Δτ of lags (n, ...).

    What noise adds at lag zero is a constant, which the residual terms of the fit take.
    """
    w = window("exponential", len(r), DECAY)
    return np.fft.rfft(r * w[:, None, None], axis=0) / rate
