"""A fresh deck from an Assembly: every array comes back when it is read again."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np

from ....geometry.solid_shapes import CORNERS
from ....model.assembly import Assembly, Equation, Scalars, picked
from ....output import write_text
from ....units import UNITS, Units
from ....units import units as unit_system
from ..text.cards import SHELL_CARDS
from ..text.deck import Deck
from ..text.format import Card, Value, card, texts
from . import part_cards, tie_cards
from .numbering import Ids, Systems

_EXACT = 1e-11  # relative loss at which a card changes to wide fields
_UNITS, _CONTROL = "$ units: ", ("SOL 103", "CEND", "ECHO = NONE")


def is_written_here(deck: Deck) -> bool:
    """True for a deck that :func:`write_assembly` wrote, changed since or not: it begins as such.

    Its shells have the drilling field of :mod:`chladni.fem.shell_drilling` unless K6ROT is given.
    """
    first, *control = (t.decode("latin-1").rstrip() for t in deck.sources[0].lines[:4])
    return first.removeprefix(_UNITS) in UNITS and tuple(control) == _CONTROL


def write_assembly(
    assembly: Assembly, path: Path | str, units: Units | str | None = None, count: int = 40
) -> Path:
    """Write a deck (SOL 103, ``count`` modes) in a unit system, SI unless given.

    Part names stand in ANSA's comments; element ids that occur twice are numbered anew.
    """
    units = unit_system("SI" if units is None else units)
    ids, systems = Ids(assembly), Systems(assembly)
    body = [
        *texts(points(assembly, units, systems), _EXACT),
        *part_cards.properties(assembly, units, ids),
        *texts(_shells(assembly, units, ids), 1e-9),
        *texts(_solids(assembly, ids)),
        *texts(_beams(assembly, units, ids), 1e-9),
        *texts(_nonstructural(assembly, units, ids), _EXACT),
        *texts(_joints(assembly, units, ids, systems), _EXACT),
        *texts(_supports(assembly)),
    ]
    frames = texts(systems.cards(), 1e-12)
    text = [*_head(assembly, units, count), *frames, *body, "ENDDATA"]
    return write_text(path, "\n".join(text) + "\n")


def _head(assembly: Assembly, units: Units, count: int) -> Iterator[str]:
    """Executive and case control, parameters."""
    yield _UNITS + units.name
    yield from (*_CONTROL, "METHOD = 1")
    if len(assembly.supports):
        yield "SPC = 1"
    if any(isinstance(t, Equation) for t in assembly.rigid):
        yield "MPC = 1"
    if any(np.any(family.nonstructural) for family in (assembly.shells, assembly.beams)):
        yield "NSM = 1"
    yield "BEGIN BULK"
    yield from card("EIGRL", [1, None, None, count])
    yield from card("PARAM", ["COUPMASS", 1 if assembly.coupled_mass else -1])
    yield from card("PARAM", ["AUTOSPC", "YES" if assembly.auto_spc else "NO"])
    if assembly.structural_damping:
        yield from card("PARAM", ["G", assembly.structural_damping], _EXACT)
    if assembly.k6rot is not None:
        yield from card("PARAM", ["K6ROT", assembly.k6rot], _EXACT)


def points(assembly: Assembly, units: Units, systems: Systems, since: int = 0) -> Iterator[Card]:
    """GRID and SPOINT; from a row on."""
    scalar = assembly.scalar_points
    for k in range(since, len(assembly.points)):
        id, place = int(assembly.ids[k]), (assembly.points[k] / units.length).tolist()
        if scalar is not None and scalar[k]:
            yield ["SPOINT", id]
        else:
            yield ["GRID", id, None, *place, systems.of_point(k)]


def _joints(assembly: Assembly, units: Units, ids: Ids, systems: Systems) -> Iterator[Card]:
    """Springs, bushes, masses, rigid elements."""
    yield from _scalars(assembly, units, ids)
    yield from tie_cards.bushes(assembly, units, iter(ids.bush), count(1), systems)
    yield from tie_cards.masses(assembly, units, iter(ids.mass))
    last = max([*ids.rigid, *ids.shell, *ids.beam, *ids.bush, *ids.spring, 0])
    yield from tie_cards.ties(assembly, units, iter(ids.rigid), count(last + 1_000_001))


def _shells(assembly: Assembly, units: Units, ids: Ids) -> Iterator[Card]:
    """CQUAD4, CTRIA3, CQUAD8 and CTRIA6, corner thickness where it is not the property's."""
    s = assembly.shells
    nodes = assembly.ids[s.nodes].tolist()
    nominal = np.array([part_cards.thickness(p) for p in assembly.parts])
    t = s.thickness / units.length
    own = ~np.isclose(s.thickness, nominal[s.part][:, None], rtol=1e-12, atol=0).all(axis=1)
    angle, curved = part_cards.material_direction(assembly), s.curved.tolist()
    for k, three in enumerate(s.triangle.tolist()):
        n = 3 if three else 4
        values: list[Value] = [ids.shell[k], ids.part[s.part[k]], *nodes[k][:n]]
        turn, corner = [angle[k], s.offset[k] / units.length or None], t[k, :n].tolist()
        corner = corner if own[k] else [None] * n
        if curved[k]:
            values += [int(assembly.ids[r]) if r >= 0 else None for r in s.middle[k, :n]]
            values += [*turn, *corner] if three else [*corner, *turn]
        else:
            values += [*turn, *[None] * (6 - n), *corner]
        # reals as floats, so that none is written as an integer
        yield [
            SHELL_CARDS[three + 2 * curved[k]],
            *(float(v) if isinstance(v, np.floating) else v for v in values),
        ]


