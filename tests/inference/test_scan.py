"""Scans give at once what one evaluation after the other gives."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from tests.builders.recorded_plate import with_attachments

from chladni.effects.attachments import AtPoints
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Parameter, PointTerm, Traits, Weight
from chladni.inference.map_fit import MassMeasurement
from chladni.inference.scan import (
    baseline,
    direction_scores,
    field_slopes,
    oscillator_scores,
    point_scores,
)
from chladni.reduced.reduced_model import evaluate

WEIGHED = MassMeasurement(1.45, 0.01)
STRENGTHS = {"M": np.array([0.003, 0.04, 0.3]), "K": np.array([30.0, 2e3, 1e5])}


class Heavy(AtPoints):
    """A mass along one direction, seen by the scales."""

    matrix = "M"

    def weight(self, x):
        m = self.parameters[0].value(x[0])
        return Weight(m, np.array([m]))


@dataclass(frozen=True, eq=False)
class Lump(Heavy):
    """A mass on a spring along one direction, seen by the scales."""

    traits = Traits(own_dofs=1)
    hertz: float = 0.0

    def terms(self, x):
        m, one = np.array([self.parameters[0].value(x[0])]), np.array([[1.0]])
        nowhere = sp.csr_array(self.rows.shape)
        spring = PointTerm("K", self.rows, m * (2 * np.pi * self.hertz) ** 2, one, own=-one)
        return spring, PointTerm("M", nowhere, m, one, own=one)


@pytest.fixture(scope="module")
def base(reduced, responses):
    effects = [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]
    return baseline(reduced.model, effects, responses, WEIGHED, np.array([0.02, -0.03]))


def directly(base, model, data, places, k, matrix, strength):
    """Score of the same thing as an effect in the reduced model."""
    kind = Heavy if matrix == "M" else AtPoints
    one = kind((Parameter("c", "-", 0.0, 1.0, strength),), rows=places.rows[[k]])
    return base.score(residuals(base, model, data, one))[0]


def residuals(base, model, data, effect):
    """Residuals of the base and an effect of one strength, as a column."""
    state = evaluate(model, [*base.effects, effect], np.append(base.x, 0.0), False)
    r, _ = data.rebased(model).residual(state, False)
    return replace(base, state=state).with_mass(r[:, None], 0.0)


@pytest.mark.parametrize("matrix", ["M", "K"])
def test_low_rank_reanalysis_is_the_evaluation(reduced, responses, base, matrix):
    places = reduced.candidates.only(np.arange(0, 60, 9))
    strengths = STRENGTHS[matrix]
    rest = np.zeros(len(places))
    scores = point_scores(base, reduced.model, responses, places, matrix, strengths, rest)
    expected = [
        [directly(base, reduced.model, responses, places, k, matrix, c) for c in strengths]
        for k in range(len(places))
    ]
    assert_allclose(scores, expected, rtol=1e-6)


def test_secant_to_a_lump_on_a_spring_passes_through_its_evaluation(reduced, responses, base):
    """The best amount is no worse than the effect itself of the mass the secant was drawn to."""
    places = reduced.candidates.only(np.array([4, 31]))
    hertz, mass, rest = np.array([60.0, 130.0]), 0.02, np.zeros(2)
    amount, score = oscillator_scores(base, reduced.model, responses, places, mass, hertz, rest)
    for k in range(len(places)):
        for j, f in enumerate(hertz):
            lump = Lump((Parameter("M", "kg", 0.0, 1.0, mass),), rows=places.rows[[k]], hertz=f)
            r = residuals(base, reduced.model, responses, lump)
            assert base.score(r)[0] >= score[k, j] * (1 - 1e-9)
            along = base.residual[:, None] + amount[k, j] / mass * (r - base.residual[:, None])
            assert_allclose(base.score(along)[0], score[k, j], rtol=1e-6)


def test_residual_flexibility_stands_for_the_attachment(reduced, responses, base):
    """A stiff spring is far better described with it than without."""
    places = reduced.candidates.only(np.arange(4, 60, 13))
    stiff = np.array([1e5])
    rest = reduced.flexibility(places)
    assert np.all(rest > 0)
    with_it, without = (
        point_scores(base, reduced.model, responses, places, "K", stiff, r)[:, 0]
        for r in (rest, 0 * rest)
    )
    exact = np.array([
        directly(base, with_attachments(reduced, places.rows[[k]]), responses, places, k, "K", 1e5)
        for k in range(len(places))
    ])  # fmt: skip
    assert np.all(np.abs(with_it - exact) < 0.3 * np.abs(without - exact))
    assert_allclose(with_it, exact, rtol=0.1)


def test_a_place_already_in_the_basis_has_no_residual_flexibility(reduced):
    place = reduced.candidates.only(np.array([10]))
    grown = replace(reduced, model=with_attachments(reduced, place.rows))
    assert grown.flexibility(place)[0] < 1e-6 * reduced.flexibility(place)[0]


def test_score_has_the_base_profiled_out(base):
    """rᵀ (I + W Wᵀ)⁻¹ r, smallest over x of |r + W x|² + |x|²."""
    r = np.random.default_rng(1).normal(size=(base.Z.shape[1], 3))
    # Z = L⁻¹ Wᵀ with L Lᵀ = I + Wᵀ W, so I - Zᵀ Z = (I + W Wᵀ)⁻¹
    P = np.eye(len(r)) - base.Z.T @ base.Z
    C = np.linalg.inv(P)
    assert_allclose(base.score(r), np.einsum("ij,ij->j", r, P @ r), rtol=1e-9)
    assert np.linalg.eigvalsh(C).min() > 1 - 1e-6
    assert np.linalg.matrix_rank(C - np.eye(len(C)), tol=1e-6) == 2


def test_slopes_of_all_groups_together_are_the_slope_of_t(reduced, responses, base):
    slopes = field_slopes(base, reduced.model, responses, "t")
    whole = calibration_parameter(reduced.groups, "t", [0])
    state = evaluate(reduced.model, [*base.effects, whole], np.append(base.x, 0.0))
    _, J = responses.residual(state, True)
    expected = np.append(J[:, -1], state.dweight[-1] / WEIGHED.sd)
    assert_allclose(slopes.sum(axis=1), expected, atol=1e-8 * np.abs(expected).max())


def test_best_amount_along_a_direction_is_the_least(base):
    columns = np.random.default_rng(2).normal(size=(len(base.residual), 3))
    amount, score = direction_scores(base, columns)
    for k, column in enumerate(columns.T):
        for away in (-0.1, 0.0, 0.1):
            tried = base.score((base.residual + (amount[k] + away) * column)[:, None])[0]
            assert tried >= score[k] * (1 - 1e-12)
            assert (away == 0.0) == bool(np.isclose(tried, score[k], rtol=1e-9))
