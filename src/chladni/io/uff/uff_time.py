"""The time histories of a universal file as one record: blocks, units, inputs, outputs."""

import numpy as np

from ...ema.time_record import TimeRecord
from ...errors import FileError
from ..time.time_channels import TimeChannel, assembled, rate_of
from .uff_accumulator import TimeSignal, UffAccumulator

_SI = {8: "m", 11: "m/s", 12: "m/s^2", 13: "N", 9: "N"}  # data types, where no unit is written


def time_record(uff: UffAccumulator) -> TimeRecord | None:
    """All time histories together; None, with a note of the reason, where they make no test.

    A dof recorded several times was recorded in blocks: the hits of a hammer, bursts. Those that
    were put together are no longer among the functions of the pile.
    """
    if not uff.time:
        return None
    blocks: dict[str, list[TimeSignal]] = {}
    for one in uff.time:
        blocks.setdefault(f"{one.label} {'force' if one.kind in (9, 13) else ''}", []).append(one)
    try:
        record, notes = _record(uff, list(blocks.values()))
    except FileError as error:
        uff.notes.append(f"no FRF can be estimated from the time data: {error}")
        return None
    if not record.inputs:  # responses alone: natural frequencies are taken from the functions
        return None
    used = {id(one.function) for one in uff.time}
    uff.functions[:] = [f for f in uff.functions if id(f) not in used]
    uff.notes += notes
    return record


def _record(uff: UffAccumulator, channels: list[list[TimeSignal]]) -> tuple[TimeRecord, list[str]]:
    name = uff.path.name
    rates, made = [], []
    for signals in channels:
        sizes = {(len(s.function.values), len(channels[0])) for s in signals}
        if sizes != {(len(channels[0][0].function.values), len(signals))}:
            raise FileError(f"{name}: {signals[0].label} has not the length and rate of "
                            f"{channels[0][0].label}")  # fmt: skip
        rates += [rate_of(name, s.function.x) for s in signals]
        first = signals[0]
        unit = first.function.unit
        if unit.strip().upper() in ("", "NONE"):
            unit = _SI.get(first.kind, "")
        values = np.stack([np.real(s.function.values) for s in signals])
        made.append(TimeChannel(first.label, unit, values))
    if max(rates) - min(rates) > 1e-4 * max(rates):
        raise FileError(f"{name}: its time histories differ in their rate")
    return assembled(name, float(np.median(rates)), made)
