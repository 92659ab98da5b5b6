"""Recordings as tables in: FRF in CSV and NPZ, poles in CSV (SI, UTF-8)."""

import csv
import difflib
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from ...dynamics.frf import FRF, Quantity
from ...ema.setup import PoleTable, Recording
from ...errors import ChladniError, FileError

_FRF = ("frequency_hz", "output", "input", "real", "imag")
_FRF_OPTIONAL = ("coherence", "variance", "level", "article")
_POLES = ("mode", "frequency_hz")
_POLES_OPTIONAL = ("frequency_sd_hz", "damping", "state")
_NPZ = ("frequency_hz", "values", "outputs", "inputs")
_NPZ_OPTIONAL = ("coherence", "variance", "quantity", "level", "article")


@dataclass(frozen=True)
class CsvTable:
    """A CSV file: columns of text, and the line of the file each row stands in."""

    path: Path
    columns: dict[str, list[str]]
    line: list[int]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def numbers(self, name: str, empty: float = np.nan) -> np.ndarray:
        """(n,) finite numbers; an empty cell is ``empty``."""
        try:  # the quick way, for a hundred thousand rows
            values = np.array(self.columns[name], dtype=float)
        except ValueError:
            values = np.array([self.number(name, k, empty) for k in range(len(self.line))])
            return values
        if not np.isfinite(values).all():
            self._not_anumber(name, int(np.argmin(np.isfinite(values))))
        return values

    def number(self, name: str, k: int, empty: float) -> float:
        """The finite number in row ``k``; an empty cell is ``empty``."""
        text = self.columns[name][k]
        if not text:
            return empty
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            self._not_anumber(name, k)
        return value

    def _not_anumber(self, name: str, k: int) -> None:
        raise FileError(
            f"{self.path.name}, line {self.line[k]}: {name} is {self.columns[name][k]!r}, "
            "which is not a number"
        )


def read_table(path: Path, due: Sequence[str], optional: Sequence[str]) -> CsvTable:
    """A CSV file with these columns, in any order.

    Raises
    ------
    FileError
        If the file, a column or a cell is missing, or a column is unknown.
    """
    if not path.is_file():
        near = difflib.get_close_matches(path.name, _beside(path), 3, 0.4) or _beside(path)[:6]
        raise FileError(f"no file {path}; beside it there are {near}")
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, skipinitialspace=True)
            rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except UnicodeDecodeError as error:
        raise FileError(f"{path.name} is not UTF-8 text ({error})") from error
    if not rows:
        raise FileError(f"{path.name} is empty; the first line names the columns {', '.join(due)}")
    header = [name.strip().lower() for name in rows[0][1]]
    _check_header(path, header, due, optional)
    for line, row in rows[1:]:
        if len(row) != len(header):
            raise FileError(
                f"{path.name}, line {line}: {len(row)} cells, the header has {len(header)}"
            )
    columns = {name: [row[k].strip() for _, row in rows[1:]] for k, name in enumerate(header)}
    if len(rows) == 1:
        raise FileError(f"{path.name} has a header but no rows")
    return CsvTable(path, columns, [line for line, _ in rows[1:]])


def _beside(path: Path) -> list[str]:
    return (
        sorted(p.name for p in path.parent.glob("*") if p.is_file()) if path.parent.is_dir() else []
    )


def _check_header(
    path: Path, header: list[str], due: Sequence[str], optional: Sequence[str]
) -> None:
    if missing := [name for name in due if name not in header]:
        raise FileError(
            f"{path.name}, line 1: no column {', '.join(missing)}; there are {', '.join(header)}"
        )
    for name in header:
        if name not in (*due, *optional):
            known = ", ".join((*due, *optional))
            raise FileError(f"{path.name}, line 1: unknown column {name!r}; known are {known}")
        if header.count(name) > 1:
            raise FileError(f"{path.name}, line 1: column {name!r} occurs twice")


