"""Supports a structure has no more, taken out of SPC1, SPC and the PS field of GRID."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly
from .. import Add, Deck, SetField
from ..read.context import id_list
from ..read.supports import selected
from ..text.format import Value
from ..text.table import Cards
from .changes import Change, DeleteRow


def support_changes(deck: Deck, before: Assembly, after: Assembly) -> list[Change]:
    """Edits that let go what ``after`` holds no more of the points of ``before``.

    A card that held some of it is taken out, and what it held beside is held by a new SPC1.

    Raises
    ------
    ModelError
        If GRDSET holds it, or a card of a set that prescribes a motion.
    """
    now = {(int(after.ids[r]), int(c)) for r, c in after.supports}
    gone = {(int(before.ids[r]), int(c)) for r, c in before.supports} - now
    if not gone:
        return []
    out = list(_permanent(deck, gone))
    for sid in selected(deck, "SPC"):
        out += _of_set(deck, sid, gone, before, after)
    return out


def _permanent(deck: Deck, gone: set[tuple[int, int]]) -> Iterator[Change]:
    """PS of the grids themselves."""
    grid, default = deck["GRID"], deck["GRDSET"]
    usual = default.words(7)[0].decode("latin-1") if len(default) else ""
    released = {id for id, _ in gone}
    for id, word in zip(grid.integers(1).tolist(), grid.words(7).tolist(), strict=True):
        if id not in released:
            continue
        own = word.decode("latin-1").replace(" ", "")
        left = _left(id, own or usual, gone)
        if left == (own or usual):
            continue
        if not own:
            raise ModelError(f"GRDSET of {deck.path} holds grid {id}; give it its own SPC1")
        yield SetField("GRID", id, "PS", left or (0 if usual else None))


def _left(id: int, components: str, gone: set[tuple[int, int]]) -> str:
    return "".join(c for c in components if (id, int(c)) not in gone)


def _of_set(
    deck: Deck, sid: int, gone: set[tuple[int, int]], before: Assembly, after: Assembly
) -> Iterator[Change]:
    """SPC1 and SPC of one set, which may not become empty: case control asks for it."""
    stays, taken, again = 0, 0, dict[str, list[int]]()
    for cards in deck.present("SPC1", "SPC"):
        for i in np.flatnonzero(cards.integers(1) == sid).tolist():
            held = list(_held(cards, i, before.ids))
            left = [(id, _left(id, components, gone)) for id, components in held]
            if left == held:
                stays += 1
                continue
            taken += 1
            yield DeleteRow(cards.name, i)
            for id, components in left:
                if components:
                    again.setdefault(components, []).append(id)
    if taken and not stays and not again:
        row, component = after.supports[after.supports[:, 0] >= len(before.points)][0]
        again[str(component)] = [int(after.ids[row])]
    if again:
        lines: list[list[Value]] = [["SPC1", sid, int(c), *ids] for c, ids in again.items()]
        yield Add(lines, "unchanged supports")


def _held(cards: Cards, i: int, ids: np.ndarray) -> Iterator[tuple[int, str]]:
    """(id of a point there is, components) of a card."""
    if cards.name == "SPC1":
        for id in sorted(set(id_list(cards, i, 3, ids)) & set(ids.tolist())):
            yield id, cards.word(i, 2).replace(" ", "")
        return
    card = cards.single(i)
    for k in (2, 5):
        if card.words(k)[0]:
            if float(card.reals(k + 2, 0.0)[0]):
                raise ModelError(
                    f"SPC {card.integers(1)[0]} prescribes a motion and stays unchanged"
                )
            yield int(card.integers(k)[0]), card.words(k + 1)[0].decode("latin-1").replace(" ", "")
