"""Dataclasses as plain data, and back by their annotations."""

from collections.abc import Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass
from functools import cache
from math import nan
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

LARGEST = 1e300  # of a number: a float holds it and its square root of a sum does
Made = TypeVar("Made")


def as_data(value: Any) -> Any:
    """Convert a dataclass, or a tuple of them, to dictionaries."""
    if isinstance(value, tuple):
        return [as_data(one) for one in value]
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def made(kind: type[Made], found: Any, where: str = "") -> Made:
    """Make a dataclass of its JSON.

    A field that is missing keeps its default, and so does one that is null and may not be None.
    A number without a default may be null. In a list it becomes not-a-number.

    Raises
    ------
    ValueError
        If a field is missing or its value is not of its type; the sentence names the field.
    """
    if not isinstance(found, Mapping):
        raise _wrong(found, where.removesuffix("."))
    hints, given = _hints(kind), {}  # type: ignore[arg-type]
    for f in fields(kind):  # type: ignore[arg-type]
        value, due = found.get(f.name), f.default is f.default_factory is MISSING
        if due and f.name not in found:
            raise ValueError(f"{where}{f.name} is missing")
        if value is not None or due or (f.name in found and NoneType in get_args(hints[f.name])):
            given[f.name] = _typed(hints[f.name], value, f"{where}{f.name}")
    return kind(**given)


def _typed(hint: Any, value: Any, where: str) -> Any:
    """A value of JSON in the type of its field: lists become tuples, objects dataclasses."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):  # a field that may be None
        (known,) = (h for h in inner if h is not NoneType)
        return None if value is None else _typed(known, value, where)
    if is_dataclass(kind):
        return made(kind, value, f"{where}.")  # type: ignore[arg-type]
    if kind is tuple and isinstance(value, list | tuple):
        each = inner[:1] * len(value) if inner[-1:] == (Ellipsis,) else inner
        if len(each) != len(value):
            raise ValueError(f"{where} holds {len(value)} values, {len(each)} are due")
        pairs = enumerate(zip(each, value, strict=True))
        return tuple(
            nan if v is None and h is float else _typed(h, v, f"{where}[{k}]")
            for k, (h, v) in pairs
        )
    if kind is dict and isinstance(value, Mapping):
        return {name: _typed(inner[1], v, f"{where}[{name!r}]") for name, v in value.items()}
    if not _fits(value, kind, inner):
        raise _wrong(value, where)
    return value


def _fits(value: object, kind: Any, inner: tuple[Any, ...]) -> bool:
    if kind is Literal:
        return isinstance(value, str) and value in inner
    if kind is float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return value is None or (number and abs(value) < LARGEST)  # type: ignore[operator, arg-type]
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
    return isinstance(value, kind)


def _wrong(value: object, where: str) -> ValueError:
    text = repr(value)
    return ValueError(f"{where} holds {text if len(text) < 60 else type(value).__name__}")
