"""Keywords of an input file of Abaqus or CalculiX, parts repeated for each of their instances.

Sources: Abaqus Keywords Reference Guide; Dhondt, CalculiX CrunchiX User's Manual 2.20.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...errors import FileError
from ..file_size import refuse_large, refuse_outside


@dataclass(frozen=True, eq=False)
class Keyword:
    """A keyword with its parameters and data lines."""

    name: str  # "SHELL SECTION"
    words: Mapping[str, str]  # parameters by name; a flag is ""
    rows: list[list[str]]  # cells of the data lines
    path: Path
    line: int  # of the keyword
    scope: str = ""  # instance in lower case; "" outside of instances
    place: "Placement | None" = None  # of the instance
    step: int = 0  # 0: the model
    at: list[int] = field(default_factory=list)  # lines of the rows

    def fault(self, what: str, row: int = -1) -> FileError:
        """An error in a data line, or in the keyword itself."""
        line = self.at[row] if 0 <= row < len(self.at) else self.line
        return FileError(f"{self.path}, line {line}: *{self.name}: {what}")

    def word(self, name: str) -> str:
        """A parameter that must be there."""
        if not self.words.get(name):
            raise self.fault(f"the parameter {name} is missing")
        return self.words[name]

    def real(self, row: int, cell: int, default: float | None = None) -> float:
        """A number of a data line; an empty cell is the default."""
        text = self.cell(row, cell)
        if not text and default is not None:
            return default
        try:
            value = float(text.upper().replace("D", "E"))
        except ValueError:
            value = np.nan
        if not np.isfinite(value) or "_" in text:
            raise self.fault(f"{text or 'nothing'!r} is not a number", row)
        return value

    def cell(self, row: int, cell: int) -> str:
        """The text of a cell, "" for a cell that is not there."""
        return self.rows[row][cell] if row < len(self.rows) and cell < len(self.rows[row]) else ""

    def reals(self, row: int) -> list[float]:
        """All numbers of a data line."""
        cells = self.rows[row] if row < len(self.rows) else []
        return [self.real(row, k, 0.0) for k in range(len(cells))]


@dataclass(frozen=True, eq=False)
class Placement:
    """x' = p + R (x + d - p) of an instance, R about an axis through the point p."""

    shift: np.ndarray
    turn: np.ndarray  # (3, 3)
    pivot: np.ndarray

    def moved(self, x: np.ndarray) -> np.ndarray:
        """Places (n, 3) in the assembly."""
        return np.asarray(self.pivot + (x + self.shift - self.pivot) @ self.turn.T)


def keywords(path: Path) -> Iterator[Keyword]:
    """All keywords of a file and its includes, those of a part once for each instance."""
    parts: dict[str, list[Keyword]] = {}
    part: list[Keyword] | None = None
    scope, place, step = "", None, 0
    for key in _lexed(path, ()):
        if key.name == "PART":
            part = parts.setdefault(key.word("NAME").lower(), [])
        elif key.name == "END PART":
            part = None
        elif part is not None:
            part.append(key)
        elif key.name == "INSTANCE":
            scope, place = key.word("NAME").lower(), _placement(key)
            if (name := key.word("PART").lower()) not in parts:
                raise key.fault(f"there is no part {name!r}; a part stands before its instances")
            yield from (_within(one, scope, place, 0) for one in parts[name])
        elif key.name == "END INSTANCE":
            scope, place = "", None
        elif key.name != "END STEP":
            step += key.name == "STEP"
            yield _within(key, scope, place, step)


def _within(key: Keyword, scope: str, place: Placement | None, step: int) -> Keyword:
    return Keyword(key.name, key.words, key.rows, key.path, key.line, scope, place, step, key.at)


def _placement(key: Keyword) -> Placement:
    shift, turn, pivot = np.zeros(3), np.eye(3), np.zeros(3)
    if key.rows:
        shift = np.array((key.reals(0) + [0.0] * 3)[:3])
    if len(key.rows) > 1:
        a, b, angle = np.array(key.reals(1)[:3]), np.array(key.reals(1)[3:6]), key.real(1, 6)
        n = (b - a) / np.linalg.norm(b - a)
        X, phi = np.cross(np.eye(3), n), np.radians(angle)
        turn, pivot = np.eye(3) + np.sin(phi) * X + (1 - np.cos(phi)) * (X @ X), a
    return Placement(shift, turn, pivot)


def _lexed(path: Path, above: tuple[Path, ...]) -> Iterator[Keyword]:
    """Keywords as they stand; a line that ends with a comma goes on in the next one."""
    refuse_large(path)
    if path.resolve() in above or len(above) > 50:
        raise FileError(f"{path} includes itself")
    key, head = None, ""
    for number, text in enumerate(path.read_text(encoding="latin-1").splitlines(), start=1):
        line = text.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*") or head:
            if not head and key is not None:
                yield from _resolved(key, above)
            head += line
            if head.endswith(","):
                key = None
                continue
            key, head = _keyword(head, path, number), ""
        elif key is None:
            raise FileError(f"{path}, line {number}: data stand before the first keyword")
        else:
            key.rows.append([cell.strip() for cell in line.split(",")])
            key.at.append(number)
    if key is not None:
        yield from _resolved(key, above)


def _keyword(head: str, path: Path, number: int) -> Keyword:
    name, *rest = head[1:].split(",")
    words = {}
    for word in rest:
        key, _, value = word.partition("=")
        if key.strip():
            words[" ".join(key.upper().split())] = value.strip().strip("\"'")
    return Keyword(" ".join(name.upper().split()), words, [], path, number)


def _resolved(key: Keyword, above: tuple[Path, ...]) -> Iterator[Keyword]:
    """The keyword itself, or those of the file that it includes."""
    if key.name != "INCLUDE":
        yield key
        return
    other = key.path.parent / key.word("INPUT").replace("\\", "/")
    refuse_outside(other, f"{key.path}, line {key.line}: *INCLUDE ")
    if not other.is_file():
        raise key.fault(f"no file {key.word('INPUT')!r}")
    yield from _lexed(other, (*above, key.path.resolve()))
