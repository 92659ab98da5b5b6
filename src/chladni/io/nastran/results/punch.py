"""Punch files (.pch): eigenvectors and frequency responses.

Layout after the MSC Nastran Reference Guide, Punch File: header lines begin with "$", a record is
a line of 18 columns and three values of 18, continued on "-CONT-" lines; columns 73-80 number the
lines. Results are in the deck's own units, components in the displacement frames of the points.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from ....errors import FileError
from ...file_size import refuse_large
from ..text.numbers import parse_real

_LINE: Final = 72  # columns of data
_KINDS: Final = {
    "$EIGENVECTOR": "eigenvector", "$DISPLACEMENTS": "displacement", "$VELOCITY": "velocity",
    "$ACCELERATION": "acceleration",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PunchModes:
    """Eigenvectors: frequency (r,) [Hz], ids (n,), shapes (n, 6, r); NaN where not punched.

    Shapes of a universal file may be complex.
    """

    frequency: np.ndarray
    ids: np.ndarray
    shapes: np.ndarray


@dataclass(frozen=True, eq=False)
class PunchResponse:
    """A response: kind, subcase, frequency (f,) [Hz], ids (n,), values (f, n, 6) complex."""

    kind: str
    subcase: int
    frequency: np.ndarray
    ids: np.ndarray
    values: np.ndarray


Record = tuple[int, tuple[float, int], np.ndarray]  # point, (abscissa, mode), values


@dataclass
class _PunchBlock:
    """Header of the records being read, and the records."""

    kind: str = ""
    polar: bool = False
    complex: bool = False
    subcase: int = 0
    point: int | None = None
    abscissa: float = 0.0
    mode: int = 0
    records: list[Record] = field(default_factory=list)


def read_punch_modes(path: Path | str) -> PunchModes:
    """Eigenvectors of a punch file.

    Raises
    ------
    FileError
        If there are none, or a record is damaged.
    """
    subcases: dict[int, list[Record]] = {}
    for block in _blocks(Path(path)):
        if block.kind == "eigenvector":
            subcases.setdefault(block.subcase, []).extend(block.records)
    found = [r for records in subcases.values() for r in records]
    if not found:
        raise FileError(f"{path} has no eigenvectors; request DISPLACEMENT(PUNCH) = ALL in SOL 103")
    for subcase, records in subcases.items():
        _refuse_gaps(records, f"{path}: subcase {subcase}")
    values, ids, eigenvalue = _table(found)
    frequency = np.sqrt(np.maximum(eigenvalue, 0)) / (2 * np.pi)
    return PunchModes(frequency, ids, np.moveaxis(values.real, 0, 2))


def read_punch_responses(path: Path | str) -> tuple[PunchResponse, ...]:
    """Frequency responses of a punch file, one for each kind and subcase.

    Raises
    ------
    FileError
        If there are none, or a record is damaged.
    """
    groups: dict[tuple[str, int], list[Record]] = {}
    for block in _blocks(Path(path)):
        if block.complex and block.kind in ("displacement", "velocity", "acceleration"):
            groups.setdefault((block.kind, block.subcase), []).extend(block.records)
    if not groups:
        raise FileError(f"{path} has no frequency responses; request (PUNCH) in SOL 108 or 111")
    out = []
    for (kind, subcase), records in groups.items():
        _refuse_gaps(records, f"{path}: {kind} of subcase {subcase}")
        values, ids, frequency = _table(records)
        out.append(PunchResponse(kind, subcase, frequency, ids, values))
    return tuple(out)


def _table(
    records: list[Record],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(values (f, n, 6), ids (n,), abscissae (f,) in the order they come) of records."""
    ids, column = np.unique([r[0] for r in records], return_inverse=True)
    abscissa = list(dict.fromkeys(r[1] for r in records))
    at = {x: k for k, x in enumerate(abscissa)}
    values = np.full((len(abscissa), len(ids), 6), np.nan, complex)
    for (_, x, v), j in zip(records, column, strict=True):
        values[at[x], j, : len(v)] = v
    return values, ids, np.array([x for x, _ in abscissa])


