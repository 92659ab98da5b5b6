"""Areas and moments of beams that changed: in their own card, or in the plain one in its place."""

from collections.abc import Iterator, Sequence

import numpy as np

from ....model.assembly import Assembly
from ....model.properties import BeamSection
from ....units import Units
from .. import Deck, Replace, SetColumns, SetField
from ..export.part_cards import beam_card
from ..text.format import Value
from .changes import Change
from .split_properties import Split, property_kind

_FIELDS = {"area": "A", "I1": "I1", "I2": "I2", "I12": "I12", "J": "J"}
_OFFSET = ("W1A", "W2A", "W3A", "W1B", "W2B", "W3B")
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


def offset_changes(deck: Deck, before: Assembly, after: Assembly) -> list[Change]:
    """Offsets of bars times one factor each, in whatever frame their card gives them."""
    size = [np.linalg.norm(a.beams.offset.reshape(-1, 6), axis=1) for a in (before, after)]
    n = len(size[0])
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = size[1][:n] / size[0]
    moved = np.flatnonzero(np.isfinite(factor) & ~np.isclose(factor, 1.0, rtol=1e-9))
    wanted = dict(zip(before.beams.ids[moved].tolist(), factor[moved].tolist(), strict=True))
    out: list[Change] = []
    for kind in ("CBAR", "CBEAM"):
        cards = deck[kind]
        rows = [i for i, id in enumerate(cards.integers(1).tolist()) if id in wanted]
        if not rows:
            continue
        ids = cards.integers(1)[rows]
        given = cards.block(11, 6, 0.0)[rows]
        new = given * np.array([wanted[i] for i in ids.tolist()])[:, None]
        out.append(SetColumns(kind, ids, _OFFSET, np.where(given != 0, new, np.nan)))
    return out


def _apart(a: float, b: float) -> bool:
    return not np.isclose(a, b, rtol=1e-9, atol=0)


def _fields(
    kind: str, id: int, section: BeamSection, names: Sequence[str], units: Units
) -> Iterator[Change]:
    for name in names:
        size = units.length ** (2 if name == "area" else 4)
        yield SetField(kind, id, _FIELDS[name], getattr(section, name) / size)
