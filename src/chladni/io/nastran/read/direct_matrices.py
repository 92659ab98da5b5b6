"""Direct input matrices K2GG, B2GG and M2GG (DMIG) as springs, dampers and masses between dofs.

A symmetric matrix is a sum of squares, qᵀ A q = Σ_i<j (-a_ij) (q_i - q_j)² + Σ_i s_i q_i² with the
row sums s_i. The squares are scalar elements without an id, which no card describes.
"""

import re
from collections.abc import Iterator

import numpy as np

from ....errors import FileError
from ....model.assembly import Scalars
from ..text.deck import Deck
from ..text.numbers import parse_real
from ..text.table import Cards
from .context import Context

Dof = tuple[int, int]  # row of a point, component 1-6
_TERM = re.compile(r"^(?:([0-9.+\-ED]+)\s*\*\s*)?([A-Z]\w*)$")


def direct(ctx: Context, kind: str) -> Scalars:
    """The squares of the matrices that the case control selects as K2GG, B2GG or M2GG.

    PARAM,WTMASS does not scale M2GG (MSC Nastran Quick Reference Guide).
    """
    if "DMIG" in ctx.deck.allowed:
        return Scalars()
    s = ctx.scale
    unit = {"K2GG": s.force * s.length, "B2GG": s.force * s.length * s.time,
            "M2GG": s.mass * s.length**2}[kind]  # fmt: skip
    total: dict[tuple[Dof, Dof], float] = {}
    for factor, name in _selected(ctx.deck, kind):
        for (a, b), value in _entries(ctx, kind, name).items():
            size = [1.0 if c > 3 and not ctx.scalar[row] else s.length for row, c in (a, b)]
            value *= factor * unit / (size[0] * size[1])
            total[a, b] = total.get((a, b), 0.0) + value
    return _squares(total)


def _selected(deck: Deck, kind: str) -> Iterator[tuple[float, str]]:
    """(factor, name) of the matrices that are selected: NAME, or 1.5*NAME, OTHER."""
    texts = dict.fromkeys(m[kind] for c in deck.case.subcases if kind in (m := c.matrices))
    if len(texts) > 1:
        raise FileError(f"{deck.path}: subcases select {kind} = {' and '.join(texts)}; one holds")
    for text in texts:
        for term in text.strip("()").split(","):
            found = _TERM.match(term.strip())
            factor = parse_real(found[1]) if found and found[1] else 1.0
            if not found or np.isnan(factor):
                raise FileError(f"{deck.path}: {kind} = {text}: {term!r} is no matrix or multiple")
            yield factor, found[2]


def _entries(ctx: Context, kind: str, name: str) -> dict[tuple[Dof, Dof], float]:
    """{(dof, dof): value} of a symmetric DMIG in the deck's units, one of each pair."""
    cards = ctx.deck["DMIG"]
    mine = np.flatnonzero(cards.words(1) == name.encode())
    if not len(mine):
        there = ", ".join(sorted({w.decode("latin-1") for w in cards.words(1).tolist()})) or "none"
        raise FileError(
            f"{ctx.deck.path}: {kind} = {name}: there is no DMIG {name}; there are {there}"
        )
    out: dict[tuple[Dof, Dof], float] = {}
    for i in mine.tolist():
        if cards.word(i, 2) == "0":
            if cards.word(i, 3) != "6" or cards.integer(i, 4, 1) > 2:
                raise cards.refuse(i, f"{kind} takes real symmetric matrices (IFO 6, TIN 1 or 2)")
            continue
        column = _dof(ctx, cards, i, 2)
        for k in range(5, len(cards.fields(i)) + 1, 4):
            if not cards.word(i, k):
                continue
            row = _dof(ctx, cards, i, k)
            pair = (row, column) if row < column else (column, row)
            if pair in out:
                raise cards.refuse(i, f"it gives a term of point {cards.word(i, k)} a second time")
            out[pair] = cards.real(i, k + 2, 0.0)
    return out


def _dof(ctx: Context, cards: Cards, i: int, k: int) -> Dof:
    row, component = ctx.row(cards, i, cards.integer(i, k)), cards.integer(i, k + 1, 0)
    if ctx.scalar[row]:
        return row, 1
    if not 1 <= component <= 6:
        raise cards.refuse(i, f"component {component} of grid {ctx.ids[row]} is not one of 1 to 6")
    return row, component


def _squares(entries: dict[tuple[Dof, Dof], float]) -> Scalars:
    """Scalar elements between the dofs, and to the ground by the row sums."""
    sums: dict[Dof, float] = {}
    found: list[tuple[Dof, Dof, float]] = []
    for (a, b), value in entries.items():
        for dof in {a, b}:
            sums[dof] = sums.get(dof, 0.0) + value
        if a != b:
            found.append((a, b, -value))
    largest = max(map(abs, entries.values()), default=0.0)
    found += [(a, (-1, 1), s) for a, s in sums.items() if abs(s) > 1e-14 * largest]
    if not found:
        return Scalars()
    return Scalars(
        np.zeros(len(found), np.int64),
        np.array([(a[0], b[0]) for a, b, _ in found]),
        np.array([(a[1], b[1]) for a, b, _ in found]),
        np.array([value for *_, value in found]),
        np.zeros(len(found)),
    )
