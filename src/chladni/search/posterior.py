"""Posterior of a calibration by draws: parameters against their Gaussian, bands of responses."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..errors import ModelError
from ..inference.calibration_result import (
    NamedValue,
    PosteriorSample,
    ResponseBand,
    SampledParameter,
)
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.identifiability import calibration_positions, parameter_names
from ..inference.likelihood import Responses
from ..inference.map_fit import Fit, fit, posterior, unknowns
from ..inference.posterior_samples import WALKERS, Chains, sampled
from ..progress import Progress
from ..reduced.effect_dofs import slices
from ..reduced.reduced_model import evaluate

BANDS, DRAWS = 4, 60  # channels whose predicted response is kept, and draws of the posterior
KEPT = 400  # draws in calibration.json
INSIDE = (0.025, 0.975)  # 95 %, as the interval of a value
REACH = 1.96  # standard deviations of the same interval
SEED = 20250102

Draws = tuple[tuple[Effect, ...], np.ndarray]  # effects, and their x (draws, n)


def _all_free(whole: UpdatingProblem, null: HypothesisFit) -> tuple[list[Effect], np.ndarray]:
    """The effects of a fit, then those that it holds at their prior mean, and x of all."""
    frozen = [e for e in whole.base if e not in null.fit.effects]
    x = np.concatenate([null.fit.x, [p.mean for p in unknowns(frozen)]])
    return [*null.fit.effects, *frozen], x


def with_frozen(whole: UpdatingProblem, null: HypothesisFit) -> Fit:
    """The fit with a covariance that counts the priors of frozen parameters.

    H = [[H_ff, H_fz], [H_zf, ·]] is the information of data and priors.  Frozen parameters z move
    the fit by -G z, G = H_ff⁻¹ H_fz.  With their prior covariance P, C = H_ff⁻¹ + G P Gᵀ
    (Tapley, Schutz and Born 2004, Statistical Orbit Determination, ch. 6: consider covariance).
    """
    found, (effects, x), n = null.fit, _all_free(whole, null), len(null.fit.x)
    if len(x) == n:
        return found
    there = posterior(null.model, effects, found.data, whole.mass_measurement, x)
    H = there.sloped()[0].information
    moved = np.linalg.solve(H[:n, :n], H[:n, n:])
    spread = moved * [p.sd for p in unknowns(effects)[n:]]
    return replace(found, covariance=found.covariance + spread @ spread.T)


def posterior_sample(
    whole: UpdatingProblem, null: HypothesisFit, progress: Progress
) -> tuple[PosteriorSample, Draws]:
    """Sample all unknowns: free and frozen parameters with their priors, and nuisances.

    The form error of the model has the size that the fit learned.  The Gaussian is that of the
    Hessian JᵀJ at the most probable x, all unknowns free.
    """
    effects, start = _all_free(whole, null)
    mass, data, model = whole.mass_measurement, null.data, null.model
    best = fit(model, effects, data, mass, start).kept()

    def log_density(x: np.ndarray) -> float:
        try:
            return -posterior(model, effects, data, mass, x).cost / 2
        except ModelError:
            return -np.inf

    chains = sampled(log_density, best.x, best.covariance, progress)
    draws = chains.draws
    at = np.linspace(0, len(draws) - 1, DRAWS).astype(int)
    return _summary(best, chains), (tuple(effects), draws[at])


def _summary(best: Fit, chains: Chains) -> PosteriorSample:
    """Every calibration parameter by its draws and by its Gaussian."""
    own = calibration_positions(best.effects)
    x = chains.draws[:, own]
    gaussian = np.sqrt(np.diag(best.covariance))[own]
    median, low, high, mode, less, more = (
        values_at(best, own, values)
        for values in (
            np.median(x, axis=0), *np.quantile(x, INSIDE, axis=0), best.x[own],
            best.x[own] - REACH * gaussian, best.x[own] + REACH * gaussian,
        )
    )  # fmt: skip
    rows = tuple(
        SampledParameter(
            mode[k].name, mode[k].unit, median[k].value, low[k].value, high[k].value,
            mode[k].value, less[k].value, more[k].value,
            float(x[:, k].std() / gaussian[k]), float(chains.autocorrelation_time[j]),
            float(chains.effective[j]),
        )
        for k, j in enumerate(own)
    )  # fmt: skip
    thin = np.linspace(0, len(x) - 1, min(KEPT, len(x))).astype(int)
    return PosteriorSample(
        rows, WALKERS, chains.steps, chains.discarded, bool(chains.converged.all()),
        float(chains.autocorrelation_time.max()), tuple(map(tuple, x[thin].tolist())),
        tuple(best.x[own].tolist()),
        tuple(map(tuple, best.covariance[np.ix_(own, own)].tolist())),
    )  # fmt: skip


def gaussian_draws(found: Fit) -> Draws:
    """Draws of the Gaussian posterior of a fit, its parameters and nuisances together."""
    root = np.linalg.cholesky((found.covariance + found.covariance.T) / 2)
    z = np.random.default_rng(SEED).normal(size=(DRAWS, len(found.x)))
    return found.effects, found.x + z @ root.T


def bands(problem: UpdatingProblem, null: HypothesisFit, every: Draws) -> Iterator[ResponseBand]:
    """90 % bands of the responses over draws of the posterior, of held-out channels first.

    Parameters and nuisances are drawn together.  The Gaussian holds frozen parameters: what these
    could change, the free ones undo in the responses.
    """
    data = null.data
    if not isinstance(data, Responses):
        return
    held = np.asarray(~data.use.any(axis=0))
    order = np.argsort(~held, kind="stable")[:BANDS]
    draws, (effects, places) = [], every
    for x in places:
        with suppress(ModelError):
            deviation = data.deviation(evaluate(null.model, effects, x, False))
            draws.append(np.abs(data.values * 10**deviation)[:, order, 0])
    if not draws:
        return
    low, high = np.quantile(draws, (0.05, 0.95), axis=0)
    f, measured = data.s.imag / (2 * np.pi), np.abs(data.values[..., 0])
    for n, k in enumerate(order):
        columns = (f, measured[:, k], low[:, n], high[:, n])
        label = problem.labels[k] if k < len(problem.labels) else f"channel {k + 1}"
        yield ResponseBand(label, bool(held[k]), *(tuple(c.tolist()) for c in columns))


def physical_values(effects: Sequence[Effect], x: np.ndarray) -> Iterator[NamedValue]:
    """Physical values of the calibration parameters."""
    names = iter(parameter_names([e for e in effects if e.kind == "calibration"]))
    for effect, at in (each for each in slices(effects) if each[0].kind == "calibration"):
        rows = effect.reported(x[at], np.array([p.sd for p in effect.parameters]))
        for k, (p, v) in enumerate(zip(effect.parameters, x[at].tolist(), strict=True)):
            value, unit = (rows[k].value, rows[k].unit) if k < len(rows) else (p.value(v), p.unit)
            yield NamedValue(next(names), float(value), unit, v)


def values_at(found: Fit, own: np.ndarray, x: np.ndarray) -> list[NamedValue]:
    """Physical values of the calibration parameters at x, which stand at these positions."""
    whole = found.x.copy()
    whole[own] = x
    return list(physical_values(found.effects, whole))
