"""Unit factors, grids by row and coordinate systems, which every converter needs."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ....errors import FileError
from ....units import Units
from ....units import units as unit_system
from ..text.deck import Deck
from ..text.numbers import parse_real
from ..text.table import Cards
from .coordinate_systems import Frames


@dataclass(frozen=True, eq=False)
class Context:
    """A deck being converted."""

    deck: Deck
    scale: Units  # from the deck's numbers to SI, PARAM,WTMASS included
    frames: Frames
    ids: np.ndarray  # (n,) int; points by increasing id, grids and scalar points
    places: np.ndarray  # (n, 3) basic coordinates in the deck's own unit of length
    axes: np.ndarray | None  # (n, 3, 3) displacement frames
    scalar: np.ndarray  # (n,) bool; scalar points

    def rows(self, cards: Cards, ids: np.ndarray, ground: bool = False) -> np.ndarray:
        """Rows of point ids (n, ...) of the cards; 0 is the ground (-1) where allowed."""
        if not len(self.ids):
            raise FileError(f"{self.deck.path}: there is no GRID")
        at = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
        missing = self.ids[at] != ids
        if ground:
            missing &= ids != 0
            at = np.where(ids == 0, -1, at)
        if np.any(missing):
            i = int(np.argmax(missing.reshape(len(ids), -1).any(axis=1)))
            raise self._missing(cards, i, int(ids[missing].ravel()[0]))
        return at

    def row(self, cards: Cards, i: int, id: int, ground: bool = False) -> int:
        """Row of one point id of card i."""
        at = int(np.searchsorted(self.ids, id)) if len(self.ids) else 0
        if ground and id == 0:
            return -1
        if at >= len(self.ids) or self.ids[at] != id:
            raise self._missing(cards, i, id)
        return at

    def _missing(self, cards: Cards, i: int, id: int) -> FileError:
        return cards.refuse(
            i,
            f"grid {id} does not exist; the deck has {len(self.ids)} points, "
            f"{self.ids.min()} to {self.ids.max()}",
        )

    def frame_at(self, row: int) -> np.ndarray:
        """Displacement frame (3, 3) of a point, unit vectors as rows."""
        return np.eye(3) if self.axes is None else self.axes[row]

    def basic(self, rows: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Vectors (n, 3) given in the displacement frames of points, in the basic frame."""
        if self.axes is None:
            return vectors
        return np.einsum("ni,nij->nj", vectors, self.axes[rows])

    def system_at(self, cards: Cards, i: int, cid: int, place: np.ndarray) -> np.ndarray:
        """Unit vectors (3, 3) of coordinate system ``cid`` at a basic place."""
        frame = self.frames.get(cid, cards, i)
        return frame.at(place[None])[0]


def with_property(deck: Deck, cards: Cards) -> Iterator[tuple[int, Cards]]:
    """Position of each element, and the card of its property: PGAP of a CGAP."""
    name = "P" + cards.name[1:]
    table = deck[name]
    known = {int(id): i for i, id in enumerate(table.unique())}
    for i, pid in enumerate(cards.properties().tolist()):
        if pid not in known:
            there = ", ".join(map(str, sorted(known)[:8])) or "none"
            raise cards.refuse(i, f"there is no {name} {pid}; there are {there}")
        yield i, table.single(known[pid])


def parameter(deck: Deck, name: str) -> str:
    """Text of the last PARAM of this name, '' where there is none."""
    cards = deck["PARAM"]
    found = np.flatnonzero(cards.words(1) == name.encode())
    return cards.word(int(found[-1]), 2) if len(found) else deck.case.parameters.get(name, "")


def real_parameter(deck: Deck, name: str, default: float) -> float:
    """Value of a real PARAM."""
    text = parameter(deck, name)
    value = parse_real(text) if text else default
    if np.isnan(value):
        raise FileError(f"{deck.path}: PARAM,{name} is {text!r}, not a number")
    return value


