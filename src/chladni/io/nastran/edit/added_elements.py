"""Everything that was added to a deck: grids, ties, masses, springs, bushes and beams."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from ....errors import ModelError
from ....model.added_points import next_id
from ....model.assembly import Assembly, Equation, picked
from ....model.properties import BeamSection, Material
from ....units import Units
from ..export import tie_cards
from ..export.numbering import Systems
from ..export.part_cards import beam_card, beam_element, material_card
from ..export.whole_deck import points, springs
from ..text.format import Card
from .free_ids import FreeIds


@dataclass(frozen=True, eq=False)
class AddedElements:
    """Elements that another assembly has in addition to those of the deck."""

    after: Assembly  # the other assembly
    # ``after`` without the added beams, and without the parts of which they alone are
    rest: Assembly
    beams: np.ndarray  # rows of these beams in ``after``
    own: tuple[int, ...]  # positions of these parts in ``after``

    def cards(self, before: Assembly, units: Units, free: FreeIds) -> Iterator[Card]:
        """All of them; elements are numbered from the first id that is free.

        Parameters
        ----------
        before : of the deck, less what was taken out of it

        Raises
        ------
        ModelError
            If an equation was added, which belongs to a set of its own.
        """
        yield from _added_points(before, self.after, units, free)
        made, known = self.after, _unchanged(before, self.rest)
        ids = {k: part.id for k, part in enumerate(made.parts)}
        for k in self.own:
            section = made.parts[k].section
            assert isinstance(section, BeamSection)
            mid = next((m.id for m in known if m == section.material), None)
            if mid is None:
                mid = next(free.materials)
                known.append(replace(section.material, id=mid))
                yield material_card(section.material, mid, units)
            ids[k] = next(free.properties)
            name, values = beam_card(section, ids[k], mid, units)
            yield [name, *values]
        for row in self.beams.tolist():
            yield beam_element(made, row, ids[int(made.beams.part[row])], units)


def added_elements(before: Assembly, after: Assembly) -> AddedElements:
    """The elements of ``after`` that ``before`` has not."""
    b = after.beams
    new = ~np.isin(b.ids, before.beams.ids)
    groups = (after.shells, *after.solids, picked(b, ~new))
    others = {int(k) for group in groups for k in np.unique(group.part)}
    own = tuple(
        k for k in np.unique(b.part[new]).tolist() if k >= len(before.parts) and k not in others
    )
    kept = [k for k in range(len(after.parts)) if k not in own]
    at = np.full(len(after.parts), -1)
    at[kept] = np.arange(len(kept))
    rest = replace(
        after,
        parts=tuple(after.parts[k] for k in kept),
        shells=replace(after.shells, part=at[after.shells.part]),
        beams=replace(groups[-1], part=at[groups[-1].part]),
        solids=tuple(replace(s, part=at[s.part]) for s in after.solids),
    )
    whole = rest if new.any() else after
    return AddedElements(after, whole, np.flatnonzero(new), own)


def _added_points(before: Assembly, after: Assembly, units: Units, free: FreeIds) -> Iterator[Card]:
    """Grids, ties, masses, springs and bushes."""
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


def _unchanged(before: Assembly, rest: Assembly) -> list[Material]:
    """Materials of the deck that keep all their numbers."""
    now = _materials(rest)
    return [m for m in _materials(before) if all(n == m for n in now if n.id == m.id)]


def _materials(assembly: Assembly) -> list[Material]:
    """All materials of beams and solids, and of the sheets' membranes."""
    every = [getattr(p.section, "membrane", None) or getattr(p.section, "material", None)
             for p in assembly.parts]  # fmt: skip
    return [m for m in every if m is not None]
