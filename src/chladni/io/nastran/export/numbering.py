"""Numbers for what a fresh deck needs: elements, properties, coordinate systems."""

from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np

from ....model.assembly import Assembly
from ..text.format import Card


class Ids:
    """Element and property ids, the assembly's own where they are positive and not yet taken."""

    def __init__(self, assembly: Assembly) -> None:
        a = assembly
        tables = [a.shells.ids, a.beams.ids, a.springs.ids, a.dampers.ids, a.scalar_masses.ids]
        tables += [a.bushes.ids, a.masses.ids, *(block.ids for block in a.solids)]
        self._next = 1 + max(int(np.max(ids, initial=0)) for ids in tables)
        self._next = max(self._next, *[t.id + 1 for t in a.rigid], 1)
        self._taken: set[int] = set()
        self.shell = self._numbered(a.shells.ids)
        self.beam = self._numbered(a.beams.ids)
        self.solids = [self._numbered(block.ids) for block in a.solids]
        self.spring = self._numbered(a.springs.ids)
        self.damper = self._numbered(a.dampers.ids)
        self.scalar_mass = self._numbered(a.scalar_masses.ids)
        self.bush = self._numbered(a.bushes.ids)
        self.rigid = self._numbered([t.id for t in a.rigid])
        self._taken = set()
        self.mass = self._numbered(a.masses.ids)
        self.part = unique_ids([p.id for p in a.parts])

    def _numbered(self, ids: Sequence[int] | np.ndarray) -> list[int]:
        out = []
        for id in np.asarray(ids, np.int64).tolist():
            if id <= 0 or id in self._taken:
                id, self._next = self._next, self._next + 1
            self._taken.add(id)
            out.append(id)
        return out


def unique_ids(wanted: Sequence[int]) -> list[int]:
    """The numbers themselves where positive and first of their kind, else the next free ones."""
    taken = {id for id in wanted if id > 0}
    free = iter(k for k in range(1, len(wanted) + len(taken) + 2) if k not in taken)
    seen: set[int] = set()
    out = []
    for id in wanted:
        keep = id > 0 and id not in seen
        out.append(id if keep else next(free))
        seen.add(out[-1])
    return out


class Systems:
    """Rectangular coordinate systems, one for each frame that is needed."""

    def __init__(self, assembly: Assembly, free: Iterator[int] | None = None) -> None:
        self._axes = assembly.axes
        self._free = count(1) if free is None else free
        self._frames: dict[int, np.ndarray] = {}
        self._known: dict[bytes, int] = {np.eye(3).tobytes(): 0}

    def of_frame(self, frame: np.ndarray) -> int:
        """Id of the system with these axes (rows), 0 for the basic one."""
        key = (np.round(frame, 12) + 0.0).tobytes()
        if key not in self._known:
            self._known[key] = cid = next(self._free)
            self._frames[cid] = frame
        return self._known[key]

    def of_point(self, row: int) -> int | None:
        """CD of a point, None where basic."""
        return None if self._axes is None else self.of_frame(self._axes[row]) or None

    def cards(self) -> Iterator[Card]:
        """CORD2R of every frame, with its origin at 0 and points one unit of length away."""
        for cid, (x, _, z) in self._frames.items():
            yield ["CORD2R", cid, None, 0.0, 0.0, 0.0, *z.tolist(), *x.tolist()]
