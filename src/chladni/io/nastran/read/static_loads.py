"""Static loads: FORCE, MOMENT, GRAV, SLOAD, pressures, and their combinations."""

from collections import defaultdict

import numpy as np

from ....model.analysis import Load, Motion
from ..text.table import Cards
from . import pressure
from .context import Context
from .supports import enforced, prescribed

Parts = dict[int, list[Load]]  # what each set adds up


def _on(rows: np.ndarray, vectors: np.ndarray, first: int) -> Load:
    """Vectors (n, 3) on components first, first + 1, first + 2."""
    components = np.tile(np.arange(first, first + 3), len(rows))
    return Load(np.repeat(rows, 3), components, vectors.ravel())


def _total(parts: list[tuple[float, Load]]) -> Load:
    """Σ S_i L_i: equal dofs added up, zeros dropped."""
    rows, components = (
        np.concatenate([np.zeros(0, np.int64), *(getattr(one, name) for _, one in parts)])
        for name in ("rows", "components")
    )
    values = np.concatenate([np.zeros(0), *(one.values * factor for factor, one in parts)])
    key, inverse = np.unique(8 * rows + components, return_inverse=True)
    total = np.bincount(inverse, values, len(key)) if len(key) else np.zeros(0)
    gravity = sum((factor * one.gravity for factor, one in parts), np.zeros(3))
    keep = total != 0
    return Load(key[keep] // 8, key[keep] % 8, total[keep], gravity)


def loads(ctx: Context) -> dict[int, Load]:
    """Every load set, LOAD combinations resolved."""
    sums: Parts = defaultdict(list)
    for cards in ctx.deck.present("FORCE", "MOMENT"):
        _vectors(ctx, cards, sums)
    for cards in ctx.deck.present("FORCE1", "MOMENT1"):
        _along(ctx, cards, sums)
    for cards in ctx.deck.present("GRAV"):
        _gravity(ctx, cards, sums)
    for cards in ctx.deck.present("SLOAD"):
        _scalar(ctx, cards, sums)
    for sid, rows, forces in pressure.forces(ctx):
        sums[sid].append(_on(rows, forces, 1))
    out = {sid: _total([(1.0, one) for one in parts]) for sid, parts in sums.items()}
    return {**out, **_combined(ctx, out)}


def _unit(ctx: Context, cards: Cards) -> tuple[float, int]:
    """(factor to SI, first component) of forces or moments."""
    turn = cards.name.startswith("MOMENT")
    return ctx.scale.force * (ctx.scale.length if turn else 1.0), 4 if turn else 1


def _vectors(ctx: Context, cards: Cards, sums: Parts) -> None:
    """FORCE, MOMENT: F N in system CID."""
    rows, cid = ctx.rows(cards, cards.integers(2)), cards.integers(3, 0)
    N = cards.block(5, 3, 0.0) * cards.reals(4)[:, None]
    for c in np.unique(cid[cid != 0]):
        mine = np.flatnonzero(cid == c)
        frame = ctx.frames.get(int(c), cards, int(mine[0]))
        N[mine] = np.einsum("ni,nij->nj", N[mine], frame.at(ctx.places[rows[mine]]))
    unit, first = _unit(ctx, cards)
    _spread(cards, sums, rows, N * unit, first)


def _spread(cards: Cards, sums: Parts, rows: np.ndarray, vectors: np.ndarray, first: int) -> None:
    sid = cards.integers(1)
    for s in np.unique(sid):
        sums[int(s)].append(_on(rows[sid == s], vectors[sid == s], first))


def _along(ctx: Context, cards: Cards, sums: Parts) -> None:
    """FORCE1, MOMENT1: along the way from grid G1 to G2."""
    rows = ctx.rows(cards, cards.integers(2))
    ends = ctx.places[ctx.rows(cards, cards.ids(4, 2))]
    span = ends[:, 1] - ends[:, 0]
    size = np.linalg.norm(span, axis=1)
    if np.any(size == 0):
        raise cards.refuse(int(np.argmax(size == 0)), "G1 and G2 are at the same place")
    unit, first = _unit(ctx, cards)
    _spread(cards, sums, rows, span / size[:, None] * cards.reals(3)[:, None] * unit, first)


def _gravity(ctx: Context, cards: Cards, sums: Parts) -> None:
    """GRAV: acceleration A N of all masses, N in system CID."""
    acceleration = ctx.scale.length / ctx.scale.time**2
    for i, sid in enumerate(cards.integers(1).tolist()):
        axes = ctx.system_at(cards, i, cards.integer(i, 2, 0), np.zeros(3))
        N = cards.single(i).block(4, 3, 0.0)[0] @ axes
        g = cards.real(i, 3) * acceleration * N
        sums[sid].append(Load(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), g))


def _scalar(ctx: Context, cards: Cards, sums: Parts) -> None:
    """SLOAD: forces on scalar points."""
    for i, sid in enumerate(cards.integers(1).tolist()):
        for k in (2, 4, 6):
            if cards.word(i, k):
                row = ctx.row(cards, i, cards.integer(i, k))
                value = cards.real(i, k + 1) * ctx.scale.force
                sums[sid].append(_on(np.array([row]), np.array([[value, 0.0, 0.0]]), 1))


def _combined(ctx: Context, simple: dict[int, Load]) -> dict[int, Load]:
    """LOAD: S Σ S_i L_i, and any plain set of the same number."""
    out = {}
    for cards in ctx.deck.present("LOAD"):
        for i, sid in enumerate(cards.unique().tolist()):
            parts = []
            for factor, part in terms(cards, i):
                if part not in simple:
                    there = ", ".join(map(str, sorted(simple)[:8])) or "none"
                    raise cards.refuse(i, f"load {part} does not exist; there are {there}")
                parts.append((factor, simple[part]))
            out[sid] = _total([*parts, *([(1.0, simple[sid])] if sid in simple else [])])
    return out


def terms(cards: Cards, i: int) -> list[tuple[float, int]]:
    """(S S_i, L_i) of a LOAD or DLOAD card."""
    scale, words = cards.real(i, 2), cards.fields(i)
    return [
        (scale * cards.real(i, k), cards.integer(i, k + 1))
        for k in range(3, len(words) + 1, 2)
        if words[k - 1]
    ]


def motions(ctx: Context) -> dict[int, Motion]:
    """SPCD and SPC cards that prescribe a displacement, by set."""
    out = {}
    names = ("SPC", "SPCD")
    for sid in sorted({int(s) for c in ctx.deck.present(*names) for s in c.integers(1)}):
        found = [*enforced(ctx, (sid,)), *prescribed(ctx, (sid,))]
        if found:
            rows, components, values = (np.array(x) for x in zip(*found, strict=True))
            unit = np.where((components > 3), 1.0, ctx.scale.length)
            out[sid] = Motion(rows, components, values * unit)
    return out
