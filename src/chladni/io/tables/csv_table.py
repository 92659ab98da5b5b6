r"""CSV in and out: columns of text and numbers with the line of each row; cells no program runs.

A spreadsheet takes a cell that begins with = + - @ for a formula, behind blanks too. Such text gets
a quotation mark in front (OWASP, CSV Injection), which is taken off where a table is read. Control
characters, which steer a terminal that shows the file, are written as ``\x1b``.
"""

import csv
import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import IO

import numpy as np

from ...arrays import real_number
from ...errors import FileError, named
from ..encoded_text import encoding_of
from ..file_size import refuse_large

DELIMITERS = ",;\t"  # Excel separates by semicolons where numbers have a decimal comma
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?(?:inf|nan)", re.IGNORECASE)
_FORMULA = re.compile(r"'*(?:\s*[=+\-@\uff1d\uff0b\uff0d\uff20]|[\t\r\n])")
_CODE = r"x([01][0-9a-f]|[789][0-9a-f]|5c)"
_STEERS = re.compile(rf"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]|\\(?={_CODE})")
_WRITTEN = re.compile(rf"\\{_CODE}")


def escaped(cell: object) -> object:
    r"""A cell that no spreadsheet takes for a formula and that steers no terminal.

    Numbers stay as they are.

    >>> escaped("+Z"), escaped("-1.5"), escaped("a" + chr(27)), escaped(-2.0)
    ("'+Z", '-1.5', 'a\\x1b', -2.0)
    """
    if not isinstance(cell, str):
        return cell
    text = _STEERS.sub(lambda c: f"\\x{ord(c[0]):02x}", cell)
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def unescaped(cell: str) -> str:
    """The text of an escaped cell.

    >>> unescaped("'+Z"), unescaped("it's")
    ('+Z', "it's")
    """
    bare = cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
    return _WRITTEN.sub(lambda c: chr(int(c[1], 16)), bare) if "\\x" in bare else bare


def write_rows(file: IO[str], rows: Iterable[Iterable[object]]) -> None:
    """Write rows as CSV: every table of this program goes through here."""
    csv.writer(file, lineterminator="\n").writerows([escaped(c) for c in row] for row in rows)


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    r"""Rows as the text of a CSV file.

    >>> csv_text([("label", "mass"), ("=1+1", 0.5)])
    "label,mass\n'=1+1,0.5\n"
    """
    text = StringIO()
    write_rows(text, rows)
    return text.getvalue()


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
        every = "".join(self.columns[name])
        try:  # the quick way, for a hundred thousand rows
            if "_" in every or not every.isascii():
                raise ValueError
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
            value = real_number(text)
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


def read_table(path: Path, due: Sequence[str], optional: Sequence[str] | None) -> CsvTable:
    """A CSV file with these columns in any order; ``optional`` None: any others may stand there."""
    if not path.is_file():
        near = (
            difflib.get_close_matches(path.name, files_next_to(path), 3, 0.4)
            or files_next_to(path)[:6]
        )
        raise FileError(f"no file {path}; the folder has {named(near)}")
    refuse_large(path)
    cut, encoding = delimiter(path), encoding_of(path)
    try:
        with path.open(encoding=encoding, newline="") as file:
            reader = csv.reader(file, delimiter=cut, skipinitialspace=True)
            rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise FileError(f"{path.name} is not a table: {error}") from error
    if not rows:
        raise FileError(f"{path.name} is empty; the first line names the columns {', '.join(due)}")
    header = [unescaped(name.strip()).lower().lstrip("# ") for name in rows[0][1]]
    _check_header(path, header, due, optional)
    for line, row in rows[1:]:
        if len(row) != len(header):
            raise FileError(
                f"{path.name}, line {line}: {len(row)} cells, the header has {len(header)}"
            )
    columns = {
        name: [unescaped(row[k].strip()) for _, row in rows[1:]] for k, name in enumerate(header)
    }
    if cut != ",":
        columns = {name: _with_points(cells) for name, cells in columns.items()}
    if len(rows) == 1:
        raise FileError(f"{path.name} has a header but no rows")
    return CsvTable(path, columns, [line for line, _ in rows[1:]])


def delimiter(path: Path) -> str:
    """The separator of the names in the first line of a file: a comma, a semicolon or a tab."""
    first = first_line(path)
    return max(DELIMITERS, key=first.count)


def first_line(path: Path) -> str:
    """The first line of a text file."""
    with path.open(encoding=encoding_of(path)) as file:
        return file.readline().strip()


def names_of(path: Path) -> list[str]:
    """The names in the first line of a table, in lower case."""
    return [name.strip().lower() for name in first_line(path).split(delimiter(path))]


def _with_points(cells: list[str]) -> list[str]:
    """Numbers with a decimal comma as numbers with a point; a column that has both stays."""
    if any("." in cell for cell in cells):
        return cells
    return [cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in cells]


_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")


def files_next_to(path: Path) -> list[str]:
    """Names of the files in the folder of this one."""
    return (
        sorted(p.name for p in path.parent.glob("*") if p.is_file()) if path.parent.is_dir() else []
    )


def _check_header(
    path: Path, header: list[str], due: Sequence[str], optional: Sequence[str] | None
) -> None:
    if missing := [name for name in due if name not in header]:
        raise FileError(
            f"{path.name}, line 1: no column {', '.join(missing)}; there are {', '.join(header)}"
        )
    for name in header:
        if optional is not None and name not in (*due, *optional):
            known = ", ".join((*due, *optional))
            raise FileError(f"{path.name}, line 1: unknown column {name!r}; known are {known}")
        if header.count(name) > 1:
            raise FileError(f"{path.name}, line 1: column {name!r} occurs twice")


def distinct_texts(texts: list[str]) -> tuple[tuple[str, ...], np.ndarray]:
    """Distinct texts in order of appearance, and the position of each among them."""
    distinct = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    return tuple(distinct), np.array([distinct[text] for text in texts])
