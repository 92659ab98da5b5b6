"""Scores of effects on few degrees of freedom, without a basis of their own.

The rows B of these dofs move by B Φ q + R f under forces f on them. Φ is the basis. R is their
static flexibility beyond it. A stiffness A then acts as A (1 + R A)⁻¹ on B Φ q, and a mass moves by
(1 + R A)⁻¹ B Φ q (Woodbury). The inertia of motions beyond the basis is left out.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..effects.effect import Effect, MatrixTerm, PointTerm, of
from ..reduced.effect_dofs import acting_at
from ..reduced.field_factors import log_fields, multiplied
from ..reduced.real_modes import real_modes
from ..reduced.reduced_model import State
from ..reduced.reduced_problem import ReducedProblem
from .hypothesis_fit import FAILED
from .likelihood import Responses
from .scan import Baseline

Operator = tuple[str, sp.csr_array, float]  # the matrix it is added to, A, c of c A
MOST_ROWS = 1000  # on which an effect may act: dense matrices of more cost as much as a basis


def local_scores(
    base: Baseline, reduced: ReducedProblem, data: Responses, effect: Effect,
    starts: Sequence[np.ndarray],
) -> np.ndarray | None:  # fmt: skip
    """Score of an effect at each start (n,); None for an effect or a base of another kind."""
    state, released = base.state, effect.release or reduced.model.following is not None
    others = state.drive, state.dissipated, state.spin
    if released or any(each is not None for each in others):
        return None
    every = [added for x in starts if (added := _added(base, reduced, effect, x)) is not None]
    if len(every) < len(starts):
        return None
    at = np.unique(np.concatenate([
        np.flatnonzero(np.diff(A.indptr)) for operators, _ in every for _, A, _ in operators
    ] or [np.zeros(0, int)]))  # fmt: skip
    unit = sp.eye_array(reduced.model.vectors.shape[0]).tocsr()[at]
    known = {0: unit, **{id(t.rows): t.rows for _, points in every for t in points}}
    ends = dict(zip(known, np.cumsum([rows.shape[0] for rows in known.values()]), strict=True))
    rows = sp.csr_array(sp.vstack(list(known.values())))
    if rows.shape[0] > MOST_ROWS:
        return None
    b = reduced.model.vectors.seen(rows) @ state.phi
    R, out = reduced.flexibility_between(rows), np.full(len(starts), np.inf)
    for k, ((operators, points), x) in enumerate(zip(every, starts, strict=True)):
        local = {matrix: np.zeros_like(R) for matrix in "KM"}
        for matrix, A, c in operators:
            local[matrix][: len(at), : len(at)] += c * A[at][:, at]
        for t in points:
            own = np.arange(ends[id(t.rows)] - t.rows.shape[0], ends[id(t.rows)])
            local[t.matrix][own, own] += t.coefficient
        with suppress(*FAILED):
            other = _changed(state, b, R, local["K"], local["M"], effect.weight(x).mass)
            r = data.scaled(other, False)[0][:, None]
            out[k] = base.score(replace(base, state=other).with_mass(r, 0.0))[0]
    return out


def _added(
    base: Baseline, reduced: ReducedProblem, effect: Effect, x: np.ndarray
) -> tuple[list[Operator], list[PointTerm]] | None:
    """Operators and points of an effect, with its part in those of the base; None: it has others.

    A factor of the base on modes does not multiply them here.
    """
    terms, z = effect.terms(x), np.concatenate([base.x, x])
    points, matrices = of(PointTerm, terms), of(MatrixTerm, terms)
    plain = all(t.own is None for t in points) and not any(t.rise or t.geometric for t in matrices)
    if not plain or len(points) + len(matrices) < len(terms):
        return None
    acting, groups = acting_at([*base.effects, effect], z), reduced.model.groups
    split = "" not in reduced.model.linear
    fields = log_fields(acting, groups, len(z), split)
    change: dict[int, Operator] = {}
    for sign, some in ((1, acting), (-1, acting[:-1])):
        for share in multiplied(some, groups, *fields, split):
            t = share.term
            c = change.get(id(t.operator), ("", t.operator, 0.0))[2]
            change[id(t.operator)] = t.matrix, t.operator, c + sign * t.coefficient
    return [each for each in change.values() if each[2]], points


def _changed(
    state: State, b: np.ndarray, R: np.ndarray, K: np.ndarray, M: np.ndarray, mass: float
) -> State:
    """The state with K and M added on rows b of its modes (k, m)."""
    left = np.linalg.inv(np.eye(len(R)) + K @ R)  # of a force on these rows
    moves = left.T @ b
    lam, turn = real_modes(
        np.diag(state.lam) + b.T @ (left @ K) @ b, np.eye(len(state.lam)) + moves.T @ M @ moves
    )
    return replace(
        state, lam=lam, phi=state.phi @ turn, own=state.own @ turn,
        moved=None if state.moved is None else state.moved @ turn, weight=state.weight + mass,
    )  # fmt: skip
