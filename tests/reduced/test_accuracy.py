"""The error estimate tells when a basis no longer serves, and the renewed basis does."""

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import PointMass, sensor_mass
from chladni.effects.sheets import ThicknessDistribution
from chladni.effects.springs import ExtraSupport
from chladni.fem.assemble import structure
from chladni.reduced.accuracy import accuracy, products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel

TOP = 300.0
NAMES = ("thickness", "thinner", "stiffer", "thinning", "mass", "masses", "spring")


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(folded_panel(h=0.06), TOP, groups=24)


@pytest.fixture(scope="module")
def changes(reduced):
    """Effect and x of each kind of change."""
    groups = reduced.groups
    sensors = tuple(reduced.candidates.grids[[3, 9]].tolist())
    setup = Setup(tuple(((int(g), 1.0),) for g in sensors), (), float(groups.weight.sum()), TOP)
    where = EffectContext(groups, reduced.grids, reduced.candidates, setup)
    k = reduced.grids.position(int(reduced.candidates.grids[5]))
    start = np.array([0.5, np.log(0.15), 0.1, 0.0, 0.2])
    return {
        "thickness": (calibration_parameter(groups, "t", [0]), np.array([0.2])),
        "thinner": (calibration_parameter(groups, "t", [1]), np.array([-0.2])),
        "stiffer": (calibration_parameter(groups, "E", [0]), np.array([0.5])),
        "thinning": (ThicknessDistribution.on(groups, 0, 1), start),
        "mass": (PointMass.near(where, k), np.array([1.0, 0.2, 0.1])),
        "masses": (sensor_mass(where)[0], np.array([0.5])),
        "spring": (ExtraSupport.near(where, k), np.array([2.0, 0.1, 0.2, 0.0, 0.0])),
    }  # fmt: skip


def true_error(reduced, effect, x):
    """Relative frequency error of the reduced model against its own operators in full."""
    model = reduced.model
    K, M = products(model, [effect], x, np.eye(len(model.basis)))
    lam = evaluate(model, [effect], x, False).lam
    at = (np.sqrt(np.maximum(lam, 0)) > 0.04 * np.pi * TOP) & (lam <= (2 * np.pi * TOP) ** 2)
    sigma = 100.0  # rad²/s²: M has no drilling inertia, K no stiffness against rigid motion
    theta = sl.eigh((M + M.T) / 2, (K + K.T) / 2 + sigma * M, eigvals_only=True)[::-1]
    return np.sqrt(lam[at] / (1 / theta[: len(lam)][at] - sigma)) - 1


@pytest.mark.parametrize("name", ["thickness", "stiffer", "mass"])
def test_nothing_is_missing_at_the_basis_own_parameters(reduced, changes, name):
    effect, x = changes[name]
    idle = np.array([-30.0, 0, 0]) if name == "mass" else 0 * x
    found = accuracy(reduced, reduced.model, [effect], idle, TOP)
    assert len(found.error) > 5
    assert found.worst < 1e-9
    assert found.serves()


@pytest.mark.parametrize("name", NAMES)
def test_estimate_lies_between_four_fifths_of_the_error_and_the_error(reduced, changes, name):
    """4 κ / (1 + κ)² of Kantorovich is 0.8 at κ = 2.6, more than any of these changes makes."""
    effect, x = changes[name]
    due = true_error(reduced, effect, x)
    got = accuracy(reduced, reduced.model, [effect], x, TOP).error
    assert due.max() > 1e-5
    assert_allclose(len(got), len(due))
    assert np.all(got <= due + 1e-9)
    assert got.max() > 0.8 * due.max()
    assert np.all(got > 0.8 * due - 0.05 * due.max())


@pytest.mark.parametrize("name", NAMES)
def test_renewed_basis_leaves_a_fraction_of_the_error(reduced, changes, name):
    effect, x = changes[name]
    before = accuracy(reduced, reduced.model, [effect], x, TOP)
    model = before.refined(reduced.model)
    after = accuracy(reduced, model, [effect], x, TOP)
    n = len(before.error)
    assert after.worst < 0.2 * before.worst
    assert_allclose(after.frequency[:n], before.frequency / (1 + before.error), rtol=1e-6)


def test_error_falls_with_the_square_of_the_change(reduced, changes):
    """Galerkin's eigenvalues err in second order of what the basis lacks."""
    effect, x = changes["thickness"]
    h = np.array([0.1, 0.05, 0.025])
    error = [accuracy(reduced, reduced.model, [effect], x * s / 0.2, TOP).worst for s in h]
    order = np.log2(np.array(error[:-1]) / error[1:])
    assert_allclose(order, 2, atol=0.15)


def test_attachments_of_the_place_make_a_mass_accurate(reduced, changes):
    """What UpdatingProblem.fitted_with adds to the basis is what the estimate asks for."""
    for name in ("mass", "spring"):
        effect, x = changes[name]
        with_them = reduced.model_for(effect, x)
        bare = accuracy(reduced, reduced.model, [effect], x, TOP)
        carried = accuracy(reduced, with_them, [effect], x, TOP)
        assert carried.worst < 0.1 * bare.worst
        assert carried.serves()


@pytest.mark.parametrize("name", ["stiffer", "masses"])
def test_products_are_those_of_the_changed_structure(reduced, changes, name):
    effect, x = changes[name]
    q = np.random.default_rng(1).normal(size=(len(reduced.model.basis), 3))
    system = structure(effect.apply(reduced.structure.assembly, x)).system
    for got, due in zip(
        products(reduced.model, [effect], x, q), (system.K @ q, system.M @ q), strict=True
    ):
        assert_allclose(got, due, atol=1e-9 * np.abs(due).max())


def test_components_give_the_same_products(reduced, changes):
    effect, x = changes["thickness"]
    split = reduced.model.with_components()
    q = np.random.default_rng(2).normal(size=(len(reduced.model.basis), 3))
    for got, due in zip(
        products(split, [effect], x, q), products(reduced.model, [effect], x, q), strict=True
    ):
        assert_allclose(got, due, atol=1e-9 * np.abs(due).max())
