"""Time histories as a universal file: dataset 58b, a record a channel and block.

Single precision has the 24 bits a converter has.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from ...ema.time_record import TimeRecord
from ...errors import FileError
from .uff_function import Axis, FunctionSet
from .write_uff import MOTION, NEWTON, binary_set, head_records, uff_code, write_sets


def write_time_uff(
    path: str | Path,
    record: TimeRecord,
    nodes: Mapping[int, np.ndarray] | None = None,
    title: str = "NONE",
) -> None:
    """All channels of all blocks, inputs first; SI."""
    if record.quantity == "transmissibility":
        raise FileError(f"time data of {record.quantity} cannot be written as a universal file")
    write_sets(path, nodes or {}, title, _records(record, title))


def _records(record: TimeRecord, title: str) -> Iterator[bytes]:
    motion = MOTION[record.quantity]
    for block in range(len(record.force)):
        for label, x in zip(record.inputs, record.force[block], strict=True):
            yield _record(label, x, record.rate, NEWTON, title)
        for label, x in zip(record.outputs, record.response[block], strict=True):
            yield _record(label, x, record.rate, motion, title)


def _record(label: str, x: np.ndarray, rate: float, ordinate: Axis, title: str) -> bytes:
    """Mark, head and samples of one channel, evenly spaced, in single precision."""
    made = FunctionSet(
        function=1, response=uff_code(label), reference=(0, 0), due=len(x),
        x=np.arange(len(x)) / rate, y=x.astype("<f4"), abscissa=Axis(17, "s"), ordinate=ordinate,
        denominator=Axis(),
    )  # fmt: skip
    return binary_set(head_records(made, title, even=True, single=True), made.y.tobytes())
