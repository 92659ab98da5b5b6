"""Solid elements: corners, nodes on edges."""

from collections.abc import Iterator

import numpy as np

from ....geometry.solid_faces import least_warp_cosine
from ....geometry.solid_shapes import EDGES, jacobians
from ....model.assembly import Solids
from ..text.table import Cards
from .context import Context
from .sections import Parts

SOLIDS = {"CHEXA": 8, "CPENTA": 6, "CPYRAM": 5, "CPYRA": 5, "CTETRA": 4}  # corners


def solids(ctx: Context, parts: Parts) -> tuple[Solids, ...]:
    """Solids by kind, those with nodes on their edges apart."""
    out = []
    for name, corners in SOLIDS.items():
        for every in ctx.deck.present(name):
            middles = every.ids(corners + 3, len(EDGES[corners]), 0)
            curved = (middles != 0).any(axis=1)
            for cards, middle in (
                (every.take(~curved), middles[:0]),
                (every.take(curved), middles[curved]),
            ):
                if len(cards):
                    out.append(_made(ctx, parts, cards, corners, middle))
    return tuple(out)


def _made(ctx: Context, parts: Parts, cards: Cards, corners: int, middle: np.ndarray) -> Solids:
    """Solids of one kind; a mid-side node that is blank or 0 repeats the first end of its edge."""
    ids = cards.ids(3, corners)
    if len(middle):
        first = np.array(EDGES[corners])[:, 0]
        ids = np.hstack([ids, np.where(middle == 0, ids[:, first], middle)])
    nodes = ctx.rows(cards, ids)
    _check(ctx, cards, nodes, middle == 0)
    return Solids(cards.integers(1), nodes, parts.of("solid", cards, cards.integers(2)))


def _check(ctx: Context, cards: Cards, nodes: np.ndarray, absent: np.ndarray) -> None:
    """Refuse a node named twice, a body without volume, and det J <= 0 at a point of integration.

    Solvers stop there; a body that is merely distorted is computed, see :func:`warped_solids`.
    """
    own = nodes.copy()
    if len(absent):
        mine = own[:, -absent.shape[1] :]
        mine[absent] = -1 - np.nonzero(absent)[1]
    same = (np.diff(np.sort(own, axis=1), axis=1) == 0).any(axis=1)
    if np.any(same):
        i = int(np.argmax(same))
        raise cards.refuse(i, f"a node is named twice, grids {ctx.ids[nodes[i]].tolist()}")
    X = ctx.places[nodes]
    dV = jacobians(X)
    size = np.abs(dV).max(axis=1)
    if np.any(bad := ~(size > _NO_VOLUME * np.ptp(X, axis=1).max(axis=1) ** 3)):
        i = int(np.argmax(bad))
        raise cards.refuse(i, f"its volume is zero; grids {ctx.ids[nodes[i]].tolist()}")
    least = (dV * np.sign(dV.sum(axis=1))[:, None]).min(axis=1)
    if np.any(bad := ~(least > _NO_VOLUME * size)):
        i = int(np.argmax(bad))
        raise cards.refuse(
            i,
            "it turns inside out: det J vanishes or changes its sign from one point of integration "
            f"to another; check the order and place of grids {ctx.ids[nodes[i]].tolist()}",
        )


_NO_VOLUME = 1e-12  # det J over the cube of the size, or over the largest det J: rounding
_WARPED = 0.707  # HEX_WARP of Nastran's GEOMCHECK, 45 degrees


def warped_solids(ctx: Context) -> Iterator[str]:
    """Solids with a face warped by more than 45 degrees, one sentence a kind of card."""
    for name in ("CHEXA", "CPENTA"):
        for cards in ctx.deck.present(name):
            X = ctx.places[ctx.rows(cards, cards.ids(3, SOLIDS[name]))]
            if len(found := np.flatnonzero(least_warp_cosine(X) < _WARPED)):
                i, more = int(found[0]), len(found) - 1
                others = f" and {more} others have" if more else " has"
                yield (
                    f"{cards.where(i)}: {name} {cards.integers(1)[i]}{others} a face warped by "
                    "more than 45 degrees; check the order of the grids"
                )
