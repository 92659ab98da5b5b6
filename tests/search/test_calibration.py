"""Where everything is linear and Gaussian, all that a calibration says is known in closed form."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import ChannelChange, Effect, Parameter
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from chladni.inference.map_fit import Fit, MassMeasurement, Status, fit
from chladni.inference.result import Agreement, MassComparison, Scores
from chladni.progress import silent
from chladni.search.calibration import (
    PROFILED,
    _basins,
    _without,
    latin_hypercube,
    profiles,
    profiles_of_the_best,
)
from chladni.search.compensation import compensating
from chladni.search.posterior import bands, gaussian_draws, posterior_sample, with_frozen

NOISE = 0.1


@dataclass(frozen=True, eq=False)
class Column(Effect):
    """One parameter that moves the channels along a column."""

    kind = "calibration"

    column: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x):
        return (ChannelChange(self.column * x[0] + 0j, self.column[:, None] + 0j),)


@dataclass(frozen=True, eq=False)
class Offsets:
    """y = channels + noise."""

    y: np.ndarray
    error = None

    def scaled(self, state, gradient):
        r = (state.offset.real - self.y) / NOISE
        return r, state.doffset.real / NOISE if gradient else np.zeros((len(r), 0))

    def scaled_slopes(self, state):
        return self.scaled(state, True)[1]

    def rebased(self, model):
        return self


@pytest.fixture(scope="module")
def columns():
    rng = np.random.default_rng(3)
    sd = (0.3, 0.5, 0.2)
    return [
        Column((Parameter("x", "-", 0.0, s, kind="linear", step=50.0),), f"x of {k}",
               column=rng.normal(size=8))
        for k, s in enumerate(sd)
    ]  # fmt: skip


def problem(reduced, base, y):
    return UpdatingProblem(reduced, Offsets(y), None, tuple(base), (), None)


def null_of(given):
    found = fit(given.reduced.model, given.base, given.data, None, given.mean(), tol=1e-14)
    return HypothesisFit(Effect(), found, given.reduced.model)


def test_intervals_count_the_prior_of_what_is_frozen(reduced, columns):
    """Over truths and noise as assumed, the errors of the free ones have the said covariance."""
    rng = np.random.default_rng(5)
    A, sd = np.stack([c.column for c in columns], 1), [c.parameters[0].sd for c in columns]
    whole = problem(reduced, columns, np.zeros(8))
    part = _without(whole, ["x of 2"])
    assert part.base == tuple(columns[:2])
    said = with_frozen(whole, null_of(part)).covariance
    gain = null_of(part).fit.covariance @ A[:, :2].T / NOISE**2
    truth = rng.normal(size=(40000, 3)) * sd
    y = truth @ A.T + NOISE * rng.normal(size=(len(truth), 8))
    seen = np.cov((y @ gain.T - truth[:, :2]).T)
    assert_allclose(seen, said, rtol=0.05, atol=0.02 * said.max())
    assert (np.diag(said) > np.diag(null_of(part).fit.covariance)).all()


def test_a_profile_of_a_linear_problem_is_the_parabola_of_its_covariance(reduced, columns):
    given = problem(reduced, columns, np.linspace(-1, 1, 8))
    null = null_of(given)
    found, lower = profiles(given, null)
    assert lower is None
    for k, profile in enumerate(found):
        sd = np.sqrt(null.fit.covariance[k, k])
        assert_allclose(profile.values, null.fit.x[k] + sd * np.array(PROFILED))
        assert_allclose(profile.neg2_log_likelihood, np.square(PROFILED), atol=1e-6)
        assert_allclose(profile.quadratic, np.square(PROFILED))


def test_a_fit_above_its_profile_is_begun_again_below_it(reduced, columns):
    """A fit that stopped early is no best: the profile finds a lower place, and it moves there."""
    given = problem(reduced, columns, np.linspace(-1, 1, 8))
    best = null_of(given)
    early = best.fit.x + np.sqrt(np.diag(best.fit.covariance)) * [1.5, 0.0, 0.0]
    stopped = fit(reduced.model, columns, given.data, None, early, max_steps=0)
    found, null = profiles_of_the_best(given, replace(best, fit=stopped))
    assert_allclose(null.fit.x, best.fit.x, atol=1e-3)
    assert all(min(p.neg2_log_likelihood) > 0 for p in found)


def test_a_latin_hypercube_has_one_start_in_every_stratum(reduced, columns):
    starts = np.array(latin_hypercube(problem(reduced, columns, np.zeros(8)), 20))
    assert starts.shape == (20, 3)
    for x, c in zip(starts.T, columns, strict=True):
        assert (np.abs(x) <= 2.06 * c.parameters[0].sd).all()
        assert len(set(np.digitize(x, np.quantile(x, np.linspace(0, 1, 21)[1:-1])))) == 20
    assert_allclose(starts, latin_hypercube(problem(reduced, columns, np.zeros(8)), 20))


def test_starts_that_end_together_are_one_basin(reduced, columns):
    """Alike in evidence but far in a parameter, or near but far worse, are basins of their own."""
    null = null_of(problem(reduced, columns, np.zeros(8)))
    sd = np.sqrt(np.diag(null.fit.covariance))

    def end(evidence, shift):
        return SimpleNamespace(neg2_log_evidence=evidence, x=null.fit.x + shift * sd)

    ends = [end(5.0, 9.0), end(2.0, 0.1), end(2.3, -0.1), end(2.1, 5.0)]
    found = _basins(null, end(2.5, 0.0), ends)
    assert [b.starts for b in found] == [2, 1, 1]
    assert_allclose([b.above for b in found], [0.0, 0.1, 3.0])


def calibrated_plate(reduced, x, sd=0.01):
    """The calibration of E of a plate, ended at x."""
    effect = calibration_parameter(reduced.groups, "E", [0])
    return Fit((effect,), np.array([x]), np.array([[sd**2]]), 0, 0, None, None, Status.CONVERGED)


AGREES = Agreement(Scores(1.0, 0.1), Scores(1.0, 0.2))
SCALES = MassMeasurement(1.4, 0.004)


def test_a_calibration_that_foretells_keeps_the_mass_and_its_priors_is_no_compensation(reduced):
    mass = MassComparison(1.4, 1.405)
    assert compensating(calibrated_plate(reduced, 0.05), AGREES, mass, SCALES, None, True) == ()


@pytest.mark.parametrize(
    ("x", "held", "model", "said"),
    [
        (0.05, 1.5, 1.4, "predicts the held-out data worse"),
        (0.05, 0.2, 1.41, "weighs 1.41 kg, 0.01 kg more than the article"),
        (0.20, 0.2, 1.4, "standard deviations of its prior from the deck's value"),
    ],
)
def test_each_sign_of_compensation_is_enough(reduced, x, held, model, said):
    agreement = replace(AGREES, held_out=Scores(1.0, held))
    mass, spot = MassComparison(1.4, model), SimpleNamespace(parts=("top",))
    plate = calibrated_plate(reduced, x)
    stands, *reasons = compensating(plate, agreement, mass, SCALES, spot, True)
    assert len(reasons) == 1
    assert said in reasons[0]
    assert f"plate {100 * np.expm1(x):.1f} % stiffer" in stands
    assert "largest on top" in stands


@pytest.mark.parametrize(
    ("x", "said"), [(np.log(3.198), "stiffer by a factor of 3.2"), (-7.0, "softer by a factor of")]
)
def test_a_stiffness_beyond_a_doubling_is_a_factor(reduced, x, said):
    stands, *_ = compensating(calibrated_plate(reduced, x), AGREES, None, SCALES, None, True)
    assert f"plate {said}" in stands


def test_a_deck_that_keeps_its_values_beside_the_scales_is_not_trusted(reduced):
    """Where the mesh errs by more than any value, nothing changes, and the weighing says so."""
    mass = MassComparison(1.4, 1.5)
    for x, sd in ((0.0, 0.01), (-0.05, 0.1)):  # what lies within one sd of it is no change
        plate = calibrated_plate(reduced, x, sd)
        last, first = compensating(plate, AGREES, mass, SCALES, None, True)
        assert "weighs 1.5 kg" in first
        assert "the deck keeps its values" in last


def test_advice_on_level_and_places_goes_to_data_that_have_them(reduced):
    worse = replace(AGREES, held_out=Scores(1.0, 1.5))
    plate = calibrated_plate(reduced, 0.05)
    ways = [compensating(plate, worse, None, None, None, given)[1] for given in (True, False)]
    assert all("try chladni diagnose" in said for said in ways)
    assert ["position_sd" in said for said in ways] == [True, False]


@pytest.mark.parametrize("sd", [1e-9, 0.02])
def test_bands_are_as_wide_as_the_posterior_and_show_held_out_channels_first(
    reduced, responses, sd
):
    effect = calibration_parameter(reduced.groups, "E", [0])
    use = responses.use.copy()
    use[:, 2] = False
    data = replace(responses, use=use)
    given = UpdatingProblem(reduced, data, None, (effect,), (), None, ("a", "b", "c", "d"))
    found = fit(reduced.model, [effect], data, None, np.array([0.04]))
    null = HypothesisFit(Effect(), replace(found, covariance=np.array([[sd**2]])), reduced.model)
    every = list(bands(given, null, gaussian_draws(null.fit)))
    assert [b.label for b in every] == ["c", "a", "b", "d"]
    assert [b.held_out for b in every] == [True, False, False, False]
    width = np.log(np.array(every[0].high) / every[0].low)
    if sd < 1e-6:
        assert_allclose(every[0].low, every[0].measured, rtol=1e-2)
        assert width.max() < 1e-6
    else:
        assert 0.5 * sd < width.max() < 50 * sd
        assert (np.array(every[0].low) <= np.array(every[0].measured) * 1.001).mean() > 0.9


def test_draws_of_a_linear_problem_have_the_covariance_of_the_whole(reduced, columns):
    """What is frozen is free among the draws: their covariance is (AᵀA/σ² + P⁻¹)⁻¹ of all."""
    pytest.importorskip("emcee")
    A, sd = np.stack([c.column for c in columns], 1), [c.parameters[0].sd for c in columns]
    whole = problem(reduced, columns, np.linspace(-1, 1, 8))
    part = _without(whole, ["x of 2"])
    found, (effects, draws) = posterior_sample(whole, null_of(part), silent)
    due = np.linalg.inv(A.T @ A / NOISE**2 + np.diag(1 / np.square(sd)))
    mean = due @ A.T @ np.linspace(-1, 1, 8) / NOISE**2
    assert_allclose(found.gaussian_mean, mean, atol=1e-4)  # where the descent stops
    assert_allclose(found.gaussian_covariance, due, rtol=1e-6)
    assert [p.name for p in found.parameters] == ["x of 0", "x of 1", "x of 2"]
    assert draws.shape == (60, 3)
    assert len(effects) == 3
    assert found.converged
    for k, p in enumerate(found.parameters):
        near = 5 * np.sqrt(due[k, k] / p.effective)
        assert p.median == pytest.approx(mean[k], abs=2 * near)
        assert p.sd_ratio == pytest.approx(1.0, abs=5 / np.sqrt(p.effective))
        assert (p.high - p.low) == pytest.approx(p.gaussian_high - p.gaussian_low, rel=0.2)
    assert "not converged" not in found.sentence
    assert "not converged" in replace(found, converged=False).sentence
