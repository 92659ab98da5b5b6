"""The channels of a universal file as one FRF matrix: signs, one axis, one quantity, coherence."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...dynamics.frf import FRF
from ...errors import ChladniError, FileError, named
from .uff_accumulator import Channel, Pair, UffAccumulator

_SAME_LINE = 1e-5  # single precision abscissas: relative
NO_PLACE = (
    "the reference has node 0, so the file does not say where the force acts; its place belongs "
    "into sensors.csv"
)


def frf_matrix(uff: UffAccumulator, quantity: str | None) -> FRF | None:
    """The FRF matrix of all records, or None where the file holds none."""
    if not uff.frf:
        return None
    called = _one_sign(uff)
    channels: dict[Pair, Channel] = {}
    for pair, channel in uff.frf.items():
        name = called[pair]
        flips = sum(a != b for a, b in zip(pair, name, strict=True))
        if name in channels:
            raise FileError(
                f"{uff.path.name}, dataset {channel.number}: repeats {name[0]} / {name[1]} of "
                f"dataset {channels[name].number} with the other sign"
            )
        channels[name] = replace(channel, values=(-1) ** flips * channel.values)
    outputs, inputs = _rectangle(uff, list(channels))
    kept = {(i, j): channels[i, j] for j in inputs for i in outputs}
    frequency = _axis(uff, kept)
    kind = _quantity(uff, kept, quantity)
    values = np.array([[kept[i, j].values for j in inputs] for i in outputs]).transpose(2, 0, 1)
    if not values.any():
        raise FileError(f"{uff.path.name}: the FRFs are empty (every value is zero)")
    order = slice(None, None, -1) if frequency[0] > frequency[-1] else slice(None)
    if np.any(np.diff(frequency[order]) <= 0):
        k = int(np.argmin(np.diff(frequency[order])))
        raise FileError(
            f"{uff.path.name}: the frequencies do not increase near {frequency[order][k]:g} Hz"
        )
    coherence = _coherence(uff, {v: k for k, v in called.items()}, outputs, inputs, len(frequency))
    driven = tuple(re.sub("^0:(?!n)", "base:", j) if kind == "transmissibility" else j
                   for j in inputs)  # fmt: skip
    if kind != "transmissibility" and any(j.startswith("0:") for j in driven):
        uff.notes.append(f"{uff.path.name}: {NO_PLACE}")
    try:
        return FRF(
            values[order],
            frequency[order],
            outputs,
            driven,
            quantity=kind,  # type: ignore[arg-type]
            coherence=None if coherence is None else coherence[order],
        )
    except ChladniError as error:
        raise FileError(f"{uff.path.name}: {error}") from error


def _one_sign(uff: UffAccumulator) -> dict[Pair, Pair]:
    """Each pair -> the pair it is called by, where a dof occurs with both signs."""
    bare = lambda dof: re.sub(r":[+-]", ":", dof)  # noqa: E731
    first: dict[tuple[int, str], str] = {}
    for pair in uff.frf:
        for role, dof in enumerate(pair):
            first.setdefault((role, bare(dof)), dof)
    return {(i, j): (first[0, bare(i)], first[1, bare(j)]) for i, j in uff.frf}


def _rectangle(uff: UffAccumulator, pairs: list[Pair]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs measured for every input, in the order of the file; the rest goes into a note."""
    inputs = tuple(dict.fromkeys(j for _, j in pairs))
    everyone = tuple(dict.fromkeys(i for i, _ in pairs))
    outputs = tuple(i for i in everyone if all((i, j) in pairs for j in inputs))
    if not outputs:
        raise FileError(
            f"{uff.path.name}: no output was measured for all of the inputs {named(inputs)}; put "
            "each reference into its own file"
        )
    if left := [i for i in everyone if i not in outputs]:
        uff.notes.append(
            f"{len(left)} outputs not measured for every input left out: {named(left)}"
        )
    return outputs, inputs


def _axis(uff: UffAccumulator, kept: Mapping[Pair, Channel]) -> np.ndarray:
    """The one frequency axis of all channels [Hz]."""
    first = next(iter(kept.values()))
    f = first.frequency
    for channel in kept.values():
        other = channel.frequency
        if len(other) != len(f) or not np.allclose(other, f, rtol=_SAME_LINE, atol=1e-9):
            raise FileError(
                f"{uff.path.name}, dataset {channel.number}: its {len(other)} frequencies from "
                f"{other[0]:g} to {other[-1]:g} Hz are not the {len(f)} from {f[0]:g} to "
                f"{f[-1]:g} Hz of dataset {first.number}"
            )
    return f


def _quantity(uff: UffAccumulator, kept: Mapping[Pair, Channel], quantity: str | None) -> str:
    """What all channels are."""
    if quantity is not None:
        if any(channel.quantity not in (None, quantity) for channel in kept.values()):
            uff.notes.append(
                f"read as {quantity} as requested; the quantity in the file is ignored"
            )
        return quantity
    said = {channel.quantity: channel.number for channel in kept.values()}
    if len(said) > 1:
        mixed = " and ".join(f"{q} (dataset {n})" for q, n in said.items())
        raise FileError(f"{uff.path.name}: has {mixed}; a file must have one quantity")
    return str(next(iter(said)))


def _coherence(
    uff: UffAccumulator,
    spelt: Mapping[Pair, Pair],
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
    n_lines: int,
) -> np.ndarray | None:
    """(n_f, n_out, n_in), or None unless every channel has it."""
    if not uff.coherence:
        return None
    gamma = np.empty((n_lines, len(outputs), len(inputs)))
    for i, output in enumerate(outputs):
        for j, input in enumerate(inputs):
            i_said, j_said = spelt[output, input]
            found = uff.coherence.get((i_said, j_said), uff.coherence.get((i_said, "")))
            if found is None or len(found) != n_lines:
                uff.notes.append(f"no coherence for {output} / {input}, so no coherence is used")
                return None
            gamma[:, i, j] = found
    return gamma
