"""Best parameters of an effect alone, while the base follows linearly: before any joint fit.

Residuals of data and priors are r(y) + J d.  y are the effect's own parameters, d is a change of
the base parameters, and J are the slopes by these at one state of the base.  d is eliminated for
every y (Golub and Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432): only slopes by y are computed.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..errors import ModelError
from ..reduced.reduced_model import Reduced, evaluate
from .likelihood import Data
from .linear_model import LinearModel, Squares
from .map_fit import (
    MassMeasurement,
    Objective,
    Point,
    constants,
    descend,
    posterior,
    prior_residuals,
)

STEPS, CLOSE = 12, 2.0  # most steps; improvement of -2 ln posterior by a step that is the last
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


Base = tuple[LinearModel, np.ndarray]  # responses of the base alone, linear about parameters (n,)


def own_optimum(
    model: Reduced, base: Sequence[Effect], effect: Effect, data: Data,
    mass_measurement: MassMeasurement | None, about: Sequence[Base], start: np.ndarray,
) -> tuple[LocalOptimum, np.ndarray]:  # fmt: skip
    """Optimise an effect from a start, with the base linear about the best of some states.

    The evidence is that of responses linear in the base.  The second value is the base (n,) that
    goes with the optimum. A strong effect spoils the base of a fit without it; that of the deck is
    then the nearer.
    """
    ways = [_objective(model, base, effect, data, mass_measurement, each) for each in about]
    begun = [way(start) for way in ways]
    best = int(np.argmin([point.cost for point in begun]))
    limit = np.array([p.step for p in effect.parameters])
    y, _, (whole, r, r0), _ = descend(ways[best], start, limit, STEPS, CLOSE, begun[best])
    x, squares, effects = about[best][1], whole.squares(r, r0), [*base, effect]
    n, moved = len(x), x
    step = np.linalg.solve(squares.information[:n, :n], squares.gradient[:n])
    for share in SHARES:
        with suppress(ModelError):
            there = x - share * step
            z = np.concatenate([there, y])
            if posterior(model, effects, data, mass_measurement, z).cost < squares.cost:
                moved = there
                break
    S = whole.neg2_log_evidence(r, r0) + constants(effects)
    sd = np.sqrt(np.diag(np.linalg.inv(squares.information))[n:])
    return LocalOptimum(effect, S, y, sd), moved


def _objective(
    model: Reduced, base: Sequence[Effect], effect: Effect, data: Data,
    mass_measurement: MassMeasurement | None, about: Base,
) -> Objective:  # fmt: skip
    """-2 ln posterior of own parameters, the base eliminated; its second value is the whole."""
    (alone, x), effects = about, [*base, effect]
    n = len(x)

    def objective(y: np.ndarray) -> Point:
        z = np.concatenate([x, y])
        state = evaluate(model, effects, z)
        r = data.scaled(state, False)[0]
        r0, J0 = prior_residuals(effects, mass_measurement, z, state)
        frozen = replace(alone, J0=J0[:, :n], within=alone)

        def sloped() -> tuple[Squares, tuple[LinearModel, np.ndarray, np.ndarray]]:
            J = data.scaled_slopes(state.of_last(len(y)))
            whole = replace(frozen, J=np.concatenate([alone.J, J], axis=1), J0=J0, within=frozen)
            return whole.squares(r, r0).profiled(n), (whole, r, r0)

        return Point(frozen.squares(r, r0).profiled(n).cost, sloped)

    return objective
