"""Channels of a time recording put together: units to SI, inputs and outputs by what they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...dynamics.frf import Quantity
from ...ema.time_record import TimeRecord
from ...errors import ChladniError, FileError
from ..uff.uff_units import force_factor, numerator

BY_NAME = {  # what an array is by its name, and the unit where none is stated
    **dict.fromkeys(("force", "f", "hammer"), "N"),
    **dict.fromkeys(("acceleration", "accel", "acc", "a"), "m/s^2"),
    **dict.fromkeys(("velocity", "vel", "v"), "m/s"),
    **dict.fromkeys(("displacement", "disp", "d"), "m"),
}
SOUND = {"Pa": 1.0, "mPa": 1e-3}  # of a microphone: good for natural frequencies alone


@dataclass(frozen=True, eq=False)
class TimeChannel:
    """One channel of a file, as it stands there.

    ``values`` are (blocks, samples); ``label`` "" where the file has none; ``role`` "" where the
    unit decides: what pushes is an input, what moves an output.
    """

    label: str
    unit: str
    values: np.ndarray
    role: str = ""


def assembled(
    name: str, rate: float, channels: Sequence[TimeChannel]
) -> tuple[TimeRecord, list[str]]:
    """The record in SI, and notes of how it was read.

    Without any force it has no inputs: motions or sound that die away, or go on.
    """
    parts: dict[str, list[tuple[TimeChannel, Quantity | None, float]]] = {"input": [], "output": []}
    for k, channel in enumerate(channels):
        role, quantity, factor = _meaning(name, channel, k)
        parts[role].append((channel, quantity, factor))
    inputs, outputs = parts["input"], parts["output"]
    if not outputs or (inputs and any(c.unit in SOUND for c, *_ in outputs)):
        units = ", ".join(dict.fromkeys(c.unit for c in channels)) or "none"
        raise FileError(
            f"{name}: {len(inputs)} inputs and {len(outputs)} outputs among its {len(channels)} "
            f"channels (units: {units}); an FRF needs a force (N, lbf) and a motion (m/s^2, g, "
            "mm/s, ...)"
        )
    motions = {q for _, q, _ in outputs}
    if len(motions) > 1:
        raise FileError(f"{name}: its outputs are {' and '.join(sorted(map(str, motions)))}; a "
                        "file must have one kind of motion")  # fmt: skip
    kind: Quantity = motions.pop() or "accelerance"
    bases = {q for _, q, _ in inputs}
    if inputs and bases != {None}:
        if bases != {kind}:
            raise FileError(f"{name}: its base and its outputs are not the same kind of motion")
        kind = "transmissibility"
    labels, notes = _labels(name, inputs, outputs)
    every = np.stack([np.asarray(c.values, float) * f for c, _, f in (*inputs, *outputs)], axis=1)
    if not np.isfinite(every).all():
        raise FileError(f"{name}: a sample is not a number")
    try:
        force, response = every[:, : len(inputs)], every[:, len(inputs) :]
        n = len(inputs)
        record = TimeRecord(force, response, float(rate), labels[:n], labels[n:], kind)
    except ChladniError as error:
        raise FileError(f"{name}: {error}") from error
    return record, notes


def _meaning(name: str, channel: TimeChannel, k: int) -> tuple[str, Quantity | None, float]:
    """(role, quantity of a motion, factor to SI)."""
    called = channel.label or f"channel {k + 1}"
    force = force_factor(channel.unit)
    if force is not None:
        if channel.role == "output":
            raise FileError(f"{name}: {called} is in {channel.unit}, a force, and cannot be output")
        return "input", None, force
    if channel.unit in SOUND and channel.role != "input":
        return "output", None, SOUND[channel.unit]
    quantity, factor = numerator(channel.unit)
    if quantity is None:
        raise FileError(
            f"{name}: {called} is in {channel.unit or 'no unit'!r}; known are N, lbf, kgf for "
            "forces, m, mm, in, m/s, mm/s, m/s^2, g, ... for motions, and Pa of a microphone in "
            "a free decay"
        )
    return channel.role or "output", quantity, factor  # type: ignore[return-value]


def _labels(name: str, inputs: Sequence[tuple], outputs: Sequence[tuple]) -> tuple[tuple, list]:
    """Labels of inputs then outputs; made up, with a note, where the file has none."""
    held = [c.label for c, *_ in (*inputs, *outputs)]
    if all(held):
        for part in (held[: len(inputs)], held[len(inputs) :]):
            if twice := [x for x in dict.fromkeys(part) if part.count(x) > 1]:
                raise FileError(f"{name}: channel {twice[0]} occurs twice")
        return tuple(held), []
    made = tuple(f"{k + 1}:n" for k in range(len(held)))
    said = ", ".join(made[: len(inputs)]), ", ".join(made[len(inputs) :])
    note = (
        f"{name} names no places: its inputs are called {said[0]}, its outputs {said[1]}; name "
        f"them in a table {name.rpartition('.')[0]}.channels.csv"
    )
    return made, [note]


def from_arrays(name: str, arrays: dict[str, np.ndarray]) -> tuple[TimeRecord, list[str]]:
    """A record of named arrays: a rate, and a force beside a motion, or data with labels and units.

    ``rate`` (or fs, sampling_rate, dt, t); ``force`` and ``acceleration`` (velocity, displacement),
    each (n,), (channels, n) or (blocks, channels, n), with ``inputs`` and ``outputs`` as labels; or
    ``data`` with ``labels``, ``units`` and, if need be, ``roles``. The longest axis is time.
    """
    only_known(name, list(arrays))
    rest = {k.lower(): v for k, v in arrays.items()}
    rate = _rate(name, rest)
    notes: list[str] = []
    if "data" in rest:
        channels = _of_data(name, rest)
    else:
        channels, notes = _of_named(name, rest)
    if rest:
        raise FileError(f"{name}: {', '.join(rest)} is not used with the others")
    record, more = assembled(name, rate, channels)
    return record, notes + more


_RATES = ("rate", "fs", "sampling_rate", "sample_rate", "samplerate")
_AXES = (*_RATES, "dt", "ts", "t", "time", "time_s")
_MORE = ("inputs", "outputs", "data", "labels", "units", "roles")


def is_time(names: Sequence[str]) -> bool:
    """True for names of time data: one says the rate."""
    return any(n.lower() in _AXES for n in names)


def only_known(name: str, names: Sequence[str]) -> None:
    """Refuse arrays that nobody reads, before they are unpacked."""
    if unknown := [n for n in names if n.lower() not in (*_AXES, *_MORE, *BY_NAME)]:
        raise FileError(
            f"{name}: unknown array {', '.join(unknown)}; known of time data are rate, fs, dt, t; "
            f"force, acceleration, velocity, displacement; {', '.join(_MORE)}; of FRFs "
            "frequency_hz, values, outputs, inputs"
        )


def _rate(name: str, rest: dict[str, np.ndarray]) -> float:
    """Samples per second, taken out of the arrays."""
    for word in _AXES:
        if word not in rest:
            continue
        value = np.asarray(rest.pop(word), float).ravel()
        if word in (*_RATES, "dt", "ts"):
            if value.size != 1 or not (np.isfinite(value[0]) and value[0] > 0):
                raise FileError(f"{name}: {word} must be one number above zero")
            return float(value[0] if word in _RATES else 1 / value[0])
        return rate_of(name, value)
    raise FileError(f"{name}: no sampling rate; give rate (per second), dt or t")


def rate_of(name: str, t: np.ndarray) -> float:
    """Samples per second of an even axis of times (n,) [s]."""
    if len(t) < 2 or not np.isfinite(t).all():
        raise FileError(f"{name}: its time axis has {len(t)} samples")
    step = (t[-1] - t[0]) / (len(t) - 1)
    if step <= 0 or np.abs(t - t[0] - step * np.arange(len(t))).max() > max(
        0.01 * step, 1e-5 * abs(t[-1])
    ):
        raise FileError(f"{name}: its samples are not evenly spaced in time")
    return float(1 / step)


def _texts(rest: dict[str, np.ndarray], word: str) -> list[str]:
    return [str(x).strip() for x in np.ravel(rest.pop(word))] if word in rest else []


def _of_data(name: str, rest: dict[str, np.ndarray]) -> list[TimeChannel]:
    """Channels of one matrix."""
    units, labels, roles = (_texts(rest, w) for w in ("units", "labels", "roles"))
    x = _cube(name, "data", rest.pop("data"))
    count = x.shape[1]
    for word, texts in (("units", units), ("labels", labels), ("roles", roles)):
        if len(texts) not in ((count,) if word == "units" else (0, count)):
            raise FileError(f"{name}: {len(texts)} {word} for the {count} channels of data")
    labels, roles = labels or [""] * count, roles or [""] * count
    return [TimeChannel(labels[c], units[c], x[:, c], _role(name, roles[c])) for c in range(count)]


def _role(name: str, text: str) -> str:
    if text not in ("", "input", "output"):
        raise FileError(f"{name}: role {text!r}; there are input and output")
    return text


def _of_named(name: str, rest: dict[str, np.ndarray]) -> tuple[list[TimeChannel], list[str]]:
    """Channels of a force, if there is one, and a motion by the names of their arrays."""
    found = {w: _cube(name, w, rest.pop(w)) for w in list(rest) if w in BY_NAME}
    forces = [w for w in found if BY_NAME[w] == "N"]
    motions = [w for w in found if BY_NAME[w] != "N"]
    if len(forces) > 1 or len(motions) != 1:
        raise FileError(
            f"{name}: time data need one array force and one of acceleration, velocity or "
            f"displacement, or one such motion alone; there are {', '.join(found) or 'none'}"
        )
    Y = found[motions[0]]
    labels = [_texts(rest, "inputs"), _texts(rest, "outputs")]
    if not forces:
        note = f"{name} states no units: {motions[0]} is read in {BY_NAME[motions[0]]}"
        return _called(name, motions[0], Y, labels[1]), [note]
    F = found[forces[0]]
    notes = [f"{name} states no units: {forces[0]} is read in N, {motions[0]} in "
             f"{BY_NAME[motions[0]]}"]  # fmt: skip
    if not any(labels) and F.shape[:2] == Y.shape[:2] == (1, F.shape[1]) and F.shape[1] > 1:
        F, Y = F.transpose(1, 0, 2), Y.transpose(1, 0, 2)
        notes.append(
            f"{name}: {len(F)} rows in both arrays are {len(F)} blocks of one channel each"
        )
    out = _called(name, forces[0], F, labels[0]) + _called(name, motions[0], Y, labels[1])
    if F.shape[0] != Y.shape[0] or F.shape[2] != Y.shape[2]:
        raise FileError(f"{name}: {forces[0]} is {F.shape}, {motions[0]} {Y.shape}: blocks and "
                        "samples differ")  # fmt: skip
    return out, notes


def _called(name: str, word: str, x: np.ndarray, labels: Sequence[str]) -> list[TimeChannel]:
    """Channels of one array (blocks, channels, samples), their labels if there are any."""
    if len(labels) not in (0, x.shape[1]):
        raise FileError(f"{name}: {len(labels)} labels for the {x.shape[1]} channels of {word}")
    return [
        TimeChannel(labels[c] if labels else "", BY_NAME[word], x[:, c]) for c in range(x.shape[1])
    ]


def _cube(name: str, word: str, x: np.ndarray) -> np.ndarray:
    """(blocks, channels, samples); the longest axis is time."""
    x = np.asarray(x)
    if x.dtype.kind not in "biuf":
        raise FileError(f"{name}: {word} has {x.dtype}, not numbers")
    x = x.astype(float)
    if x.ndim == 0 or x.ndim > 3 or x.size == 0:
        raise FileError(f"{name}: {word} is {x.shape}; it must be (blocks, channels, samples)")
    x = np.moveaxis(x, int(np.argmax(x.shape)), -1)
    return x.reshape((1,) * (3 - x.ndim) + x.shape)
