"""Rigid elements, averages and multi-point constraints."""

from collections.abc import Iterator

import numpy as np

from ....model.assembly import Average, Equation, RigidBody
from ..text.deck import Deck
from ..text.table import Cards
from .context import Context, digits, id_list
from .splines import spline
from .springs_and_masses import skew

Tie = RigidBody | Average | Equation
Dof = tuple[int, int]
_ALL = (1, 2, 3, 4, 5, 6)


def ties(ctx: Context, mpc: tuple[int, ...]) -> tuple[Tie, ...]:
    """Every rigid link, and the multi-point constraints of the selected sets."""
    out: list[Tie] = []
    for name, read in _READERS.items():
        for cards in ctx.deck.present(name) if name not in ctx.deck.allowed else ():
            cards.unique()
            for i in range(len(cards)):
                out.extend(read(ctx, cards, i))
    for cards in ctx.deck.present("MPC"):  # SID G1 C1 A1 G2 C2 A2 - - G3 C3 A3...; Σ A q = 0
        for k in np.flatnonzero(np.isin(cards.integers(1), mpc)):
            out.append(_equation(ctx, cards.single(int(k))))
    return tuple(out)


def _body(
    ctx: Context, cards: Cards, i: int, lead: int, others: list[int], comps: tuple[int, ...]
) -> RigidBody:
    """Points that follow a leading one."""
    rows = [ctx.row(cards, i, g) for g in dict.fromkeys(others)]
    for row in (lead, *rows):
        if ctx.scalar[row]:
            raise cards.refuse(i, f"{ctx.ids[row]} is a scalar point")
    if lead in rows:
        raise cards.refuse(i, f"grid {ctx.ids[lead]} follows itself")
    return RigidBody(cards.integer(i, 1), lead, tuple(rows), (comps,) * len(rows))


