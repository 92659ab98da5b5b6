"""A CSV file as columns of text and numbers, with the line each row stands in."""

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import real_number
from ...errors import FileError, named
from ..encoded_text import encoding_of
from ..file_size import refuse_large

DELIMITERS = ",;\t"  # Excel separates by semicolons where numbers have a decimal comma


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
    """A CSV file with these columns, in any order; ``optional`` None: any others may stand there.

    Raises
    ------
    FileError
        If the file, a column or a cell is missing, or a column is unknown.
    """
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
    header = [name.strip().lower().lstrip("# ") for name in rows[0][1]]
    _check_header(path, header, due, optional)
    for line, row in rows[1:]:
        if len(row) != len(header):
            raise FileError(
                f"{path.name}, line {line}: {len(row)} cells, the header has {len(header)}"
            )
    columns = {name: [row[k].strip() for _, row in rows[1:]] for k, name in enumerate(header)}
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
