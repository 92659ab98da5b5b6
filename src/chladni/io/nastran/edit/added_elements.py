"""Cards of grids, ties, masses, springs and bushes that were added to a deck."""

from collections.abc import Iterator
from itertools import count

from ....errors import ModelError
from ....model.added_points import next_id
from ....model.assembly import Assembly, Equation
from ....units import Units
from ..export import tie_cards
from ..export.numbering import Systems
from ..export.whole_deck import points, springs
from ..text.format import Card
from .free_ids import FreeIds


def added_cards(before: Assembly, after: Assembly, units: Units, free: FreeIds) -> Iterator[Card]:
    """All of them; elements are numbered from the first id that is free.

    Raises
    ------
    ModelError
        If an equation was added, which belongs to a set of its own.
    """
    systems, number = Systems(after, free.systems), count(next_id(after))
    new = after.rigid[len(before.rigid) :]
    if other := [tie.id for tie in new if isinstance(tie, Equation)]:
        raise ModelError(f"rigid element {other[0]} was added; only RBE2 and RBE3 are")
    own = (tie.id for tie in new)
    cards = [
        *_held_points(before, after, units, systems),
        *tie_cards.ties(after, units, own, number, len(before.rigid)),
        *tie_cards.masses(after, units, number, len(before.masses)),
        *springs(after, units, number, len(before.springs)),
        *tie_cards.bushes(after, units, number, free.properties, systems, len(before.bushes)),
    ]
    yield from (*systems.cards(), *cards)


def _held_points(
    before: Assembly, after: Assembly, units: Units, systems: Systems
) -> Iterator[Card]:
    """Points with their supports in PS, so that they need no set."""
    new = range(len(before.points), len(after.points))
    for row, card in zip(new, points(after, units, systems, len(before.points)), strict=True):
        held = sorted(int(c) for r, c in after.supports if r == row)
        yield [*card, "".join(map(str, held))] if held else card
