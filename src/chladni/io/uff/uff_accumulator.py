"""What has been read of a universal file so far, in SI."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...ema.setup import Function
from .uff_units import FileUnits

Pair = tuple[str, str]  # output, input


@dataclass(frozen=True, eq=False)
class Channel:
    """One FRF in SI, and the number of the dataset it came from; ``quantity`` None: not said."""

    number: int
    frequency: np.ndarray  # (n,) [Hz]
    values: np.ndarray  # (n,)
    quantity: str | None


@dataclass(frozen=True, eq=False)
class Shape:
    """One mode: frequency [Hz], damping ratio, value by dof."""

    frequency: float
    damping: float
    values: dict[str, complex]


@dataclass(frozen=True, eq=False)
class TimeSignal:
    """One time history as the file has it; ``kind``: data type of its ordinate (13: a force)."""

    label: str
    kind: int
    function: Function


@dataclass
class UffAccumulator:
    """What has been read so far; filled dataset by dataset."""

    path: Path
    units: FileUnits = field(default_factory=FileUnits)
    frf: dict[Pair, Channel] = field(default_factory=dict)
    coherence: dict[Pair, np.ndarray] = field(default_factory=dict)  # input "": multiple
    functions: list[Function] = field(default_factory=list)
    time: list[TimeSignal] = field(default_factory=list)
    nodes: dict[int, np.ndarray] = field(default_factory=dict)
    systems: dict[int, np.ndarray] = field(default_factory=dict)
    turned: dict[int, int] = field(default_factory=dict)  # node -> system
    elements: list[tuple[int, ...]] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    title: str = ""  # first line of the first FRF

    def where(self, number: int, code: int) -> str:
        """A dataset as a sentence names it."""
        return dataset_name(self.path, number, code)


def dataset_name(path: Path, number: int, code: int) -> str:
    """A dataset as a sentence names it."""
    return f"{path.name}, dataset {number} (type {code})"
