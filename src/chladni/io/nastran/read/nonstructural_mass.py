"""Non-structural mass that the case control selects: NSM, NSM1 a unit, NSML, NSML1 in all."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....geometry.facets import cell_areas
from ....model.assembly import Assembly, Beams, Shells
from ....model.properties import BeamSection, ShellSection
from ..text.table import Cards
from .context import Context, id_list

_FAMILY = {
    "PSHELL": "shell", "PCOMP": "shell", "PCOMPG": "shell", "PBAR": "bar", "PBARL": "bar",
    "PBEAM": "beam", "PBEAML": "beam", "PROD": "rod", "PTUBE": "rod",
}  # fmt: skip
_TYPES = (*_FAMILY, "CONROD", "ELEMENT")


def with_nonstructural(ctx: Context, made: Assembly, sets: tuple[int, ...]) -> Assembly:
    """The assembly with the mass of these sets on its shells and beams."""
    ends = made.points[made.beams.nodes] + made.beams.offset
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    sizes = (cell_areas(made.points, made.shells.nodes), length)
    more = [np.zeros(len(size)) for size in sizes]
    L, unit = ctx.scale.length, ctx.scale.inertia
    for cards in ctx.deck.present("NSM", "NSM1", "NSML", "NSML1"):
        for i in np.flatnonzero(np.isin(cards.integers(1), sets)).tolist():
            for rows, value in _loads(ctx, made, cards, i):
                each = [value * unit / L**2, value * unit / L]
                if cards.name.startswith("NSML"):
                    if all(map(len, rows)):
                        raise cards.refuse(i, "it spreads one mass over areas and lengths")
                    total = sum(size[r].sum() for size, r in zip(sizes, rows, strict=True))
                    each = [value * unit / total if total else 0.0] * 2
                for load, r, a in zip(more, rows, each, strict=True):
                    load[r] += a
            _refuse_negative(cards, i, made, more)
    return replace(
        made,
        shells=replace(made.shells, nonstructural=more[0]),
        beams=replace(made.beams, nonstructural=more[1]),
    )


def _loads(
    ctx: Context, made: Assembly, cards: Cards, i: int
) -> Iterator[tuple[list[np.ndarray], float]]:
    """(rows of shells and of beams, value) of each entry of card i."""
    of = _named(ctx, made, cards, i)
    there = np.unique(np.concatenate(of))
    if cards.name.endswith("1"):
        value, every = cards.real(i, 3), cards.word(i, 4) == "ALL"
        ids = there[there >= 0].tolist() if every else id_list(cards, i, 4, there)
        yield _rows(cards, i, of, ids), value
        return
    for k in range(3, len(cards.fields(i)) + 1, 2):
        if cards.word(i, k):
            yield _rows(cards, i, of, [cards.integer(i, k)]), cards.real(i, k + 1)


def _named(ctx: Context, made: Assembly, cards: Cards, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Ids by which TYPE names shells (n,) and beams (m,), -1 where it does not mean them."""
    kind = cards.word(i, 2)
    if kind not in _TYPES:
        raise cards.refuse(i, f"TYPE {kind!r} is not understood; there are {', '.join(_TYPES)}")
    conrods = np.isin(made.beams.ids, ctx.deck["CONROD"].integers(1))
    if kind == "CONROD":
        return np.full(len(made.shells), -1), np.where(conrods, made.beams.ids, -1)
    if kind == "ELEMENT":
        return made.shells.ids, made.beams.ids
    family = _FAMILY[kind]
    ids = [
        part.id if family == getattr(part.section, "kind", "shell") else -1 for part in made.parts
    ]
    table = np.array([*ids, -1])
    if family == "shell":
        return table[made.shells.part], np.full(len(made.beams), -1)
    return np.full(len(made.shells), -1), np.where(conrods, -1, table[made.beams.part])


def _rows(
    cards: Cards, i: int, of: tuple[np.ndarray, np.ndarray], ids: list[int]
) -> list[np.ndarray]:
    """Rows of shells and beams with these ids; a property that no element has has none."""
    if cards.word(i, 2) in ("ELEMENT", "CONROD"):
        if lost := [id for id in ids if not any(np.any(x == id) for x in of)]:
            raise cards.refuse(i, f"element {lost[0]} is no shell, bar, beam or rod of the deck")
    return [np.flatnonzero(np.isin(x, ids)) for x in of]


def _refuse_negative(cards: Cards, i: int, made: Assembly, more: list[np.ndarray]) -> None:
    """Refuse a mass that takes away more than a sheet or beam has."""
    own = np.zeros(len(made.parts))
    for k, part in enumerate(made.parts):
        s = part.section
        if isinstance(s, ShellSection):
            own[k] = getattr(s.membrane or s.bending, "rho", 0.0) * s.thickness + s.nonstructural
        elif isinstance(s, BeamSection):
            own[k] = s.material.rho * s.area + s.nonstructural
    families: tuple[Shells | Beams, ...] = (made.shells, made.beams)
    for family, load in zip(families, more, strict=True):
        if np.any(load < -own[family.part]):
            id = family.ids[int(np.argmin(load + own[family.part]))]
            raise cards.refuse(i, f"its mass is negative, and more than element {id} weighs")
