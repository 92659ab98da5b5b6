"""Time data in: WAV, MATLAB's MAT, CSV; what says which channel is what (SI, pickles refused).

A file that cannot say it itself has a table beside it, ``NAME.channels.csv``: ``channel`` (number
from 1, or its name in the file), ``label`` (412:+Z), ``unit``, and if need be ``role`` (input,
output) and ``scale`` (unit per number of the file; of WAV, per full scale).
"""

import re
from math import prod
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...ema.time_record import TimeRecord
from ...errors import FileError, named
from ..damage import DAMAGED
from ..encoded_text import encoding_of
from ..file_size import refuse_large
from ..tables.csv_table import delimiter, first_line, read_table
from .time_channels import TimeChannel, assembled, from_arrays, rate_of

_UNSTATED = 0xFFFFFFFF  # length of a chunk that is not known yet
Read = tuple[TimeRecord, list[str]]


def read_wav(path: Path) -> Read:
    """A WAV of any width; its numbers are shares of full scale: a table of channels is needed."""
    from scipy.io import wavfile

    _refuse_cut(path)
    try:
        rate, x = wavfile.read(path)
    except DAMAGED as error:
        why = "its header has 0 channels" if isinstance(error, ZeroDivisionError) else error
        raise FileError(f"{path.name} cannot be read as WAV: {why}") from error
    x = np.atleast_2d(x.T)
    if not described(path).is_file():
        raise FileError(
            f"{path.name} has {len(x)} channels without units; add the file "
            f"{described(path).name} with the columns channel, label, unit and scale (units per "
            "full scale)"
        )
    values = x.astype(float)
    if x.dtype.kind == "u":
        values = values / 128.0 - 1.0  # eight bits are written without sign
    elif x.dtype.kind == "i":
        values /= -float(np.iinfo(x.dtype).min)
    raw = [TimeChannel(str(k + 1), "", v[None]) for k, v in enumerate(values)]
    return _assembled(path, float(rate), raw)


