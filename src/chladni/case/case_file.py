"""The words of a ``case.toml``, with the lines where they stand."""

import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import FileError, nearest, not_text
from .key import Key
from .request import Request, Stated, stated
from .schema import SCHEMA, SECTIONS

_REPEATED = ("recording", "parameter")
_QUOTED = r"""(['"])((?:(?!\1)[^\\]|\\.)*)\1"""
_HEADER = re.compile(r"^\s*\[\[?\s*([\w.\-]+)\s*\]?\]")
_KEY = re.compile(r"""^\s*["']?([\w\-]+)["']?\s*=""")


@dataclass(frozen=True)
class _Table:
    """A [name] or [[name]] of a file, with the lines of its header and its keys."""

    file: str
    name: str
    values: dict[str, Any] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    line: int = 1

    def stated(self) -> Stated[Any]:
        """Its words, checked."""
        keys = [k for k in SCHEMA if k.section == self.name]
        whole = f"the [[{self.name}]] of line {self.line}"
        return stated(keys, self.values, self._at, self._missing, whole)

    def _at(self, key: str) -> str:
        return f"{self.file}, line {self.lines.get(key, self.line)}: [{self.name}] {key}"

    def _missing(self, key: Key) -> str:
        return f"{self.file}, line {self.line}: [{self.name}] needs a key {key.name}"


def request_of(path: Path) -> Request:
    """All that a ``case.toml`` states.

    Raises
    ------
    FileError
        If the file is missing or no TOML, or a section or a word is unknown, missing or wrong.
    """
    tables = _tables(path)
    if "model" not in tables:
        raise FileError(f"{path.name} needs a section [model]")
    for name, found in tables.items():
        if len(found) > 1 and name not in _REPEATED:
            raise FileError(f"{path.name}, line {found[1].line}: [{name}] occurs twice")
    for name in set(SECTIONS) - set(_REPEATED):
        tables.setdefault(name, [_Table(path.name, name)])
    every = {name: [table.stated() for table in found] for name, found in tables.items()}
    once = [each for name, found in every.items() if name not in _REPEATED for each in found]
    said = Stated[Any](
        {word: value for each in once for word, value in each.words.items()},
        {word: place for each in once for word, place in each.places.items()},
    )
    recordings, parameters = (tuple(every.get(name, ())) for name in _REPEATED)
    return Request(path, said, recordings, parameters)


def _tables(path: Path) -> dict[str, list[_Table]]:
    """The tables of a file, by the names of their sections."""
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
    headers, lines = _lines(text)
    tables = {}
    for name, value in values.items():
        where = headers.get(name, [lines.get(("", 0, name), 1)])
        if name not in SECTIONS:
            near = nearest(name, SECTIONS)
            hint = f"did you mean [{near}]? " if near else ""
            kind = f"[{name}]" if isinstance(value, dict | list) else f"{name!r} outside a section"
            raise FileError(
                f"{path.name}, line {where[0]}: {kind} is unknown; {hint}"
                f"known are {', '.join(f'[{k}]' for k in SECTIONS)}"
            )
        items = value if isinstance(value, list) else [value]
        if not all(isinstance(item, dict) for item in items):
            raise FileError(f"{path.name}, line {where[0]}: write [{name}] on a line of its own")
        tables[name] = [
            _Table(path.name, name, item, {k: lines.get((name, n, k), 1) for k in item}, line)
            for n, (item, line) in enumerate(zip(items, where * len(items), strict=False))
        ]
    return tables


def _lines(text: str) -> tuple[dict[str, list[int]], dict[tuple[str, int, str], int]]:
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
