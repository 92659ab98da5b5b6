"""Maximum a posteriori fits of effects: Levenberg-Marquardt on whitened residuals and priors.

-2 ln posterior = |r(x)|² + ((m(x) - m_weighed)/σ_m)² + Σ ((x - μ)/σ)²; the evidence is Laplace's
(MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 27-28).
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Self

import numpy as np

from ..effects.effect import Effect, Parameter
from ..errors import ModelError
from ..reduced.effect_dofs import slices
from ..reduced.reduced_model import Reduced, State, evaluate
from .discrepancy import Discrepancy
from .likelihood import Data
from .linear_model import LinearModel, Squares, cost

APART = 1.96  # standard deviations of a weighing: a mass farther off has left the scales


class Status(Enum):
    """Outcome of a fit."""

    CONVERGED = "converged"
    OUT_OF_STEPS = "ran out of steps; raise max_steps or start nearer"
    STALLED = "no step improves the fit; the start may be near a local optimum"


@dataclass(frozen=True)
class MassMeasurement:
    """Weighed mass and its standard deviation [kg]; it counts as a datum like any other."""

    mass: float
    sd: float


@dataclass(frozen=True, eq=False)
class LinearPosterior:
    """A state with its slopes, and residuals of the data (n,) and of all other knowledge (m,)."""

    state: State
    model: LinearModel
    r: np.ndarray
    r0: np.ndarray

    def under(self, error: Discrepancy) -> "Point":
        """The posterior at the same x with errors of form of another size."""
        linear = replace(self.model, error=error, within=self.model)
        squares, there = linear.squares(self.r, self.r0), replace(self, model=linear)
        return Point(squares.cost, lambda: (squares, there))


@dataclass(frozen=True, eq=False)
class Fit:
    """Effects at their most probable x."""

    effects: tuple[Effect, ...]  # in the order of x
    x: np.ndarray  # (n_p,) most probable parameters
    covariance: np.ndarray  # (n_p, n_p) of x, Laplace's
    misfit: float  # |r|² of the data alone
    neg2_log_evidence: float  # -2 ln evidence up to a constant common to all fits of the data
    state: State  # the reduced model there
    data: Data  # what was fitted
    status: Status
    linear: LinearPosterior | None = None

    def of(self, effect: Effect) -> np.ndarray:
        """The part of x that belongs to one effect."""
        return self.x[self.slice(effect)]

    def slice(self, effect: Effect) -> slice:
        """Positions of an effect's parameters in x."""
        at = 0
        for other in self.effects:
            if other is effect:
                return slice(at, at + len(other.parameters))
            at += len(other.parameters)
        raise ModelError(f"{effect.name} is not part of this fit")

    def kept(self) -> Self:
        """The fit without ∂K and ∂M of its state, so that a search can keep many fits."""
        return replace(self, state=self.state.without_slopes(), linear=None)

    def sd(self, effect: Effect) -> np.ndarray:
        """Standard deviations of an effect's parameters."""
        return np.sqrt(np.diag(self.covariance)[self.slice(effect)])


def unknowns(effects: Sequence[Effect]) -> tuple[Parameter, ...]:
    """All parameters, in the order of x."""
    return tuple(p for effect in effects for p in effect.parameters)