def _refuse_cut(path: Path) -> None:
    """Refuse a WAV whose chunk of samples is longer than what is left of the file.

    A chunk is a name, its length in bytes, and its bytes, padded to an even number (Microsoft,
    Multimedia Programming Interface and Data Specifications 1.0, 1991). A recorder that does not
    know the length yet writes ones in all its bits.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        order: Literal["little", "big"] = "big" if file.read(12)[:4] == b"RIFX" else "little"
        while len(head := file.read(8)) == 8:
            length, left = int.from_bytes(head[4:], order), size - file.tell()
            if head[:4] != b"data":
                file.seek(length + length % 2, 1)
                continue
            if left < length < _UNSTATED:
                raise FileError(
                    f"{path.name} states {length} bytes of samples, but has {left}: it is cut off "
                    "or damaged"
                )
            return


def mat_variables(path: Path) -> dict[str, Any]:
    """Variables of a MAT of MATLAB 4 to 7, axes of length one left out."""
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import MatReadError

    with path.open("rb") as file:
        head = file.read(128)
    if b"MATLAB 7.3" in head or head[:4] == b"\x89HDF":
        raise FileError(
            f"{path.name} has the format MATLAB 7.3 (HDF5), which is not supported; save it with "
            "-v7"
        )
    try:
        refuse_large(path, sum(8 * prod(shape) for _, shape, _ in whosmat(str(path))), "unpacks to")
        held = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except (*DAMAGED, MatReadError) as error:
        raise FileError(f"{path.name} cannot be read as MAT: {error}") from error
    return {k: v for k, v in held.items() if not k.startswith("__")}


def time_of_mat(path: Path, held: dict[str, Any]) -> Read:
    """Time data of a MAT: named arrays, or records with x_values and y_values (Testlab).

    Raises
    ------
    FileError
        If the variables do not say rate and channels.
    """
    records = [r for v in held.values() for r in np.ravel(np.array(v, dtype=object))
               if hasattr(r, "x_values") and hasattr(r, "y_values")]  # fmt: skip
    if records:
        return _assembled(path, *_testlab(path.name, records))
    return named_arrays(path, mat_arrays(held))


def mat_arrays(held: dict[str, Any]) -> dict[str, np.ndarray]:
    """Variables as arrays, a cell of texts as a row of them."""
    arrays = {name: np.asarray(value) for name, value in held.items()}
    return {
        name: np.array([str(x) for x in array.ravel()]) if array.dtype.kind == "O" else array
        for name, array in arrays.items()
    }


def named_arrays(path: Path, arrays: dict[str, np.ndarray]) -> Read:
    """Time data as named arrays; labels from the table of channels where there is one."""
    record, notes = from_arrays(path.name, arrays)
    if not described(path).is_file():
        return record, notes
    stacks = np.concatenate([record.force, record.response], axis=1)
    motion = {"receptance": "m", "mobility": "m/s"}.get(record.quantity, "m/s^2")
    units = ["N"] * len(record.inputs) + [motion] * len(record.outputs)
    raw = [TimeChannel(str(k + 1), u, stacks[:, k]) for k, u in enumerate(units)]
    return _assembled(path, record.rate, raw)


def _testlab(name: str, records: list[Any]) -> tuple[float, list[TimeChannel]]:
    """Rate and channels of records {x_values: {start_value, increment}, y_values: {values, ...}}.

    Layout of MAT exports of Simcenter Testlab.
    """
    channels, rates = [], []
    for k, record in enumerate(records):
        x, y = record.x_values, record.y_values
        if np.asarray(getattr(y, "values", 0.0)).dtype.kind == "c":
            raise FileError(
                f"{name}: record {k + 1} is complex, a function of frequency; export FRFs as a "
                "universal file"
            )
        try:
            rates.append(1 / float(x.increment))
            values = np.asarray(y.values, float)
        except (AttributeError, TypeError, ValueError, ZeroDivisionError) as error:
            raise FileError(f"{name}: record {k + 1} has no increment or no values") from error
        unit = str(getattr(getattr(y, "quantity", None), "label", "") or "")
        about = getattr(record, "function_record", None)
        called = getattr(about, "name", "") if about is not None else ""
        columns = values[:, None] if values.ndim == 1 else values
        names = [str(n) for n in np.ravel(called)] if np.size(called) else []
        names = names if len(names) == columns.shape[1] else [""] * columns.shape[1]
        channels += [
            TimeChannel(_dof(n), unit, c[None]) for n, c in zip(names, columns.T, strict=True)
        ]
    lengths = {c.values.shape[1] for c in channels}
    if len(lengths) > 1 or np.ptp(rates) > 1e-6 * max(rates):
        raise FileError(f"{name}: its records differ in length or rate")
    return rates[0], channels


def _dof(text: str) -> str:
    """'shaker:12:+Z' -> '12:+Z'; any other name as it stands."""
    found = re.search(r"(\d+:[+-]?[XYZ]|\d+:n)$", text.strip())
    return found[1] if found else text.strip()


def read_time_csv(path: Path) -> Read:
    """Columns ``time_s``, if need be ``block``, and one a channel, headed ``412:+Z [m/s^2]``."""
    cut = delimiter(path)
    head = [cell.strip() for cell in first_line(path).split(cut)]
    try:
        with path.open(encoding=encoding_of(path)) as file:
            lines = file if cut == "," else (line.replace(",", ".") for line in file)
            rows = np.loadtxt(lines, delimiter=cut, skiprows=1, ndmin=2)
    except ValueError as error:
        raise FileError(f"{path.name}: a line after the first is not {len(head)} numbers "
                        f"({str(error).split(';')[0]})") from error  # fmt: skip
    if rows.size == 0 or rows.shape[1] != len(head):
        raise FileError(f"{path.name}: {rows.shape[1] if rows.size else 0} columns of numbers, the "
                        f"header has {len(head)}")  # fmt: skip
    names = [h.lower() for h in head]
    t = rows[:, names.index("time_s")]
    block = rows[:, names.index("block")] if "block" in names else np.zeros(len(rows))
    pieces = [np.flatnonzero(block == b) for b in dict.fromkeys(block.tolist())]
    if len({len(p) for p in pieces}) > 1:
        raise FileError(f"{path.name}: its blocks differ in length")
    rate = rate_of(path.name, t[pieces[0]])
    raw = []
    for k, cell in enumerate(head):
        if names[k] in ("time_s", "block"):
            continue
        said = re.fullmatch(r"(.*?)\s*\[(.*)\]", cell)
        label, unit = (said[1], said[2]) if said else (cell, "")
        raw.append(TimeChannel(label, unit, np.stack([rows[p, k] for p in pieces])))
    return _assembled(path, rate, raw)


def described(path: Path) -> Path:
    """The table of channels that belongs to a file."""
    return path.with_name(f"{path.stem}.channels.csv")


def _assembled(path: Path, rate: float, raw: list[TimeChannel]) -> Read:
    """The record of the channels, under the words of its table of channels, if it has one."""
    if not described(path).is_file():
        return assembled(path.name, rate, raw)
    channels, left = _described(path, raw)
    record, notes = assembled(path.name, rate, channels)
    if left:
        said = f"{described(path).name} has no line for channel {named(left)}, which is not used"
        notes = [*notes, said]
    return record, notes


def _described(path: Path, raw: list[TimeChannel]) -> tuple[list[TimeChannel], list[str]]:
    """The channels that the table of channels names, and the names of the others."""
    table = read_table(described(path), ("channel", "label", "unit"), ("role", "scale"))
    called = {c.label: k for k, c in enumerate(raw)} | {str(k + 1): k for k in range(len(raw))}
    out, lines = [], dict[int, int]()
    for k, line in enumerate(table.line):
        where = f"{table.path.name}, line {line}"
        word = table.columns["channel"][k]
        if word not in called:
            raise FileError(
                f"{where}: no channel {word!r} in {path.name}; there are 1 to {len(raw)}"
            )
        at = called[word]
        if at in lines:
            raise FileError(f"{where}: channel {word} occurs twice, first in line {lines[at]}")
        lines[at] = line
        role = table.columns["role"][k] if "role" in table else ""
        if role not in ("", "input", "output"):
            raise FileError(f"{where}: role {role!r}; there are input and output")
        scale = table.number("scale", k, 1.0) if "scale" in table else 1.0
        label = table.columns["label"][k]
        if not label:
            raise FileError(f"{where}: channel {word} has no label")
        unit = table.columns["unit"][k] or raw[at].unit
        out.append(TimeChannel(label, unit, scale * raw[at].values, role))
    return out, [c.label or str(k + 1) for k, c in enumerate(raw) if k not in lines]
