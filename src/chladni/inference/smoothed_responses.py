"""A recording and the responses of a model on the same wide lines.

Both are smoothed along frequency by Gaussian weights. A peak is then as high as the area below it,
so that damping hardly matters and no mode need be identified.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from ..dynamics.frf import FRF
from ..dynamics.modal_sum import modal_sum
from ..ema.correlation import log10, wrapped
from ..ema.finding import Finding
from ..ema.identification import DERIVATIVES
from ..ema.shape_faults import SHIFT
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled

WIDTH = 0.06  # of a frequency: standard deviation of the smoothing
LEAST_LINES, MOST_LINES = 20, 4000  # of the recording, of the model
DAMPING = 0.01  # of the model; the smoothing is several times as wide
RIGID = 1e-3  # of the highest frequency: below are rigid motions
LN10 = np.log(10.0)
TINY = 1e-9  # Q of a recording that is the model's own
EXPLAINED = 1 / 2  # of Q as declared, and of ``CHANCE``: what an error that is named may leave
CHANCE = (np.pi / LN10) ** 2 / 3  # Q of responses of one size whose phases have nothing in common


Average = Literal["median", "mean"]


@dataclass(frozen=True)
class Hypothesis:
    """One way of reading a recording: its Q, Q as declared, and what it would mean."""

    Q: float
    declared: float
    finding: Finding
    over: Average = "median"  # of the outputs, in Q

    @property
    def share(self) -> float:
        """Its Q over Q as declared."""
        return self.Q / self.declared


def against(Q: float, declared: float) -> str:
    """Q of a hypothesis in words."""
    return f"smoothed Q against the model is {Q:.2g}, as declared {declared:.2g}."


@dataclass(frozen=True, eq=False)
class Reading:
    """A recording as it is read, the model that is to answer likewise, and the channels on it."""

    frf: FRF
    lines: np.ndarray  # (n_f,) bool, those to look at
    model: Modelled  # of the deck as it was tested, a little beyond the band at least
    outputs: MeasuredDofs
    inputs: MeasuredDofs

    def smoothed(self) -> "Smoothed | None":
        """A recording and a model on wide lines; None where lines or modes are too few."""
        frf, modes = self.frf, self.model.modes
        k = self.lines & (frf.frequency > 0) & np.isfinite(frf.values).all(axis=(1, 2))
        f, H = frf.frequency[k], frf.values[k]
        if len(f) < LEAST_LINES or f[-1] < f[0] * (1 + WIDTH) ** 3 or not len(modes):
            return None
        log_test = log10_of(np.einsum("sf,foi->soi", _weights(f, f), H))
        level = float(np.median(log_test.real))
        some = f[:: -(-len(f) // MOST_LINES)]
        omega = np.where(modes.frequency < RIGID * f[-1], 0.0, 2 * np.pi * modes.frequency)
        built, weights = self.model.structure, _weights(f, some)
        phi_o, drive = (
            self.outputs.rows(built) @ modes.shapes,
            self.inputs.loads(built) @ modes.shapes,
        )
        return Smoothed(self, some, weights, log_test - level, level, phi_o, drive, omega)


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A recording on a few wide lines, and the model that is to answer likewise."""

    reading: Reading
    f: np.ndarray  # (n_f,) lines on which the model is evaluated [Hz]
    weights: np.ndarray  # (n_s, n_f) of the smoothing
    log_test: np.ndarray  # (n_s, n_out, n_in) log10 of the smoothed recording, less its level
    level: float  # median of log10 |H|
    # phi_o, drive: (n_out, r), (n_in, r) shapes at outputs, loads of the inputs
    phi_o: np.ndarray
    drive: np.ndarray
    omega: np.ndarray  # (r,) [rad/s], 0 of rigid motions

    def answers(
        self,
        scale: float = 1.0,
        delay: float = 0.0,
        drive: np.ndarray | None = None,
        shifts: Sequence[float] = SHIFT,
    ) -> Iterator[np.ndarray]:
        """Σ_r φ_or φ_ir s^k e^(-sτ) / (ω_r² + 2 ζ ω_r s + s²), smoothed (n_s, n_out, n_in).

        Lines are times ``scale``; the model's frequencies are shifted by each of ``shifts`` (ln).
        """
        read, load = self.reading, self.drive if drive is None else drive
        direct = read.outputs.moved_with_base(read.inputs) if drive is None else 0.0
        for shift in shifts:
            s = 2j * np.pi * self.f[:, None] * scale / np.exp(shift)
            above = s ** DERIVATIVES[read.frf.quantity] * np.exp(-s * delay)
            D = self.weights @ (above / (self.omega**2 + 2 * DAMPING * self.omega * s + s**2))
            yield modal_sum(self.phi_o, D, load) + direct

    @cached_property
    def as_declared(self) -> tuple[float, float]:
        """Q, and how many times as large the recording is as the model."""
        scored = [(self.score(H), float(np.median(log10_of(H).real))) for H in self.answers()]
        Q, level = min(scored)
        return Q, float(10 ** (self.level - level))

    def score(self, H: np.ndarray, inputs: slice = slice(None), over: Average = "median") -> float:
        """Q of responses (n_s, n_out, n_in)."""
        average = np.median if over == "median" else np.mean
        Q = average(mean_squares(level_free(H) - self.log_test[:, :, inputs]))
        return float(np.maximum(Q, TINY))


def log10_of(H: np.ndarray) -> np.ndarray:
    """log10 of responses, -150 of zero."""
    return log10(np.where(H == 0, 1e-150, H))


def level_free(H: np.ndarray) -> np.ndarray:
    """Log10 of responses, less the median of its real part."""
    x = log10_of(H)
    return np.asarray(x - np.median(x.real))


def mean_squares(delta: np.ndarray) -> np.ndarray:
    """Mean square over lines of log10 ratios (n_s, ...), phase wrapped."""
    return np.asarray((np.abs(wrapped(delta)) ** 2).mean(axis=0))


def _weights(every: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Gaussian weights on lines f (n_s, n_f), of unit sum, about centres one width apart."""
    centre = np.exp(np.arange(np.log(every[0]) + WIDTH, np.log(every[-1]), WIDTH))[:, None]
    weights = np.exp(-0.5 * ((f - centre) / (WIDTH * centre)) ** 2) * np.gradient(f)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
