"""An effect on few degrees of freedom added to a state, without a basis of its own.

The rows B of these dofs move by B Φ q + R f under forces f on them. Φ is the basis. R is their
static flexibility beyond it. A stiffness A then acts as A (1 + R A)⁻¹ on B Φ q, and a mass moves by
(1 + R A)⁻¹ B Φ q (Woodbury). The inertia of motions beyond the basis is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..effects.effect import Effect, MatrixTerm, PointTerm, of
from .effect_dofs import acting_at
from .field_factors import log_fields, multiplied
from .real_modes import real_modes
from .reduced_model import State
from .reduced_problem import ReducedProblem

MOST_ROWS = 1000  # on which an effect may act: dense matrices of more cost as much as a basis
Operator = tuple[str, sp.csr_array, float]  # the matrix it is added to, A, c of c A


@dataclass(frozen=True, eq=False)
class LocalEffect:
    """An effect next to those of a base, over the basis of a reduced problem."""

    reduced: ReducedProblem
    base: Sequence[Effect]
    effect: Effect
    _rows: list["_Rows"] = field(default_factory=list, repr=False)  # those of the last state

    @classmethod
    def of(
        cls, reduced: ReducedProblem, base: Sequence[Effect], effect: Effect, state: State,
        x: np.ndarray, y: np.ndarray,
    ) -> Self | None:  # fmt: skip
        """The effect at y next to a base at x; None where either is of another kind."""
        released = effect.release or reduced.model.following is not None
        others = state.drive, state.dissipated, state.spin
        terms = effect.terms(y)
        points, matrices = of(PointTerm, terms), of(MatrixTerm, terms)
        plain = all(t.own is None and not t.moving for t in points)
        plain &= not any(t.rise or t.geometric for t in matrices)
        plain &= 0 < len(terms) == len(points) + len(matrices)
        if released or not plain or any(each is not None for each in others):
            return None
        local = cls(reduced, base, effect)
        operators = [A for _, A, _ in local._operators(x, y)]
        return local if local._seated(operators, points).count <= MOST_ROWS else None

    def added(self, state: State, x: np.ndarray, y: np.ndarray) -> State:
        """The state of the base at x with the effect at y, if it is a structure; without slopes."""
        operators, points = self._operators(x, y), of(PointTerm, self.effect.terms(y))
        rows, weight = self._seated([A for _, A, _ in operators], points), self.effect.weight(y)
        K, M = np.zeros((2, rows.count, rows.count))
        for (matrix, _, c), A, on in zip(operators, rows.dense, rows.at, strict=False):
            (K if matrix == "K" else M)[np.ix_(on, on)] += c * A
        for t, on in zip(points, rows.at[len(operators) :], strict=True):
            (K if t.matrix == "K" else M)[on, on] += t.coefficient
        b = rows.in_basis @ state.phi
        left = np.linalg.inv(np.eye(len(K)) + K @ rows.flexibility)  # of a force on these rows
        moves = left.T @ b
        lam, turn = real_modes(
            np.diag(state.lam) + b.T @ (left @ K) @ b, np.eye(len(state.lam)) + moves.T @ M @ moves
        )
        return replace(
            state, lam=lam, phi=state.phi @ turn, own=state.own @ turn,
            moved=None if state.moved is None else state.moved @ turn,
            weight=state.weight + weight.mass, dweight=np.append(state.dweight, weight.gradient),
        )  # fmt: skip

    def _operators(self, x: np.ndarray, y: np.ndarray) -> list[Operator]:
        """Operators of the effect, with its part in those of the base.

        The operators of the effect itself are there at every y, so that it has the same rows. A
        factor of the base on modes does not multiply them here.
        """
        acting = acting_at([*self.base, self.effect], z := np.concatenate([x, y]))
        groups, split = self.reduced.model.groups, "" not in self.reduced.model.linear
        fields = log_fields(acting, groups, len(z), split)
        change: dict[int, Operator] = {}
        for sign, some in ((1, acting), (-1, acting[:-1])):
            for share in multiplied(some, groups, *fields, split):
                t = share.term
                c = change.get(id(t.operator), ("", t.operator, 0.0))[2]
                change[id(t.operator)] = t.matrix, t.operator, c + sign * t.coefficient
        own = {id(t.operator) for t in of(MatrixTerm, self.effect.terms(y))}
        return [each for key, each in change.items() if each[2] or key in own]

    def _seated(self, operators: list[sp.csr_array], points: Sequence[PointTerm]) -> "_Rows":
        """Their rows; those of the last state where they are the same."""
        parts = [*operators, *(t.rows for t in points)]
        if not self._rows or list(map(id, parts)) != list(map(id, self._rows[0].parts)):
            self._rows[:] = [_Rows.of(self.reduced, parts, len(operators))]
        return self._rows[0]


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows B (k, n) on which some parts act: operators, and rows of points."""

    parts: list[sp.csr_array]
    at: list[np.ndarray]  # positions of each part among the rows
    dense: list[np.ndarray]  # each operator on its own rows
    # in_basis, flexibility: B Φ (k, r), R (k, k)
    in_basis: np.ndarray
    flexibility: np.ndarray

    @classmethod
    def of(cls, reduced: ReducedProblem, parts: list[sp.csr_array], operators: int) -> Self:
        """Collect the rows; of too many the flexibility is left out."""
        busy = [np.flatnonzero(np.diff(A.indptr)) for A in parts[:operators]]
        dofs = np.unique(np.concatenate([np.zeros(0, int), *busy]))
        unit = sp.eye_array(reduced.model.vectors.shape[0]).tocsr()[dofs]
        B = sp.csr_array(sp.vstack([unit, *parts[operators:]]))
        at, end = [np.searchsorted(dofs, on) for on in busy], len(dofs)
        for rows in parts[operators:]:
            at.append(np.arange(end, end := end + rows.shape[0]))
        few = B.shape[0] <= MOST_ROWS
        R = reduced.flexibility_between(B) if few else np.zeros((0, 0))
        dense = [A[on][:, on].toarray() for A, on in zip(parts, busy, strict=False)]
        return cls(parts, at, dense, reduced.model.vectors.seen(B), R)

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.in_basis)
