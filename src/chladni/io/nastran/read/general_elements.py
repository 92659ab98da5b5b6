"""A matrix of stiffness or flexibility between dofs (GENEL), as springs on scalar points.

K or Z = K⁻¹ belongs to u_i - S u_d. A blank S is that of a rigid body, which six dofs u_d of a
structure determine (MSC Nastran Quick Reference Guide, GENEL).
"""

from collections.abc import Iterator

import numpy as np

from ..text.table import Cards
from .context import Context, digits
from .rigid_elements import motions
from .strain_springs import StrainSpring, squares

_MARKS = ("UD", "K", "Z", "S")
_SINGULAR = 1e-12  # least over largest eigenvalue of a flexibility that has an inverse
Dof = tuple[int, int]  # row of a point, component 1-6


def general_elements(ctx: Context) -> list[StrainSpring]:
    """The springs of all GENEL."""
    return [
        spring
        for cards in ctx.deck.present("GENEL")
        for i in range(len(cards))
        for spring in _element(ctx, cards, i)
    ]


def _element(ctx: Context, cards: Cards, i: int) -> Iterator[StrainSpring]:
    lists = _lists(cards, i)
    u_i, u_d = _dofs(ctx, cards, i, lists[""]), _dofs(ctx, cards, i, lists.get("UD", [])[1:])
    m, n, kind = len(u_i), len(u_d), "K" if "K" in lists else "Z"
    if not m or ("K" in lists) == ("Z" in lists):
        raise cards.refuse(i, "it gives no dofs UI, or not one of K and Z")
    if len({*u_i, *u_d}) < m + n:
        raise cards.refuse(i, "a dof is named twice")
    A: np.ndarray = np.zeros((m, m))
    A[np.triu_indices(m)] = _numbers(cards, i, kind, lists[kind], m * (m + 1) // 2)
    A = A + np.triu(A, 1).T
    size = _sizes(ctx, u_i)
    if kind == "Z":
        value = np.linalg.eigvalsh(A * np.outer(size, size) / np.outer(size, size).max())
        if not abs(value).min() > _SINGULAR * abs(value).max():
            raise cards.refuse(i, "its flexibility Z has no inverse")
    stiff = np.linalg.inv(A) if kind == "Z" else A
    K = stiff * ctx.scale.force * ctx.scale.length / np.outer(size, size)
    if "S" in lists:
        S = _numbers(cards, i, "S", lists["S"], m * n).reshape(m, n)
        S = S * size[:, None] / _sizes(ctx, u_d)
    else:
        S = _rigid(ctx, cards, i, u_i, u_d) if n else np.zeros((m, 0))
    rows = list(dict.fromkeys(row for row, _ in (*u_i, *u_d)))
    E = np.zeros((m, 6 * len(rows)))
    for k, dof in enumerate(u_i):
        E[k] += _direction(ctx, rows, dof)
    for k, dof in enumerate(u_d):
        E -= np.outer(S[:, k], _direction(ctx, rows, dof))
    yield from squares(cards.integer(i, 1), rows, E, K, size / size.max())


def _lists(cards: Cards, i: int) -> dict[str, list[str]]:
    """Fields behind each mark, those of UI under ""."""
    out: dict[str, list[str]] = {"": []}
    mark = ""
    for word in cards.fields(i)[2:]:
        if word in _MARKS:
            if word in out:
                raise cards.refuse(i, f"{word} stands there twice")
            mark = word
            out[mark] = []
        else:
            out[mark].append(word)
    return out


def _dofs(ctx: Context, cards: Cards, i: int, words: list[str]) -> list[Dof]:
    """Pairs of point and component."""
    out = []
    for point, component in zip(words[::2], [*words[1::2], ""], strict=False):
        if not point:
            continue
        if not point.isdecimal():
            raise cards.refuse(i, f"{point!r} is not a grid")
        row = ctx.row(cards, i, int(point))
        comps = (1,) if ctx.scalar[row] else digits(cards, i, component)
        if len(comps) != 1:
            raise cards.refuse(i, f"{component!r} is not one component")
        out.append((row, comps[0]))
    return out


def _numbers(cards: Cards, i: int, kind: str, words: list[str], count: int) -> np.ndarray:
    """Values of K, Z or S; a blank among them is zero."""
    first = cards.fields(i).index(kind) + 2
    given = max((k + 1 for k, word in enumerate(words) if word), default=0)
    if given != count:
        raise cards.refuse(i, f"{kind} has {given} values; its dofs ask for {count}")
    return cards.single(i).block(first, count, 0.0)[0]


def _sizes(ctx: Context, dofs: list[Dof]) -> np.ndarray:
    """Units of the dofs in SI: the length of a translation, 1 of a rotation."""
    L = ctx.scale.length
    return np.array([1.0 if c > 3 and not ctx.scalar[row] else L for row, c in dofs])


def _direction(ctx: Context, rows: list[int], dof: Dof) -> np.ndarray:
    """The dof (6n,) as a motion of all rows in the basic frame."""
    row, c = dof
    out = np.zeros((len(rows), 2, 3))
    axis = np.eye(3)[0] if ctx.scalar[row] else ctx.frame_at(row)[(c - 1) % 3]
    out[rows.index(row), int(c > 3)] = axis
    return out.ravel()


def _rigid(ctx: Context, cards: Cards, i: int, u_i: list[Dof], u_d: list[Dof]) -> np.ndarray:
    """S = R_i R_d⁻¹ of rigid motions R, in SI."""
    about = ctx.places[u_d[0][0]]
    scalar = any(ctx.scalar[row] for row, _ in (*u_i, *u_d))
    if len(u_d) != 6 or scalar:
        raise cards.refuse(i, "S is blank, so UD has to be six dofs of grids, and UI dofs of grids")
    R_i, R_d = (motions(ctx, dofs, about) for dofs in (u_i, u_d))
    span = float(np.abs(R_d[:, 3:]).max()) or 1.0
    unit = np.array([1.0] * 3 + [1 / span] * 3)
    if not np.linalg.cond(R_d * unit) < 1e8:
        raise cards.refuse(i, "the six dofs UD leave a rigid motion free")
    S = (R_i * unit) @ np.linalg.inv(R_d * unit)
    turns = [np.array([c > 3 for _, c in dofs]) for dofs in (u_i, u_d)]
    L = ctx.scale.length
    return S * np.where(turns[0], 1.0, L)[:, None] / np.where(turns[1], 1.0, L)