def read_recordings(path: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """What a file holds, by its ending: .uff .unv .ufb .uf .uff58, .npz, .csv (FRF or poles).

    Raises
    ------
    FileError
        One sentence about what is wrong with the file.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".npz":
        return (read_npz(path, quantity),)
    if ending == ".csv":
        return read_csv(path, quantity)
    if ending in (".uff", ".unv", ".ufb", ".uf", ".uff58", ".bunv"):
        from ..uff.read_uff import read_uff

        return (read_uff(path, quantity),)
    raise FileError(f"{path.name}: recordings end in .uff, .unv, .npz or .csv, not {ending!r}")


def read_csv(path: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """FRFs (one recording per article and level) or poles, told apart by the header."""
    path = Path(path)
    if path.is_file() and _first_line(path).isdisjoint({"real", "imag", "output", "input"}):
        return (Recording(name=path.name, poles=read_poles(path)),)
    table = read_table(path, _FRF, _FRF_OPTIONAL)
    if quantity is None:
        raise FileError(f"{path.name} does not say its quantity: one of {_quantities()}")
    numbers = {k: table.numbers(k) for k in (*_FRF, *_FRF_OPTIONAL) if k in table and k in _NUMERIC}
    article = table.columns.get("article", [""] * len(table.line))
    level = numbers.get("level", np.full(len(table.line), np.nan))
    groups: dict[tuple[str, float], list[int]] = {}
    for k, key in enumerate(zip(article, np.nan_to_num(level, nan=-1.0).tolist(), strict=True)):
        groups.setdefault(key, []).append(k)
    return tuple(
        _recording(table, numbers, np.array(rows), key, quantity) for key, rows in groups.items()
    )


_NUMERIC = {"frequency_hz", "real", "imag", "coherence", "variance", "level"}


def _quantities() -> str:
    return ", ".join(get_args(Quantity))


def _first_line(path: Path) -> set[str]:
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return {name.strip().lower() for name in file.readline().split(",")}


def _recording(
    table: CsvTable,
    numbers: dict[str, np.ndarray],
    rows: np.ndarray,
    key: tuple[str, float],
    quantity: str,
) -> Recording:
    """The rows of one article and level as a recording."""
    article, level = key
    said = [f"article {article}"] * bool(article) + [f"level {level:g}"] * (level >= 0)
    name = ", ".join([table.path.name, *said])
    outputs, i = _coded([table.columns["output"][k] for k in rows])
    inputs, j = _coded([table.columns["input"][k] for k in rows])
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
    values = array(numbers["real"] + 1j * numbers["imag"])
    frf = _frf(name, values, frequency, outputs, inputs, quantity, **extra)
    return Recording(name=name, frf=frf, level=level if level >= 0 else None, article=article)


def _coded(texts: list[str]) -> tuple[tuple[str, ...], np.ndarray]:
    """Distinct texts in order of appearance, and the position of each among them."""
    distinct = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    return tuple(distinct), np.array([distinct[text] for text in texts])


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
            f"{table.path.name}: {channel} has no line at {frequency[k]:g} Hz, where others have "
            "one; all channels need the same frequencies"
        )
    twice = np.flatnonzero((place[0] == k) & (place[1] == i) & (place[2] == j))[1]
    raise FileError(
        f"{table.path.name}, line {table.line[rows[twice]]}: {channel} at {frequency[k]:g} Hz is "
        "there twice; several levels or articles need a column level or article"
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
    if not np.isfinite(values).all():
        k, i, _ = (int(v[0]) for v in np.nonzero(~np.isfinite(values)))
        raise FileError(f"{name}: {tuple(outputs)[i]} is not a number at {frequency[k]:g} Hz")
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
        raise FileError(f"no file {path}; beside it there are {_beside(path)[:6]}")
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise FileError(f"{path.name} cannot be read as NPZ: {error}") from error
    if missing := [name for name in _NPZ if name not in arrays]:
        raise FileError(f"{path.name}: no array {', '.join(missing)}; there are {list(arrays)}")
    if unknown := [name for name in arrays if name not in (*_NPZ, *_NPZ_OPTIONAL)]:
        raise FileError(
            f"{path.name}: unknown array {', '.join(unknown)}; known are "
            f"{', '.join((*_NPZ, *_NPZ_OPTIONAL))}"
        )
    quantity = quantity or (str(arrays["quantity"]) if "quantity" in arrays else None)
    if quantity is None:
        raise FileError(f"{path.name} does not say its quantity: one of {_quantities()}")
    frf = _frf(
        path.name,
        arrays["values"].astype(complex),
        arrays["frequency_hz"].astype(float),
        [str(o) for o in np.atleast_1d(arrays["outputs"])],
        [str(i) for i in np.atleast_1d(arrays["inputs"])],
        quantity,
        **{
            name: arrays[name].astype(float) for name in ("coherence", "variance") if name in arrays
        },
    )
    level = float(arrays["level"]) if "level" in arrays else None
    return Recording(path.name, frf, level=level, article=str(arrays.get("article", "")))


def read_poles(path: str | Path) -> PoleTable:
    """Poles from CSV: mode, frequency_hz, optional frequency_sd_hz, damping, state."""
    table = read_table(Path(path), _POLES, _POLES_OPTIONAL)
    n = len(table.line)
    frequency = table.numbers("frequency_hz")
    for k in np.flatnonzero(~(frequency > 0)):
        raise FileError(
            f"{table.path.name}, line {table.line[k]}: a frequency of "
            f"{table.columns['frequency_hz'][k]!r} Hz is no frequency of a mode"
        )
    unknown = np.full(n, np.nan)
    sd = table.numbers("frequency_sd_hz") if "frequency_sd_hz" in table else unknown
    damping = table.numbers("damping") if "damping" in table else unknown
    state = table.columns.get("state", [""] * n)
    mode = table.numbers("mode")
    return PoleTable(frequency, sd, damping, mode.astype(int), tuple(state))