def _rbe2(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RBE2: EID GN CM GM1 GM2...; a real among the grids is the thermal coefficient."""
    comps = digits(cards, i, cards.word(i, 3))
    lead = ctx.row(cards, i, cards.integer(i, 2))
    one = cards.single(i)
    words = one.fields(0)
    real = bool(words) and "." in words[-1]
    grids = id_list(one if not real else _without_last(one), 0, 4)
    if not grids or not comps:
        raise cards.refuse(i, "it ties no grids or no components")
    yield _body(ctx, cards, i, lead, grids, comps)


def _without_last(card: Cards) -> Cards:
    """One card without its last field that is not blank."""
    text = card.text.copy()
    text[np.flatnonzero(text != b"")[-1]] = b""
    return Cards(card.name, text, card.start, card.file, card.lines, card.line_start, card.files)


def _rbe3(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RBE3: EID - REFGRID REFC WT1 C1 G1.. WT2 C2 G.. UM GM1 CM1.. ALPHA a."""
    words = cards.fields(i)
    reference = ctx.row(cards, i, cards.integer(i, 3))
    comps = digits(cards, i, cards.word(i, 4)) or ()
    body, moved = words[4:], []
    for mark in ("ALPHA", "TREF"):
        if mark in body:
            body = body[: body.index(mark)]
    if "UM" in body:
        at = body.index("UM")
        body, moved = body[:at], [w for w in body[at + 1 :] if w]
    terms = tuple(_terms(ctx, cards, i, [w for w in body if w]))
    if not terms or not comps:
        raise cards.refuse(i, "it has no REFC, or no grids to average")
    yield Average(cards.integer(i, 1), reference, comps, terms, tuple(_moved(ctx, cards, i, moved)))


def _terms(
    ctx: Context, cards: Cards, i: int, words: list[str]
) -> Iterator[tuple[int, tuple[int, ...], float]]:
    """Groups weight, components, grids: a word with a point begins a new group."""
    k = 0
    while k < len(words):
        weight = _real(cards, i, words[k])
        if k + 1 >= len(words):
            raise cards.refuse(i, f"the weight {words[k]} has no components and no grids")
        comps = digits(cards, i, words[k + 1])
        k += 2
        while k < len(words) and not _is_real(words[k]):
            if words[k] == "THRU" and k + 1 < len(words):
                first, last = (_integer(cards, i, words[j]) for j in (k - 1, k + 1))
                for g in range(first + 1, last + 1):  # the first that is no grid is refused
                    yield ctx.row(cards, i, g), comps, weight
                k += 2
                continue
            yield ctx.row(cards, i, _integer(cards, i, words[k])), comps, weight
            k += 1


def _is_real(word: str) -> bool:
    return "." in word or (not word.lstrip("+-").isdecimal() and word != "THRU")


def _real(cards: Cards, i: int, word: str) -> float:
    from ..text.numbers import parse_real

    value = parse_real(word)
    if np.isnan(value):
        raise cards.refuse(i, f"{word!r} is not a weight")
    return value


def _integer(cards: Cards, i: int, word: str) -> int:
    if not word.isdecimal() or len(word) > 12:
        raise cards.refuse(i, f"{word!r} is not an integer")
    return int(word)


def _moved(ctx: Context, cards: Cards, i: int, words: list[str]) -> Iterator[Dof]:
    """UM pairs: grid, components."""
    for g, c in zip(words[::2], words[1::2], strict=False):
        for comp in digits(cards, i, c):
            yield ctx.row(cards, i, _integer(cards, i, g)), comp


def _rbar(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RBAR: EID GA GB CNA CNB CMA CMB; one end leads, or the leading dofs are shared.

    CNA is 123456 where both are blank (MSC Nastran Quick Reference, RBAR, Lagrange method). Fewer
    than six components lead their own like at the other end only, see :func:`partial_bars`.
    """
    a, b = (ctx.row(cards, i, cards.integer(i, k)) for k in (2, 3))
    cna, cnb, cma, cmb = _bar_components(cards, i)
    if len(cna) + len(cnb) > 6:
        raise cards.refuse(i, "CNA and CNB hold more than six components together")
    if not cma and not cmb:
        few = len(cna) + len(cnb) < 6
        cma, cmb = (cnb, cna) if few else (_rest(cna), _rest(cnb))
    if cna == _ALL and not cma:
        yield _body(ctx, cards, i, a, [int(ctx.ids[b])], cmb)
    elif cnb == _ALL and not cmb:
        yield _body(ctx, cards, i, b, [int(ctx.ids[a])], cma)
    else:
        lead = [(a, c) for c in cna] + [(b, c) for c in cnb]
        follow = [(a, c) for c in cma] + [(b, c) for c in cmb]
        yield from _general(ctx, cards, i, lead, follow, least=1)


def _bar_components(cards: Cards, i: int) -> tuple[tuple[int, ...], ...]:
    """CNA, CNB, CMA, CMB of an RBAR."""
    cna, cnb, cma, cmb = (digits(cards, i, cards.word(i, k)) for k in (4, 5, 6, 7))
    return (cna if cna or cnb else _ALL), cnb, cma, cmb


def partial_bars(deck: Deck) -> Iterator[str]:
    """RBAR of fewer than six leading components, in one sentence.

    MSC's manual asks for six. A solver that computes a bar between solids with CNA = 123 alone
    gives both ends the same translations and no rotations.
    """
    for cards in deck.present("RBAR"):
        few = [i for i in range(len(cards)) if len(sum(_bar_components(cards, i)[:2], ())) < 6]
        if few:
            more = f" and {len(few) - 1} others have" if few[1:] else " has"
            yield (
                f"{cards.where(few[0])}: RBAR {cards.integer(few[0], 1)}{more} fewer than six "
                "components in CNA and CNB: the other end moves equally in these components, the "
                "rest is not tied"
            )


def _rtrplt(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RTRPLT: three grids on a rigid plate, EID GA GB GC CNA CNB CNC - CMA CMB CMC."""
    rows = [ctx.row(cards, i, cards.integer(i, k)) for k in (2, 3, 4)]
    lead, follow = (
        [(r, c) for r, k in zip(rows, ks, strict=True) for c in digits(cards, i, cards.word(i, k))]
        for ks in ((5, 6, 7), (9, 10, 11))
    )
    rest = [(r, c) for r in rows for c in _ALL if (r, c) not in lead]
    yield from _general(ctx, cards, i, lead, follow or rest)


def _rest(given: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(c for c in _ALL if c not in given)


def _rrod(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RROD: the distance of two grids is fixed, Σ ± t·u = 0; the dependent dof comes first."""
    a, b = (ctx.row(cards, i, cards.integer(i, k)) for k in (2, 3))
    cma, cmb = (digits(cards, i, cards.word(i, k)) for k in (4, 5))
    if len(cma) + len(cmb) != 1:
        raise cards.refuse(i, "exactly one of CMA, CMB is to be one of 1, 2, 3")
    yield _distance(ctx, cards, i, a, b, (a, cma[0]) if cma else (b, cmb[0]))


def _distance(ctx: Context, cards: Cards, i: int, a: int, b: int, follows: Dof) -> Equation:
    """t·(u_b - u_a) = 0 with the dependent dof first."""
    t = ctx.places[b] - ctx.places[a]
    if not np.any(t) or not 1 <= follows[1] <= 3:
        raise cards.refuse(i, "its length is zero, or its component is not one of 1, 2, 3")
    t = t / np.linalg.norm(t)
    dofs = [(a, c) for c in (1, 2, 3)] + [(b, c) for c in (1, 2, 3)]
    factors = np.concatenate([-ctx.frame_at(a) @ t, ctx.frame_at(b) @ t])
    first = dofs.index(follows)
    if abs(factors[first]) < 1e-3:
        raise cards.refuse(i, "the dependent component is across the rod")
    order = [first, *(k for k in range(6) if k != first and factors[k])]
    return Equation(
        cards.integer(i, 1),
        tuple(dofs[k][0] for k in order),
        tuple(dofs[k][1] for k in order),
        tuple(float(factors[k]) for k in order),
    )


def _pairs(ctx: Context, cards: Cards, i: int, words: list[str]) -> list[Dof]:
    """Grid, components, grid, components..."""
    words = [w for w in words if w]
    return [
        (ctx.row(cards, i, _integer(cards, i, g)), c)
        for g, comps in zip(words[::2], words[1::2], strict=False)
        for c in digits(cards, i, comps)
    ]


def _rbe1(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """RBE1 (and COSMIC CRIGD3): six leading dofs, then UM (MSET) and the dofs that follow."""
    words = cards.fields(i)[1:]
    mark = next((m for m in ("UM", "MSET") if m in words), "")
    if not mark:
        raise cards.refuse(i, "UM, the list of dependent components, is missing")
    at = words.index(mark)
    follow = words[at + 1 :]
    if "ALPHA" in follow:
        follow = follow[: follow.index("ALPHA")]
    if follow and "." in follow[-1]:
        follow = follow[:-1]
    lead = _pairs(ctx, cards, i, words[:at])
    yield from _general(ctx, cards, i, lead, _pairs(ctx, cards, i, follow))


def motions(ctx: Context, dofs: list[Dof], about: np.ndarray) -> np.ndarray:
    """R with q = R r: dofs in their own frames under the rigid motion r of point ``about``."""
    x = ctx.places[[row for row, _ in dofs]] - about
    R = np.zeros((len(dofs), 6))
    X = skew(x)
    for k, (row, c) in enumerate(dofs):
        axis = ctx.frame_at(row)[(c - 1) % 3]
        R[k] = (
            np.concatenate([axis, -axis @ X[k]]) if c <= 3 else np.concatenate([np.zeros(3), axis])
        )
    return R


def _general(
    ctx: Context, cards: Cards, i: int, lead: list[Dof], follow: list[Dof], least: int = 6
) -> Iterator[Equation]:
    """q_m = R_m R_n⁺ q_n: one equation a dependent dof; R_n⁺ is the inverse of six rows."""
    if not least <= len(lead) <= 6 or not follow:
        raise cards.refuse(i, f"{len(lead)} independent components are given, six are needed")
    about = ctx.places[lead[0][0]]
    span = float(np.abs(ctx.places[[r for r, _ in lead + follow]] - about).max()) or 1.0
    unit = np.array([1.0] * 3 + [1 / span] * 3)
    Rn, Rm = (motions(ctx, dofs, about) * unit for dofs in (lead, follow))
    if np.linalg.cond(Rn) > 1e8:
        raise cards.refuse(i, "the six independent components leave a rigid motion free")
    factors = Rm @ np.linalg.pinv(Rn)
    id, L = cards.integer(i, 1), ctx.scale.length
    for (row, comp), line in zip(follow, factors, strict=True):
        terms = [(row, comp, -1.0)] + [
            (r, c, float(f)) for (r, c), f in zip(lead, line, strict=True) if abs(f) > 1e-14
        ]
        yield Equation(
            id,
            tuple(t[0] for t in terms),
            tuple(t[1] for t in terms),
            tuple(t[2] * (L if t[1] > 3 else 1.0) for t in terms),
        )


def _crigdr(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """COSMIC CRIGDR: EID IG G C: the distance of two grids is fixed, component C of G follows."""
    a, b = (ctx.row(cards, i, cards.integer(i, k)) for k in (2, 3))
    yield _distance(ctx, cards, i, a, b, (b, cards.integer(i, 4)))


def _crigd1(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """COSMIC CRIGD1: EID IG G1 G2...: all six dofs follow."""
    lead = ctx.row(cards, i, cards.integer(i, 2))
    yield _body(ctx, cards, i, lead, id_list(cards, i, 3), _ALL)


def _crigd2(ctx: Context, cards: Cards, i: int) -> Iterator[Tie]:
    """COSMIC CRIGD2: EID IG G1 C1 G2 C2...: the named dofs follow."""
    lead = ctx.row(cards, i, cards.integer(i, 2))
    dofs = _pairs(ctx, cards, i, cards.fields(i)[2:])
    rows = tuple(dict.fromkeys(r for r, _ in dofs))
    comps = tuple(tuple(c for r, c in dofs if r == row) for row in rows)
    yield RigidBody(cards.integer(i, 1), lead, rows, comps)


_READERS = {
    "RBE2": _rbe2,
    "RBE3": _rbe3,
    "RBAR": _rbar,
    "RROD": _rrod,
    "RTRPLT": _rtrplt,
    "RBE1": _rbe1,
    "RSPLINE": spline,
    "CRIGD1": _crigd1,
    "CRIGD2": _crigd2,
    "CRIGD3": _rbe1,
    "CRIGDR": _crigdr,
}


def _equation(ctx: Context, card: Cards) -> Equation:
    terms = []
    for k in range(2, card.width() + 1, 1):
        if (k - 2) % 8 not in (0, 3) or card.words(k)[0] == b"":
            continue
        row = ctx.row(card, 0, int(card.integers(k)[0]))
        word = card.words(k + 1)[0].decode("latin-1")
        comps = (1,) if ctx.scalar[row] else digits(card, 0, word)
        if len(comps) != 1:
            raise card.refuse(0, f"{word!r} is not one component")
        factor = float(card.reals(k + 2, 0.0)[0])
        rotation = comps[0] > 3
        terms.append((row, comps[0], factor * (ctx.scale.length if rotation else 1.0)))
    if not terms or terms[0][2] == 0:
        raise card.refuse(0, "the factor of its first (dependent) term is missing or zero")
    rows, comps, factors = zip(*terms, strict=True)
    return Equation(int(card.integers(1)[0]), rows, comps, factors)
