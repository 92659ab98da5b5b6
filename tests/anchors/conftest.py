"""Loads of the reference decks, resolved here so that the reader's own may be checked by them."""

from dataclasses import dataclass

import numpy as np
import pytest

from chladni.dynamics.damping import DampingTable
from chladni.fem.solve import inertia_load
from chladni.meshing.nastran.numbers import parse_real

FACES = {
    4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    6: ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


@dataclass(frozen=True)
class Loads:
    """Forces of a deck's load sets as (6n,) over the points of its assembly, deck's units."""

    deck: object
    made: object

    def static(self, case) -> np.ndarray:
        """(6n,) of what LOAD selects in a subcase."""
        return sum(factor * self._plain(s) for factor, s in self._sets("LOAD", case.get("LOAD")))

    def excitation(self, case) -> np.ndarray:
        """(6n,) of what DLOAD selects, tables of ones."""
        total = np.zeros(6 * len(self.made.ids))
        for name in ("RLOAD1", "RLOAD2"):
            for card in self._of(name, case.get("DLOAD")):
                total += self._areas(card.integer(0, 2)) + self._plain(card.integer(0, 2))
                table = card.integer(0, 5, 0) or card.integer(0, 6)
                pairs = [parse_real(x) for x in next(self._of("TABLED1", table)).fields(0)[8:-1]]
                assert set(pairs[1::2]) == {1.0}
        return total

    def _of(self, name, sid):
        cards = self.deck[name]
        return (cards.single(k) for k in range(len(cards)) if cards.integer(k, 1) == sid)

    def _sets(self, name, sid):
        """(factor, set): a combination's parts, or the set itself."""
        for card in self._of(name, sid):
            words = [float(card.real(0, k)) for k in range(2, len(card.fields(0)) + 1)]
            return [(words[0] * s, int(i)) for s, i in zip(words[1::2], words[2::2], strict=True)]
        return [(1.0, sid)]

    def _plain(self, sid) -> np.ndarray:
        f = np.zeros((len(self.made.ids), 6))
        for name, first in (("FORCE", 0), ("MOMENT", 3)):
            for card in self._of(name, sid):
                assert card.integer(0, 3, 0) == 0
                row = self.made.rows([card.integer(0, 2)])[0]
                f[row, first : first + 3] += card.real(0, 4) * card.block(5, 3, 0.0)[0]
        for card in self._of("PLOAD4", sid):
            self._pressure(card, f)
        total = f.ravel()
        for card in self._of("GRAV", sid):
            g = card.real(0, 3) * card.block(4, 3, 0.0)[0]
            total = total + inertia_load(self.made, g[:, None])[:, 0]
        return total

    def _areas(self, sid) -> np.ndarray:
        f = np.zeros((len(self.made.ids), 6))
        for card in self._of("DAREA", sid):
            for k in range(2, len(card.fields(0)), 3):
                f[self.made.rows([card.integer(0, k)])[0], card.integer(0, k + 1) - 1] += card.real(
                    0, k + 2
                )
        return f.ravel()

    def _pressure(self, card, f) -> None:
        first = card.integer(0, 2)
        last = card.integer(0, 8) if card.word(0, 7) == "THRU" else first
        p = card.real(0, 3)
        shells = self.made.shells
        for k in np.flatnonzero((shells.ids >= first) & (shells.ids <= last)):
            nodes = shells.nodes[k, : 3 if shells.triangle[k] else 4]
            f[nodes, :3] += p * _normal_shares(self.made.points[nodes])
        for solids in self.made.solids:
            for k in np.flatnonzero((solids.ids >= first) & (solids.ids <= last)):
                nodes = solids.nodes[k][list(self._face(card, solids.nodes[k]))]
                shares = _normal_shares(self.made.points[nodes])
                out = self.made.points[nodes].mean(axis=0) - self.made.points[solids.nodes[k]].mean(
                    axis=0
                )
                f[nodes, :3] -= p * np.sign(shares.sum(axis=0) @ out) * shares

    def _face(self, card, nodes):
        """The face that G1 and G3 span, or the triangle that G1 is on."""
        g1 = int(np.flatnonzero(nodes == self.made.rows([card.integer(0, 7)])[0])[0])
        word = card.word(0, 8)
        if not word:
            return next(f for f in FACES[len(nodes)] if len(f) == 3 and g1 in f)
        g3 = int(np.flatnonzero(nodes == self.made.rows([int(word)])[0])[0])
        if len(nodes) == 4:
            return next(f for f in FACES[4] if g1 in f and g3 not in f)
        return next(
            f for f in FACES[len(nodes)] if len(f) == 4 and {g1, g3} in ({f[0], f[2]}, {f[1], f[3]})
        )


def _normal_shares(P) -> np.ndarray:
    """∫ N n dA at the corners of a flat or bilinear face."""
    if len(P) == 3:
        return np.tile(np.cross(P[1] - P[0], P[2] - P[0]) / 6, (3, 1))
    out = np.zeros((4, 3))
    for x, y in np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / np.sqrt(3):
        a, b = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
        along = np.cross(a * (1 + b * y) / 4 @ P, b * (1 + a * x) / 4 @ P)
        out += ((1 + a * x) * (1 + b * y) / 4)[:, None] * along
    return out


@pytest.fixture(scope="session")
def loads():
    return Loads


@pytest.fixture(scope="session")
def damping():
    """TABDMP1 of a deck as a table."""

    def read(deck, sid) -> DampingTable:
        cards = deck["TABDMP1"]
        card = cards.single(int(np.flatnonzero(cards.integers(1) == sid)[0]))
        pairs = np.array([parse_real(x) for x in card.fields(0)[8:] if x != "ENDT"])
        kind = (card.word(0, 2) or "G").lower()
        return DampingTable(pairs[0::2], pairs[1::2], kind)

    return read
