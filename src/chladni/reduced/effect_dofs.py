"""Effects with their terms, and the degrees of freedom that they add behind those of the basis.

A mass on a spring has a resonance of its own, so it cannot be condensed onto its attachment point.
It adds a row and a column to the reduced K and M, which is exact at every frequency.
"""

from collections.abc import Sequence

import numpy as np

from ..effects.effect import Effect, PointTerm, Term

Acting = Sequence[tuple[Effect, slice, tuple[Term, ...]]]  # see :func:`acting_at`


def acting_at(effects: Sequence[Effect], x: np.ndarray) -> Acting:
    """Every effect, the positions of its parameters in x, and its terms there."""
    return [(effect, at, effect.terms(x[at])) for effect, at in slices(effects)]


def slices(effects: Sequence[Effect]) -> list[tuple[Effect, slice]]:
    """Every effect and the positions of its parameters in x."""
    ends = np.cumsum([len(e.parameters) for e in effects])
    return [(e, slice(end - len(e.parameters), end)) for e, end in zip(effects, ends, strict=True)]


def own_positions(effects: Sequence[Effect]) -> list[int]:
    """Position of the first degree of freedom of each effect among all that effects add."""
    ends = np.cumsum([e.traits.own_dofs for e in effects])
    return [int(end) - e.traits.own_dofs for e, end in zip(effects, ends, strict=True)]


def own_part(term: PointTerm, first: int, n_own: int) -> np.ndarray:
    """The columns of a term's rows at the degrees of freedom that effects add (k, n_own)."""
    out = np.zeros((term.rows.shape[0], n_own))
    if term.own is not None:
        out[:, first : first + term.own.shape[1]] = term.own
    return out


def row(b: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Rows over a basis and the degrees of freedom that effects add (k, r + n_own)."""
    return np.concatenate([b, own], axis=1) if own.shape[1] else b


def with_own(A: np.ndarray, n_own: int) -> np.ndarray:
    """Matrices (..., r, r) with zero rows and columns for the dofs that effects add."""
    wide = ((0, n_own), (0, n_own))
    return np.pad(A, (*[(0, 0)] * (A.ndim - 2), *wide)) if n_own else A
