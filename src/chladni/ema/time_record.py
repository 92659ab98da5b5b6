"""Forces and responses against time, as a front end recorded them (SI)."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import readonly
from ..dynamics.frf import Quantity
from ..errors import ShapeError
from ..results import ShownBriefly


@dataclass(frozen=True, eq=False, repr=False)
class TimeRecord(ShownBriefly):
    """Time histories of all channels of one test: hits or bursts as blocks, or one long stretch."""

    # (b, n_in, n) [N]; where the base was moved, its motion in the unit of the responses
    force: np.ndarray
    response: np.ndarray  # (b, n_out, n) [m], [m/s] or [m/s²] as ``quantity`` says
    rate: float  # samples per second
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    quantity: Quantity = "accelerance"  # of the response per input

    def __post_init__(self) -> None:
        b, _, n = self.force.shape if self.force.ndim == 3 else (0, 0, 0)
        due = ((b, len(self.inputs), n), (b, len(self.outputs), n))
        if (self.force.shape, self.response.shape) != due:
            raise ShapeError(
                f"force {self.force.shape} and response {self.response.shape} are (blocks, "
                f"channels, samples); the labels say {due}"
            )
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise ShapeError(f"a rate of {self.rate:g} samples per second is no rate")
        for name in ("force", "response"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def duration(self) -> float:
        """Duration of one block [s]."""
        return self.force.shape[2] / self.rate

    @property
    def channels(self) -> tuple[str, ...]:
        """Every channel in words, inputs first."""
        return (*(f"input {i}" for i in self.inputs), *(f"output {o}" for o in self.outputs))

    def cut(self, starts: np.ndarray, n: int) -> Self:
        """Blocks of n samples of a single stretch, from these samples on."""
        pieces = [
            np.stack([x[0, :, k : k + n] for k in starts]) for x in (self.force, self.response)
        ]
        return replace(self, force=pieces[0], response=pieces[1])

    def sel(self, blocks: np.ndarray) -> Self:
        """Some of the blocks."""
        return replace(self, force=self.force[blocks], response=self.response[blocks])


def overloaded(record: TimeRecord) -> dict[str, int]:
    """Channels that were clipped, and in how many blocks: {channel in words: blocks}.

    A clipped signal stays at its extreme for three samples or more after a steep rise. The round
    top of a coarsely quantised sine reaches its extreme by one step.
    """
    signals = np.concatenate([record.force, record.response], axis=1)
    found = {}
    for c, name in enumerate(record.channels):
        hit = sum(any(_flat_top(side) for side in (x, -x)) for x in signals[:, c])
        if hit:
            found[name] = hit
    return found


_STEPS = 4.0  # in quantisation steps: the top of a parabola, three samples wide, falls 2.8


def _flat_top(x: np.ndarray) -> bool:
    top = x.max()
    at = x >= top
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]])))
    starts, ends = edges[::2], edges[1::2]
    long = (ends - starts >= 3) & (starts > 0) & (ends < len(x))
    if not long.any() or top == x.min():
        return False
    near = np.unique(x[np.abs(x - top) < 0.05 * (top - x.min())])
    step = float(np.diff(near).min()) if len(near) > 1 else 0.0
    fall = np.minimum(top - x[starts[long] - 1], top - x[ends[long]])
    return bool((fall > _STEPS * step).any() or (len(near) == 1 and long.sum() > 1))
