"""Articles of one design fitted together: their common mean, their spread, each one's own values.

The mean of all tests is fitted like one test.  It carries the error of the model's form, and that
error once.  The differences between the tests carry none of it (:mod:`..inference.unit_spread`).
The deviations of articles from their mean are known far better than the values of any one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.calibration_parameters import RandomField
from ..effects.effect import Effect
from ..ema.identification import Identified, equalised
from ..ema.recording_noise import sample_noise
from ..inference.calibration_result import ArticleParameter, ArticleValue
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from ..inference.identifiability import calibration_positions
from ..inference.joint_fit import of_the_object
from ..inference.likelihood import LN10, Responses
from ..inference.map_fit import unknowns
from ..inference.unit_spread import KNOWN, UnitSpread, unit_spread
from ..reduced.reduced_model import evaluate
from .other_recordings import ALIKE
from .posterior import values_at, with_frozen
from .question import Prepared

Tests = dict[str, list[tuple[np.ndarray, np.ndarray]]]  # article: ln H over the first's, its noise


def articles_together(prepared: Prepared, null: HypothesisFit) -> tuple[ArticleParameter, ...]:
    """Fit all articles of a case together; empty where it has one, or no responses.

    The null of the first may hold parameters that are free in the prepared problem.
    """
    data = null.data
    if not isinstance(data, Responses) or prepared.identified is None:
        return ()
    tests = _tests(prepared, data, prepared.identified)
    if len(tests) < 2:
        return ()
    logs = np.array([np.mean([log for log, _ in each], axis=0) for each in tests.values()])
    variances = ([sd**2 for _, sd in each] for each in tests.values())
    noise = np.sqrt(np.mean([np.mean(v, axis=0) / len(v) for v in variances], axis=0))
    apart = (logs - logs.mean(axis=0)) / LN10
    plain = data.exactly()
    plain = replace(plain, values=plain.values * np.exp(logs.mean(axis=0)), spread=None)
    mean = _mean_fit(prepared.problem, null, replace(plain, noise=noise / np.sqrt(len(logs))))
    J, y = _differences(mean, replace(plain, noise=noise), apart)
    own, group = _of_one_article(mean.fit.effects), _groups(mean.fit.effects)
    sd = np.array([p.sd for p in unknowns(mean.fit.effects)])
    found = unit_spread(J[:, own], y, group[own], sd[own])
    return _summary(mean, tuple(tests), found, own, group)


def _tests(prepared: Prepared, data: Responses, identified: Identified) -> Tests:
    """The tests of every article at the level of the first: ln of H over the first's, and noise."""
    question = prepared.question
    assert question.frf is not None
    first = equalised(identified, data.s)
    out: Tests = {
        question.article: [(np.zeros_like(first), sample_noise(identified, question.frf, data.s))]
    }
    for other, modes in prepared.others:
        alike = other.relation == "repeat" or other.level in (None, question.level)
        if other.relation in ALIKE and alike:
            log = np.log(equalised(modes, data.s) / first)
            pair = log, sample_noise(modes, other.frf, data.s)
            out.setdefault(other.article, []).append(pair)
    return out


def _mean_fit(whole: UpdatingProblem, null: HypothesisFit, plain: Responses) -> HypothesisFit:
    """The fit of the mean of all tests, errors of form about the state of the first."""
    data, known = plain, null.data
    if isinstance(known, Responses) and known.error is not None:
        data = plain.allowing_errors(null.fit.state, known.error.delta)
    found = fitted(null.model, null.fit.effects, data, whole.mass_measurement, null.fit.x)
    mean = replace(null, fit=found)
    return replace(mean, fit=with_frozen(whole, mean))


def _differences(
    mean: HypothesisFit, quiet: Responses, apart: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Slopes at the mean, and differences of the tests from it, whitened without errors of form."""
    known = mean.data
    if isinstance(known, Responses) and known.error is not None:
        quiet = replace(quiet, about=known.about, error=known.error).using(quiet.use)
    J = quiet.scaled(evaluate(mean.model, mean.fit.effects, mean.fit.x), True)[1]
    return J, quiet.stacked(apart / quiet.std()).T


def _of_one_article(effects: Sequence[Effect]) -> np.ndarray:
    """Mask over what differs between articles: parameters, scatter within parts, gains."""
    differs = (
        e.kind == "calibration" or isinstance(e, RandomField) or not of_the_object(e)
        for e in effects for _ in e.parameters
    )  # fmt: skip
    return np.fromiter(differs, bool)


def _groups(effects: Sequence[Effect]) -> np.ndarray:
    """Number of the quantity of every calibration parameter: E, rho, t, ...; others ``KNOWN``."""
    names = [p.name for e in effects if e.kind == "calibration" for p in e.parameters]
    known = list(dict.fromkeys(names))
    return np.array(
        [known.index(p.name) if e.kind == "calibration" else KNOWN
         for e in effects for p in e.parameters]
    )  # fmt: skip


def _summary(
    mean: HypothesisFit, names: tuple[str, ...], found: UnitSpread, own: np.ndarray,
    group: np.ndarray,
) -> tuple[ArticleParameter, ...]:  # fmt: skip
    """Mean, spread and places of all parameters with 95 % intervals.

    The mean of A articles is off μ by τ/√A, where τ is known from A - 1 differences: Student's t.
    """
    from scipy.stats import norm, t

    fit, count = mean.fit, len(names)
    at = calibration_positions(fit.effects)
    among = np.flatnonzero(np.isin(np.flatnonzero(own), at))  # the same among those of one article
    tau, low, high = (v[group[at]] for v in (found.tau, found.low, found.high))
    z, form = norm.ppf(0.975), np.diag(fit.covariance)[at]
    reach = np.sqrt(z**2 * form + t.ppf(0.975, count - 1) ** 2 * tau**2 / count)
    x, away, width = fit.x[at], found.away[:, among], np.diag(found.covariance)[among]
    each = z * np.sqrt(form + width)
    middle, least, most = (values_at(fit, at, v) for v in (x, x - reach, x + reach))
    places = [[values_at(fit, at, x + a + side) for side in (0.0, -each, each)] for a in away]
    return tuple(
        ArticleParameter(
            middle[k].name, middle[k].unit, middle[k].value, least[k].value, most[k].value,
            float(tau[k]), float(low[k]), float(high[k]) if np.isfinite(high[k]) else None,
            tuple(ArticleValue(name, value[k].value, less[k].value, more[k].value, float(a[k]),
                               float(z * np.sqrt(width[k])))
                  for name, (value, less, more), a in zip(names, places, away, strict=True)),
        )
        for k in range(len(at))
    )  # fmt: skip
