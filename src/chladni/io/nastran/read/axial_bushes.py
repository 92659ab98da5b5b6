"""Springs and dashpots along one line: CBUSH1D, CVISC."""

import numpy as np

from ....model.assembly import Bushes
from ..text.table import Cards
from .context import Context, with_property


def cbush1d(ctx: Context, cards: Cards) -> Bushes:
    """CBUSH1D: EID PID GA GB CID, a spring and a dashpot along x of CID or from end to end."""
    s, n = ctx.scale, len(cards)
    first = ctx.rows(cards, cards.integers(3))
    nodes = np.stack([first, ctx.rows(cards, cards.integers(4, 0), ground=True)], axis=1)
    A = ctx.places[first]
    along = np.where((nodes[:, 1] < 0)[:, None], 0.0, ctx.places[nodes[:, 1]] - A)
    stiffness, viscous, frames = np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 3, 3))
    for i, card in with_property(ctx.deck, cards):
        stiffness[i, 0], viscous[i, 0] = card.real(0, 2, 0.0), card.real(0, 3, 0.0)
        if card.real(0, 4, 0.0):
            raise card.refuse(0, "a mass M is not supported; write it as a CONM2")
        if cards.word(i, 5):
            frames[i] = ctx.system_at(cards, i, cards.integer(i, 5), A[i])
        elif np.any(along[i]):
            frames[i] = _end_to_end(along[i])
        else:
            raise cards.refuse(i, "its ends coincide, so it needs a coordinate system CID")
    k = s.force / s.length
    place = (A + along / 2) * s.length
    return Bushes(
        cards.integers(1), nodes, frames, place, stiffness * k, viscous * k * s.time,
        np.zeros((n, 6)),
    )  # fmt: skip


def _end_to_end(x: np.ndarray) -> np.ndarray:
    """Any frame (3, 3) along x."""
    z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    frame = np.array([x, np.cross(z, x), z])
    return np.asarray(frame / np.linalg.norm(frame, axis=1)[:, None])


def cvisc(ctx: Context, cards: Cards) -> Bushes:
    """CVISC: an axial and a torsional dashpot from end to end."""
    nodes = ctx.rows(cards, cards.ids(3, 2))
    X, s, n = ctx.places[nodes], ctx.scale, len(cards)
    viscous, frames = np.zeros((n, 6)), np.zeros((n, 3, 3))
    for i, card in with_property(ctx.deck, cards):
        viscous[i, [0, 3]] = card.block(2, 2, 0.0)[0]
        x = X[i, 1] - X[i, 0]
        if not np.any(x):
            raise cards.refuse(i, "its length is zero")
        frames[i] = _end_to_end(x)
    work = np.array([s.force / s.length] * 3 + [s.force * s.length] * 3) * s.time
    none = np.zeros((n, 6))
    return Bushes(
        cards.integers(1), nodes, frames, X.mean(axis=1) * s.length, none, viscous * work, none
    )
