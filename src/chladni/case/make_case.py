"""A case from the arguments of a function: the words of ``case.toml``, without a file."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict, cast, get_args

from ..arguments import checked
from ..dynamics.frf import FRF, Quantity
from ..ema.setup import PoleTable, Recording, Sensor
from ..errors import FileError, did_you_mean
from ..io.nastran import Deck
from ..model.assembly import Assembly
from .load import Case, InMemory, resolved
from .schema import SCHEMA, known
from .toml_sections import KeyFile, TomlSection

Measured = str | Path | FRF | PoleTable | Recording | Mapping[str, Any]
"""A measurement: a file, responses, poles, a recording, or the keys of a [[recording]]."""

_RENAMED = {  # argument: word of a case, where the names differ
    "band": ("band", "fit"),
    "held_out_sensors": ("held_out", "sensors"),
    "held_out_band": ("held_out", "band"),
}
_SECTIONS = ("model", "test", "band", "search")  # where an argument has the name of its key


class CaseWords(TypedDict, total=False):
    """Keyword arguments that describe a case, each a word of ``case.toml``.

    Attributes
    ----------
    units : str                   of the deck: SI, mm-t-s, mm-kg-ms, mm-kg-s or in-lb-s
    allow : cards and commands of the deck that are passed over
    thickness, thickness_units, thickness_place : file of the thickness after forming
    damping : float               fraction of critical where responses are drawn or scored
    use : str                     the recording that is compared, by its name, article or level
    quantity : str                of the responses: receptance, mobility, accelerance or
                                  transmissibility, where the recording does not say it
    gain : "known" or "unknown"   unknown: one real factor common to all channels is free
    factor : float                the responses are multiplied by it
    delay : float                 lag of the responses behind the forces [s]
    frequency_unit : Hz, kHz, rad/s or rpm
    conjugated : bool             True if the responses were computed with exp(-iωt)
    sensors : path of a table, or a sequence of ``Sensor``: places, directions and masses of the
                                  channels and drive points
    mass, mass_sd : float         weighed mass of the article [kg]
    gain_sd, direction_sd, position_sd : float   accuracy of the sensors [-, deg, m]
    hangers : grids at which cords hold the article
    band, exclude : (low, high), and pairs left out of it [Hz]
    held_out_sensors : a number, or labels
    held_out_band : (low, high) [Hz]
    effects : names of the effects that ``diagnose`` tries; default all
    parameters : dicts with the keys of a [[parameter]]: field, parts, name, sd, low, high
    """

    units: str
    allow: Sequence[str]
    thickness: str | Path
    thickness_units: str
    thickness_place: str
    damping: float
    use: str
    quantity: Quantity
    gain: str
    factor: float
    delay: float
    frequency_unit: str
    conjugated: bool
    sensors: str | Path | Sequence[Sensor]
    mass: float
    mass_sd: float
    gain_sd: float
    direction_sd: float
    position_sd: float
    hangers: Sequence[int]
    band: tuple[float, float]
    exclude: Sequence[tuple[float, float]]
    held_out_sensors: int | Sequence[str]
    held_out_band: tuple[float, float]
    effects: Sequence[str]
    parameters: Sequence[Mapping[str, Any]]


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
    words = words or {}
    if unknown := [name for name in words if name not in WORDS]:
        hint = did_you_mean(unknown[0], tuple(WORDS))
        raise FileError(f"no argument {unknown[0]!r}; {hint}there are {', '.join(WORDS)}")
    file = _ArgumentFile(Path.cwd() / "arguments", {})
    path = deck.path if isinstance(deck, Deck) else Path(deck)
    file.put("model", "deck", str(path))
    sensors = _sensors(words.get("sensors"))
    for name, value in words.items():
        if name == "parameters":
            for one in value if isinstance(value, list | tuple) else [value]:
                if not isinstance(one, Mapping):
                    raise FileError(
                        f"argument parameters holds {one!r}; give dicts with the keys of a "
                        "[[parameter]]"
                    )
                file.add("parameter", one)
        elif value is not None and not (name == "sensors" and sensors is not None):
            file.put(*WORDS[name], value)
    recordings = _recordings(file, recording, words.get("quantity"))
    read = deck if isinstance(deck, Deck) else None
    return resolved(path, file, InMemory(read, assembly, recordings, sensors, anywhere=True))


def _recordings(
    file: "_ArgumentFile", given: Measured | Sequence[Measured], quantity: str | None
) -> dict[str, tuple[Recording, ...]]:
    """List all recordings in the file; return by their names those that need not be read."""
    single = isinstance(given, str | Path | FRF | PoleTable | Recording | Mapping)
    each = [cast(Measured, given)] if single else list(cast(Sequence[Measured], given))
    names: list[str] = []
    out: dict[str, tuple[Recording, ...]] = {}
    for k, one in enumerate(each):
        if isinstance(one, Mapping):
            file.add("recording", one)
        elif isinstance(one, str | Path):
            names.append(os.fspath(one))
        else:
            held = _recording(one, "recording" if len(each) == 1 else f"recording {k + 1}")
            if quantity is not None and held.frf is not None:
                held = replace(held, frf=_read_as(held.frf, quantity))
            while held.name in names:
                held = replace(held, name=f"{held.name} ({k + 1})")
            names.append(held.name)
            out[held.name] = (held,)
    if names:
        file.put("test", "recordings", names)
    return out


def _recording(one: object, name: str) -> Recording:
    """A recording of what is in memory."""
    if isinstance(one, FRF):
        return Recording(name, frf=one)
    if isinstance(one, PoleTable):
        return Recording(name, poles=one)
    if isinstance(one, Recording):
        return one
    raise FileError(
        f"argument recording is of the type {type(one).__name__}; give a path, an FRF, a "
        "PoleTable, a Recording or a dict with the keys of a [[recording]]"
    )


def _read_as(frf: FRF, quantity: str) -> FRF:
    """Read responses as another quantity than they name."""
    if quantity not in get_args(Quantity):
        raise FileError(
            f"argument quantity = {quantity!r}; there are {', '.join(get_args(Quantity))}"
        )
    return replace(frf, quantity=cast(Quantity, quantity))


def _sensors(given: object) -> tuple[Sensor, ...] | None:
    """The sensors where they are objects; None where a file holds them."""
    if given is None or isinstance(given, str | Path):
        return None
    each = tuple(given) if isinstance(given, Iterable) else (given,)
    if wrong := [type(one).__name__ for one in each if not isinstance(one, Sensor)]:
        raise FileError(
            f"argument sensors holds an object of the type {wrong[0]}; give the path of a table, "
            "or a sequence of chladni.Sensor"
        )
    return cast(tuple[Sensor, ...], each)


def _plain(value: Any) -> Any:
    """A value as TOML holds it: lists for tuples and arrays, text for paths."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return os.fspath(value) if isinstance(value, Path) else value


