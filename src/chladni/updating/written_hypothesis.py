"""A hypothesis as a deck can hold it: no scatter, no joints that scatter, no error of the mesh."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.calibrated_family import calibrated_family
from ..effects.discretisation import MeshError
from ..effects.effect import Effect
from .hypothesis_fit import HypothesisFit
from .leaning import is_strained
from .likelihood import Responses
from .map_fit import MassMeasurement, fit
from .reduced_model import evaluate

HELD = 1e-4  # sd of a parameter that a fit has to leave where it is
LEFT = 0.1  # decades that a deck may be off: with less, numbers go to their priors' ends for little


def as_written(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None
) -> HypothesisFit:
    """The hypothesis as a deck can hold it: without scatter and modal discrepancy, the effect held.

    The ordinary parameters are fitted anew, for they were found beside a scatter that is not there
    any more.  The learned error of the model stays in the likelihood, else they would bend to make
    up for mesh and joints: on a coarse plate with a concealed crack E went to 264 GPa for 210
    without it, and to 212 with it.
    """
    effects, start, (effect, *beside) = _kept(hypothesis)
    model = hypothesis.model
    found = fit(model, effects, hypothesis.data, mass_measurement, start).kept()
    return HypothesisFit(effect, found, model, tuple(beside))


def as_foretold(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None, unseen: np.ndarray
) -> HypothesisFit:
    """The hypothesis as a deck can hold it, so that the deck responds as the hypothesis does.

    What it has beside the deck (mesh error, joints, folds, scatter) is known on all lines and at
    all sensors, where they were held out too, for there it is foretold and not measured. The
    ordinary parameters take up what they can of that, as far as their priors let them against a
    spread of ``LEFT``, and as far as all of them stay within the 95 % intervals of what was found:
    a number that the data exclude is no property of the structure. On the demo the held-out Q of
    the deck is 0.0185 so, 0.0195 where numbers may leave their intervals and 0.0245 with the
    numbers as found. What changes no response, and natural frequencies, are written as
    :func:`as_written` does.

    Parameters
    ----------
    unseen : samples held out, in the shape of ``hypothesis.data.use``
    """
    data, found, model = hypothesis.data, hypothesis.fit, hypothesis.model
    if not isinstance(data, Responses) or not hypothesis.physics:
        return as_written(hypothesis, mass_measurement)
    whole = data.exactly().using(data.use | unseen)
    state = evaluate(model, found.effects, found.x, False)
    foretold = whole.values * 10 ** whole.deviation(state)
    target = replace(whole, values=foretold, sigma_model=LEFT)
    effects, x, (effect, *beside) = _kept(hypothesis)
    hidden = of_mesh(effects)
    bare = [_held(e, 0 * found.of(e)) if isinstance(e, MeshError) else e for e in effects]
    near = fit(model, bare, target, mass_measurement, np.where(hidden, 0.0, x))
    sd = np.concatenate([found.sd(e) for e in found.effects if e.writable])
    x = x + _share_within(sd, step := np.where(hidden, 0.0, near.x - x)) * step
    state = evaluate(model, effects, x, False)
    near = replace(near, effects=tuple(effects), x=x, state=state, data=data)
    return HypothesisFit(effect, near.kept(), model, tuple(beside))


def _share_within(sd: np.ndarray, step: np.ndarray) -> float:
    """How much of a step may be made until the first number leaves its 95 % interval."""
    far = np.abs(step) > 0
    return float(min([1.0, *(1.96 * sd[far] / np.abs(step[far]))]))


def of_mesh(effects: Sequence[Effect]) -> np.ndarray:
    """Which of their parameters are of errors of the mesh (n_p,) bool: no deck has these in it."""
    each = [np.full(len(e.parameters), isinstance(e, MeshError)) for e in effects]
    return np.concatenate([np.zeros(0, bool), *each])


def _kept(hypothesis: HypothesisFit) -> tuple[list[Effect], np.ndarray, tuple[Effect, ...]]:
    """What a deck keeps, where it was found; and what was named, which has to stay there."""
    found = hypothesis.fit
    held = {id(e): _held(e, found.of(e)) if e.parameters else e for e in hypothesis.effects}
    kept = [e for e in found.effects if e.writable]
    x = np.concatenate([np.zeros(0), *(found.of(e) for e in kept)])
    return [held.get(id(e), e) for e in kept], x, tuple(held.values())


def as_found(hypothesis: HypothesisFit) -> HypothesisFit:
    """A hypothesis without effects as a deck can hold it, its numbers as they were found.

    They were found beside all that is known to err, and the better for it: on a tailgate where
    nothing was missing E of the inner panel ended 2 % nearer its value, t 2 % and E of a bracket
    7 % than fitted anew without joints and scatter, which :func:`as_written` does.  Joints that
    took more than joints scatter are numbers of the deck as well: a deck whose adhesive is six
    times too soft stays 4 % off in frequency without.
    """
    fit = hypothesis.fit
    every = [calibrated_family(e) if is_strained(e, fit.of(e)) else e for e in fit.effects]
    inside = np.concatenate([np.full(len(e.parameters), e.writable) for e in every])
    effects, x = tuple(e for e in every if e.writable), fit.x[inside]
    state = evaluate(hypothesis.model, effects, x)
    covariance = fit.covariance[np.ix_(inside, inside)]
    found = replace(fit, effects=effects, x=x, state=state, covariance=covariance)
    return replace(hypothesis, fit=found)


def _held(effect: Effect, x: np.ndarray) -> Effect:
    """An effect that has to stay at x."""
    at = zip(effect.parameters, x, strict=True)
    return replace(effect, parameters=tuple(replace(p, mean=float(v), sd=HELD) for p, v in at))
