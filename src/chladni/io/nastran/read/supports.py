"""Supports: which SPC and MPC sets hold, and the dofs they hold."""

from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

import numpy as np

from ....errors import FileError, named
from ..text.deck import Deck
from ..text.table import Cards
from .context import Context, digits, id_list


def selected(deck: Deck, kind: str, subcase: int | None = None) -> tuple[int, ...]:
    """Sets of SPC, MPC or NSM cards that hold, additions (SPCADD...) resolved.

    The subcase asked for selects. Without it the first that looks for modes does, or else the first
    that selects any. Without a case control the only set of the deck is taken.
    """
    chosen = _chosen(deck, kind, subcase)
    there = _sets(deck, kind)
    if not chosen:
        added = _additions(deck, kind)
        inside = {s for parts in added.values() for s in parts}
        tops = sorted((there | set(added)) - inside)
        if deck.case.present or not tops:
            return ()
        if len(tops) > 1:
            raise FileError(
                f"{deck.path}: no case control selects one of the {kind} sets "
                f"{', '.join(map(str, tops))}; write {kind} = ... before BEGIN BULK"
            )
        chosen = tops[0]
    return _resolved(deck, kind, chosen, there)


def _chosen(deck: Deck, kind: str, subcase: int | None) -> int:
    cases = deck.case.subcases
    if subcase is not None:
        found = [c for c in cases if c.id == subcase]
        if not found:
            known = ", ".join(str(c.id) for c in cases)
            raise FileError(f"{deck.path}: there is no subcase {subcase}; there are {known}")
        return found[0].get(kind)
    if modal := [c for c in cases if c.get("METHOD")]:
        return modal[0].get(kind)
    return next((c.get(kind) for c in cases if c.get(kind)), 0)


def _sets(deck: Deck, kind: str) -> set[int]:
    return {int(s) for cards in deck.present(*_CARDS[kind]) for s in cards.integers(1)}


_CARDS = {"SPC": ("SPC", "SPC1"), "MPC": ("MPC",), "NSM": ("NSM", "NSM1", "NSML", "NSML1")}


def _additions(deck: Deck, kind: str) -> dict[int, list[int]]:
    """{set: the sets it joins} of SPCADD or MPCADD."""
    cards = deck[f"{kind}ADD"]
    added = {int(s): id_list(cards, i, 2) for i, s in enumerate(cards.unique())}
    there = _sets(deck, kind) if len(cards) else set()
    for i, (s, parts) in enumerate(added.items()):
        if not parts:
            raise cards.refuse(i, "it joins no sets")
        if s in there:  # the cards of this number are joined in any case
            added[s] = [part for part in parts if part != s]
    try:
        TopologicalSorter(added).prepare()
    except CycleError as error:
        ring = error.args[1]
        chain = " -> ".join(map(str, ring[::-1]))
        raise cards.refuse(list(added).index(ring[0]), f"the set joins itself ({chain})") from None
    return added


def _resolved(deck: Deck, kind: str, chosen: int, there: set[int]) -> tuple[int, ...]:
    """The plain sets behind a number."""
    added = _additions(deck, kind)
    if not there | set(added):
        return ()  # with a note of selection_notes
    known = f"there are {', '.join(map(str, sorted(there | set(added))))}"
    if chosen not in there | set(added):
        raise FileError(
            f"{deck.path}: {kind} set {chosen} is selected but there is no such set; {known}"
        )
    order, seen = [chosen], {chosen}
    for s in order:  # which grows while it is gone through
        order += dict.fromkeys(part for part in added.get(s, ()) if part not in seen)
        seen.update(order)
    if not (found := tuple(s for s in order if s in there)):
        lost = ", ".join(str(s) for s in order if s not in added)
        why = f"none of the sets it joins exists ({lost}); {known}"
        raise deck[f"{kind}ADD"].refuse(list(added).index(chosen), why)
    return found


def selection_notes(deck: Deck) -> Iterator[str]:
    """Sets that are selected and of which there is no card; subcases that select others."""
    for kind in _CARDS:
        every = deck.case.subcases
        cases = [c for c in every if c.get("METHOD")] or [c for c in every if c.get(kind)]
        chosen = list(dict.fromkeys(c.get(kind) for c in cases))
        if any(chosen) and not _sets(deck, kind) and not len(deck[f"{kind}ADD"]):
            said = f"{kind} = {max(chosen)} selects nothing"
            yield f"{deck.path}: {said}, because there is no {kind} card"
        elif len(chosen) > 1:
            ids, sets = ([str(x) for x in found] for found in ((c.id for c in cases), chosen))
            yield (
                f"{deck.path}: subcases {named(ids)} select {kind} sets {named(sets)}; "
                f"subcase {ids[0]} is taken unless another is chosen"
            )
    yield from _missing_sets(deck)


