"""Arguments of public functions and fields of settings, compared with their annotations."""

import functools
import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, is_typeddict

import numpy as np

from .errors import ArgumentError, LabelError, did_you_mean

P = ParamSpec("P")
R = TypeVar("R")
_NOUNS = {
    int: "a whole number",
    float: "a number",
    str: "text",
    bool: "True or False",
    Path: "a path",
    NoneType: "None",
    np.ndarray: "numbers",
    Any: "any value",
}
_LONGEST = 60  # characters of a value that a sentence repeats


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function refuse arguments of other types than its annotations name.

    Arguments are compared before any work, so that an error never comes from deep inside.
    """

    @functools.wraps(function)
    def inner(*args: P.args, **named: P.kwargs) -> R:
        _refuse_types(function, args, named)
        return function(*args, **named)

    return inner


@functools.cache
def _expected(function: Callable[..., Any]) -> tuple[inspect.Signature, dict[str, Any]]:
    return inspect.signature(function), _hints(function)


def _hints(annotated: Any) -> dict[str, Any]:
    """Annotations that are objects; one in quotes names a package that may not be installed."""
    return {n: h for n, h in inspect.get_annotations(annotated).items() if not isinstance(h, str)}


def _refuse_types(function: Any, args: tuple[Any, ...], named: Mapping[str, Any]) -> None:
    signature, hints = _expected(function)
    called = f"{function.__name__}()"
    try:
        bound = signature.bind(*args, **named)
    except TypeError as error:
        known = [name for name in signature.parameters if name != "self"]
        hint = next((h for n in named if n not in known and (h := did_you_mean(n, known))), "")
        raise ArgumentError(f"{called}: {error}; {hint}there are {', '.join(known)}") from None
    for name, value in bound.arguments.items():
        if name in hints:
            open_ended = signature.parameters[name].kind is inspect.Parameter.VAR_KEYWORD
            for called_by, one in value.items() if open_ended else [(name, value)]:
                _refuse_type(f"argument {called_by} of {called}", one, hints[name])


def _refuse_type(what: str, value: Any, hint: Any) -> None:
    if not _fits(value, hint):
        raise ArgumentError(f"{what} is {_in_words(value)}; it takes {_noun(hint)}")


def refuse_fields(settings: Any, **limits: tuple[float, float]) -> None:
    """Refuse fields of a dataclass of another type, or outside their limits (least, most).

    Raises
    ------
    ArgumentError, LabelError
        The first field that is wrong.
    """
    hints = _hints(type(settings))
    for each in fields(settings):
        value = getattr(settings, each.name)
        _refuse_type(f"{each.name} of {type(settings).__name__}", value, hints[each.name])
        least, most = limits.get(each.name, (-np.inf, np.inf))
        if isinstance(value, Real) and not least <= float(value) <= most:
            raise LabelError(f"{each.name} = {value} is not {_between(least, most)}")
        if each.name == "band":
            refuse_band(value)


def refuse_band(band: tuple[float, float] | None) -> None:
    """Refuse a band (low, high) [Hz] that is empty or begins below 0, by LabelError."""
    if band is not None and not 0 <= band[0] < band[1]:
        raise LabelError(f"band = {band} is empty; give (low, high) in Hz, from 0 up")


def _between(least: float, most: float) -> str:
    return f"between {least:g} and {most:.10g}" if np.isfinite(most) else f"{least:g} or more"


def settings_of(kind: type[R], given: R | None, words: Mapping[str, Any]) -> R:
    """Settings as they were given, with the fields that were given by name.

    Raises
    ------
    ArgumentError
        If there is no such field.
    """
    known = [each.name for each in fields(kind)]  # type: ignore[arg-type]
    for name in words:
        if name not in known:
            hint = did_you_mean(name, known)
            raise ArgumentError(f"no argument {name!r}; {hint}there are {', '.join(known)}")
    whole: Any = kind() if given is None else given
    changed: R = replace(whole, **words)
    return changed


def _fits(value: Any, hint: Any) -> bool:
    """Return True unless the annotation excludes the value."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in inner)
    if hint is np.ndarray:
        return _numbers(value)
    if hint in (int, float):
        kind = Integral if hint is int else Real
        return isinstance(value, kind) and not isinstance(value, bool)
    if hint is Path:
        return isinstance(value, os.PathLike)
    if hint is Any or is_typeddict(hint):
        return hint is Any or isinstance(value, Mapping)
    if origin is Literal:
        return isinstance(value, str)  # the function lists the words
    if origin is tuple and inner[-1] is not Ellipsis:
        return (
            isinstance(value, Sequence | np.ndarray)
            and len(value) == len(inner)
            and all(map(_fits, value, inner))
        )
    if origin in (tuple, Sequence, Iterable):
        single = isinstance(value, str | bytes | Mapping)
        each = value if isinstance(value, Sequence | np.ndarray) else ()
        return isinstance(value, Iterable) and not single and all(_fits(x, inner[0]) for x in each)
    if origin is Mapping and isinstance(value, Mapping):
        return all(_fits(x, inner[1]) for x in value.values())
    if origin is Callable:
        return callable(value)
    kind = origin or hint
    return isinstance(value, kind) if isinstance(kind, type) else True


def _numbers(value: Any) -> bool:
    """Return True for what NumPy takes as an array of numbers."""
    try:
        return np.asarray(value).dtype.kind in "biufc"
    except ValueError:
        return False


def _in_words(value: Any) -> str:
    if isinstance(value, str | Real | NoneType | Sequence):
        text = repr(value)
        return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    return f"an object of the type {type(value).__name__}"


def _noun(hint: Any) -> str:
    """An annotation in words, as 'a path, Case or Model'."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return _either(h for h in inner if h is not str or Path not in inner)
    if origin is tuple and inner[-1] is not Ellipsis:
        return f"{len(inner)} values, each {_either(inner)}"
    if origin in (tuple, Sequence, Iterable):
        return f"a list, each {_noun(inner[0])}"
    if origin is Literal:
        return ", ".join(map(str, inner))
    if origin is Callable:
        return "a function"
    if origin is Mapping:
        return f"a dict with {_noun(inner[1])} for each key"
    name = str(getattr(origin or hint, "__name__", hint))
    return _NOUNS.get(hint) or f"{'an' if name[0] in 'AEIO' else 'a'} {name}"


def _either(hints: Iterable[Any]) -> str:
    *first, last = dict.fromkeys(map(_noun, hints))
    return f"{', '.join(first)} or {last}" if first else last
