"""Coordinate systems (CORD1x, CORD2x) resolved to the basic frame, however deep they nest."""

from dataclasses import dataclass

import numpy as np

from ..text.deck import Deck
from ..text.table import Cards


@dataclass(frozen=True, eq=False)
class Frame:
    """A system in the basic frame: kind R, C or S, origin (3,), axes (3, 3) with unit rows."""

    kind: str
    origin: np.ndarray
    axes: np.ndarray

    def place(self, x: np.ndarray) -> np.ndarray:
        """Basic coordinates (n, 3) of coordinates (n, 3) in this system, angles in degrees."""
        return self.origin + _cartesian(self.kind, x) @ self.axes

    def at(self, points: np.ndarray) -> np.ndarray:
        """Unit vectors (n, 3, 3), as rows, of the system at basic points (n, 3)."""
        points = np.atleast_2d(points)
        if self.kind == "R":
            return np.broadcast_to(self.axes, (len(points), 3, 3)).copy()
        local = (points - self.origin) @ self.axes.T
        return _curvilinear(self.kind, local) @ self.axes


BASIC = Frame("R", np.zeros(3), np.eye(3))


def _cartesian(kind: str, x: np.ndarray) -> np.ndarray:
    """(r θ z) or (r θ φ) to local x, y, z."""
    if kind == "R":
        return x
    r, a = x[:, 0], np.radians(x[:, 1])
    if kind == "C":
        return np.stack([r * np.cos(a), r * np.sin(a), x[:, 2]], axis=1)
    b = np.radians(x[:, 2])
    return np.stack([r * np.sin(a) * np.cos(b), r * np.sin(a) * np.sin(b), r * np.cos(a)], axis=1)


def _curvilinear(kind: str, x: np.ndarray) -> np.ndarray:
    """Unit vectors e_r, e_θ, e_z (or e_r, e_θ, e_φ) at local points, θ = 0 on the axis."""
    reach = np.hypot(x[:, 0], x[:, 1])
    scale = np.maximum(np.linalg.norm(x, axis=1), 1e-300)
    on_axis = reach < 1e-10 * np.maximum(scale, 1e-290)
    angle = np.where(on_axis, 0.0, np.arctan2(x[:, 1], x[:, 0]))
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros(len(x)), np.ones(len(x))
    if kind == "C":
        rows = [[c, s, zero], [-s, c, zero], [zero, zero, one]]
    else:
        tilt = np.arctan2(np.where(on_axis, 0.0, reach), x[:, 2])
        ct, st = np.cos(tilt), np.sin(tilt)
        rows = [[st * c, st * s, ct], [ct * c, ct * s, -st], [-s, c, zero]]
    return np.moveaxis(np.array(rows), 2, 0)


class Frames:
    """All coordinate systems of a deck, each resolved when first asked for (deck's own units)."""

    def __init__(self, deck: Deck, default_cp: int) -> None:
        self._known: dict[int, Frame] = {0: BASIC}
        self._pending: list[int] = []
        self._cards = _systems(deck)
        self._grid = deck["GRID"]
        self._default_cp = default_cp
        self._row: dict[int, int] | None = None

    def get(self, cid: int, asker: Cards, at: int) -> Frame:
        """The system with this id, which card ``at`` of ``asker`` names."""
        if cid in self._known:
            return self._known[cid]
        if cid not in self._cards:
            there = ", ".join(map(str, sorted(self._cards)[:8])) or "none but 0, the basic one"
            raise asker.refuse(at, f"coordinate system {cid} does not exist; there are {there}")
        cards, i = self._cards[cid]
        if cid in self._pending:
            raise cards.refuse(i, "the coordinate system is defined by itself")
        self._pending.append(cid)
        try:
            frame = self._one(cards, i) if cards.name[4] == "1" else self._two(cards, i)
        except RecursionError:
            raise cards.refuse(i, "the coordinate systems nest too deeply") from None
        self._pending.pop()
        self._known[cid] = frame
        return frame

    def _two(self, cards: Cards, i: int) -> Frame:
        """CORD2x: three points in the reference system."""
        one = cards.single(i)
        parent = self.get(int(one.integers(2, 0)[0]), cards, i)
        A, B, C = parent.place(one.block(3, 9, 0.0).reshape(3, 3))
        return _frame(cards, i, A, B, C)

    def _one(self, cards: Cards, i: int) -> Frame:
        """CORD1x: three grids; a card may hold two systems."""
        one = cards.single(i)
        grids = one.ids(2, 3)[0]
        A, B, C = (self._grid_place(int(g), cards, i) for g in grids)
        return _frame(cards, i, A, B, C)

    def _grid_place(self, grid: int, asker: Cards, at: int) -> np.ndarray:
        if self._row is None:
            self._row = {int(g): k for k, g in enumerate(self._grid.integers(1))}
        if grid not in self._row:
            raise asker.refuse(at, f"grid {grid} does not exist")
        one = self._grid.single(self._row[grid])
        frame = self.get(int(one.integers(2, self._default_cp)[0]), asker, at)
        return frame.place(one.block(3, 3, 0.0))[0]


def _systems(deck: Deck) -> dict[int, tuple[Cards, int]]:
    """{id: (table, row)}; the second system of a CORD1x card is split off."""
    out: dict[int, tuple[Cards, int]] = {}
    for kind in "RCS":
        for name in (f"CORD2{kind}", f"CORD1{kind}"):
            for cards in deck.present(name):
                for table in (cards, *_second(cards)):
                    for i, cid in enumerate(table.integers(1)):
                        if int(cid) in out and out[int(cid)][0].fields(
                            out[int(cid)][1]
                        ) != table.fields(i):
                            other, j = out[int(cid)]
                            raise table.refuse(i, f"the id is already taken at {other.where(j)}")
                        out[int(cid)] = (table, i)
    return out


def _second(cards: Cards) -> list[Cards]:
    """The systems in fields 5 to 8 of CORD1x cards, as cards of their own."""
    if cards.name[4] != "1":
        return []
    has = np.flatnonzero(cards.words(5) != b"")
    if not len(has):
        return []
    part = cards.take(has)
    text = np.stack([part.words(k) for k in range(5, 9)], axis=1)
    start = 4 * np.arange(len(has) + 1)
    return [
        Cards(cards.name, text.ravel(), start, part.file, part.lines, part.line_start, part.files)
    ]


def _frame(cards: Cards, i: int, A: np.ndarray, B: np.ndarray, C: np.ndarray) -> Frame:
    """Origin A, z through B, x in the plane of C."""
    z, x = B - A, C - A
    y = np.cross(z, x)
    size = np.linalg.norm(z) * np.linalg.norm(x)
    if not np.linalg.norm(y) > 1e-12 * size or not np.isfinite(size):
        raise cards.refuse(i, "its three points lie on one line")
    x = np.cross(y, z)
    return Frame(cards.name[5], A, np.array([v / np.linalg.norm(v) for v in (x, y, z)]))
