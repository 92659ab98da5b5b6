"""Hypotheses in the form of a deck: no scatter of parts or joints, no mesh error."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..effects.joint_stiffness import calibrated_family
from ..effects.model_errors import MeshError
from ..reduced.reduced_model import evaluate
from .hypothesis_fit import HypothesisFit, fitted
from .implausible_values import is_strained
from .likelihood import Data, Responses
from .map_fit import MassMeasurement, fit
from .pole_data import Poles

HELD = 1e-4  # sd of a parameter that a fit must not move
LEFT = 0.1  # sd of a deck's error [decades]: less moves numbers to their priors' ends for little


def as_written(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None
) -> HypothesisFit:
    """The hypothesis in the form of a deck: no scatter or modal discrepancy, the effect held.

    Calibration parameters are fitted again, because the scatter they were found with is gone.  The
    learned error of the model stays in the likelihood.  Otherwise the parameters would compensate
    for mesh and joints.  On a coarse plate with a concealed crack E went to 264 GPa for 210 without
    it, and to 212 with it.
    """
    effects, start, (effect, *others) = _kept(hypothesis)
    model = hypothesis.model
    data = hypothesis.data
    made = fitted if isinstance(data, Poles) else fit  # their spread is that of the deck
    found = made(model, effects, data, mass_measurement, start).kept()
    return HypothesisFit(effect, found, model, tuple(others))


def as_foretold(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None, unseen: np.ndarray
) -> HypothesisFit:
    """The hypothesis in the form of a deck that reproduces the hypothesis's responses.

    A deck has no mesh error, joints, folds or scatter.  The hypothesis predicts their effect on all
    lines and sensors, including held-out ones, without measured values. Calibration parameters
    compensate for them as far as two limits allow. They are fitted to the predicted responses with
    their priors and a standard deviation ``LEFT``, and all stay within their 95 % intervals. A
    number that the data exclude is no property of the structure. On the demo Q of the deck on all
    held-out data was 0.0185, 0.0195 if numbers may leave their intervals, and 0.0245 with the
    numbers as found. Use :func:`as_written` for natural frequencies and for effects that change no
    response.

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
    effects, x, (effect, *others) = _kept(hypothesis)
    hidden = of_mesh(effects)
    bare = [_held(e, 0 * found.of(e)) if isinstance(e, MeshError) else e for e in effects]
    near = fit(model, bare, target, mass_measurement, np.where(hidden, 0.0, x))
    sd = np.concatenate([found.sd(e) for e in found.effects if e.traits.writable])
    x = x + _share_within(sd, step := np.where(hidden, 0.0, near.x - x)) * step
    state = evaluate(model, effects, x, False)
    near = replace(near, effects=tuple(effects), x=x, state=state, data=data)
    return HypothesisFit(effect, near.kept(), model, tuple(others))


def _share_within(sd: np.ndarray, step: np.ndarray) -> float:
    """Largest share of a step for which all numbers stay within their 95 % intervals."""
    far = np.abs(step) > 0
    return float(min([1.0, *(1.96 * sd[far] / np.abs(step[far]))]))


def of_mesh(effects: Sequence[Effect]) -> np.ndarray:
    """True for parameters of mesh errors (n_p,) bool, which no deck contains."""
    each = [np.full(len(e.parameters), isinstance(e, MeshError)) for e in effects]
    return np.concatenate([np.zeros(0, bool), *each])


def in_deck(effect: Effect, data: Data) -> bool:
    """True for what the fit of a deck keeps: parameters, and the mesh error of responses.

    Natural frequencies are compared with the deck as it is written, on its own mesh.
    """
    return effect.traits.writable and not (
        isinstance(data, Poles) and isinstance(effect, MeshError)
    )


def _kept(hypothesis: HypothesisFit) -> tuple[list[Effect], np.ndarray, tuple[Effect, ...]]:
    """Effects that a deck can hold, their values, and the named effects, held at theirs."""
    found = hypothesis.fit
    held = {id(e): _held(e, found.of(e)) if e.parameters else e for e in hypothesis.effects}
    kept = [e for e in found.effects if in_deck(e, found.data)]
    x = np.concatenate([np.zeros(0), *(found.of(e) for e in kept)])
    return [held.get(id(e), e) for e in kept], x, tuple(held.values())


def as_found(hypothesis: HypothesisFit) -> HypothesisFit:
    """A hypothesis without effects in the form of a deck, with its numbers as found.

    The numbers were found with all known errors in the model, which makes them more accurate. The
    alternative is :func:`as_written`, a new fit without joints and scatter.  On a tailgate where
    nothing was missing, E of the inner panel ended 2 % nearer its value than there, t 2 % and E of
    a bracket 7 %.  Joints whose change exceeds their usual scatter are numbers of the deck as well.
    Without them a deck whose adhesive is six times too soft stays 4 % off in frequency.
    """
    fit = hypothesis.fit
    every = [calibrated_family(e) if is_strained(e, fit.of(e)) else e for e in fit.effects]
    inside = np.concatenate([np.full(len(e.parameters), e.traits.writable) for e in every])
    effects, x = tuple(e for e in every if e.traits.writable), fit.x[inside]
    state = evaluate(hypothesis.model, effects, x)
    covariance = fit.covariance[np.ix_(inside, inside)]
    found = replace(fit, effects=effects, x=x, state=state, covariance=covariance)
    return replace(hypothesis, fit=found)


def _held(effect: Effect, x: np.ndarray) -> Effect:
    """An effect held at x."""
    at = zip(effect.parameters, x, strict=True)
    return replace(effect, parameters=tuple(replace(p, mean=float(v), sd=HELD) for p, v in at))
