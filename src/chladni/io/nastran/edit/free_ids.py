"""Ids no card of a deck has, each given once, whoever of those who change the deck asks for it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from ....model.assembly import Assembly
from .. import Deck


@dataclass(frozen=True)
class FreeIds:
    """Counters of ids for new materials, properties and coordinate systems."""

    materials: Iterator[int]
    properties: Iterator[int]
    systems: Iterator[int]


def free_ids(deck: Deck, after: Assembly) -> FreeIds:
    """Counters that begin above what the deck, and the parts of the structure to be, have."""
    parts = [p.id for p in after.parts]
    return FreeIds(
        count(1 + max([0, *ids_of(deck, "MAT")])),
        count(1 + max([0, *parts, *ids_of(deck, "P")])),
        count(1 + max([900, *ids_of(deck, "CORD"), *ids_of(deck, "CORD1", 5)])),  # CORD1 holds two
    )


def ids_of(deck: Deck, begins: str, field: int = 1) -> Iterator[int]:
    """Ids of all cards whose names begin so."""
    for kind in (kind for kind in deck.cards if kind.startswith(begins)):
        yield from (int(word) for word in deck[kind].words(field).tolist() if word.isdigit())
