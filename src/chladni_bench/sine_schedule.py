"""The lines of a stepped-sine test, how long each is waited for and measured.

Echaniz Granado (2015), section 4.2.5 and table 3.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Stage:
    """One range of a stepped-sine test: lines per octave, cycles to wait and to measure.

    ``share`` is the force there, of the level of the test.
    """

    low: float  # [Hz]
    high: float  # [Hz]
    per_octave: float
    delay: float  # cycles
    measure: float = 20.0  # cycles
    share: float = 1.0

    def lines(self) -> np.ndarray:
        """Lines of the stage, its upper end left out [Hz]."""
        count = round(self.per_octave * float(np.log2(self.high / self.low)))
        return self.low * (self.high / self.low) ** (np.arange(count) / count)


TABLE_3 = (
    Stage(10, 20, 50, 10),
    Stage(20, 50, 200, 30),
    Stage(50, 100, 200, 80, share=0.7),
    Stage(100, 200, 200, 120, share=0.5),
    Stage(200, 400, 200, 300, share=0.2),
)  # Echaniz Granado 2015, table 3, five sweeps; the shares are ours: the thesis has no figures


def stage_lines(stages: Sequence[Stage]) -> np.ndarray:
    """All lines of a stepped-sine test, the upper end of the last stage included [Hz]."""
    return np.r_[np.concatenate([s.lines() for s in stages]), float(stages[-1].high)]


@dataclass(frozen=True)
class SineLine:
    """One line: frequency [Hz], cycles to wait, cycles to measure, share of the level."""

    frequency: float
    delay: float
    measure: float
    share: float

    @property
    def seconds(self) -> float:
        """How long it takes [s]."""
        return (self.delay + self.measure) / self.frequency


def dwells_of(
    stages: Sequence[Stage], band: tuple[float, float] = (0.0, np.inf)
) -> tuple[SineLine, ...]:
    """Every line of the stages within a band, in the order of the sweep."""
    out = [SineLine(float(f), s.delay, s.measure, s.share) for s in stages for f in s.lines()]
    last = stages[-1]
    out.append(SineLine(float(last.high), last.delay, last.measure, last.share))
    return tuple(line for line in out if band[0] <= line.frequency <= band[1])


def stages_for(low: float, high: float, delay: float = 0.0) -> tuple[Stage, ...]:
    """Table 3 on another band: its ranges below 400 Hz, above them the last one octave by octave.

    The minimum wait is ``delay`` cycles. The table belongs to a tailgate with a damping of 1 % in
    its lowest modes, and e^(-2πζN) of a transient remains after N cycles.

    The lines begin at ``low`` and end at ``high`` [Hz]; below 10 Hz the first range is that of
    10 Hz.
    """
    stages: list[Stage] = []
    start = low
    ranges = [*TABLE_3]
    while ranges[-1].high < high:
        end = ranges[-1]
        ranges.append(Stage(end.high, 2 * end.high, end.per_octave, end.delay, share=end.share))
    for one in ranges:
        if start < min(one.high, high):
            stop = min(one.high, high)
            wait = max(one.delay, delay)
            stages.append(Stage(start, stop, one.per_octave, wait, one.measure, one.share))
            start = stop
    return tuple(stages)
