"""Areas and moments of beams that changed: in their own card, or in the plain one in its place."""

from collections.abc import Iterator, Sequence

import numpy as np

from ....model.assembly import Assembly
from ....model.properties import BeamSection
from ....units import Units
from .. import Deck, Replace, SetField
from ..export.part_cards import beam_card
from ..text.format import Value
from .changes import Change
from .split_properties import Split, property_kind

_FIELDS = {"area": "A", "I1": "I1", "I2": "I2", "I12": "I12", "J": "J"}
_OWN = {"PBAR": ("area", "I1", "I2", "I12", "J"), "PROD": ("area", "J")}  # say them one by one


def with_sections(
    deck: Deck,
    before: Assembly,
    after: Assembly,
    units: Units,
    split: Split,
    known: Sequence[Change],
) -> list[Change]:
    """The known changes, and those of areas and moments.

    A card that gives dimensions of a profile, or several stations, becomes the PBAR, PBEAM or PROD
    of the same property.
    """
    out = list(known)
    for was, now in zip(before.parts, after.parts, strict=True):
        old, new = was.section, now.section
        if not isinstance(old, BeamSection) or not isinstance(new, BeamSection):
            continue
        if not (differ := [n for n in _FIELDS if _apart(getattr(old, n), getattr(new, n))]):
            continue
        kind = property_kind(deck, split.get(now.id, now.id))
        if set(differ) <= set(_OWN.get(kind, ())):
            out += _fields(kind, now.id, new, differ, units)
            continue
        row = deck[kind].integers(1) == split.get(now.id, now.id)
        mid: Value = int(deck[kind].integers(2)[row][0])
        for change in [c for c in out if isinstance(c, SetField)]:
            if (change.kind, change.id, change.field) == (kind, now.id, "MID"):
                mid = change.value
                out.remove(change)
        name, values = beam_card(new, now.id, mid, units)
        out.append(Replace(kind, now.id, [name, *values]))
    return out


def _apart(a: float, b: float) -> bool:
    return not np.isclose(a, b, rtol=1e-9, atol=0)


def _fields(
    kind: str, id: int, section: BeamSection, names: Sequence[str], units: Units
) -> Iterator[Change]:
    for name in names:
        size = units.length ** (2 if name == "area" else 4)
        yield SetField(kind, id, _FIELDS[name], getattr(section, name) / size)
