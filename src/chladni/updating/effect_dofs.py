"""Degrees of freedom that effects bring along: they stand below those of the structure's basis.

A lump on a spring swings by itself, so that it cannot be condensed onto the place it sits at: it is
a row and a column more of the reduced K and M, exact at every frequency.
"""

from collections.abc import Sequence

import numpy as np

from ..effects.effect import Effect, PointTerm


def own_positions(effects: Sequence[Effect]) -> list[int]:
    """Of each effect the position of the first degree of freedom it brings, among all brought."""
    ends = np.cumsum([e.own_dofs for e in effects])
    return [int(end) - e.own_dofs for e, end in zip(effects, ends, strict=True)]


def own_part(term: PointTerm, first: int, n_own: int) -> np.ndarray:
    """What a term's rows are at the degrees of freedom that effects bring (k, n_own)."""
    out = np.zeros((term.rows.shape[0], n_own))
    if term.own is not None:
        out[:, first : first + term.own.shape[1]] = term.own
    return out


def row(b: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Rows over a basis and what effects bring (k, r + n_own)."""
    return np.concatenate([b, own], axis=1) if own.shape[1] else b


def with_own(A: np.ndarray, n_own: int) -> np.ndarray:
    """Matrices (..., r, r) with empty rows and columns for what effects bring."""
    wide = ((0, n_own), (0, n_own))
    return np.pad(A, (*[(0, 0)] * (A.ndim - 2), *wide)) if n_own else A
