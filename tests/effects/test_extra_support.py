"""A support that pushes askew: what a deck then holds is what the fit meant."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.structures import held_along_x0

from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect import WIDER
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.springs import ExtraSupport
from chladni.fem.assemble import structure
from chladni.model.properties import Isotropic
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), 250.0)


@pytest.fixture(scope="module")
def where(reduced):
    setup = Setup((), (), float(reduced.groups.weight.sum()), 200.0)
    return EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)


@pytest.fixture(scope="module")
def support(where):
    """Soft enough that the sheet does not dent beneath it: the patch is smoother than a dent."""
    return ExtraSupport.near(where, where.grids.position(25))


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.4, -0.7), (1.0, 0.0)])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, -0.25)])
def test_the_deck_has_the_modes_of_the_fit(reduced, support, tilt, place):
    """One spring along one direction where the fit put it, not one along each axis of a grid."""
    x = np.array([-3.0, *place, *tilt])
    model = reduced.model_for(support, x)
    lam = evaluate(model, [support], x, False).lam[:12]
    fitted = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    written = support.apply(reduced.structure.assembly, x)
    assert_allclose(written.bushes.place[-1], support.at(x))
    full = normal_modes(structure(written).system, 12).frequency
    assert_allclose(fitted[full > 1], full[full > 1], rtol=3e-3)
    held = int((full > 0.2).sum())
    assert held == 7  # one rigid motion is held, five are free


def test_it_pushes_along_a_unit_vector(support):
    for tilt in ((0.0, 0.0), (0.3, 0.2), (-2.0, 1.0)):
        d = support.pushes(np.array([0.0, 0.0, 0.0, *tilt]))
        assert_allclose(np.linalg.norm(d), 1)
        assert_allclose(d @ support.direction, 1 / np.sqrt(1 + np.sum(np.square(tilt))))


def test_begun_anew_it_pushes_as_before(where, support):
    x = np.array([0.3, 1.0, 0.0, 0.2, -0.4])
    again, start = support.recentred(x, where)
    assert_allclose(again.pushes(start), support.pushes(x), atol=1e-9)
    turned = replace(again, direction=-again.direction)
    assert_allclose(np.abs(turned.pushes(start) @ turned.direction), again.pushes(start)[2])


def test_a_tilt_worth_a_word_is_said(support):
    assert "along" not in support.location(np.zeros(5)).text
    assert "along (" in support.location(np.array([0, 0, 0, 1.0, 0])).text


def test_a_place_is_known_as_well_as_the_fit_says(support):
    """95 % of a Gaussian in a plane lie in the radius √5.99 sd (χ² of two); no less than h."""
    rng, sd = np.random.default_rng(0), np.array([0.1, 0.8, 0.8, 0.1, 0.1])
    radius = support.location(np.zeros(5), sd).radius_m
    drawn = support.patch.size * WIDER * 0.8 * rng.normal(size=(20000, 2))
    assert np.mean(np.linalg.norm(drawn, axis=1) < radius) == pytest.approx(0.95, abs=0.01)
    longer = support.location(np.zeros(5), sd * [1, 1, 2, 1, 1]).radius_m
    assert longer == pytest.approx(2 * radius)  # what one way is less known counts
    assert support.location(np.zeros(5), 1e-3 * sd).radius_m == support.patch.size
    beyond = np.array([0.0, 0.0, 40.0, 0.0, 0.0])  # its deviation there is that of the prior
    assert support.location(beyond, sd * [1, 1, 9, 1, 1]).radius_m == pytest.approx(radius)


def test_at_the_edge_of_a_fold_what_leads_off_it_is_no_doubt(support):
    """All grids that face as it does lie on a line: the other parameter stays at its prior."""
    line = replace(support.patch, flat=support.patch.flat * [1.0, 0.0])
    known = replace(support, patch=line).location(np.zeros(5), np.array([0.1, 0.8, 1.5, 0.1, 0.1]))
    assert known.radius_m == pytest.approx(1.96 * WIDER * 0.8 * support.patch.size)


def test_starts_reach_from_a_spring_that_is_hardly_noticed_to_a_rigid_support():
    """Tip of a strip: it yields by L³/3EI, and at the highest line it moves with a mass of m/4r."""
    L, E, width, t, rho = 0.5, 210e9, 0.02, 2e-3, 7850.0
    strip = held_along_x0(plate(L, width, 25, 1, t, Isotropic(E, 0.0, rho)))
    problem, top = reduced_problem(strip, 600.0), 600.0
    shapes = problem.shapes
    f = problem.frequency[: shapes.shape[1]]
    setup = Setup((), (), float(problem.groups.weight.sum()), top)
    where = EffectContext(problem.groups, problem.grids, problem.candidates, setup, f, shapes)
    tip = int(np.argmax(problem.grids.point[:, 0]))
    K = ExtraSupport.near(where, tip).parameters[0]
    soft, rigid = (np.exp(K.starts[k]) * K.scale for k in (0, -1))
    assert soft < 0.2 * 3 * E * width * t**3 / 12 / L**3
    fixed = rho * L * width * t / (4 * len(f)) * (2 * np.pi * top) ** 2
    assert rigid > 3 * fixed
    assert np.diff(K.starts).max() < 2.1
    alone = ExtraSupport.near(replace(where, frequency=f[:0], shapes=shapes[:, :0]), tip)
    assert alone.parameters[0].starts == (-2.0, 0.0, 2.0)
