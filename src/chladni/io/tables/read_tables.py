"""Recordings as tables in: FRF and modal models in CSV and NPZ, poles in CSV (SI)."""

import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast, get_args

import numpy as np

from ...arrays import measurable
from ...dynamics.frf import FRF, MOTION_OVER_FORCE, Quantity
from ...ema.response_correlations import of_responses
from ...ema.setup import PoleTable, Recording
from ...ema.time_record import TimeRecord
from ...errors import ChladniError, FileError, named
from ..damage import DAMAGED
from ..file_size import refuse_large
from ..time.read_time import (
    mat_arrays,
    mat_variables,
    named_arrays,
    read_time_csv,
    read_wav,
    time_of_mat,
)
from ..time.time_channels import is_time, only_known
from .array_fields import numbers_of, word_of, words_of
from .csv_table import CsvTable, distinct_texts, files_next_to, names_of, read_table
from .read_shapes import (
    MODAL,
    MODAL_OPTIONAL,
    modal_of_arrays,
    read_result_modes,
    read_shape_table,
)

_UNIVERSAL = (".uff", ".unv", ".ufb", ".uf", ".uff58", ".bunv")
_RESULTS = (".op2", ".pch", ".punch")
ENDINGS = (".npz", ".csv", ".wav", ".mat", *_RESULTS, *_UNIVERSAL)
_CHANNEL = ("frequency_hz", "output", "input")
_CARTESIAN = ("real", "imag")
_PHASE = {"phase_deg": np.pi / 180, "phase_rad": 1.0}  # radians each
_FRF = (*_CHANNEL, *_CARTESIAN)
_FRF_OPTIONAL = ("coherence", "variance", "level", "article")
_POLES = ("mode", "frequency_hz")
_POLES_OPTIONAL = ("frequency_sd_hz", "damping", "state")
_NPZ = ("frequency_hz", "values", "outputs", "inputs")
_NPZ_OPTIONAL = ("coherence", "variance", "quantity", "level", "article")


