"""A fresh deck from an Assembly: every array comes back when it is read again."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ....model.assembly import Assembly, Scalars
from ....output import write_text
from ....units import Units
from ....units import units as unit_system
from ..text.format import card
from . import part_cards, tie_cards
from .numbering import Ids, Systems

_EXACT = 1e-11  # relative loss at which a card changes to wide fields
_SHELL = ("CQUAD4", "CTRIA3")


def write_assembly(
    assembly: Assembly, path: Path | str, units: Units | str | None = None, count: int = 40
) -> Path:
    """Write a deck (SOL 103, ``count`` modes) in a unit system, SI unless given.

    Part names stand in ANSA's comments; element ids that occur twice are numbered anew.
    """
    units = unit_system("SI" if units is None else units)
    ids, systems = Ids(assembly), Systems(assembly)
    body = [
        *_points(assembly, units, systems),
        *part_cards.properties(assembly, units, ids),
        *_shells(assembly, units, ids),
        *_solids(assembly, ids),
        *_beams(assembly, units, ids),
        *_scalars(assembly, units, ids),
        *tie_cards.bushes(assembly, units, ids, systems),
        *tie_cards.masses(assembly, units, ids),
        *tie_cards.ties(assembly, units, ids),
        *_supports(assembly),
    ]
    text = [*_head(assembly, units, count), *systems.cards(units), *body, "ENDDATA"]
    return write_text(path, "\n".join(text) + "\n")


def _head(assembly: Assembly, units: Units, count: int) -> Iterator[str]:
    """Executive and case control, parameters."""
    yield f"$ units: {units.name}"
    yield from ("SOL 103", "CEND", "ECHO = NONE", "METHOD = 1")
    if len(assembly.supports):
        yield "SPC = 1"
    if tie_cards.has_equations(assembly):
        yield "MPC = 1"
    yield "BEGIN BULK"
    yield from card("EIGRL", [1, None, None, count])
    yield from card("PARAM", ["COUPMASS", 1 if assembly.coupled_mass else -1])
    yield from card("PARAM", ["AUTOSPC", "YES" if assembly.auto_spc else "NO"])
    if assembly.structural_damping:
        yield from card("PARAM", ["G", assembly.structural_damping], _EXACT)
    if assembly.k6rot is not None:
        yield from card("PARAM", ["K6ROT", assembly.k6rot], _EXACT)


def _points(assembly: Assembly, units: Units, systems: Systems) -> Iterator[str]:
    """GRID and SPOINT."""
    scalar = assembly.scalar_points
    points = (assembly.points / units.length).tolist()
    for k, (id, place) in enumerate(zip(assembly.ids.tolist(), points, strict=True)):
        if scalar is not None and scalar[k]:
            yield from card("SPOINT", [id])
        else:
            yield from card("GRID", [id, None, *place, systems.of_point(k)], _EXACT)


def _shells(assembly: Assembly, units: Units, ids: Ids) -> Iterator[str]:
    """CQUAD4 and CTRIA3, corner thickness where it is not the property's."""
    s = assembly.shells
    nodes = assembly.ids[s.nodes].tolist()
    nominal = np.array([part_cards.thickness(p) for p in assembly.parts])
    t = s.thickness / units.length
    own = ~np.isclose(s.thickness, nominal[s.part][:, None], rtol=1e-12, atol=0).all(axis=1)
    angle = part_cards.material_direction(assembly)
    for k, three in enumerate(s.triangle.tolist()):
        n = 3 if three else 4
        values: list[float | int | str | None] = [ids.shell[k], ids.part[s.part[k]], *nodes[k][:n]]
        values += [angle[k], s.offset[k] / units.length or None, *[None] * (6 - n)]
        if own[k]:
            values += t[k, :n].tolist()
        yield from card(_SHELL[three], _tail(values), 1e-9)


def _tail(values: list[float | int | str | None]) -> list[float | int | str | None]:
    """Reals as floats, so that none is written as an integer."""
    return [float(v) if isinstance(v, np.floating) else v for v in values]


def _solids(assembly: Assembly, ids: Ids) -> Iterator[str]:
    names = {8: "CHEXA", 6: "CPENTA", 4: "CTETRA"}
    for block, mine in zip(assembly.solids, ids.solids, strict=True):
        for k, nodes in enumerate(assembly.ids[block.nodes].tolist()):
            yield from card(names[len(nodes)], [mine[k], ids.part[block.part[k]], *nodes])


def _beams(assembly: Assembly, units: Units, ids: Ids) -> Iterator[str]:
    """CBAR, CBEAM, CROD."""
    numbered = replace(assembly, beams=replace(assembly.beams, ids=np.array(ids.beam, int)))
    for k, part in enumerate(assembly.beams.part.tolist()):
        name, *values = part_cards.beam_element(numbered, k, ids.part[part], units)
        yield from card(str(name), values, 1e-9)


def _scalars(assembly: Assembly, units: Units, ids: Ids) -> Iterator[str]:
    """CELAS2, CDAMP2, CMASS2."""
    work = units.force * units.length
    families = (
        ("CELAS2", assembly.springs, ids.spring, work),
        ("CDAMP2", assembly.dampers, ids.damper, work * units.time),
        ("CMASS2", assembly.scalar_masses, ids.scalar_mass, units.mass * units.length**2),
    )
    for name, table, mine, unit in families:
        yield from _scalar(assembly, name, table, mine, unit, units.length)


def _scalar(
    assembly: Assembly, name: str, table: Scalars, mine: Sequence[int], unit: float, length: float
) -> Iterator[str]:
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
        scale = np.prod([1.0 if t else length for t in turns])
        values: list[float | int | str | None] = [mine[k], float(table.value[k] * scale / unit)]
        for r, c, there in zip(rows, comps, known, strict=True):
            values += [int(assembly.ids[r]), int(c)] if there else [None, None]
        if name == "CELAS2" and table.damping[k]:
            values.append(float(table.damping[k]))
        yield from card(name, values, _EXACT)


def _supports(assembly: Assembly) -> Iterator[str]:
    """SPC1, points with the same components together."""
    held: dict[int, list[int]] = {}
    for row, component in assembly.supports.tolist():
        held.setdefault(row, []).append(component)
    groups: dict[str, list[int]] = {}
    for row, components in held.items():
        groups.setdefault("".join(map(str, sorted(components))), []).append(int(assembly.ids[row]))
    for text, points in groups.items():
        yield from card("SPC1", [1, int(text), *points])