def _solids(assembly: Assembly, ids: Ids) -> Iterator[Card]:
    """CHEXA, CPENTA, CPYRAM, CTETRA; a mid-side node that is absent stays blank."""
    names = {8: "CHEXA", 6: "CPENTA", 5: "CPYRAM", 4: "CTETRA"}
    for block, mine in zip(assembly.solids, ids.solids, strict=True):
        corners = CORNERS[block.nodes.shape[1]]
        for k, rows in enumerate(assembly.ids[block.nodes].tolist()):
            nodes = rows[:corners]
            middle = [None if id in nodes else id for id in rows[corners:]]
            yield [names[corners], mine[k], ids.part[block.part[k]], *nodes, *middle]


def _beams(assembly: Assembly, units: Units, ids: Ids) -> Iterator[Card]:
    """CBAR, CBEAM, CROD."""
    numbered = replace(assembly, beams=replace(assembly.beams, ids=np.array(ids.beam, int)))
    for k, part in enumerate(assembly.beams.part.tolist()):
        yield part_cards.beam_element(numbered, k, ids.part[part], units)


def _nonstructural(assembly: Assembly, units: Units, ids: Ids) -> Iterator[Card]:
    """NSM of shells and beams that have more than their section."""
    for family, own, power in ((assembly.shells, ids.shell, 2), (assembly.beams, ids.beam, 1)):
        for k in np.flatnonzero(family.nonstructural).tolist():
            load = float(family.nonstructural[k]) * units.length**power / units.inertia
            yield ["NSM", 1, "ELEMENT", own[k], load]


def _scalars(assembly: Assembly, units: Units, ids: Ids) -> Iterator[Card]:
    """CELAS2, CDAMP2, CMASS2."""
    work = units.force * units.length
    yield from springs(assembly, units, iter(ids.spring))
    dampers, masses = assembly.dampers, assembly.scalar_masses
    yield from _scalar(assembly, "CDAMP2", dampers, iter(ids.damper), work * units.time, units)
    unit = units.mass * units.length**2
    yield from _scalar(assembly, "CMASS2", masses, iter(ids.scalar_mass), unit, units)


def springs(assembly: Assembly, units: Units, ids: Iterator[int], since: int = 0) -> Iterator[Card]:
    """CELAS2; from a row of springs on."""
    work, some = units.force * units.length, picked(assembly.springs, slice(since, None))
    yield from _scalar(assembly, "CELAS2", some, ids, work, units)


def _scalar(
    assembly: Assembly, name: str, table: Scalars, ids: Iterator[int], unit: float, units: Units
) -> Iterator[Card]:
    """K in the deck's unit: K_SI u_a u_b = K unit, u the length of a translation, 1 of a turn."""
    spoint = assembly.scalar_points
    for k in range(len(table)):
        rows, comps = table.nodes[k], table.component[k]
        known = [r >= 0 for r in rows]
        turns = [
            bool(c > 3 and not (spoint is not None and spoint[r]))
            for r, c in zip(rows, comps, strict=True)
        ]
        turns = [turns[e] if known[e] else turns[1 - e] for e in (0, 1)]
        scale = np.prod([1.0 if t else units.length for t in turns])
        values: list[Value] = [next(ids), float(table.value[k] * scale / unit)]
        for r, c, there in zip(rows, comps, known, strict=True):
            values += [int(assembly.ids[r]), int(c)] if there else [None, None]
        if name == "CELAS2" and table.damping[k]:
            values.append(float(table.damping[k]))
        yield [name, *values]


def _supports(assembly: Assembly) -> Iterator[Card]:
    """SPC1, points with the same components together."""
    held: dict[int, list[int]] = {}
    for row, component in assembly.supports.tolist():
        held.setdefault(row, []).append(component)
    groups: dict[str, list[int]] = {}
    for row, components in held.items():
        groups.setdefault("".join(map(str, sorted(components))), []).append(int(assembly.ids[row]))
    for text, ids in groups.items():
        yield ["SPC1", 1, int(text), *ids]