WORDS = {  # argument: section and key
    name: _RENAMED.get(name) or next((s, name) for s in _SECTIONS if name in known(s))
    for name in CaseWords.__annotations__
    if name != "parameters"
} | {"parameters": ("parameter", "")}
_ARGUMENT = {word: name for name, word in WORDS.items()} | {("test", "recordings"): "recording"}
_REPEATED = {"parameter": "parameters", "recording": "recording"}


class _Arguments(TomlSection):
    """Arguments of a function in place of a section of a file."""

    def at(self, key: str) -> str:
        """'argument band', to begin a sentence with."""
        if self.name in _REPEATED:
            return f"argument {_REPEATED[self.name]}, number {self.line}: {key}"
        return f"argument {_ARGUMENT.get((self.name, key), key)}"

    def lacks(self, key: str) -> str:
        """Say that an argument is missing."""
        among = next((k.choices for k in SCHEMA if (k.section, k.name) == (self.name, key)), ())
        return f"{self.at(key)} is missing{'; there are ' if among else ''}{', '.join(among)}"


class _ArgumentFile(KeyFile):
    """All arguments, by the sections of a case."""

    def put(self, section: str, key: str, value: object) -> None:
        """Add a key to a single section."""
        if section not in self.tables:
            self.tables[section] = [self.empty(section)]
        self.tables[section][0].values[key] = _plain(value)

    def add(self, section: str, values: Mapping[str, Any]) -> None:
        """Add a section that may be repeated."""
        there = self.tables.setdefault(section, [])
        there.append(_Arguments(self.path, section, _plain(values), {}, len(there) + 1))

    def written(self, section: str, key: str, example: str) -> str:
        """Say which argument is meant."""
        return f"the {self.empty(section).at(key)}"

    def empty(self, name: str) -> TomlSection:
        """A section of which no argument was given."""
        return _Arguments(self.path, name, {}, {}, 1)