def units_of(deck: Deck, units: Units | str | None) -> Units:
    """The unit system of a deck with its PARAM,WTMASS; without one its numbers are kept."""
    weight = real_parameter(deck, "WTMASS", 1.0)
    if not weight > 0:
        raise FileError(f"{deck.path}: PARAM,WTMASS is {weight:g}; it scales mass, so it is > 0")
    return replace(unit_system(units or "SI"), weight=weight)


def context(deck: Deck, units: Units | str | None) -> Context:
    """Points and factors of a deck; without units its numbers are kept."""
    scale = units_of(deck, units)
    default = only_one(deck, "GRDSET")
    cp, cd = (int(default.integers(k, 0)[0]) if len(default) else 0 for k in (2, 6))
    return _points(deck, scale, Frames(deck, cp), cp, cd)


def only_one(deck: Deck, name: str) -> Cards:
    """The card of a name of which a deck has one at most."""
    cards = deck[name]
    if len(cards) > 1:
        first = cards.where(0)
        raise FileError(f"{cards.where(1)}: a second {name}; a deck has one, which is at {first}")
    return cards


def _points(deck: Deck, scale: Units, frames: Frames, cp: int, cd: int) -> Context:
    grid = _without_repeats(deck["GRID"])
    ids = grid.unique()
    if np.any(bad := ids <= 0):
        raise grid.refuse(int(np.argmax(bad)), "a grid's id is a positive integer")
    if np.any(other := grid.integers(8, 0) != 0) and "SEID" not in deck.allowed:
        why = (
            "SEID puts it into a superelement, which is not supported; take it out, or --allow SEID"
        )
        raise grid.refuse(int(np.argmax(other)), why)
    places = _places(grid, frames, grid.integers(2, cp))
    axes = _axes(grid, frames, grid.integers(6, cd), places)
    spoints = _spoints(deck, ids)
    all_ids = np.concatenate([ids, spoints])
    order = np.argsort(all_ids)
    scalar = np.arange(len(all_ids)) >= len(ids)
    places = np.concatenate([places, np.zeros((len(spoints), 3))])
    if axes is not None:
        axes = np.concatenate([axes, np.broadcast_to(np.eye(3), (len(spoints), 3, 3))])[order]
    return Context(deck, scale, frames, all_ids[order], places[order], axes, scalar[order])


def _without_repeats(grid: Cards) -> Cards:
    """A grid written twice, word for word the same, is one grid."""
    ids = grid.integers(1)
    order = np.argsort(ids, kind="stable")
    again = order[1:][np.diff(ids[order]) == 0]
    first = order[:-1][np.diff(ids[order]) == 0]
    same = [b for a, b in zip(first, again, strict=True) if grid.fields(a) == grid.fields(b)]
    return grid.take(np.setdiff1d(np.arange(len(grid)), same)) if same else grid


def _places(grid: Cards, frames: Frames, cp: np.ndarray) -> np.ndarray:
    """Basic coordinates (n, 3)."""
    x = grid.block(3, 3, 0.0)
    for cid in np.unique(cp):
        mine = np.flatnonzero(cp == cid)
        frame = frames.get(int(cid), grid, int(mine[0]))
        x[mine] = frame.place(x[mine])
    return x


def _axes(grid: Cards, frames: Frames, cd: np.ndarray, places: np.ndarray) -> np.ndarray | None:
    """Displacement frames (n, 3, 3); None where all are basic. CD -1 is a fluid point."""
    if np.any(cd == -1):
        raise grid.refuse(int(np.argmax(cd == -1)), "CD is -1: fluid points are not supported")
    if not np.any(cd):
        return None
    axes = np.broadcast_to(np.eye(3), (len(cd), 3, 3)).copy()
    for cid in np.unique(cd):
        mine = np.flatnonzero(cd == cid)
        frame = frames.get(int(cid), grid, int(mine[0]))
        axes[mine] = frame.at(places[mine])
    return axes


