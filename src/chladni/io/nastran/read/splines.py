"""Elastic lines as equations (RSPLINE): dofs that follow an unloaded tube through all grids.

The dofs that the card names carry no load: K_dd q_d + K_di q_i = 0, K the stiffness of the line.
On a straight line between independent grids the tube's diameter cancels: translations along the
line and twist are linear, deflections cubic. Where the line bends, the tube matters, which no
manual describes. Its wall is thin here (I = A D²/8, J = 2 I), its Poisson's ratio 0.3, its diameter
D/L times the whole length.
"""

from collections.abc import Iterator

import numpy as np

from ....model.assembly import Equation
from ..text.table import Cards
from .context import Context, digits
from .strain_springs import relative

_SLENDER = 0.1  # D/L where the card is silent
_NU = 0.3
_NOTHING = 1e-10  # of the largest factor of an equation: rounding


def spline(ctx: Context, cards: Cards, i: int) -> Iterator[Equation]:
    """RSPLINE: EID D/L G1 G2 C2 G3 C3...; the first and the last grid lead, a blank C leads too."""
    words = cards.fields(i)[2:]
    if len(words) % 2 == 0:
        words.append("")
    grids, comps = [words[0], *words[1::2]], ["", *words[2::2]]
    rows = [ctx.row(cards, i, _grid(cards, i, word)) for word in grids]
    follow = [digits(cards, i, word) for word in comps]
    if len(rows) < 3 or follow[-1] or not any(follow):
        raise cards.refuse(i, "it needs a grid between two others, and the last one leads")
    if np.any(scalar := ctx.scalar[rows]):
        raise cards.refuse(i, f"{grids[int(np.argmax(scalar))]} is a scalar point")
    if len(set(rows)) < len(rows):
        raise cards.refuse(i, "a grid is named twice")
    ratio = cards.real(i, 2, _SLENDER)
    if not ratio > 0:
        raise cards.refuse(i, f"D/L is {ratio:g}; it is to be positive")
    K, span = _line(ctx, cards, i, rows, ratio)
    dependent = np.array([6 * k + c - 1 for k, some in enumerate(follow) for c in some])
    rest = np.setdiff1d(np.arange(len(K)), dependent)
    unit = np.tile([1.0] * 3 + [span] * 3, len(rows))
    G = -np.linalg.solve(K[np.ix_(dependent, dependent)], K[np.ix_(dependent, rest)])
    for d, line in zip(dependent.tolist(), G, strict=True):
        at = np.flatnonzero(np.abs(line) > _NOTHING * np.abs(line).max())
        dofs = [d, *rest[at].tolist()]
        factors = [-1.0, *(line[at] * unit[rest[at]] / unit[d])]
        yield Equation(
            cards.integer(i, 1),
            tuple(int(rows[k // 6]) for k in dofs),
            tuple(k % 6 + 1 for k in dofs),
            tuple(map(float, factors)),
        )


def _grid(cards: Cards, i: int, word: str) -> int:
    if not word.isdecimal():
        raise cards.refuse(i, f"{word!r} is not a grid")
    return int(word)


def _line(
    ctx: Context, cards: Cards, i: int, rows: list[int], ratio: float
) -> tuple[np.ndarray, float]:
    """K (6n, 6n) in displacement frames, rotations times the length, for EA = 1; the length [m]."""
    X = ctx.places[rows] * ctx.scale.length
    along = np.diff(X, axis=0)
    length = np.linalg.norm(along, axis=1)
    if not np.all(length > 0):
        raise cards.refuse(i, "two of its grids lie at one place")
    EI = (ratio * length.sum()) ** 2 / 8
    GJ = EI / (1 + _NU)
    span = float(length.sum())
    unit = np.array([1.0] * 3 + [1 / span] * 3)
    K = np.zeros((6 * len(rows), 6 * len(rows)))
    for k, (x, L) in enumerate(zip(along, length, strict=True)):
        F = np.diag([L, L**3 / (3 * EI), L**3 / (3 * EI), L / GJ, L / EI, L / EI])
        F[1, 5] = F[5, 1] = L**2 / (2 * EI)
        F[2, 4] = F[4, 2] = -(L**2) / (2 * EI)
        y = np.eye(3)[np.argmin(np.abs(x))]
        axes = np.array([x, np.cross(np.cross(x, y), x), np.cross(x, y)])
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        own = np.kron(np.eye(2), axes) @ relative(x)
        frames = [ctx.frame_at(r).T for r in rows[k : k + 2] for _ in (0, 1)]
        own = np.hstack([own[:, 3 * j : 3 * j + 3] @ f for j, f in enumerate(frames)])
        own = own * np.tile(unit, 2)
        at = slice(6 * k, 6 * k + 12)
        K[at, at] += own.T @ np.linalg.inv(F) @ own
    return K, span
