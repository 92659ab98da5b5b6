"""Calibration without new physics: what can be known, many starts, and how sure the result is.

1. Parameters that the data cannot know are frozen at its prior (:mod:`.identifiability`).
2. The null hypothesis of a diagnosis is fitted: free parameters and all nuisances.
3. Fits from a Latin hypercube of starts map the basins of the same objective.
4. The covariance counts the priors of frozen parameters as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
from scipy.special import ndtri

from ..errors import ModelError
from ..inference.calibration_result import (
    Basin,
    CalibrationStudy,
    Identifiability,
    LikelihoodProfile,
    PosteriorSample,
)
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from ..inference.identifiability import calibration_positions, identifiability, parameter_names
from ..inference.likelihood import Responses
from ..inference.map_fit import Fit, MassMeasurement, Point, descend, fit, posterior, unknowns
from ..inference.pole_data import Poles
from ..inference.written_hypothesis import as_written
from ..parallel import in_parallel
from ..progress import Progress, silent, within
from ..reduced.reduced_model import evaluate
from .diagnosis import Diagnosis, best_base_fit, restarted, without_effects
from .posterior import (
    bands,
    gaussian_draws,
    physical_values,
    posterior_sample,
    values_at,
    with_frozen,
)

STARTS = 12  # of the Latin hypercube
BEST = 10  # basins that are reported
REACH = 0.02  # probability beyond each end of the hypercube: two standard deviations of a prior
SAME = 1.0  # in -2 ln evidence and in standard deviations: fits as near as that are one basin
PROFILED = (-2.0, -1.0, 1.0, 2.0)  # standard deviations from the best at which a profile is taken
PROFILE_STEPS = 6  # of a fit with one parameter held; it starts where the covariance says
TOLERANCE = 0.05  # in -2 ln posterior, of a fit
LOWER = 3  # times a fit is begun again where a profile lies below it
SEED = 20250102


@dataclass(frozen=True)
class CalibrationSettings:
    """Extent of a calibration."""

    freeze: bool = True  # False keeps parameters free that the data do not know, and names them
    quick: bool = False  # fit from the prior mean alone, without starts, profiles and bands
    sample: bool = False  # draw from the posterior
    starts: int = STARTS  # of a Latin hypercube


FULL = CalibrationSettings()


def calibration(
    problem: UpdatingProblem, progress: Progress = silent,
    settings: CalibrationSettings = FULL,
) -> tuple[UpdatingProblem, Diagnosis, CalibrationStudy]:  # fmt: skip
    """Fit the calibration parameters that the data can determine; no new physics.

    The problem is that of the free parameters, the diagnosis has no effects.
    """
    freeze, quick, whole = settings.freeze, settings.quick, problem
    progress("identifiability", 0.0)
    known = identifiability(about_nominal(whole))
    problem = _without(whole, known.frozen if freeze else ())
    progress("calibration without new physics", 0.05)
    problem, null = without_effects(problem)
    learned = getattr(getattr(null.data, "error", None), "delta", None)
    if freeze and known.frozen and learned is not None:
        again = identifiability(about_nominal(whole, learned))
        if set(again.frozen) < set(known.frozen):  # the error of form is smaller than its prior
            known = again
            problem, null = without_effects(_without(whole, known.frozen))
    nominal = best_base_fit(problem, problem.nuisance, [problem.begun(problem.nuisance)])
    ends = [] if quick else list(_ends(problem, null, settings.starts, within(progress, 0.3, 0.7)))
    null = _restarted(problem, null, ends)
    progress("profiles", 0.75)
    profiled, null = ((), null) if quick else profiles_of_the_best(problem, null)
    basins = () if quick else _basins(null, _end_of(problem, null), ends)
    every, sample = gaussian_draws(null.fit), None
    if settings.sample:
        sample, every = posterior_sample(whole, null, within(progress, 0.8, 1.0))
    predicted = () if quick else tuple(bands(problem, null, every))
    null = replace(null, fit=with_frozen(whole, null))
    notes = tuple(_notes(known, basins, ends, sample))
    plain = as_written(null, problem.mass_measurement)
    found = Diagnosis(nominal, null, plain, (), notes=notes)
    own = calibration_positions(null.fit.effects)
    names = parameter_names([e for e in null.fit.effects if e.kind == "calibration"])
    study = CalibrationStudy(
        known, 0 if quick else settings.starts, basins[:BEST], tuple(names),
        tuple(null.fit.x[own].tolist()),
        tuple(map(tuple, null.fit.covariance[np.ix_(own, own)].tolist())),
        profiled, predicted, sample=sample,
    )  # fmt: skip
    return problem, found, study


def about_nominal(problem: UpdatingProblem, delta: float | None = None) -> UpdatingProblem:
    """The problem with errors of form about the nominal state, of the median of their prior."""
    if not isinstance(problem.data, Responses):
        return problem
    state = evaluate(problem.reduced.model, problem.base, problem.mean(), False)
    problem = problem.allowing_errors(state)
    data = problem.data
    assert isinstance(data, Responses)
    assert data.error is not None
    error = data.error.with_delta(data.error.prior.median if delta is None else delta)
    return replace(problem, data=replace(data, error=error))


def _without(problem: UpdatingProblem, frozen: Sequence[str]) -> UpdatingProblem:
    """The problem without the frozen parameters, which keep their prior means."""
    names = [parameter_names([e]) if e.kind == "calibration" else [] for e in problem.base]
    held = [bool(own) and set(own) <= set(frozen) for own in names]
    return replace(problem, base=tuple(compress(problem.base, np.logical_not(held))))


def latin_hypercube(problem: UpdatingProblem, count: int) -> list[np.ndarray]:
    """Starts that fill the priors of the calibration parameters evenly, the rest at its mean.

    McKay, Beckman and Conover (1979), Technometrics 21, 239-245; a fixed seed.
    """
    from scipy.stats import qmc

    own, every = calibration_positions(problem.base), unknowns(problem.base)
    if not len(own):
        return []
    u = qmc.LatinHypercube(len(own), seed=SEED).random(count)
    z = ndtri(REACH + (1 - 2 * REACH) * u)
    out = np.tile(problem.mean(), (count, 1))
    out[:, own] += z * [every[k].sd for k in own]
    return list(out)


def _ends(
    problem: UpdatingProblem, null: HypothesisFit, count: int, progress: Progress
) -> Iterator[Fit]:
    """Fits from every start to the same likelihood; a start that is no structure has none."""
    mass, starts = problem.mass_measurement, latin_hypercube(problem, count)

    def one(x: np.ndarray) -> Fit | None:
        try:
            if isinstance(null.data, Poles):
                return fitted(null.model, problem.base, problem.data, mass, x)
            return fit(null.model, problem.base, null.data, mass, x).kept()
        except ModelError:
            return None

    for k, end in enumerate(in_parallel(one, starts)):
        progress(f"start {k + 1} of {len(starts)}", (k + 1) / len(starts))
        if end is not None:
            yield end


def _restarted(problem: UpdatingProblem, null: HypothesisFit, ends: Sequence[Fit]) -> HypothesisFit:
    """The null, or the fit from the best start where that is better."""
    best = min((null.fit, *ends), key=lambda f: f.neg2_log_evidence)
    if isinstance(null.data, Poles):
        return replace(null, fit=best)
    better = best.neg2_log_evidence <= null.fit.neg2_log_evidence - SAME
    return restarted(problem, null, [best.x] if better else [])


def _end_of(problem: UpdatingProblem, null: HypothesisFit) -> Fit:
    """The null as an end like those of the starts: with the evidence at one error of form."""
    if isinstance(null.data, Poles):
        return null.fit
    effects, mass = null.fit.effects, problem.mass_measurement
    return fit(null.model, effects, null.data, mass, null.fit.x, max_steps=0).kept()


def _basins(null: HypothesisFit, own_end: Fit, ends: Sequence[Fit]) -> tuple[Basin, ...]:
    """The ends that are one place together, best first, with the number of starts of each."""
    own = calibration_positions(null.fit.effects)
    if not len(own):
        return ()
    sd = np.sqrt(np.diag(null.fit.covariance)[own])
    basins: list[list[Fit]] = []
    for end in sorted((own_end, *ends), key=lambda f: f.neg2_log_evidence):
        for basin in basins:
            apart = np.abs(end.x[own] - basin[0].x[own]) / sd
            if apart.max() < SAME and end.neg2_log_evidence < basin[0].neg2_log_evidence + SAME:
                basin.append(end)
                break
        else:
            basins.append([end])
    least = basins[0][0].neg2_log_evidence
    return tuple(
        Basin(b[0].neg2_log_evidence - least, sum(end is not own_end for end in b),
              tuple(physical_values(null.fit.effects, b[0].x)))
        for b in basins
    )  # fmt: skip


def _notes(
    known: Identifiability, basins: Sequence[Basin], ends: Sequence[Fit],
    sample: PosteriorSample | None,
) -> Iterator[str]:  # fmt: skip
    """Sentences on what was frozen, on how many starts agree, and on the draws."""
    for p in known.parameters:
        if p.frozen:
            yield f"frozen at the deck's value: {p.why}"
    if basins:
        yield (
            f"{basins[0].starts} of {len(ends)} starts of a Latin hypercube ended in the best "
            "basin: within 1 of its -2 ln evidence and one standard deviation of its parameters"
        )
    if sample is not None:
        yield sample.sentence


def profiles_of_the_best(
    problem: UpdatingProblem, null: HypothesisFit
) -> tuple[tuple[LikelihoodProfile, ...], HypothesisFit]:
    """The profiles, and the null, fitted again from a place on them that lies below it."""
    for _ in range(LOWER):
        found, lower = profiles(problem, null)
        again = null if lower is None else restarted(problem, null, [lower])
        if again is null:
            break
        null = again
    return found, null


def profiles(
    problem: UpdatingProblem, null: HypothesisFit
) -> tuple[tuple[LikelihoodProfile, ...], np.ndarray | None]:
    """Profile of every free calibration parameter, all others fitted again.

    Raue et al. (2009), Bioinformatics 25, 1923-1929, profile the likelihood.  Here all priors
    count, that of the parameter as well: then the fit is the lowest place, and the covariance
    predicts z² at z standard deviations.  Frozen parameters are held.  The profiles are above the
    lowest place; it is returned too where it lies clearly below the null.
    """
    found, mass, out = null.fit, problem.mass_measurement, []
    own, count = calibration_positions(found.effects), len(PROFILED)
    tasks = [(int(k), z) for k in own for z in PROFILED]
    every = list(in_parallel(lambda task: _held(null, mass, *task), tasks))
    best = posterior(null.model, found.effects, found.data, mass, found.x).cost
    lowest, x = min(every, key=lambda one: one[0], default=(best, found.x))
    for n, k in enumerate(own):
        away = float(np.sqrt(found.covariance[k, k])) * np.array(PROFILED)
        at = [values_at(found, own, found.x[own] + d * (own == k))[n] for d in away]
        costs = (cost - min(best, lowest) for cost, _ in every[n * count : (n + 1) * count])
        values, squares = tuple(v.value for v in at), tuple(z**2 for z in PROFILED)
        out.append(LikelihoodProfile(at[0].name, at[0].unit, values, tuple(costs), squares))
    return tuple(out), x if lowest < best - TOLERANCE else None


def _held(
    null: HypothesisFit, mass: MassMeasurement | None, k: int, z: float
) -> tuple[float, np.ndarray]:
    """-2 ln posterior and x, parameter k held z deviations from its fit; inf: no structure."""
    found, model = null.fit, null.model
    rest = np.arange(len(found.x)) != k
    sd = np.sqrt(found.covariance[k, k])
    held = found.x[k] + z * sd

    def objective(y: np.ndarray) -> Point:
        x = np.empty(len(rest))
        x[rest], x[k] = y, held
        there = posterior(model, found.effects, found.data, mass, x)
        return Point(there.cost, lambda: (there.sloped()[0].of_some(rest), None))

    start = found.x[rest] + z * found.covariance[rest, k] / sd
    limit = np.array([p.step for p in unknowns(found.effects)])[rest]
    x = np.insert(start, k, held)
    try:
        x[rest], squares, *_ = descend(objective, start, limit, PROFILE_STEPS, TOLERANCE)
    except ModelError:
        return np.inf, x
    return squares.cost, x
