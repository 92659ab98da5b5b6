"""What the test itself does to a channel."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .effect import ChannelChange, Effect, Parameter


@dataclass(frozen=True, eq=False)
class SensorFault(Effect):
    """Gain and sign of one channel: what was recorded is ± e^x times the truth."""

    name = "sensor-fault"
    claim = "a channel's gain or sign is wrong"
    kind = "test"

    channel: int = 0
    n_outputs: int = 1
    sign: int = 1
    mask: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> list[dict[str, Any]]:
        """The factor on the channel, negative where its sign is wrong too."""
        row = super().reported(x, sd)[0]
        low, high = sorted(self.sign * row[k] for k in ("low", "high"))
        return [{**row, "value": self.sign * row["value"], "low": low, "high": high}]

    def outputs(self, x: np.ndarray) -> ChannelChange:
        """X / ln 10 (+ iπ / ln 10 where the sign is wrong) on that channel."""
        value, slope = np.zeros(self.n_outputs, complex), np.zeros((self.n_outputs, 1), complex)
        value[self.channel] = (x[0] + (1j * np.pi if self.sign < 0 else 0)) / np.log(10)
        slope[self.channel] = 1 / np.log(10)
        return ChannelChange(value, slope)


def sensor_fault(label: str, channel: int, n_outputs: int, sign: int, start: float) -> SensorFault:
    """A wrong gain (and sign) of one channel."""
    text = f"channel {label}" + (", sign reversed" if sign < 0 else "")
    unknown = Parameter("gain", "-", 0.0, 0.7, step=0.7, starts=(start,))
    return SensorFault(
        (unknown,), text, channels=(label,), places=2 * n_outputs,
        channel=channel, n_outputs=n_outputs, sign=sign,
    )  # fmt: skip