def _refuse_gaps(records: list[Record], where: str) -> None:
    """Refuse records of which one is there twice or missing: every point, in each mode or line."""
    seen: set[tuple[int, tuple[float, int]]] = set()
    points, abscissae = dict.fromkeys(r[0] for r in records), dict.fromkeys(r[1] for r in records)
    for point, x, _ in records:
        if (point, x) in seen:
            raise FileError(f"{where}: point {point} occurs twice {_at(x)}")
        seen.add((point, x))
    if len(seen) < (due := len(points) * len(abscissae)):
        point, x = next((p, x) for x in abscissae for p in points if (p, x) not in seen)
        raise FileError(
            f"{where}: point {point} is missing {_at(x)}, where others have a value ({len(seen)} "
            f"of {due} records); the file is cut off or damaged"
        )


def _at(x: tuple[float, int]) -> str:
    """Which mode, or which line."""
    return f"in mode {x[1]}" if x[1] else f"at {x[0]:g} Hz"


def _blocks(path: Path) -> Iterator[_PunchBlock]:
    """Blocks of records with the header that stands above each."""
    try:
        refuse_large(path)
        text = path.read_text("latin-1")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}") from None
    block = _PunchBlock()
    rows: list[tuple[int, str]] = []
    lines = text.splitlines()
    for number, line in enumerate(lines, start=1):
        if line.startswith("$"):
            if rows:
                yield _filled(block, rows, path)
                block, rows = _PunchBlock(block.kind, block.polar, block.complex, block.subcase), []
            _header(block, line[:72], path, number)
        elif line.strip() and block.kind:
            rows.append((number, line[:72]))
            if len(line) < _LINE and not text.endswith("\n") and number == len(lines):
                raise FileError(f"{path}:{number}: the line ends in a field: the file is cut off")
    if rows:
        yield _filled(block, rows, path)


def _header(block: _PunchBlock, line: str, path: Path, number: int) -> None:
    """Take in one header line."""
    word = line.split("(")[0].strip()
    if word.startswith(("$TITLE", "$SUBTITLE", "$LABEL")):
        block.kind = ""
    elif word in _KINDS:
        block.kind, block.polar, block.complex = _KINDS[word], False, False
    elif word.startswith(("$REAL-IMAGINARY", "$MAGNITUDE-PHASE")):
        block.complex, block.polar = True, word.startswith("$MAGNITUDE")
    elif word.startswith("$SUBCASE ID"):
        block.subcase = int(_value(line, path, number))
    elif word.startswith("$POINT ID"):
        block.point = int(_value(line.split("IDENTIFIED")[0], path, number))
    elif word.startswith(("$EIGENVALUE", "$FREQUENCY")):
        head, _, tail = line.partition("MODE")
        block.abscissa, block.point = _value(head, path, number), None
        block.mode = int(_value(tail, path, number)) if tail else 0


def _value(line: str, path: Path, number: int) -> float:
    """The number behind the equals sign."""
    value = parse_real(line.partition("=")[2])
    if np.isnan(value):
        raise FileError(f"{path}:{number}: {line.strip()!r} is not a number")
    return value


def _filled(block: _PunchBlock, rows: list[tuple[int, str]], path: Path) -> _PunchBlock:
    """The block with its records: lines joined with their continuations."""
    starts = [k for k, (_, line) in enumerate(rows) if not line.startswith("-CONT-")]
    for a, b in zip(starts, [*starts[1:], len(rows)], strict=True):
        number, first = rows[a]
        words = [line[18:].ljust(54) for _, line in rows[a:b]]
        values = [
            parse_real(w[k : k + 18]) for w in words for k in (0, 18, 36) if w[k : k + 18].strip()
        ]
        head = first[:18].split()
        key = parse_real(head[0]) if head else float("nan")
        if np.isnan(key) or any(np.isnan(v) for v in values) or not values:
            raise FileError(
                f"{path}:{number}: {first.strip()[:40]!r} is not a record of a punch file"
            )
        due = 12 if block.complex else 6
        if head[1:2] == ["G"] and len(values) != due:
            raise FileError(
                f"{path}:{number}: the record of grid {head[0]} has {len(values)} values, but "
                f"{due} are required; a line is lost or cut off"
            )
        point, x = (int(key), block.abscissa) if block.point is None else (block.point, key)
        block.records.append((point, (x, block.mode), _complex(block, np.array(values))))
    return block


def _complex(block: _PunchBlock, values: np.ndarray) -> np.ndarray:
    """Real and imaginary halves, or modulus and phase [deg], as complex numbers."""
    if not block.complex:
        return values[:6].astype(complex)
    half = len(values) // 2
    a, b = values[:half][:6], values[half : 2 * half][:6]
    return a * np.exp(1j * np.radians(b)) if block.polar else a + 1j * b
