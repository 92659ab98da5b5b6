"""Shells that take a property of their own: a copy of the old one, with what changed in it."""

from collections.abc import Sequence
from dataclasses import replace

from ....errors import ModelError
from ....model.assembly import Assembly
from ....model.properties import ShellSection
from ....units import Units
from .. import Add, Deck, SetField
from ..text.cards import position
from ..text.format import Value
from .changes import Change

Split = dict[int, int]  # id of a new property: id of the one it is a copy of


def with_new_properties(
    deck: Deck, before: Assembly, after: Assembly
) -> tuple[Assembly, Assembly, Split]:
    """Both assemblies with the same parts, new ones under ids the deck has free.

    A part that only ``after`` has must have all its shells from one part of ``before``.

    Raises
    ------
    ModelError
        If shells changed their part otherwise.
    """
    known, moved = len(before.parts), before.shells.part != after.shells.part
    if (after.shells.part[moved] < known).any():
        raise ModelError("a shell went from one property of the deck to another one")
    old, new, split = list(before.parts), list(after.parts), Split()
    free = 1 + max(max(p.id for p in new), *property_ids(deck))
    for k in range(known, len(new)):
        sources = set(before.shells.part[after.shells.part == k].tolist())
        if len(sources) != 1:
            raise ModelError(f"the shells of {new[k].name} come from {len(sources)} properties")
        source = before.parts[sources.pop()]
        new[k] = replace(new[k], id=free)
        old.append(replace(new[k], section=source.section))
        split[free], free = source.id, free + 1
    shells = replace(before.shells, part=after.shells.part)
    return replace(before, parts=tuple(old), shells=shells), after.with_parts(tuple(new)), split


def split_changes(
    deck: Deck, after: Assembly, split: Split, changes: Sequence[Change]
) -> list[Change]:
    """The changes with those of a new property put into its card, and its shells told its id."""
    fields: dict[int, dict[int, Value]] = {id: {1: id} for id in split}
    out: list[Change] = []
    for change in changes:
        if isinstance(change, SetField) and change.kind == "PSHELL" and change.id in split:
            fields[change.id][position("PSHELL", change.field)] = change.value
        else:
            out.append(change)
    for k, part in enumerate(after.parts):
        if part.id not in split:
            continue
        out.append(Add([_card(deck, split[part.id], fields[part.id])], part.name))
        mine = after.shells.part == k
        for kind, chosen in (
            ("CQUAD4", mine & ~after.shells.triangle), ("CTRIA3", mine & after.shells.triangle)
        ):  # fmt: skip
            out += [SetField(kind, int(i), "PID", part.id) for i in after.shells.ids[chosen]]
    return out


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
            load = new.nonstructural / (units.mass / units.length**2)
            out.append(SetField("PSHELL", now.id, "NSM", load))
    return out


def property_ids(deck: Deck) -> list[int]:
    """Ids of all cards that may be properties; 0 where there is none."""
    kinds = [kind for kind in deck.cards if kind.startswith("P")]
    words = [word for kind in kinds for word in deck[kind].words(1).tolist()]
    return [0, *(int(word) for word in words if word.isdigit())]


def _card(deck: Deck, source: int, fields: dict[int, Value]) -> list[Value]:
    """A PSHELL as another one, but for some fields."""
    cards = deck["PSHELL"]
    row = next((i for i in range(len(cards)) if cards.fields(i)[0] == str(source)), None)
    if row is None:
        raise ModelError(f"{deck.path}: property {source} is no PSHELL, so shells of it cannot "
                         "have a copy of their own")  # fmt: skip
    card: list[Value] = [word or None for word in cards.fields(row)]
    card += [None] * (max(fields) - len(card))
    for k, value in fields.items():
        card[k - 1] = value
    return ["PSHELL", *card]
