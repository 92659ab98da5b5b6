"""Where everything is linear and Gaussian, fit and evidence are known in closed form."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.effect import ChannelChange, Effect, Parameter, Weight
from chladni.errors import ModelError
from chladni.inference.map_fit import MassMeasurement, Status, fit
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

MEAN, SD = np.array([0.5, -1.0, 0.2]), np.array([0.3, 2.0, 1.0])
NOISE = np.array([0.1, 0.4, 0.2, 0.3, 0.1, 0.25])
EXACT = {"tol": 1e-14, "max_steps": 60}


@dataclass(frozen=True, eq=False)
class Linear(Effect):
    """Channels A x, weight w x."""

    A: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    w: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x):
        return (ChannelChange((self.A @ x).astype(complex), self.A.astype(complex)),)

    def weight(self, x):
        return Weight(float(self.w @ x), self.w)


@dataclass(frozen=True, eq=False)
class Offsets:
    """y = channels + noise."""

    y: np.ndarray
    error = None

    def scaled(self, state, gradient):
        r = (state.offset.real - self.y) / NOISE
        return r, state.doffset.real / NOISE[:, None] if gradient else np.zeros((len(r), 0))

    def scaled_slopes(self, state):
        return self.scaled(state, True)[1]

    def rebased(self, model):
        return self


@pytest.fixture(scope="module")
def model():
    return reduced_problem(plate(0.4, 0.3, 3, 2, 1.5e-3), 100.0).model


def linear(A, w, trials_factor=1, which=slice(None)):
    unknown = tuple(
        Parameter(f"x{k}", "-", m, s, kind="linear", step=100.0)
        for k, (m, s) in enumerate(zip(MEAN[which], SD[which], strict=True))
    )
    return Linear(unknown, "a toy", trials_factor=trials_factor, A=A[:, which], w=w[which])


def problem(seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(6, 3)), rng.normal(size=3), rng.normal(size=6)


def exact(A, y, sd, mean, prior):
    """(-2 ln p(y) less what is common to all models, posterior mean, covariance)."""
    C = np.diag(sd**2) + A @ np.diag(prior**2) @ A.T
    off = y - A @ mean
    S = off @ np.linalg.solve(C, off) + np.linalg.slogdet(C)[1] - 2 * np.log(sd).sum()
    gain = np.diag(prior**2) @ A.T @ np.linalg.inv(C)
    return S, mean + gain @ off, np.diag(prior**2) - gain @ A @ np.diag(prior**2)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("weighed", [False, True])
def test_evidence_mean_and_covariance_are_exact(model, seed, weighed):
    A, w, y = problem(seed)
    plain = model.groups.weight.sum()
    mass_measurement = MassMeasurement(plain + 0.4, 0.05) if weighed else None
    found = fit(model, [linear(A, w)], Offsets(y), mass_measurement, np.zeros(3), **EXACT)
    rows = np.vstack([A, w]) if weighed else A
    data = np.append(y, 0.4) if weighed else y
    sd = np.append(NOISE, 0.05) if weighed else NOISE
    S, x, covariance = exact(rows, data, sd, MEAN, SD)
    assert found.status is Status.CONVERGED
    assert_allclose(found.x, x, atol=1e-6)
    assert_allclose(found.covariance, covariance, atol=1e-9)
    assert_allclose(found.neg2_log_evidence, S, rtol=1e-8)
    assert_allclose(found.misfit, (((A @ x - y) / NOISE) ** 2).sum(), rtol=1e-6)


def test_difference_of_evidence_is_the_ratio_of_marginal_likelihoods(model):
    """Models with other numbers of parameters stand on one scale."""
    A, w, y = problem(7)
    some = slice(0, 2)
    large = fit(model, [linear(A, w)], Offsets(y), None, np.zeros(3), **EXACT).neg2_log_evidence
    fewer = [linear(A, w, which=some)]
    small = fit(model, fewer, Offsets(y), None, np.zeros(2), **EXACT).neg2_log_evidence
    expected = (
        exact(A, y, NOISE, MEAN, SD)[0] - exact(A[:, some], y, NOISE, MEAN[some], SD[some])[0]
    )
    assert_allclose(large - small, expected, rtol=1e-8)


def test_places_tried_are_paid_for(model):
    A, w, y = problem(1)
    one, ten = (
        fit(model, [linear(A, w, n)], Offsets(y), None, np.zeros(3), **EXACT).neg2_log_evidence
        for n in (1, 10)
    )
    assert_allclose(ten - one, 2 * np.log(10))


def test_effects_split_in_two_are_the_same_fit(model):
    A, w, y = problem(2)
    first, second = linear(A, w, which=slice(0, 1)), linear(A, w, which=slice(1, 3))
    whole = fit(model, [linear(A, w)], Offsets(y), None, np.zeros(3), **EXACT)
    split = fit(model, [first, second], Offsets(y), None, np.zeros(3), **EXACT)
    assert_allclose(split.neg2_log_evidence, whole.neg2_log_evidence, rtol=1e-8)
    assert_allclose(split.of(second), whole.x[1:], atol=1e-6)
    assert_allclose(split.sd(first), np.sqrt(whole.covariance[0, 0]))
    with pytest.raises(ModelError, match="not part of this fit"):
        split.of(linear(A, w))


def test_too_few_steps_are_owned_up_to(model):
    A, w, y = problem(3)
    found = fit(model, [linear(A, w)], Offsets(y), None, np.full(3, 50.0), max_steps=1, tol=1e-14)
    assert found.status is Status.OUT_OF_STEPS
