"""Elements that take a property of their own, a copy of the old one with what changed in it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly, picked
from ....model.properties import ShellSection
from ....units import Units
from .. import Add, Deck, Delete, SetField
from ..text.cards import position
from ..text.format import Value
from ..text.table import Cards
from .changes import Change

Split = dict[int, int]  # id of a new property: id of the one it is a copy of
SHEETS = ("CQUAD4", "CTRIA3", "CQUADR", "CTRIAR", "CQUAD8", "CTRIA6")
SOLIDS = ("CHEXA", "CPENTA", "CPYRAM", "CPYRA", "CTETRA")
BEAMS = ("CBAR", "CBEAM", "CROD", "CTUBE")
PROPERTIES = ("PSHELL", "PSOLID", "PBAR", "PBARL", "PBEAM", "PBEAML", "PROD", "PTUBE")


def with_new_properties(
    before: Assembly, after: Assembly, free: Iterator[int]
) -> tuple[Assembly, Assembly, Split]:
    """Both assemblies with the same parts, new ones under ids from ``free``.

    A part that only ``after`` has must have all its elements from one part of ``before``.

    Raises
    ------
    ModelError
        If elements changed their part otherwise.
    """
    known = len(before.parts)
    pairs = [(old.part, new.part) for old, new in zip(_groups(before), _groups(after), strict=True)]
    if any((now[was != now] < known).any() for was, now in pairs):
        raise ModelError("an element went from one property of the deck to another one")
    old, new, split = list(before.parts), list(after.parts), Split()
    for k in range(known, len(new)):
        sources = set(np.concatenate([was[now == k] for was, now in pairs]).tolist())
        if len(sources) != 1:
            raise ModelError(f"the elements of {new[k].name} come from {len(sources)} properties")
        source = before.parts[sources.pop()]
        new[k] = replace(new[k], id=next(free))
        old.append(replace(new[k], section=source.section))
        split[new[k].id] = source.id
    moved = replace(
        before, parts=tuple(old), shells=replace(before.shells, part=after.shells.part),
        beams=replace(before.beams, part=after.beams.part),
        solids=tuple(
            replace(was, part=now.part)
            for was, now in zip(before.solids, after.solids, strict=True)
        ),
    )  # fmt: skip
    return moved, after.with_parts(tuple(new)), split


def _groups(assembly: Assembly) -> tuple[Any, ...]:
    return assembly.shells, assembly.beams, *assembly.solids


def split_changes(
    deck: Deck, after: Assembly, split: Split, changes: Sequence[Change]
) -> list[Change]:
    """The changes with those of a new property put into its card, and its elements told its id."""
    fields: dict[int, dict[int, Value]] = {id: {1: id} for id in split}
    out: list[Change] = []
    for change in changes:
        if isinstance(change, SetField) and change.kind in PROPERTIES and change.id in split:
            fields[change.id][position(change.kind, str(change.field))] = change.value
        else:
            out.append(change)
    for k, part in enumerate(after.parts):
        if part.id in split:
            out.append(Add([_card(deck, split[part.id], fields[part.id])], part.name))
            out += [
                SetField(kind, id, "PID", part.id)
                for group, kinds in _with_kinds(after)
                for kind, id in _named(deck, kinds, group.ids[group.part == k])
            ]
    return out


def _with_kinds(assembly: Assembly) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Groups of elements with parts, and the cards they may stand on."""
    yield assembly.shells, SHEETS
    yield assembly.beams, BEAMS
    yield from ((group, SOLIDS) for group in assembly.solids)


def _named(deck: Deck, kinds: Sequence[str], ids: np.ndarray) -> Iterator[tuple[str, int]]:
    """(card, id) of elements."""
    if not len(ids):
        return
    for cards in deck.present(*kinds):
        for id in cards.integers(1)[np.isin(cards.integers(1), ids)].tolist():
            yield cards.name, int(id)


def taken_out(deck: Deck, before: Assembly, after: Assembly) -> tuple[Assembly, list[Change]]:
    """The assembly less the solids, beams and bushes that the other has no more; their cards."""
    changes: list[Change] = []

    def kept(was: Any, now: Any, kinds: tuple[str, ...]) -> Any:
        stays = np.isin(was.ids, now.ids)
        changes.extend(Delete(kind, id) for kind, id in _named(deck, kinds, was.ids[~stays]))
        return type(was)(**{name: column[stays] for name, column in vars(was).items()})

    solids = tuple(
        kept(was, now, SOLIDS) for was, now in zip(before.solids, after.solids, strict=True)
    )
    beams = kept(before.beams, after.beams, (*BEAMS, "CONROD"))
    bushes = kept(before.bushes, after.bushes, ("CBUSH", "CBUSH1D", "CWELD", "CFAST"))
    masses, gone = before.masses, np.setdiff1d(before.bushes.ids, bushes.ids)
    left = {*zip(after.masses.ids.tolist(), after.masses.node.tolist(), strict=True)}
    stays = [  # the mass of a CFAST that was taken out does not
        id not in gone or (id, node) in left
        for id, node in zip(masses.ids.tolist(), masses.node.tolist(), strict=True)
    ]
    masses = picked(masses, np.array(stays, bool))
    return replace(before, solids=solids, beams=beams, bushes=bushes, masses=masses), changes


def section_changes(before: Assembly, after: Assembly, units: Units) -> list[Change]:
    """12I/T**3 and NSM of every part whose bending stiffness or mass alone changed."""
    out: list[Change] = []
    for was, now in zip(before.parts, after.parts, strict=True):
        old, new = was.section, now.section
        if not isinstance(old, ShellSection) or not isinstance(new, ShellSection):
            continue
        if old.bending_ratio != new.bending_ratio:
            out.append(SetField("PSHELL", now.id, "12I/T3", new.bending_ratio))
        if old.nonstructural != new.nonstructural:
            load = new.nonstructural / (units.inertia / units.length**2)
            out.append(SetField("PSHELL", now.id, "NSM", load))
    return out


def property_kind(deck: Deck, id: int) -> str:
    """Name of the card of a property of elements, "" where none here has the id."""
    for kind in (kind for kind in PROPERTIES if kind in deck.cards):
        if str(id).encode() in deck[kind].words(1).tolist():
            return kind
    return ""


def _card(deck: Deck, source: int, fields: dict[int, Value]) -> list[Value]:
    """A property as another one, but for some fields."""
    kind = property_kind(deck, source)
    if not kind:
        raise ModelError(f"{deck.path}: property {source} is none of {', '.join(PROPERTIES)}, so "
                         "its elements cannot have their own copy")  # fmt: skip
    return copied(deck[kind], source, fields)


def copied(cards: Cards, source: int, fields: Mapping[int, Value]) -> list[Value]:
    """The card of this id, but for some fields {position: value}."""
    row = int(np.flatnonzero(cards.integers(1) == source)[0])
    card: list[Value] = [word or None for word in cards.fields(row)]
    card += [None] * (max(fields) - len(card))
    for k, value in fields.items():
        card[k - 1] = value
    return [cards.name, *card]
