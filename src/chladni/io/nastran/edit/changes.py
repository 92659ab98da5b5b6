"""Changes to a deck: a field set, many fields set, cards added, deleted, replaced."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....errors import LabelError
from ..text.cards import FIELDS
from ..text.deck import Deck
from ..text.format import Value
from ..text.table import Cards


@dataclass(frozen=True)
class SetField:
    """PSHELL 101's T becomes 0.8: ``SetField("PSHELL", 101, "T", 0.8)``.

    ``field`` is a name of the Quick Reference Guide, or a position after the card's name.
    """

    kind: str
    id: int
    field: str | int
    value: Value


@dataclass(frozen=True, eq=False)
class SetColumns:
    """Fields (k,) of many cards (n,) at once; values (n, k), NaN: leave alone."""

    kind: str
    ids: np.ndarray
    fields: tuple[str | int, ...]
    values: np.ndarray


@dataclass(frozen=True)
class Add:
    """Cards appended before ENDDATA under a comment; each is (name, field, field, ...)."""

    cards: Sequence[Sequence[Value]]
    comment: str = ""


@dataclass(frozen=True)
class Delete:
    """A card taken out."""

    kind: str
    id: int


@dataclass(frozen=True)
class DeleteRow:
    """A card without an id of its own (SPC1) taken out: the i-th of its kind."""

    kind: str
    row: int


@dataclass(frozen=True)
class Replace:
    """A card whose place another takes: MAT1 7 becomes ("MAT8", 7, ...)."""

    kind: str
    id: int
    card: Sequence[Value]


Change = SetField | SetColumns | Add | Delete | DeleteRow | Replace


@dataclass(frozen=True, eq=False)
class SortedChanges:
    """Changes sorted by card: {(kind, row): {position: value}}; whole cards; additions."""

    fields: dict[tuple[str, int], dict[int, Value]]
    whole: dict[tuple[str, int], Sequence[Value] | None]
    added: list[Add]


def plan(deck: Deck, changes: Sequence[Change]) -> SortedChanges:
    """Find the cards the changes name.

    Raises
    ------
    LabelError
        If a card or a field does not exist, or an id belongs to several cards.
    """
    out = SortedChanges({}, {}, [])
    rows: dict[str, dict[int, int]] = {}
    for change in changes:
        if isinstance(change, Add):
            out.added.append(change)
            continue
        if isinstance(change, DeleteRow):
            out.whole[change.kind, change.row] = None
            continue
        known = rows.setdefault(change.kind, _rows(deck, change.kind))
        if isinstance(change, SetColumns):
            _columns(deck, change, known, out)
            continue
        key = (change.kind, _row(deck, change.kind, change.id, known))
        if isinstance(change, SetField):
            out.fields.setdefault(key, {})[_position(change.kind, change.field)] = change.value
        else:
            out.whole[key] = change.card if isinstance(change, Replace) else None
    return out


def _columns(deck: Deck, change: SetColumns, known: dict[int, int], out: SortedChanges) -> None:
    """The changes of many cards."""
    at = [_position(change.kind, f) for f in change.fields]
    values = np.asarray(change.values, float).reshape(len(change.ids), len(at)).tolist()
    for id, row in zip(np.asarray(change.ids).tolist(), values, strict=True):
        wanted = {k: v for k, v in zip(at, row, strict=True) if v == v}
        if wanted:
            key = (change.kind, _row(deck, change.kind, id, known))
            out.fields.setdefault(key, {}).update(wanted)


def _rows(deck: Deck, kind: str) -> dict[int, int]:
    """{id: row of the table}; -1 where several cards have the id."""
    cards: Cards = deck[kind]
    out: dict[int, int] = {}
    for i, word in enumerate(cards.words(1).tolist()):
        if word.isdigit():
            out[int(word)] = -1 if int(word) in out else i
    return out


def _row(deck: Deck, kind: str, id: int, known: dict[int, int]) -> int:
    row = known.get(id)
    if row is None:
        there = ", ".join(map(str, list(known)[:8])) or "none at all"
        raise LabelError(f"{deck.path} has no {kind} {id}; there are {there}")
    if row < 0:
        raise LabelError(f"{deck.path} has several {kind} {id}, so the reference is ambiguous")
    return row


def _position(kind: str, field: str | int) -> int:
    """Position of a field after the card's name, from 1."""
    known = FIELDS.get(kind, ())
    if isinstance(field, int):
        return field
    if field not in known or field == "-":
        names = ", ".join(n for n in known if n != "-") or "positions only (1, 2, ...)"
        raise LabelError(f"{kind} has no field {field!r}; there are {names}")
    return known.index(field) + 1
