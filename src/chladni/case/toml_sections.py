"""A TOML file read key by key: every complaint names file, line, offender and alternatives."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import FileError, did_you_mean, nearest, not_text, shortened

_LONGEST = 60  # characters of a value that a sentence repeats
_QUOTED = r"""(['"])((?:(?!\1)[^\\]|\\.)*)\1"""


def _why(said: str) -> str:
    """Message of tomllib, with its tuples of names in the notation of TOML.

    >>> _why("Cannot declare ('model',) twice (at line 2, column 7)")
    '[model] occurs twice (at line 2, column 7)'
    """
    if "digits)" in said:
        return "a number has thousands of digits"
    said = re.sub(rf"\((?:{_QUOTED},? ?)+\)", _dotted, said)
    said = re.sub(r"Cannot declare (\[.*\]) twice", r"\1 occurs twice", said)
    said = re.sub(r"Cannot mutate immutable namespace (\[.*\])", r"\1 has a value already", said)
    return said.replace("Cannot overwrite a value", "a key occurs twice")


def _dotted(names: re.Match[str]) -> str:
    return f"[{'.'.join(text for _, text in re.findall(_QUOTED, names[0]))}]"


def _short(value: object) -> str:
    """A value for a sentence; of a long one its beginning."""
    if isinstance(value, int) and abs(value) > 10**_LONGEST:
        return "a number of more than 60 digits"
    return shortened(repr(value), _LONGEST)


@dataclass(frozen=True)
class TomlSection:
    """A table of the file.

    Attributes
    ----------
    file : Path
    name : str            as in [name] or [[name]]
    values : dict
    lines : {key: line}   where each key stands
    line : int            where the table begins
    """

    file: Path
    name: str
    values: dict[str, Any]
    lines: dict[str, int]
    line: int

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def at(self, key: str) -> str:
        """'case.toml, line 7: [test] gain', to begin a sentence with."""
        return f"{self.file.name}, line {self.lines.get(key, self.line)}: [{self.name}] {key}"

    def lacks(self, key: str) -> str:
        """Say that a key is missing."""
        return f"{self.file.name}, line {self.line}: [{self.name}] needs a key {key}"

    def only(self, known: Sequence[str]) -> None:
        """Refuse keys that nobody reads."""
        for key in self.values:
            if key not in known:
                hint = did_you_mean(key, known)
                raise FileError(f"{self.at(key)} is unknown; {hint}known are {', '.join(known)}")

    def _get(self, key: str, due: bool) -> Any:
        if due and key not in self.values:
            raise FileError(self.lacks(key))
        return self.values.get(key)

    def text(self, key: str, due: bool = False, among: Sequence[str] = ()) -> str | None:
        """A string, one of ``among`` where given."""
        value = self._get(key, due)
        if value is None:
            return None
        if not isinstance(value, str):
            raise FileError(f"{self.at(key)} = {_short(value)} is not text in quotes")
        if among and value not in among:
            hint = did_you_mean(value, among)
            raise FileError(f"{self.at(key)} = {_short(value)}; {hint}there are {', '.join(among)}")
        return value

    def flag(self, key: str) -> bool:
        """True or false; false where it is missing."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise FileError(f"{self.at(key)} = {_short(value)} is neither true nor false")
        return value

    def number(
        self, key: str, due: bool = False, low: float = -1e300, high: float = 1e300
    ) -> float | None:
        """A number between two bounds."""
        value = self._get(key, due)
        return None if value is None else self._number(key, value, low, high)

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FileError(f"{self.at(key)} = {_short(value)} is not a number")
        if abs(value) > 1e300:
            raise FileError(f"{self.at(key)} = {_short(value)} is too large")
        if not low <= value <= high:
            bound = f"at least {low:g}" if high > 1e299 else f"between {low:g} and {high:g}"
            raise FileError(f"{self.at(key)} = {value:g}; it must be {bound}")
        return float(value)

    def list(self, key: str, kind: type, due: bool = False) -> list | None:
        """A list of strings or whole numbers; a single one counts as a list of one."""
        value = self._get(key, due)
        if value is None:
            return None
        items = value if isinstance(value, list) else [value]
        word = {str: "text in quotes", int: "whole numbers"}[kind]
        for item in items:
            if isinstance(item, bool) or not isinstance(item, kind):
                raise FileError(f"{self.at(key)} contains {_short(item)}; write a list of {word}")
            if isinstance(item, int) and not 0 < item < 2**31:
                raise FileError(f"{self.at(key)} contains {_short(item)}, which is not a grid id")
        return items

    def band(self, key: str) -> tuple[float, float] | None:
        """[low, high] in Hz."""
        return self._pair(key, self.values[key]) if key in self.values else None

    def bands(self, key: str) -> tuple[tuple[float, float], ...]:
        """[[low, high], ...] in Hz, or one pair."""
        value = self.values.get(key, [])
        single = isinstance(value, list) and value and not isinstance(value[0], list)
        items = [value] if single else value
        if not isinstance(items, list):
            raise FileError(f"{self.at(key)} = {_short(value)}; write [[low, high], ...] in Hz")
        return tuple(self._pair(key, item) for item in items)

    def _pair(self, key: str, value: Any) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise FileError(f"{self.at(key)} = {_short(value)}; write [low, high] in Hz")
        low, high = (self._number(key, v, 0.0, 1e9) for v in value)
        if low >= high:
            raise FileError(f"{self.at(key)} = {value!r}; the first must be below the second")
        return low, high


@dataclass(frozen=True)
class KeyFile:
    """A parsed file: its tables, single or repeated."""

    path: Path
    tables: dict[str, list[TomlSection]]

    def section(self, name: str, known: Sequence[str], due: bool = False) -> TomlSection:
        """The one table of this name; empty where the file has none."""
        found = self.tables.get(name, [])
        if not found and due:
            raise FileError(f"{self.path.name} needs a section [{name}]")
        if len(found) > 1:
            raise FileError(f"{self.path.name}, line {found[1].line}: [{name}] occurs twice")
        section = found[0] if found else self.empty(name)
        section.only(known)
        return section

    def written(self, section: str, key: str, example: str) -> str:
        """Say where a key is written, with an example."""
        return f"{key} = {example} under [{section}]"

    def empty(self, name: str) -> TomlSection:
        """A table that is not there."""
        return TomlSection(self.path, name, {}, {}, 1)

    def given(self) -> tuple[tuple[str, str], ...]:
        """(section, key) of every word of the file."""
        return tuple((s.name, k) for many in self.tables.values() for s in many for k in s.values)

    def sections(self, name: str, known: Sequence[str]) -> list[TomlSection]:
        """Every [[name]]."""
        found = self.tables.get(name, [])
        for section in found:
            section.only(known)
        return found


def read_keys(path: Path, known: Sequence[str]) -> KeyFile:
    """A TOML file with no other tables than these.

    Raises
    ------
    FileError
        If the file is missing, no TOML, or holds other tables.
    """
    if not path.is_file():
        raise FileError(f"no file {path}")
    try:
        text = path.read_text(encoding="utf-8-sig")
        values = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise FileError(f"{path.name} is {not_text(error)}") from error
    except RecursionError as error:
        raise FileError(f"{path.name} is not TOML: its brackets are nested too deep") from error
    except ValueError as error:  # TOMLDecodeError, and numbers beyond any use
        raise FileError(f"{path.name} is not TOML: {_why(str(error))}") from error
    headers, lines = _places(text)
    tables = {}
    for name, value in values.items():
        where = headers.get(name, [lines.get(("", 0, name), 1)])
        if name not in known:
            near = nearest(name, known)
            hint = f"did you mean [{near}]? " if near else ""
            kind = f"[{name}]" if isinstance(value, dict | list) else f"{name!r} outside a section"
            raise FileError(
                f"{path.name}, line {where[0]}: {kind} is unknown; {hint}"
                f"known are {', '.join(f'[{k}]' for k in known)}"
            )
        items = value if isinstance(value, list) else [value]
        if not all(isinstance(item, dict) for item in items):
            raise FileError(f"{path.name}, line {where[0]}: write [{name}] on a line of its own")
        tables[name] = [
            TomlSection(path, name, item, {k: lines.get((name, n, k), 1) for k in item}, line)
            for n, (item, line) in enumerate(zip(items, where * len(items), strict=False))
        ]
    return KeyFile(path, tables)


_HEADER = re.compile(r"^\s*\[\[?\s*([\w.\-]+)\s*\]?\]")
_KEY = re.compile(r"""^\s*["']?([\w\-]+)["']?\s*=""")


def _places(text: str) -> tuple[dict[str, list[int]], dict[tuple[str, int, str], int]]:
    """Lines of the headers of each table, and of each key of its n-th occurrence."""
    headers: dict[str, list[int]] = {}
    keys: dict[tuple[str, int, str], int] = {}
    current = ""
    for line, content in enumerate(text.splitlines(), start=1):
        if found := _HEADER.match(content):
            current = found[1]
            headers.setdefault(current, []).append(line)
        elif found := _KEY.match(content):
            keys.setdefault((current, max(0, len(headers.get(current, [])) - 1), found[1]), line)
    return headers, keys