def read_recordings(path: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """Contents of a file, by its ending: .uff .unv .ufb .uf .uff58, .npz, .csv, .wav, .mat, .op2.

    A CSV, NPZ or MAT holds FRFs, modes with shapes, poles (CSV) or time data; WAV holds time data;
    OP2 and punch files hold modes of another program. Force over motion (apparent mass, dynamic
    stiffness, impedance) of one force at a time is turned into its reciprocal.
    """
    if quantity in MOTION_OVER_FORCE and Path(path).suffix.lower() not in _UNIVERSAL:
        read = read_recordings(path, MOTION_OVER_FORCE[quantity])
        return tuple(r.reciprocal(quantity) for r in read)
    path = Path(path)
    ending = path.suffix.lower()
    if path.is_file():
        refuse_large(path)
    elif ending in ENDINGS and ending not in _UNIVERSAL:
        raise FileError(f"no file {path}; the folder has {named(files_next_to(path))}")
    if ending == ".mat":
        return (_read_mat(path, quantity),)
    if ending == ".wav" or (ending == ".csv" and "time_s" in names_of(path)):
        return (_timed(path, _TIMED[ending](path), quantity),)
    if ending == ".npz":
        return (read_npz(path, quantity),)
    if ending == ".csv":
        return read_csv(path, quantity)
    if ending in _UNIVERSAL:
        from ..uff.read_uff import read_uff

        found = read_uff(path, quantity)
        return (_as_quantity(found, quantity),)
    if ending in _RESULTS:
        return (read_result_modes(path),)
    raise FileError(
        f"{path.name}: recordings end in .uff, .unv, .npz, .csv, .mat, .wav, .op2 or .pch, not "
        f"{ending!r}"
    )


_TIMED = {".wav": read_wav, ".csv": read_time_csv}


def _read_mat(path: Path, quantity: str | None) -> Recording:
    """FRFs by the names of NPZ, else time data; axes of length one, which it loses, come back."""
    held = mat_variables(path)
    arrays = mat_arrays(held)
    if not {"frequency_hz", "values"} & set(arrays):
        return _timed(path, time_of_mat(path, held), quantity)
    _only_known(path, list(arrays))
    words = {k: np.char.strip(np.atleast_1d(arrays[k]).astype(str)) for k in _TEXTS if k in arrays}
    arrays |= words
    due = [np.size(arrays[k]) for k in ("frequency_hz", "outputs", "inputs") if k in arrays]
    for name in ("values", "coherence", "variance"):
        if name in arrays and arrays[name].shape == tuple(n for n in due if n != 1):
            arrays[name] = arrays[name].reshape(due)
    if "frequency_hz" in arrays:
        arrays["frequency_hz"] = np.atleast_1d(arrays["frequency_hz"])
    return _of_arrays(path, arrays, quantity)


_TEXTS = ("outputs", "inputs", "quantity", "article")


def _timed(path: Path, read: tuple[TimeRecord, list[str]], quantity: str | None) -> Recording:
    record, notes = read
    if not record.inputs:
        return Recording(path.name, functions=of_responses(record), notes=tuple(notes))
    return _as_quantity(Recording(path.name, time=record, notes=tuple(notes)), quantity)


def _as_quantity(r: Recording, quantity: str | None) -> Recording:
    """Time data read as the quantity that was asked for, whatever its units say."""
    if r.time is None or quantity in (None, r.time.quantity):
        return r
    if "transmissibility" in (quantity, r.time.quantity):
        raise FileError(
            f"{r.name}: its units make it {r.time.quantity}, which cannot be read as {quantity}"
        )
    note = f"read as {quantity} as requested; its units are ignored"
    time = replace(r.time, quantity=cast(Quantity, quantity))
    return replace(r, time=time, notes=(*r.notes, note))


def read_csv(path: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """FRFs (one recording per article and level) or poles; the header decides."""
    path = Path(path)
    head = set(names_of(path)) - {""} if path.is_file() else set()
    if {"label", "mode"} <= head:
        return (read_shape_table(path),)
    if head and head.isdisjoint({*_CARTESIAN, "output", "input", "magnitude"}):
        if "mode" not in head:
            raise FileError(
                f"{path.name}, line 1: neither FRFs (columns {', '.join(_FRF)}; or magnitude and "
                f"phase_deg or phase_rad for the last two) nor poles (columns mode, frequency_hz) "
                "nor shapes (columns label, mode, frequency_hz, real); there are "
                f"{', '.join(sorted(head))}"
            )
        return (Recording(name=path.name, poles=read_poles(path)),)
    parts = _CARTESIAN
    if "magnitude" in head:
        parts = ("magnitude", next((k for k in _PHASE if k in head), "phase_deg"))
    table = read_table(path, (*_CHANNEL, *parts), _FRF_OPTIONAL)
    if quantity is None:
        raise FileError(f"{path.name} does not say its quantity: one of {_quantities()}")
    numbers = {k: table.numbers(k) for k in ("frequency_hz", *_NUMERIC) if k in table}
    values = _responses(table, parts)
    article = table.columns.get("article", [""] * len(table.line))
    level = numbers.get("level", np.full(len(table.line), np.nan))
    for row in np.flatnonzero(level < 0):
        _amplitude(f"{path.name}, line {table.line[row]}", level[row])
    groups: dict[tuple[str, float], list[int]] = {}
    for k, key in enumerate(zip(article, np.nan_to_num(level, nan=-1.0).tolist(), strict=True)):
        groups.setdefault(key, []).append(k)
    return tuple(
        _recording(table, values, numbers, np.array(rows), key, quantity)
        for key, rows in groups.items()
    )


_NUMERIC = ("coherence", "variance", "level")


def _responses(table: CsvTable, parts: tuple[str, str]) -> np.ndarray:
    """Complex responses of every row (n,)."""
    one, other = (table.numbers(k) for k in parts)
    if parts == _CARTESIAN:
        return one + 1j * other
    for k in np.flatnonzero(one < 0):
        raise FileError(
            f"{table.path.name}, line {table.line[k]}: a magnitude cannot be {one[k]:g}; convert "
            "decibels to a ratio"
        )
    return one * np.exp(1j * _PHASE[parts[1]] * other)


def _quantities() -> str:
    return ", ".join(get_args(Quantity))


def _recording(
    table: CsvTable,
    values: np.ndarray,
    numbers: dict[str, np.ndarray],
    rows: np.ndarray,
    key: tuple[str, float],
    quantity: str,
) -> Recording:
    """The rows of one article and level as a recording."""
    article, level = key
    said = [f"article {article}"] * bool(article) + [f"level {level:g}"] * (level >= 0)
    name = ", ".join([table.path.name, *said])
    outputs, i = distinct_texts([table.columns["output"][k] for k in rows])
    inputs, j = distinct_texts([table.columns["input"][k] for k in rows])
    frequency, f = np.unique(numbers["frequency_hz"][rows], return_inverse=True)
    shape = (len(frequency), len(outputs), len(inputs))
    count = np.zeros(shape, int)
    np.add.at(count, (f, i, j), 1)
    _complete(table, rows, count, frequency, outputs, inputs, (f, i, j))

    def array(column: np.ndarray) -> np.ndarray:
        cube = np.empty(shape, column.dtype)
        cube[f, i, j] = column[rows]
        return cube

    extra = {n: array(numbers[n]) for n in ("coherence", "variance") if n in numbers}
    frf = _frf(name, array(values), frequency, outputs, inputs, quantity, **extra)
    return Recording(name=name, frf=frf, level=level if level >= 0 else None, article=article)


def _complete(
    table: CsvTable,
    rows: np.ndarray,
    count: np.ndarray,
    frequency: np.ndarray,
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
    place: tuple[np.ndarray, ...],
) -> None:
    """Every channel at every frequency, once."""
    if (count == 1).all():
        return
    k, i, j = (int(v[0]) for v in np.nonzero(count != 1))
    channel = f"{outputs[i]} / {inputs[j]}"
    if count[k, i, j] == 0:
        raise FileError(
            f"{table.path.name}: {channel} has no line at {frequency[k]:g} Hz, but others have; "
            "all channels need the same frequencies"
        )
    twice = np.flatnonzero((place[0] == k) & (place[1] == i) & (place[2] == j))[1]
    raise FileError(
        f"{table.path.name}, line {table.line[rows[twice]]}: {channel} at {frequency[k]:g} Hz "
        "occurs twice; several levels or articles need a column level or article"
    )


def _frf(
    name: str,
    values: np.ndarray,
    frequency: np.ndarray,
    outputs: Iterable[str],
    inputs: Iterable[str],
    quantity: str,
    **extra: np.ndarray,
) -> FRF:
    """An FRF whose complaints name the file."""
    if not (known := measurable(values)).all():
        k, i, _ = (int(v[0]) for v in np.nonzero(~known))
        raise FileError(f"{name}: {tuple(outputs)[i]} is not a number at {frequency[k]:g} Hz")
    for role, labels in (("output", list(outputs)), ("input", list(inputs))):
        if twice := [label for label in dict.fromkeys(labels) if labels.count(label) > 1]:
            raise FileError(f"{name}: {role} {twice[0]} occurs twice")
    if not (np.isfinite(frequency).all() and np.all(frequency >= 0)):
        raise FileError(f"{name}: a frequency is negative or not a number")
    if values.size == 0 or not values.any():
        raise FileError(f"{name}: the FRF is empty ({values.shape[0]} lines, no value but zero)")
    try:
        return FRF(values, frequency, tuple(outputs), tuple(inputs), quantity, **extra)  # type: ignore[arg-type]
    except ChladniError as error:
        raise FileError(f"{name}: {error}") from error


def read_npz(path: str | Path, quantity: str | None = None) -> Recording:
    """FRF from NPZ: frequency_hz, values, outputs, inputs, optional coherence, variance, quantity.

    Pickles are refused.
    """
    path = Path(path)
    if not path.is_file():
        raise FileError(f"no file {path}; the folder has {named(files_next_to(path))}")
    if not zipfile.is_zipfile(path):
        raise FileError(f"{path.name} cannot be read as NPZ: it is not an archive of arrays")
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(held.file_size for held in archive.infolist())
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            if timed := not {"frequency_hz", "values"} & set(file.files) and is_time(file.files):
                only_known(path.name, file.files)
            else:
                _only_known(path, file.files)
            refuse_large(path, size, "unpacks to")
            arrays = {name: file[name] for name in file.files}
    except FileError:
        raise
    except DAMAGED as error:
        why = error.args[0] if error.args else error
        raise FileError(f"{path.name} cannot be read as NPZ: {why}") from error
    if timed:
        return _timed(path, named_arrays(path, arrays), quantity)
    return _of_arrays(path, arrays, quantity)


def _of_arrays(path: Path, arrays: dict[str, np.ndarray], quantity: str | None) -> Recording:
    """FRF, or modal model, of named arrays."""
    if "shapes" in arrays:
        return modal_of_arrays(path, arrays)
    if missing := [name for name in _NPZ if name not in arrays]:
        raise FileError(f"{path.name}: no array {', '.join(missing)}; there are {named(arrays)}")
    quantity = quantity or (word_of(path, arrays, "quantity") if "quantity" in arrays else None)
    if quantity is None:
        raise FileError(f"{path.name} does not say its quantity: one of {_quantities()}")
    frf = _frf(
        path.name,
        numbers_of(path, arrays, "values", "biufc").astype(complex),
        numbers_of(path, arrays, "frequency_hz").astype(float),
        words_of(path, arrays, "outputs"),
        words_of(path, arrays, "inputs"),
        quantity,
        **{
            name: numbers_of(path, arrays, name).astype(float)
            for name in ("coherence", "variance")
            if name in arrays
        },
    )
    level = None
    if "level" in arrays:
        if (found := numbers_of(path, arrays, "level")).size != 1:
            raise FileError(f"{path.name}: level has {found.size} values; it must be one number")
        level = _amplitude(path.name, float(found.reshape(-1)[0]))
    article = word_of(path, arrays, "article") if "article" in arrays else ""
    return Recording(path.name, frf, level=level, article=article)


def _amplitude(where: str, level: float) -> float:
    """The level, which is the amplitude of what was held."""
    if not 0 <= level < np.inf:
        raise FileError(
            f"{where}: level is {level:g}; an amplitude must be finite and not negative"
        )
    return level


def _only_known(path: Path, names: Sequence[str]) -> None:
    """Refuse arrays nobody reads before they are unpacked."""
    due, more = (MODAL, MODAL_OPTIONAL) if "shapes" in names else (_NPZ, _NPZ_OPTIONAL)
    if unknown := [name for name in names if name not in (*due, *more)]:
        missing = [name for name in due if name not in names]
        lacks = f"; there is no array {', '.join(missing)}" if missing else ""
        raise FileError(
            f"{path.name}: unknown array {', '.join(unknown)}{lacks}; known are "
            f"{', '.join((*due, *more))}"
        )


def read_poles(path: str | Path) -> PoleTable:
    """Poles from CSV: mode, frequency_hz, optional frequency_sd_hz, damping, state."""
    table = read_table(Path(path), _POLES, _POLES_OPTIONAL)
    n = len(table.line)
    frequency = table.numbers("frequency_hz")
    for k in np.flatnonzero(~(frequency > 0)):
        raise FileError(
            f"{table.path.name}, line {table.line[k]}: a frequency of "
            f"{table.columns['frequency_hz'][k]!r} Hz is not a natural frequency"
        )
    unknown = np.full(n, np.nan)
    sd = table.numbers("frequency_sd_hz") if "frequency_sd_hz" in table else unknown
    damping = table.numbers("damping") if "damping" in table else unknown
    state = table.columns.get("state", [""] * n)
    mode = table.numbers("mode")
    return PoleTable(frequency, sd, damping, mode.astype(int), tuple(state))
