"""Beams that were added to a deck, with their properties and materials."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ....model.assembly import Assembly, picked
from ....model.properties import BeamSection, Material
from ....units import Units
from ..export.part_cards import beam_card, beam_element, material_card
from .free_ids import FreeIds


@dataclass(frozen=True, eq=False)
class AddedBeams:
    """Beams that another assembly has not.

    Attributes
    ----------
    rest : the assembly without them, and without the parts of which they alone are
    whole : the assembly with them
    rows : of the beams in ``whole``
    own : positions of the parts of which they alone are
    """

    rest: Assembly
    whole: Assembly
    rows: np.ndarray
    own: tuple[int, ...]

    def cards(self, before: Assembly, units: Units, free: FreeIds) -> Iterator[list]:
        """PBAR, PBEAM or PROD and MAT1 or MAT8 of their parts, then CBAR, CBEAM or CROD."""
        made, known = self.whole, _unchanged(before, self.rest)
        ids = {k: made.parts[k].id for k in range(len(made.parts))}
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
        for row in self.rows.tolist():
            yield beam_element(made, row, ids[int(made.beams.part[row])], units)


def added_beams(before: Assembly, after: Assembly) -> AddedBeams:
    """The beams of ``after`` whose ids ``before`` has not."""
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
    return AddedBeams(rest if new.any() else after, after, np.flatnonzero(new), own)


def _unchanged(before: Assembly, rest: Assembly) -> list[Material]:
    """Materials of the deck that keep all their numbers."""
    now = _materials(rest)
    return [m for m in _materials(before) if all(n == m for n in now if n.id == m.id)]


def _materials(assembly: Assembly) -> list[Material]:
    """All materials of beams and solids, and of the sheets' membranes."""
    every = [getattr(p.section, "membrane", None) or getattr(p.section, "material", None)
             for p in assembly.parts]  # fmt: skip
    return [m for m in every if m is not None]
