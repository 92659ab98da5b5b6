"""A case from the arguments of a function: the words of ``case.toml``, without a file."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from ..arguments import checked
from ..dynamics.frf import FRF, MOTION_OVER_FORCE, Quantity, Recorded
from ..ema.setup import PoleTable, Recording, Sensor
from ..errors import FileError, did_you_mean
from ..io.nastran import Deck
from ..model.assembly import Assembly
from .key import Key
from .load import Case, resolved
from .request import Request, Stated, stated
from .schema import ARGUMENTS, ONCE, PARAMETER, RECORDING, CaseWords

Measured = str | Path | FRF | PoleTable | Recording | Mapping[str, Any]
"""A measurement: a file, responses, poles, a recording, or the keys of a [[recording]]."""


@checked
def make_case(
    deck: str | Path | Deck,
    recording: Measured | Sequence[Measured] = (),
    assembly: Assembly | None = None,
    words: CaseWords | None = None,
) -> Case:
    """Resolve a case that no file describes, as :func:`load_case` resolves a ``case.toml``.

    Parameters
    ----------
    deck : path, or a deck that was read
    recording : one or several; the first is compared with the model
    assembly : the structure, SI, where it differs from the deck's
    words : the rest, by the names of :class:`CaseWords`

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence that names the argument, the offender and the alternatives.
    """
    given: dict[str, Any] = {k: v for k, v in (words or {}).items() if v is not None}
    if unknown := [name for name in words or {} if name not in ARGUMENTS]:
        hint = did_you_mean(unknown[0], ARGUMENTS)
        raise FileError(f"no argument {unknown[0]!r}; {hint}there are {', '.join(ARGUMENTS)}")
    path = deck.path if isinstance(deck, Deck) else Path(deck)
    parameters = _each(given.pop("parameters", ()), Mapping)
    if wrong := [one for one in parameters if not isinstance(one, Mapping)]:
        raise FileError(
            f"argument parameters holds {wrong[0]!r}; give dicts with the keys of a [[parameter]]"
        )
    sensors = _sensors(given)
    names, dicts, held = _measured(_each(recording, FRF | PoleTable | Recording | Mapping))
    given |= {"deck": path} | ({"recordings": names} if names else {})
    said = _stated(ONCE, given)
    request = Request(
        path,
        said,
        _repeated(RECORDING, dicts, "recording"),
        _repeated(PARAMETER, parameters, "parameters"),
        by_program=True,
        deck=deck if isinstance(deck, Deck) else None,
        assembly=assembly,
        sensors=sensors,
        held={r.name: _read_as(r, said.words.get("quantity")) for r in held},
    )
    return resolved(request)


def _each(given: Any, one: Any) -> list[Any]:
    """Several as they are, one as a list of one."""
    single = isinstance(given, str | Path | one) or not isinstance(given, Iterable)
    return [given] if single else list(given)


def _stated(keys: Sequence[Key], given: Mapping[str, Any], within: str = "") -> Stated[Any]:
    """Check arguments, or the keys of a dict within one, against the model."""

    def at(name: str) -> str:
        return f"argument {within}{'recording' if name == 'recordings' else name}"

    def missing(key: Key) -> str:
        among = f"; there are {', '.join(key.choices)}" if key.choices else ""
        return f"{at(key.name)} is missing{among}"

    keys = [replace(key, name=key.argument) for key in keys]
    return stated(keys, _plain(given), at, missing, f"argument {within.rstrip(': ')}")


def _repeated(keys: Sequence[Key], dicts: Sequence[Any], argument: str) -> tuple[Stated[Any], ...]:
    return tuple(
        _stated(keys, one, f"{argument}, number {k}: ") for k, one in enumerate(dicts, start=1)
    )


def _measured(
    each: Sequence[Any],
) -> tuple[list[str], list[Mapping[str, Any]], list[Recording]]:
    """Names of recordings, the dicts among them, and those of the names that are in memory."""
    names: list[str] = []
    dicts: list[Mapping[str, Any]] = []
    held: list[Recording] = []
    for k, one in enumerate(each, start=1):
        if isinstance(one, Mapping):
            dicts.append(one)
        elif isinstance(one, str | Path):
            names.append(os.fspath(one))
        else:
            r = _recording(one, "recording" if len(each) == 1 else f"recording {k}")
            while r.name in names:
                r = replace(r, name=f"{r.name} ({k})")
            names.append(r.name)
            held.append(r)
    return names, dicts, held


def _recording(one: FRF | PoleTable | Recording, name: str) -> Recording:
    """A recording of what is in memory."""
    if isinstance(one, Recording):
        return one
    return Recording(name, frf=one) if isinstance(one, FRF) else Recording(name, poles=one)


def _read_as(r: Recording, quantity: Recorded | None) -> Recording:
    """A recording whose responses are of another quantity than they name."""
    if quantity is None or r.frf is None:
        return r
    if quantity in MOTION_OVER_FORCE:
        return r.reciprocal(quantity)
    return replace(r, frf=replace(r.frf, quantity=cast(Quantity, quantity)))


def _sensors(given: dict[str, Any]) -> tuple[Sensor, ...]:
    """Take sensors that are objects out of the words; none where a file holds them."""
    if isinstance(given.get("sensors", ""), str | Path):
        return ()
    each = tuple(_each(given.pop("sensors"), Sensor))
    if wrong := [type(one).__name__ for one in each if not isinstance(one, Sensor)]:
        raise FileError(
            f"argument sensors holds an object of the type {wrong[0]}; give the path of a table, "
            "or a sequence of chladni.Sensor"
        )
    return each


def _plain(value: Any) -> Any:
    """A value as TOML holds it: lists for tuples and arrays, text for paths."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return os.fspath(value) if isinstance(value, Path) else value
