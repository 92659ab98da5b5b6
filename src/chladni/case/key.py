"""A key of a case: the type of its value, how it is read from TOML, and what it means."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..ema.setup import Sensor
from ..errors import FileError, did_you_mean, shortened

NEEDED = "needed"  # as a default
File = str | Path
Band = tuple[float, float]
_LONGEST = 60  # characters of a value that a sentence repeats


@dataclass(frozen=True)
class Key:
    """One word of a section, or one column of a table."""

    section: str
    example: str
    used: tuple[str, ...]  # commands that it matters to
    default: str  # what holds where it is missing
    unit: str
    meaning: str
    kind: str = ""  # what is written there, if the type does not say it
    choices: tuple[str, ...] = ()
    more: bool = False  # True if packages add choices
    least: float = -1e300
    most: float = 1e300
    name: str = ""  # in the file
    argument: str = ""  # in Python
    type: Any = str

    @property
    def in_words(self) -> str:
        """What is written there."""
        if self.choices:
            return f"word: {', '.join(self.choices)}"
        among = f", {self.least:g} to {self.most:g}" if self.most < 1e300 else ""
        return self.kind or _TYPES[self.type][0] + among

    def read(self, at: str, value: Any) -> Any:
        """The value, as the type has it.

        Raises
        ------
        FileError
            If it is of another type, none of the choices or out of bounds; ``at`` begins the
            sentence.
        """
        return _TYPES[self.type][1](at, value, self)


def refuse_other(at: str, value: str, among: Sequence[str]) -> None:
    """Refuse a word outside of a list."""
    if value not in among:
        hint = did_you_mean(value, among)
        raise FileError(f"{at} = {_short(value)}; {hint}there are {', '.join(among)}")


def refuse_beyond(at: str, value: float, least: float, most: float) -> None:
    """Refuse a number out of bounds."""
    if not least <= value <= most:
        bound = f"at least {least:g}" if most > 1e299 else f"between {least:g} and {most:g}"
        raise FileError(f"{at} = {value:g}; it must be {bound}")


def _short(value: object) -> str:
    """A value for a sentence; of a long one its beginning."""
    if isinstance(value, int) and abs(value) > 10**_LONGEST:
        return "a number of more than 60 digits"
    return shortened(repr(value), _LONGEST)


def _text(at: str, value: Any, key: Key) -> str:
    if not isinstance(value, str):
        raise FileError(f"{at} = {_short(value)} is not text in quotes")
    if key.choices and not key.more:
        refuse_other(at, value, key.choices)
    return value


def _flag(at: str, value: Any, key: Key) -> bool:
    if not isinstance(value, bool):
        raise FileError(f"{at} = {_short(value)} is neither true nor false")
    return value


def _number(at: str, value: Any, key: Key) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise FileError(f"{at} = {_short(value)} is not a number")
    if abs(value) > 1e300:
        raise FileError(f"{at} = {_short(value)} is too large")
    refuse_beyond(at, value, key.least, key.most)
    return float(value)


def _count_or_labels(at: str, value: Any, key: Key) -> int | list[str]:
    if isinstance(value, list):
        return _listed(at, value, str, "text in quotes")
    count = _number(at, value, key)
    if count != int(count):
        raise FileError(f"{at} = {count:g} is not a whole number")
    return int(count)


def _listed(at: str, value: Any, kind: Any, nouns: str) -> list[Any]:
    """A list of one kind; a single item counts as a list of one."""
    items = value if isinstance(value, list) else [value]
    for item in items:
        if isinstance(item, bool) or not isinstance(item, kind):
            raise FileError(f"{at} contains {_short(item)}; write a list of {nouns}")
    return items


def _texts(at: str, value: Any, key: Key) -> list[str]:
    return _listed(at, value, str, "text in quotes")


def _parts(at: str, value: Any, key: Key) -> list[str | int]:
    return _listed(at, value, str | int, "names in quotes, or of property ids")


def _grids(at: str, value: Any, key: Key) -> list[int]:
    for item in (items := _listed(at, value, int, "whole numbers")):
        if not 0 < item < 2**31:
            raise FileError(f"{at} contains {_short(item)}, which is not a grid id")
    return items


def _band(at: str, value: Any, key: Key) -> Band:
    if not isinstance(value, list) or len(value) != 2:
        raise FileError(f"{at} = {_short(value)}; write [low, high] in Hz")
    low, high = (_number(at, end, key) for end in value)
    for end in (low, high):
        refuse_beyond(at, end, 0.0, 1e9)
    if low >= high:
        raise FileError(f"{at} = {value!r}; the first must be below the second")
    return low, high


def _bands(at: str, value: Any, key: Key) -> tuple[Band, ...]:
    """[[low, high], ...]; one pair counts as a list of one."""
    single = isinstance(value, list) and value and not isinstance(value[0], list)
    items = [value] if single else value
    if not isinstance(items, list):
        raise FileError(f"{at} = {_short(value)}; write [[low, high], ...] in Hz")
    return tuple(_band(at, item, key) for item in items)


_TYPES: dict[Any, tuple[str, Callable[[str, Any, Key], Any]]] = {
    bool: ("true or false", _flag),
    float: ("number", _number),
    str: ("text", _text),
    File: ("file", _text),
    File | Sequence[Sensor]: ("file; in Python also a list of Sensor", _text),
    Sequence[str]: ("list of text", _texts),
    Sequence[str | int]: ("list of text", _parts),
    Sequence[int]: ("list of grids", _grids),
    int | Sequence[str]: ("number, or list of labels", _count_or_labels),
    Band: ("[low, high]", _band),
    Sequence[Band]: ("list of [low, high]", _bands),
}