def _missing_sets(deck: Deck) -> Iterator[str]:
    """SPCADD, MPCADD, NSMADD that name a set the deck does not have, one sentence a card."""
    for kind in _CARDS:
        cards, added = deck[f"{kind}ADD"], _additions(deck, kind)
        there = _sets(deck, kind) | set(added)
        for i, (s, parts) in enumerate(added.items()):
            if lost := [part for part in parts if part not in there]:
                what = f"sets {lost[0]} and {len(lost) - 1} more" if lost[1:] else f"set {lost[0]}"
                yield f"{cards.where(i)}: {cards.name} {s} joins {what}, of which there is no card"


def supports(ctx: Context, sets: tuple[int, ...]) -> np.ndarray:
    """(k, 2): row and component of every dof held, by GRID PS or the selected sets."""
    found = [_permanent(ctx), *_spc1(ctx, sets)]
    found += [np.array([(r, c) for r, c, _ in _spc(ctx, sets, "SPC")], np.int64).reshape(-1, 2)]
    return np.unique(np.concatenate(found), axis=0)


def enforced(ctx: Context, sets: tuple[int, ...]) -> list[tuple[int, int, float]]:
    """(row, component, displacement in the deck's unit) of SPC cards that prescribe a motion."""
    return [(r, c, d) for r, c, d in _spc(ctx, sets, "SPC") if d]


def _permanent(ctx: Context) -> np.ndarray:
    """GRID field PS, or GRDSET's."""
    grid, default = ctx.deck["GRID"], ctx.deck["GRDSET"]
    usual = default.words(7)[0] if len(default) else b""
    words = grid.words(7)
    words = np.where(words == b"", usual, words)
    ids = grid.integers(1)
    out = []
    for word in np.unique(words):
        mine = np.flatnonzero(words == word)
        for c in digits(grid, int(mine[0]), word.decode("latin-1"), "PS"):
            rows = ctx.rows(grid, ids[mine])
            out.append(np.stack([rows, np.full(len(rows), c)], axis=1))
    return np.concatenate(out) if out else np.zeros((0, 2), np.int64)


def _components(ctx: Context, cards: Cards, i: int, word: str, row: int) -> tuple[int, ...]:
    return (1,) if ctx.scalar[row] else digits(cards, i, word)


def _spc1(ctx: Context, sets: tuple[int, ...]) -> Iterator[np.ndarray]:
    """SPC1: SID C G1 G2..., or G1 THRU G2, which passes over grids that do not exist."""
    for cards in ctx.deck.present("SPC1"):
        for i in np.flatnonzero(np.isin(cards.integers(1), sets)).tolist():
            ids = np.unique(np.array(id_list(cards, i, 3, ctx.ids), np.int64))
            if b"THRU" in cards.text[cards.start[i] : cards.start[i + 1]]:
                ids = ids[np.isin(ids, ctx.ids)]
            rows = np.array([ctx.row(cards, i, g) for g in ids.tolist()], np.int64)
            word = cards.word(i, 2)
            out = [(r, c) for r in rows.tolist() for c in _components(ctx, cards, i, word, r)]
            yield np.array(out, np.int64).reshape(-1, 2)


def _spc(ctx: Context, sets: tuple[int, ...], name: str) -> Iterator[tuple[int, int, float]]:
    """SPC, SPCD: SID G1 C1 D1 G2 C2 D2: (row, component, value)."""
    for cards in ctx.deck.present(name):
        for i in np.flatnonzero(np.isin(cards.integers(1), sets)):
            card = cards.single(int(i))
            for k in (2, 5):
                if card.words(k)[0] == b"":
                    continue
                row = ctx.row(card, 0, int(card.integers(k)[0]))
                value = float(card.reals(k + 2, 0.0)[0])
                for c in _components(ctx, card, 0, card.words(k + 1)[0].decode("latin-1"), row):
                    yield row, c, value


def prescribed(ctx: Context, sets: tuple[int, ...]) -> list[tuple[int, int, float]]:
    """(row, component, value in the deck's unit) of SPCD cards."""
    return list(_spc(ctx, sets, "SPCD"))
