"""Types of a result that was read from a file, compared with the annotations of its dataclasses."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

LARGEST = 1e300  # of a number: a float holds it and its square root of a sum does


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def wrong_field(value: object, where: str = "") -> str:
    """The first field of a dataclass whose value is not of its type, in words; "" if all are.

    A number that is missing (None) passes: JSON has no other word for not-a-number.
    """
    for one in fields(value):  # type: ignore[arg-type]
        hint = _hints(type(value))[one.name]  # type: ignore[arg-type]
        if wrong := _wrong(getattr(value, one.name), hint, f"{where}{one.name}"):
            return wrong
    return ""


def _wrong(value: object, hint: Any, where: str) -> str:
    """The fault of one value in words; "" if it has the type."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):
        found = [_wrong(value, h, where) for h in inner]
        return "" if "" in found else found[0]
    if is_dataclass(kind):
        return wrong_field(value, f"{where}.") if isinstance(value, kind) else _said(value, where)  # type: ignore[arg-type]
    if kind is tuple:
        return _wrong_tuple(value, inner, where)
    if kind is dict:
        return _wrong_dict(value, inner, where)
    return "" if _fits(value, kind, inner) else _said(value, where)


def _wrong_tuple(value: object, inner: tuple[Any, ...], where: str) -> str:
    if not isinstance(value, tuple):
        return _said(value, where)
    each = inner[:1] * len(value) if inner[-1:] == (Ellipsis,) else inner
    if len(each) != len(value):
        return f"{where} holds {len(value)} values, {len(each)} are due"
    found = (
        _wrong(v, h, f"{where}[{k}]") for k, (v, h) in enumerate(zip(value, each, strict=True))
    )
    return next(filter(None, found), "")


def _wrong_dict(value: object, inner: tuple[Any, ...], where: str) -> str:
    if not isinstance(value, Mapping):
        return _said(value, where)
    found = (_wrong(v, inner[1], f"{where}[{k!r}]") for k, v in value.items())
    return next(filter(None, found), "")


def _fits(value: object, kind: Any, inner: tuple[Any, ...]) -> bool:
    if kind is Literal:
        return value in inner
    if kind is float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return value is None or (number and abs(value) < LARGEST)  # type: ignore[operator, arg-type]
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
    return kind is Any or not isinstance(kind, type) or isinstance(value, kind)


def _said(value: object, where: str) -> str:
    text = repr(value)
    return f"{where} holds {text if len(text) < 60 else type(value).__name__}"
