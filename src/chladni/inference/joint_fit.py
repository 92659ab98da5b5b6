"""Joint fit of several states of one object with shared parameters.

-2 ln posterior = Σ_states |r_s(x_shared, x_s)|² + priors.  The residuals of all states are stacked.
E, rho, t of a part, mesh error and the like are one unknown for all states, and their prior counts
once. An effect or a gain belongs to its state.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect, Parameter, of_test
from ..reduced.reduced_model import State
from .hypothesis_fit import HypothesisFit
from .linear_model import Squares
from .map_fit import MassMeasurement, Point, descend, posterior

MAX_STEPS = 30

SharedKey = tuple[str, str, int]  # an effect's name, where it acts, number of the parameter
Posterior = dict[SharedKey, tuple[float, float]]  # mean and standard deviation


@dataclass(frozen=True, eq=False)
class JointFit:
    """All states at their most probable x."""

    # x, covariance: (n,), (n, n) of every unknown
    x: np.ndarray
    covariance: np.ndarray
    where: tuple[np.ndarray, ...]  # for each state, positions of its parameters in x
    # {(effect, text, number): position in x} of parameters that the states share
    shared: dict[SharedKey, int]
    # the states one by one, with their part of x and of the covariance
    fits: tuple[HypothesisFit, ...]

    def posterior(self) -> Posterior:
        """Mean and standard deviation of the shared parameters."""
        sd = np.sqrt(np.diag(self.covariance))
        return {key: (float(self.x[k]), float(sd[k])) for key, k in self.shared.items()}


def joint_fit(
    states: Sequence[HypothesisFit], masses: Sequence[MassMeasurement | None], tol: float = 0.05
) -> JointFit:
    """Fit all states at once, starting from the fit of each.

    The first state that has a shared parameter sets its prior.
    """
    where, shared, priors = _positions(states)
    start = np.zeros(len(priors))
    for fit, at in zip(reversed(states), reversed(where), strict=True):
        start[at] = fit.fit.x
    mean, sd = np.array([p.mean for p in priors]), np.array([p.sd for p in priors])

    def objective(x: np.ndarray) -> Point:
        off = (x - mean) / sd
        each = [
            posterior(one.model, one.fit.effects, one.data, mass, x[at], priors=False)
            for one, at, mass in zip(states, where, masses, strict=True)
        ]
        total = float(off @ off) + sum(point.cost for point in each)

        def sloped() -> tuple[Squares, list[State]]:
            slope, H, found = off / sd, np.diag(1 / sd**2), list[State]()
            for point, at in zip(each, where, strict=True):
                own, there = point.sloped()
                slope[at] += own.gradient
                H[np.ix_(at, at)] += own.information
                found.append(there.state)
            return Squares(total, slope, H), found

        return Point(total, sloped)

    limit = np.array([p.step for p in priors])
    x, squares, found, _ = descend(objective, start, limit, MAX_STEPS, tol)
    covariance = np.linalg.inv(squares.information)
    fits = []
    for one, at, state in zip(states, where, found, strict=True):
        own = replace(one.fit, x=x[at], covariance=covariance[np.ix_(at, at)], state=state)
        fits.append(replace(one, fit=own.kept()))
    return JointFit(x, covariance, tuple(where), shared, tuple(fits))


def _positions(
    states: Sequence[HypothesisFit],
) -> tuple[list[np.ndarray], dict[SharedKey, int], list[Parameter]]:
    """Positions of every state's and of the shared parameters, and the priors of all."""
    shared, where, priors = dict[SharedKey, int](), [], list[Parameter]()
    for one in states:
        at = []
        for effect in one.fit.effects:
            common = effect is not one.effect and of_the_object(effect)
            for k, p in enumerate(effect.parameters):
                key = (effect.name, effect.text, k)
                known = shared.get(key) if common else None
                if known is None:
                    known = len(priors)
                    priors.append(p)
                    if common:
                        shared[key] = known
                at.append(known)
        where.append(np.array(at, dtype=int))
    return where, shared, priors


def of_the_object(effect: Effect) -> bool:
    """True where an effect belongs to the object in all its states, not to one test of it."""
    return effect.kind in ("calibration", "nuisance") and not of_test(effect)


def informed(effects: Sequence[Effect], posterior: Posterior) -> list[Effect]:
    """The effects with the posterior of other states as their prior.

    No prior becomes wider than it was.
    """
    return [_informed(e, posterior) if of_the_object(e) else e for e in effects]


def _informed(effect: Effect, posterior: Posterior) -> Effect:
    estimates = [
        posterior.get((effect.name, effect.text, k), (p.mean, p.sd))
        for k, p in enumerate(effect.parameters)
    ]
    wide = effect.widened(np.array([sd for _, sd in estimates]))
    own = [
        replace(p, mean=mean, sd=float(sd))
        for p, (mean, _), sd in zip(effect.parameters, estimates, wide, strict=True)
    ]
    return replace(effect, parameters=tuple(own))


def with_priors(effects: Sequence[Effect], known: Sequence[Effect]) -> list[Effect]:
    """The effects with the priors of the calibration parameters of the same name in ``known``."""
    priors = {(e.name, e.text): e.parameters for e in known if e.kind == "calibration"}
    return [
        replace(e, parameters=priors.get((e.name, e.text), e.parameters))
        if e.kind == "calibration"
        else e
        for e in effects
    ]
