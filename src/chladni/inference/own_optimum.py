"""Best parameters of an effect alone, while the base follows linearly: before any joint fit.

Residuals of data and priors are r(y) + J d.  y are the effect's own parameters, d is a change of
the base parameters, and J are the slopes by these at one state of the base.  d is eliminated for
every y (Golub and Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432): only slopes by y are computed,
by differences where an effect is local (:mod:`..reduced.local_effect`).
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..effects.effect import Effect
from ..errors import ModelError
from ..reduced.local_effect import LocalEffect
from ..reduced.reduced_model import Reduced, State, evaluate
from .likelihood import Data
from .linear_model import LinearModel, Squares, cost
from .map_fit import (
    Fit,
    MassMeasurement,
    Objective,
    Point,
    Status,
    constants,
    descend,
    prior_residuals,
)

STEPS, CLOSE = 12, 2.0  # most steps; improvement of -2 ln posterior by a step that is the last
NEAR = 1e-4  # of the prior sd of a parameter: the step of slopes by differences
SHARES = (1.0, 0.3)  # of the linear change of the base: the first that improves is taken


@dataclass(frozen=True, eq=False)
class LocalOptimum:
    """An effect at one optimum of its family: its parameters and standard deviations (n_p,)."""

    effect: Effect
    neg2_log_evidence: float
    x: np.ndarray
    sd: np.ndarray

    def same(self, other: "LocalOptimum") -> bool:
        """True if both are one optimum: places or parameters agree within their uncertainty."""
        if self.effect.text == other.effect.text:
            sd = np.maximum(self.sd, other.sd)
            return bool((np.abs(self.x - other.x) <= 2 * sd).all())
        mine, its = (v.effect.location(v.x, v.sd) for v in (self, other))
        if None in (mine.point_m, its.point_m, mine.radius_m, its.radius_m):
            return False
        apart = np.linalg.norm(np.subtract(mine.point_m, its.point_m))  # type: ignore[arg-type]
        return bool(apart <= max(mine.radius_m, its.radius_m))  # type: ignore[type-var, operator]


def distinct(
    optima: Iterable[LocalOptimum], kept: Sequence[LocalOptimum] = ()
) -> list[LocalOptimum]:
    """Optima that are no other one and none of ``kept``, best first."""
    out: list[LocalOptimum] = []
    for v in sorted(optima, key=lambda v: v.neg2_log_evidence):
        if not any(v.same(known) for known in (*kept, *out)):
            out.append(v)
    return out


class Base(NamedTuple):
    """Responses of the base alone, linear about parameters x (n,), and its state there."""

    alone: LinearModel
    x: np.ndarray
    state: State | None = None  # for effects that are added to it


def own_optimum(
    model: Reduced, base: Sequence[Effect], effect: Effect, data: Data,
    mass_measurement: MassMeasurement | None, about: Sequence[Base], start: np.ndarray,
    local: LocalEffect | None = None,
) -> Fit:  # fmt: skip
    """Optimise an effect from a start, with the base linear about the best of some states.

    The evidence is that of responses linear in the base.  A strong effect spoils the base of a fit
    without it; that of the deck is then the nearer. Without ``local``, which adds the effect to a
    state of the base, ``model`` must represent the effect.
    """
    effects = [*base, effect]

    def state_of(x: np.ndarray, y: np.ndarray, alone: State | None = None) -> State:
        if local is None:
            return evaluate(model, effects, np.concatenate([x, y]))
        return local.added(alone or evaluate(model, base, x, False), x, y)

    def slopes(at: Base, y: np.ndarray, state: State, r: np.ndarray) -> np.ndarray:
        if local is None:
            return data.scaled_slopes(state.of_last(len(y)))
        steps = NEAR * np.array([p.sd for p in effect.parameters])
        near = [data.scaled(state_of(at.x, y + dy, at.state), False)[0] for dy in np.diag(steps)]
        return (np.array(near) - r).T / steps

    def objective(at: Base) -> Objective:
        """-2 ln posterior of own parameters, the base eliminated; its second value is the whole."""
        alone, n = at.alone, len(at.x)

        def point(y: np.ndarray) -> Point:
            state = state_of(at.x, y, at.state)
            r, z = data.scaled(state, False)[0], np.concatenate([at.x, y])
            r0, J0 = prior_residuals(effects, mass_measurement, z, state)
            frozen = replace(alone, J0=J0[:, :n], within=alone)

            def sloped() -> tuple[Squares, tuple[LinearModel, np.ndarray, np.ndarray]]:
                J = np.concatenate([alone.J, slopes(at, y, state, r)], axis=1)
                whole = replace(frozen, J=J, J0=J0, within=frozen)
                return whole.squares(r, r0).profiled(n), (whole, r, r0)

            return Point(frozen.squares(r, r0).profiled(n).cost, sloped)

        return point

    ways = [objective(each) for each in about]
    begun = [way(start) for way in ways]
    best = int(np.argmin([point.cost for point in begun]))
    limit = np.array([p.step for p in effect.parameters])
    y, _, (whole, r, r0), _ = descend(ways[best], start, limit, STEPS, CLOSE, begun[best])
    x, squares = about[best].x, whole.squares(r, r0)
    n, z, state = len(x), np.concatenate([x, y]), None
    misfit = squares.cost - float(r0 @ r0)
    step = np.linalg.solve(squares.information[:n, :n], squares.gradient[:n])
    for share in SHARES:
        with suppress(ModelError):
            there, moved = x - share * step, state_of(x - share * step, y)
            rest = prior_residuals(effects, mass_measurement, at := np.append(there, y), moved)[0]
            whole_cost = cost(data.error, data.scaled(moved, False)[0], rest)
            if whole_cost < squares.cost:
                z, state, misfit = at, moved, whole_cost - float(rest @ rest)
                break
    state = state_of(x, y, about[best].state) if state is None else state
    S = whole.neg2_log_evidence(r, r0) + constants(effects)
    covariance = np.linalg.inv(squares.information)
    return Fit(
        tuple(effects), z, covariance, misfit, S, state.without_slopes(), data, Status.CONVERGED
    )