def _spoints(deck: Deck, grids: np.ndarray) -> np.ndarray:
    """Ids of scalar points: of SPOINT, and of scalar elements that name what is no grid."""
    cards = deck["SPOINT"]
    found = [id for i in range(len(cards)) for id in id_list(cards, i, 1)]
    ids = np.unique(np.array(found, np.int64))
    if np.any(both := np.isin(ids, grids)):
        raise FileError(f"{deck.path}: {int(ids[both][0])} is both a GRID and an SPOINT")
    return np.union1d(ids, np.setdiff1d(_of_scalar_elements(deck), np.append(grids, 0)))


def _of_scalar_elements(deck: Deck) -> np.ndarray:
    """Points without a component on CELAS, CDAMP and CMASS, which need no SPOINT.

    MSC Nastran Quick Reference Guide, SPOINT.
    """
    out = [np.zeros(0, np.int64)]
    for kind in ("CELAS", "CDAMP", "CMASS"):
        for cards in deck.present(f"{kind}3", f"{kind}4"):
            out += [cards.integers(3, 0), cards.integers(4, 0)]
        for cards in deck.present(f"{kind}1", f"{kind}2"):
            for k in (3, 5):
                out.append(np.where(cards.integers(k + 1, 0) == 0, cards.integers(k, 0), 0))
    return np.concatenate(out)


_LONGEST = 1_000_000  # ids that a THRU may stand for


def id_list(cards: Cards, i: int, first: int, among: np.ndarray | None = None) -> list[int]:
    """Ids in fields ``first``... of card i: THRU, BY and EXCEPT spelled out.

    Parameters
    ----------
    among : (n,) increasing ids; of a THRU those alone count
    """
    words = [w for w in cards.fields(i)[first - 1 :] if w]
    out: list[int] = []
    last = k = 0  # where the latest THRU ends, while EXCEPT is at work
    while k < len(words):
        if words[k] in ("THRU", "TO") and out and k + 1 < len(words):
            step, last = 1, _whole(cards, i, words[k + 1])
            if last < out[-1]:
                raise cards.refuse(i, f"{out[-1]} {words[k]} {last} runs backwards")
            if k + 3 < len(words) and words[k + 2] == "BY":
                step = max(_whole(cards, i, words[k + 3]), 1)
                k += 2
            out += _run(cards, i, range(out[-1] + step, last + 1, step), among)
            k += 2
        elif words[k] == "EXCEPT" and last:
            k += 1
            while k < len(words) and (id := _whole(cards, i, words[k])) <= last:
                out = [x for x in out if x != id]
                k += 1
            last = 0
        else:
            out.append(_whole(cards, i, words[k]))
            k += 1
    return out


def _run(cards: Cards, i: int, ids: range, among: np.ndarray | None) -> list[int]:
    """The ids of a THRU."""
    if among is not None and ids:
        low, high = np.searchsorted(among, [ids[0], ids[-1] + 1])
        return [id for id in among[low:high].tolist() if id in ids]
    if len(ids) > _LONGEST:
        said = f"the range {ids[0]} THRU {ids[-1]} stands for {len(ids)} ids"
        raise cards.refuse(i, f"{said}, more than {_LONGEST}")
    return list(ids)


def _whole(cards: Cards, i: int, word: str) -> int:
    if not re.fullmatch(r"[+-]?[0-9]{1,11}", word):
        raise cards.refuse(i, f"{word!r} is not an integer")
    return int(word)


def digits(cards: Cards, i: int, word: str, what: str = "component") -> tuple[int, ...]:
    """Components 1-6 packed in one integer, "123" or "12 3" -> (1, 2, 3); "0" or blank: none."""
    word = word.replace(" ", "")
    if word in ("", "0"):
        return ()
    if set(word) - set("123456") or len(set(word)) < len(word):
        raise cards.refuse(i, f"{what} {word!r} is not made of the digits 1 to 6")
    return tuple(sorted(int(c) for c in word))
