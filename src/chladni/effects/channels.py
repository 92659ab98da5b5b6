"""Errors of measurement channels: gain and sign, and the place and direction of a force."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from .effect import ChannelChange, Effect, Parameter, ShapeChange, Traits
from .estimate import Estimate
from .family import Article, Family
from .search_context import Candidate, SearchContext

LN10 = np.log(10.0)


@dataclass(frozen=True, eq=False)
class ChannelGain(Effect):
    """One unknown real factor on some channels: the recorded signal is ± e^x times the true one.

    ``mask`` (n_out,) is 1 on these channels, ``sign`` that of the factor.
    """

    name = "gain"
    claim = "the gain of the measuring chain is unknown"
    kind = "nuisance"

    mask: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sign: int = 1

    def terms(self, x: np.ndarray) -> tuple[ChannelChange, ...]:
        """x / ln 10 (+ iπ / ln 10 for a reversed sign) on these channels."""
        value = self.mask * (x[0] + (1j * np.pi if self.sign < 0 else 0)) / LN10
        slope = (self.mask / LN10)[:, None].astype(complex)
        return (ChannelChange(value.astype(complex), slope),)


def channel_gain(n_outputs: int, sd: float) -> ChannelGain:
    """The unknown gain e^x, common to all channels."""
    unknown = Parameter("gain", "-", 0.0, sd, step=1.0)
    return ChannelGain((unknown,), "every channel", mask=np.ones(n_outputs))


@dataclass(frozen=True, eq=False)
class GaugeErrors(Effect):
    """Tilt and place of a force gauge: the motion there is φ_i + Σ_k x_k r_k, x ~ N(0, I).

    They change all lines and channels at once. H is linear in them, but ln H is not. If the gauge
    is near a node line, the response to a force at a small distance is several times as large.
    """

    name = "gauge-errors"
    claim = "the force does not act exactly where and in the direction that the test states"
    kind = "nuisance"

    rows: tuple[sp.csr_array, ...] = ()  # r_k (1, n), motion added by a standard deviation
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))  # 1 at its place, else 0

    def terms(self, x: np.ndarray) -> tuple[ShapeChange, ...]:
        """x_k r_k at the place of the gauge."""
        each = zip(self.rows, x.tolist(), np.eye(len(x)), strict=True)
        return tuple(ShapeChange(r, self.shapes, value, unit) for r, value, unit in each)


@dataclass(frozen=True, eq=False)
class SensorFault(ChannelGain):
    """Gain and sign of one channel."""

    name = "sensor-fault"
    claim = "a channel's gain or sign is wrong"
    kind = "test"
    traits = Traits(writable=False)

    @property
    def channel(self) -> int:
        """Position of the channel."""
        return int(self.mask.argmax())

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The factor on the channel, negative for a reversed sign."""
        (gain,) = self.parameters
        low, high = sorted(self.sign * v for v in gain.interval(x[0], self.widened(sd)[0]))
        return (Estimate(gain.name, self.sign * gain.value(x[0]), gain.unit, low, high),)


def sensor_fault(label: str, channel: int, n_outputs: int, sign: int, start: float) -> SensorFault:
    """A wrong gain (and sign) of one channel."""
    text = f"channel {label}" + (", sign reversed" if sign < 0 else "")
    unknown = Parameter("gain", "-", 0.0, 0.7, step=0.7, starts=(start,))
    return SensorFault(
        (unknown,), text, channels=(label,), trials_factor=2 * n_outputs,
        mask=np.eye(n_outputs)[channel], sign=sign,
    )  # fmt: skip


def candidates(context: SearchContext) -> list[Candidate]:
    """The two channels whose level or sign deviates most from the calibrated model.

    Each starts from that model and from the nominal one, because a wrong channel distorts the
    calibration. With a single channel only the sign is tested. Its level is that of the whole
    recording, and no other channel shows it to be wrong (``gain = "unknown"`` frees it).
    """
    if context.scan is None:
        return []
    deviation = context.scan.deviation
    n = deviation.shape[1]
    best = sorted((_departure(deviation[:, i].ravel(), i) for i in range(n)), reverse=True)[:2]
    return [
        Candidate(sensor_fault(context.labels[i], i, n, sign, start), np.array([start]), base)
        for _, i, sign, start in best
        if n > 1 or sign < 0
        for base in (context.null, context.bases[0])
    ]


def _departure(delta: np.ndarray, channel: int) -> tuple[float, int, int, float]:
    """Reduction of the mean square of δ = log10 H_model/H_test by one factor; channel, sign, ln."""
    flipped = np.mean(np.abs(delta.imag)) > np.pi / 2 / LN10
    start = float(np.clip(-np.median(delta.real) * LN10, -2.5, 2.5))
    left = delta + (start + (1j * np.pi if flipped else 0)) / LN10
    gain = np.mean(np.abs(delta) ** 2) - np.mean(
        np.abs(left.real + 1j * ((left.imag * LN10 + np.pi) % (2 * np.pi) - np.pi) / LN10) ** 2
    )
    return gain, channel, -1 if flipped else 1, start


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply one channel by a factor, for example 0.5, 2 or -1."""
    at = int(rng.integers(len(article.outputs)))
    gains = article.gains.copy()
    gains[at] = float(rng.choice([-1.0, 0.5, 0.7, 1.4, 2.0, -1.3]))
    factor = float(gains[at])
    channel = f"{article.outputs[at]}:+Z"
    truth = {"channel": channel, "value": factor, "parameters": {"gain": factor}}
    return replace(article, gains=gains, truth=truth)


FAMILY = Family(
    SensorFault,
    conceal,
    candidates=candidates,
    no_cards="a fault of the test is not in the deck",
    settled_by="put another sensor there",
)
