"""Dynamic loads, frequencies and damping: RLOAD, DLOAD, DAREA, LSEQ, TABLED, TABDMP1."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....model.analysis import Excitation, Load, Motion, Tabulated
from ..text.table import Cards
from .context import Context, digits
from .static_loads import terms

_KINDS = {
    "": "force", "0": "force", "LOAD": "force", "L": "force", "LO": "force", "LOA": "force",
    "1": "displacement", "DISP": "displacement", "D": "displacement", "DI": "displacement",
    "2": "velocity", "VELO": "velocity", "V": "velocity", "VE": "velocity",
    "3": "acceleration", "ACCE": "acceleration", "A": "acceleration", "AC": "acceleration",
}  # fmt: skip
Dofs = tuple[np.ndarray, np.ndarray, np.ndarray]  # rows, components, values


def dynamic(
    ctx: Context, loads: dict[int, Load], motions: dict[int, Motion]
) -> dict[int, tuple[Excitation, ...]]:
    """RLOAD1 and RLOAD2 by id, and DLOAD combinations of them."""
    tables, areas = _tables(ctx), _areas(ctx)
    _static_into(ctx, areas, loads)
    out: dict[int, tuple[Excitation, ...]] = {}
    for cards in ctx.deck.present("RLOAD1", "RLOAD2"):
        for i, sid in enumerate(cards.integers(1).tolist()):
            made = _rload(ctx, cards, i, tables, areas, motions)
            out[sid] = (*out.get(sid, ()), made)
    return {**out, **_dloads(ctx, out)}


def _dloads(
    ctx: Context, simple: dict[int, tuple[Excitation, ...]]
) -> dict[int, tuple[Excitation, ...]]:
    """DLOAD: S Σ S_i L_i; time-domain loads among them are refused."""
    out = {}
    for cards in ctx.deck.present("DLOAD"):
        for i, sid in enumerate(cards.unique().tolist()):
            found: list[Excitation] = []
            for factor, part in terms(cards, i):
                if part not in simple:
                    there = ", ".join(map(str, sorted(simple)[:8])) or "none"
                    raise cards.refuse(i, f"there is no RLOAD1 or RLOAD2 {part}; there are {there}")
                found += [replace(e, amplitude=e.amplitude * factor) for e in simple[part]]
            out[sid] = tuple(found)
    return out


def _rload(
    ctx: Context,
    cards: Cards,
    i: int,
    tables: dict[int, Tabulated],
    areas: dict[int, Dofs],
    motions: dict[int, Motion],
) -> Excitation:
    """RLOAD: SID EXCITEID DELAY DPHASE, two tables, TYPE."""
    word = cards.word(i, 7)
    if word not in _KINDS:
        raise cards.refuse(i, f"TYPE {word!r} is not one of LOAD, DISP, VELO, ACCE")
    kind, excite, s = _KINDS[word], cards.integer(i, 2), ctx.scale
    if kind == "force":
        if excite not in areas:
            raise cards.refuse(i, f"there is no DAREA, LSEQ or static load {excite}")
        rows, components, values = areas[excite]
    else:
        if excite not in motions:
            raise cards.refuse(i, f"there is no SPCD {excite} with the motion")
        m = motions[excite]
        power = {"displacement": 0, "velocity": 1, "acceleration": 2}[kind]
        rows, components, values = m.rows, m.components, m.values / s.time**power
    made = [_table(ctx, cards, i, k, tables) for k in (5, 6)]
    delay = _per_dof(ctx, cards, i, 3, "DELAY", rows, components) * s.time
    phase = np.radians(_per_dof(ctx, cards, i, 4, "DPHASE", rows, components))
    polar = cards.name == "RLOAD2"
    return Excitation(kind, rows, components, values, delay, phase, made[0], made[1], polar)


def _table(
    ctx: Context, cards: Cards, i: int, k: int, tables: dict[int, Tabulated]
) -> Tabulated | None:
    """The table in field k: an id, or a real that is constant over frequency."""
    word = cards.word(i, k)
    if not word or word == "0":
        return None
    if not word.isdecimal():
        return Tabulated(np.zeros(1), np.array([cards.real(i, k)]))
    if int(word) not in tables:
        there = ", ".join(map(str, sorted(tables)[:8])) or "none"
        raise cards.refuse(i, f"there is no TABLED {word}; there are {there}")
    return tables[int(word)]


def _per_dof(
    ctx: Context, cards: Cards, i: int, k: int, name: str, rows: np.ndarray, comps: np.ndarray
) -> np.ndarray:
    """DELAY or DPHASE (n,): a real for all, or cards SID P1 C1 V1 P2 C2 V2."""
    out, word = np.zeros(len(rows)), cards.word(i, k)
    if not word or word == "0":
        return out
    if not word.isdecimal():
        return out + cards.real(i, k)
    known = {(r, c): v for r, c, v in _triples(ctx, ctx.deck[name], int(word))}
    return np.array(
        [known.get((r, c), 0.0) for r, c in zip(rows.tolist(), comps.tolist(), strict=True)]
    )


def _triples(ctx: Context, cards: Cards, sid: int) -> Iterator[tuple[int, int, float]]:
    """(row, component, value) of DAREA-like cards of a set."""
    for i in np.flatnonzero(cards.integers(1) == sid).tolist() if len(cards) else []:
        for k in (2, 5):
            if not cards.word(i, k):
                continue
            row = ctx.row(cards, i, cards.integer(i, k))
            comps = (1,) if ctx.scalar[row] else digits(cards, i, cards.word(i, k + 1)) or (1,)
            for c in comps:
                yield row, c, cards.real(i, k + 2)


def _areas(ctx: Context) -> dict[int, Dofs]:
    """DAREA by id, turned from displacement frames to the basic one, in SI."""
    cards, s = ctx.deck["DAREA"], ctx.scale
    out = {}
    for sid in np.unique(cards.integers(1)).tolist() if len(cards) else []:
        total: dict[tuple[int, int], float] = {}
        for row, c, value in _triples(ctx, cards, sid):
            turn = c > 3
            axis = ctx.frame_at(row)[(c - 1) % 3]
            unit = s.force * (s.length if turn else 1.0)
            for j in range(3):
                if axis[j]:
                    key = (row, j + (4 if turn else 1))
                    total[key] = total.get(key, 0.0) + float(value * unit * axis[j])
        keys = np.array(list(total), np.int64).reshape(-1, 2)
        out[sid] = keys[:, 0], keys[:, 1], np.array(list(total.values()))
    return out


def _static_into(ctx: Context, areas: dict[int, Dofs], loads: dict[int, Load]) -> None:
    """Static loads stand for DAREA of the same id, or of the one an LSEQ names."""
    pairs = [(sid, sid) for sid in loads]
    for cards in ctx.deck.present("LSEQ"):
        pairs += list(zip(cards.integers(2).tolist(), cards.integers(3, 0).tolist(), strict=True))
    for excite, lid in pairs:
        load = loads.get(lid)
        if load is not None and len(load.rows):
            old = areas.get(excite)
            new = (load.rows, load.components, load.values)
            both = zip(old, new, strict=True) if old else ()
            areas[excite] = tuple(np.concatenate(x) for x in both) if old else new  # type: ignore[assignment]


def _pairs(card: Cards, first: int) -> tuple[np.ndarray, np.ndarray]:
    """x, y of a table from field ``first`` up to ENDT, increasing."""
    words = card.fields(0)[first - 1 :]
    x, y, k = [], [], first
    for a, b in zip(words[::2], [*words[1::2], ""], strict=False):
        if "ENDT" in (a, b):
            break
        if a != "SKIP" and b != "SKIP" and a:
            x.append(card.real(0, k))
            y.append(card.real(0, k + 1, 0.0))
        k += 2
    if not x:
        raise card.refuse(0, "the table is empty")
    order = np.argsort(x, kind="stable")
    return np.array(x)[order], np.array(y)[order]


def _tables(ctx: Context) -> dict[int, Tabulated]:
    """TABLED1 to TABLED3; frequencies in Hz."""
    out: dict[int, Tabulated] = {}
    for name in ("TABLED1", "TABLED2", "TABLED3"):
        for cards in ctx.deck.present(name):
            for i, tid in enumerate(cards.unique().tolist()):
                card = cards.single(i)
                x, y = _pairs(card, 9)
                logs = (
                    [card.word(0, k) == "LOG" for k in (2, 3)] if name == "TABLED1" else [False] * 2
                )
                if (logs[0] and np.any(x <= 0)) or (logs[1] and np.any(y <= 0)):
                    raise card.refuse(0, "a logarithmic axis needs positive values")
                if name != "TABLED1":
                    x = card.real(0, 2, 0.0) + x * (
                        card.real(0, 3, 1.0) if name == "TABLED3" else 1.0
                    )
                out[tid] = Tabulated(x / ctx.scale.time, y, *logs)
    return out


def damping(ctx: Context) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """TABDMP1: (f [Hz], ζ); TYPE G (the default): ζ = g/2, CRIT: ζ, Q: ζ = 1/2Q."""
    out = {}
    for cards in ctx.deck.present("TABDMP1"):
        for i, tid in enumerate(cards.unique().tolist()):
            card, kind = cards.single(i), cards.word(i, 2) or "G"
            f, g = _pairs(card, 9)
            if kind not in ("G", "CRIT", "Q") or (kind == "Q" and np.any(g <= 0)):
                raise card.refuse(
                    0, f"TYPE {kind!r} is not one of G, CRIT, Q, or its Q is not positive"
                )
            zeta = {"G": g / 2, "CRIT": g, "Q": 1 / (2 * np.where(g > 0, g, 1.0))}[kind]
            out[tid] = (f / ctx.scale.time, zeta)
    return out


def eigenvalues(ctx: Context) -> dict[int, tuple[float, float, int]]:
    """EIGRL (SID V1 V2 ND) and EIGR (SID METHOD F1 F2 NE ND)."""
    out = {}
    for name, low, count in (("EIGRL", 2, 4), ("EIGR", 3, 6)):
        for cards in ctx.deck.present(name):
            for i, sid in enumerate(cards.unique().tolist()):
                a, b = (cards.real(i, low + k, np.nan) / ctx.scale.time for k in (0, 1))
                out[sid] = (a, b, cards.integer(i, count, 0))
    return out
