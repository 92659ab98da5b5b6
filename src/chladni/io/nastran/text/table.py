"""All cards of one name as arrays of texts, and their columns as numbers."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from ....errors import FileError
from . import numbers
from .cards import FIELDS

_BEYOND = 1e60  # no number of a structure in any units is larger; products of them would overflow


@dataclass(frozen=True, eq=False)
class Cards:
    """Cards of one name, fields one after another."""

    name: str
    text: np.ndarray  # (N,) bytes; fields after the name, stripped, upper case, card after card
    start: np.ndarray  # (n + 1,) int; where each card's fields begin in ``text``
    file: np.ndarray  # (n,) int; position of the file in ``Deck.sources``
    lines: np.ndarray  # (m,) int; line numbers (from 1) of the cards, card after card
    line_start: np.ndarray  # (n + 1,) where each card's lines begin in ``lines``
    files: tuple[Path, ...] = ()  # paths of all files of the deck, for messages

    def __len__(self) -> int:
        return len(self.file)

    def where(self, i: int) -> str:
        """file:line of card i, as messages begin."""
        return f"{self.files[self.file[i]]}:{self.lines[self.line_start[i]]}"

    def width(self) -> int:
        """Fields of the longest card."""
        return int(np.diff(self.start).max(initial=0))

    def fields(self, i: int) -> list[str]:
        """Texts of card i, trailing blanks dropped."""
        text = self.text[self.start[i] : self.start[i + 1]]
        filled = np.flatnonzero(text != b"")
        return [t.decode("latin-1") for t in text[: filled[-1] + 1 if len(filled) else 0].tolist()]

    def words(self, k: int) -> np.ndarray:
        """Texts (n,) of field k, 1 being the first after the name; blank where absent."""
        at = self.start[:-1] + k - 1
        inside = at < self.start[1:]
        if not len(self.text):
            return np.full(len(self), b"")
        return np.where(inside, self.text[np.minimum(at, len(self.text) - 1)], b"")

    def field_name(self, k: int) -> str:
        """How the manual calls field k."""
        known = FIELDS.get(self.name, ())
        return known[k - 1] if k <= len(known) and known[k - 1] != "-" else f"field {k}"

    def refuse(self, i: int, why: str) -> FileError:
        """The error about card i: file:line: NAME id: why."""
        who = self.words(1)[i].decode("latin-1")
        return FileError(f"{self.where(i)}: {f'{self.name} {who}'.strip()}: {why}")

    def required(self, text: np.ndarray, k: int) -> None:
        """Refuse the first card whose field k is blank."""
        if np.any(blank := text == b""):
            i = int(np.argmax(blank))
            raise self.refuse(i, f"{self.field_name(k)} is blank, the card is not complete")

    def integers(self, k: int, blank: int | None = None) -> np.ndarray:
        """Integers (n,) of field k; a blank is refused unless its meaning is given."""
        text = self.words(k)
        if blank is None:
            self.required(text, k)
        values, bad = numbers.integers(text, 0 if blank is None else blank)
        if bad >= 0:
            raise self._bad(bad, k, text[bad], "an integer")
        return values

    def reals(self, k: int, blank: float | None = None) -> np.ndarray:
        """Reals (n,) of field k; a blank is refused unless its meaning is given."""
        text = self.words(k)
        if blank is None:
            self.required(text, k)
        values, bad = numbers.reals(text, 0.0 if blank is None else blank)
        if bad >= 0:
            raise self._bad(bad, k, text[bad], "a number")
        if np.any(beyond := np.abs(values) > _BEYOND):
            at = int(np.argmax(beyond))
            raise self._bad(at, k, text[at], "a number of any structure")
        return values

    def properties(self, blank: int | None = 0) -> np.ndarray:
        """Ids (n,) of the properties of elements, field 2; 0 stands for the element's own id."""
        pid = self.integers(2, blank)
        return np.where(pid == 0, self.integers(1), pid)

    def _bad(self, i: int, k: int, word: bytes, kind: str) -> FileError:
        return self.refuse(i, f"{self.field_name(k)} is {word.decode('latin-1')!r}, not {kind}")

    def word(self, i: int, k: int) -> str:
        """Text of field k of card i."""
        at = self.start[i] + k - 1
        return str(self.text[at].decode("latin-1")) if at < self.start[i + 1] else ""

    def integer(self, i: int, k: int, blank: int | None = None) -> int:
        """Integer in field k of card i."""
        return int(self.single(i).integers(k, blank)[0])

    def real(self, i: int, k: int, blank: float | None = None) -> float:
        """Real in field k of card i."""
        return float(self.single(i).reals(k, blank)[0])

    def single(self, i: int) -> Self:
        """Card i alone, without copying."""
        a, b = self.start[i], self.start[i + 1]
        c, d = self.line_start[i], self.line_start[i + 1]
        return replace(
            self,
            text=self.text[a:b],
            start=np.array([0, b - a]),
            file=self.file[i : i + 1],
            lines=self.lines[c:d],
            line_start=np.array([0, d - c]),
        )

    def block(self, k: int, count: int, blank: float | None = None) -> np.ndarray:
        """Reals (n, count) of fields k, k+1, ..."""
        return np.stack([self.reals(k + j, blank) for j in range(count)], axis=1)

    def ids(self, k: int, count: int, blank: int | None = None) -> np.ndarray:
        """Integers (n, count) of fields k, k+1, ..."""
        return np.stack([self.integers(k + j, blank) for j in range(count)], axis=1)

    def take(self, which: np.ndarray) -> Self:
        """Only these cards (positions or mask)."""
        which = np.flatnonzero(which) if which.dtype == bool else which
        text, start = _gather(self.text, self.start, which)
        lines, line_start = _gather(self.lines, self.line_start, which)
        return replace(
            self, text=text, start=start, file=self.file[which], lines=lines, line_start=line_start
        )

    def unique(self, k: int = 1) -> np.ndarray:
        """Ids (n,) of field k; refuses two cards with the same one."""
        ids = self.integers(k)
        order = np.argsort(ids, kind="stable")
        same = np.flatnonzero(np.diff(ids[order]) == 0)
        if len(same):
            first, again = order[same[0]], order[same[0] + 1]
            raise self.refuse(int(again), f"the id is already taken at {self.where(int(first))}")
        return ids


def _gather(values: np.ndarray, start: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, ...]:
    """Ragged rows ``which`` of (values, start)."""
    count = (start[1:] - start[:-1])[which]
    new = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    at = np.repeat(start[:-1][which] - new[:-1], count) + np.arange(new[-1])
    return values[at], new


def empty(name: str, files: tuple[Path, ...] = ()) -> Cards:
    """No cards of this name."""
    none, zero = np.zeros(0, np.int64), np.zeros(1, np.int64)
    return Cards(name, np.zeros(0, "S8"), zero, none, none, zero, files)


def joined(tables: list[Cards]) -> Cards:
    """The cards of several files, one after another."""
    if len(tables) == 1:
        return tables[0]
    return replace(
        tables[0],
        text=np.concatenate([t.text for t in tables]),
        start=_chained([t.start for t in tables]),
        file=np.concatenate([t.file for t in tables]),
        lines=np.concatenate([t.lines for t in tables]),
        line_start=_chained([t.line_start for t in tables]),
    )


def _chained(starts: list[np.ndarray]) -> np.ndarray:
    counts = np.concatenate([np.diff(s) for s in starts])
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
