"""A case as it was stated, by a file or by arguments: words of their types, and their places."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..ema.setup import Recording, Sensor
from ..errors import FileError, did_you_mean, named, shortened
from ..io.file_size import LEADS_OUT, lies_within
from ..io.nastran import Deck
from ..model.assembly import Assembly
from ..results import ShownBriefly
from .key import NEEDED, Key
from .schema import ONCE, PARAMETER, RECORDING, OnceWords, ParameterWords, RecordingWords

W = TypeVar("W", bound=Mapping[str, Any])


@dataclass(frozen=True)
class Stated(Generic[W]):
    """Words that were stated together."""

    words: W  # by their names in Python, without those that are missing
    places: Mapping[str, str]  # of every word: 'case.toml, line 7: [test] gain' begins a sentence
    whole: str = ""  # all of them: 'the [[parameter]] of line 21'


@dataclass(frozen=True, eq=False, repr=False)
class Request(ShownBriefly):
    """A case before it is resolved, with what a program holds already in place of files."""

    path: Path  # of the case, as messages name it
    said: Stated[OnceWords]
    recordings: tuple[Stated[RecordingWords], ...]
    parameters: tuple[Stated[ParameterWords], ...]
    by_program: bool = False  # stated by arguments
    deck: Deck | None = None  # None: to be read
    sensors: tuple[Sensor, ...] = ()
    assembly: Assembly | None = None  # None: that of the deck
    held: Mapping[str, Recording] = field(default_factory=dict)  # by the names that list them

    @property
    def anywhere(self) -> bool:
        """True if files may lie outside of the folder of the case."""
        return self.by_program or self.said.words.get("outside", False)

    @property
    def given(self) -> tuple[tuple[str, str], ...]:
        """(section, key) of every word."""
        parts = ((ONCE, (self.said,)), (RECORDING, self.recordings), (PARAMETER, self.parameters))
        return tuple(
            (key.section, key.name)
            for keys, every in parts
            for each in every
            for key in keys
            if key.argument in each.words
        )

    def file(self, name: str, at: str) -> Path:
        """A file that a word names, in the folder of the case unless others are allowed.

        Raises
        ------
        FileError
            If it lies elsewhere, or there is none; ``at`` begins the sentence.
        """
        folder = Path.cwd() if self.by_program else self.path.parent
        path, said = folder / name, shortened(repr(name))
        if "\0" in name:
            raise FileError(f"{at} = {said} is not a file name")
        if not self.anywhere and not lies_within(path, folder):
            raise FileError(f"{at} = {said} {LEADS_OUT}")
        try:
            exists = path.is_file()
        except OSError:
            raise FileError(f"{at} = {said} is no file name") from None
        if not exists:
            there = sorted(p.name for p in path.parent.glob("*") if p.is_file())
            fit = [n for n in there if Path(n).suffix == path.suffix] or there
            rest = f"there are {named(fit, 8)}" if fit else "its folder has no files"
            hint = did_you_mean(path.name, there)
            raise FileError(f"{at}: there is no file {said}; {hint}{rest}")
        return path


def stated(
    keys: Sequence[Key],
    values: Mapping[str, Any],
    at: Callable[[str], str],
    missing: Callable[[Key], str],
    whole: str = "",
) -> Stated[Any]:
    """Values by the names of their keys, compared with the model.

    Parameters
    ----------
    at : the place of a name, to begin a sentence with
    missing : the sentence on a key that is needed

    Raises
    ------
    FileError
        If a name is unknown, a needed one is missing or a value is wrong.
    """
    known = {key.name: key for key in keys}
    for name in values:
        if name not in known:
            hint = did_you_mean(name, known)
            raise FileError(f"{at(name)} is unknown; {hint}known are {', '.join(known)}")
    for key in keys:
        if key.default == NEEDED and key.name not in values:
            raise FileError(missing(key))
    words = {known[name].argument: known[name].read(at(name), v) for name, v in values.items()}
    return Stated(words, {key.argument: at(key.name) for key in keys}, whole)