def prior_residuals(
    effects: Sequence[Effect], mass_measurement: MassMeasurement | None, x: np.ndarray, state: State
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened residuals and slopes of information besides the data: priors and the weighing."""
    priors = unknowns(effects)
    mean, sd = np.array([p.mean for p in priors]), np.array([p.sd for p in priors])
    r, J = [(x - mean) / sd], [np.diag(1 / sd)]
    if mass_measurement is not None:
        J.append(state.dweight[None] / mass_measurement.sd)
        r.append(np.array([(state.weight - mass_measurement.mass) / mass_measurement.sd]))
    for off, slope in _by_effects(effects, x, state):
        r.append(off)
        J.append(slope)
    return np.concatenate(r), np.concatenate(J)


def _by_effects(
    effects: Sequence[Effect], x: np.ndarray, state: State
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Residuals and slopes of the information that effects add to the data."""
    lost = state.dissipated
    if lost is None:
        return
    for effect, at in slices(effects):
        if effect.damping is None:
            continue
        known = effect.damping.residual(x[at], effect.traits.level, state.lam, lost.ratio)
        slope = np.zeros((len(known.r), len(x)))
        if state.dK is not None and state.dM is not None:
            near = np.flatnonzero(known.by_lam.any(axis=0))
            phi = state.vectors[:, near]
            dlam = state.dK.along(phi) - state.lam[near] * state.dM.along(phi)
            slope = known.by_lam[:, near] @ dlam.T + known.by_dissipated @ lost.slopes.T
            slope[:, at] += known.gradient
        yield known.r, slope


def constants(effects: Sequence[Effect]) -> float:
    """Terms of -2 ln evidence from the effects: prior widths and odds, places, extra data.

    An effect may be compared with extra data, such as measured damping.  Only the likelihood ratio
    with and without the effect counts there, so all hypotheses are compared on the same data.
    """
    widths = sum(2 * np.log(p.sd) for p in unknowns(effects))
    without = [0.0 if e.damping is None else e.damping.neg2_log_evidence() for e in effects]
    places = [2 * np.log(e.trials_factor) - e.two_log_odds for e in effects]
    return float(widths + sum(p - w for p, w in zip(places, without, strict=True)))


@dataclass(frozen=True, eq=False)
class Point:
    """A sum of squares at one x; ``sloped`` computes its slopes, and a second value of any kind."""

    cost: float
    sloped: Callable[[], tuple[Squares, Any]]


def posterior(
    model: Reduced, effects: Sequence[Effect], data: Data,
    mass_measurement: MassMeasurement | None, x: np.ndarray, *, priors: bool = True,
) -> Point:  # fmt: skip
    """-2 ln posterior at x up to a constant, and the :class:`LinearPosterior` when it is needed.

    Without ``priors`` those of x are left out. A :class:`ModelError` says that x is no structure.
    """
    state = evaluate(model, effects, x)
    r = data.scaled(state, False)[0]
    first = 0 if priors else len(x)
    r0 = prior_residuals(effects, mass_measurement, x, state.without_slopes())[0][first:]

    def sloped() -> tuple[Squares, LinearPosterior]:
        J = data.scaled_slopes(state)
        J0 = prior_residuals(effects, mass_measurement, x, state)[1][first:]
        linear = LinearModel(data.error, J, J0)
        return linear.squares(r, r0), LinearPosterior(state, linear, r, r0)

    return Point(cost(data.error, r, r0), sloped)


def fit(
    model: Reduced,
    effects: Sequence[Effect],
    data: Data,
    mass_measurement: MassMeasurement | None,
    start: np.ndarray,
    *,
    max_steps: int = 30,
    tol: float = 0.05,
    begun: Point | None = None,
) -> Fit:
    """Most probable x from one start (n_p,), and the evidence there.

    A step that improves -2 ln posterior by less than ``tol`` is the last one; ``begun`` is the
    posterior at the start, where it is known.
    """
    limit = np.array([p.step for p in unknowns(effects)])

    def objective(x: np.ndarray) -> Point:
        return posterior(model, effects, data, mass_measurement, x)

    x, found, there, status = descend(objective, start, limit, max_steps, tol, begun)
    A = found.information
    S = float(found.cost + np.linalg.slogdet(A)[1] + constants(effects))
    misfit = found.cost - float(there.r0 @ there.r0)
    return Fit(tuple(effects), x, np.linalg.inv(A), misfit, S, there.state, data, status, there)


Objective = Callable[[np.ndarray], Point]
SETTLED = 0.02  # of the tolerance: a further step that is expected to improve less is not taken


def descend(
    objective: Objective, start: np.ndarray, limit: np.ndarray, max_steps: int, tol: float,
    begun: Point | None = None,
) -> tuple[np.ndarray, Squares, Any, Status]:  # fmt: skip
    """Levenberg-Marquardt: final x, its squares, second value of the objective, status.

    Steps are no longer than ``limit`` (n_p,). The last one improves the sum of squares by less than
    ``tol``, or a further one would by far less.
    """
    x, damping = start.copy(), 1e-2
    found, here = (begun or objective(x)).sloped()
    for _ in range(max_steps):
        if found.further < SETTLED * tol:
            break
        step = _step(objective, x, found, damping, limit)
        if step is None:
            stalled = np.abs(found.gradient).max() > 1e-2 * found.cost
            return x, found, here, Status.STALLED if stalled else Status.CONVERGED
        point, x, damping = step
        improved = found.cost - point.cost
        del here  # its slopes take as much memory as the next ones
        found, here = point.sloped()
        if improved < tol:
            return x, found, here, Status.CONVERGED
    settled = found.further < SETTLED * tol
    return x, found, here, Status.CONVERGED if settled else Status.OUT_OF_STEPS


def _step(
    objective: Objective, x: np.ndarray, found: Squares, damping: float, limit: np.ndarray
) -> tuple[Point, np.ndarray, float] | None:
    """One accepted Levenberg-Marquardt step: (the point, new x, new damping), or None."""
    A, g = found.information, found.gradient
    for _ in range(8):
        dx = -np.linalg.solve(A + damping * np.diag(np.diag(A)), g)
        dx = dx / max(1.0, np.abs(dx / limit).max())
        with suppress(ModelError):
            new = objective(x + dx)
            if new.cost < found.cost:
                return new, x + dx, damping / 6
        damping = max(damping, 1e-4) * 6
    return None
