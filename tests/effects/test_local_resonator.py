"""A lump on a spring: its dynamic stiffness, its limits, and which data tell it from a mass."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import LocalResonator, PointMass
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.reduced.accuracy import LIMIT, accuracy
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP = 300.0


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), TOP)


@pytest.fixture(scope="module")
def where(reduced):
    setup = Setup((), (), float(reduced.groups.weight.sum()), TOP)
    return EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)


@pytest.fixture(scope="module")
def lump(where):
    return LocalResonator.near(where, where.grids.position(25))


def at(lump, m, f):
    ln = [np.log(v / lump.parameters[p].scale) for v, p in ((m, 0), (f, 3))]
    return np.array([ln[0], 0.0, 0.0, ln[1]])


@pytest.mark.parametrize("f", [20.0, 120.0, 900.0])
def test_it_answers_with_its_dynamic_stiffness_at_every_frequency(reduced, lump, f):
    """H - G_ob D / (1 + D G_bb) G_bi with D = m s² ω²/(ω² + s²), no condensation in between."""
    m, x = 0.03, at(lump, 0.03, f)
    model = reduced.model_for(lump, x)
    s = 2 * np.pi * np.linspace(15, TOP, 40) * (0.02 + 1j)
    rows = reduced.grids.rows[[0, 5, 40]]
    use = np.ones((40, 3), bool)
    data = Responses(np.ones((40, 3, 1), complex), s, rows, rows[[2]], use, "receptance")
    data = data.rebased(model)
    plain = evaluate(model, [], x[:0], False)
    (tangent,) = [t for t in lump.terms(x) if t.own is None]  # carried along the sheet
    b_t = model.rows(tangent.rows, keep=False) @ plain.phi
    M = np.eye(len(plain.lam)) + m * b_t.T @ b_t
    b = model.rows(lump.terms(x)[0].rows, keep=False) @ plain.phi
    o, i = data.a @ plain.phi, data.b @ plain.phi
    w = 2 * np.pi * f
    due = np.array([
        o @ np.linalg.solve(
            np.diag(plain.lam) + z**2 * M + m * z**2 * w**2 / (w**2 + z**2) * b.T @ b, i.T
        )
        for z in s
    ])  # fmt: skip
    assert_allclose(data.model(evaluate(model, [lump], x, False)), due, rtol=1e-7)


def test_far_above_the_band_it_is_a_point_mass(reduced, where, lump):
    """Its modes below are those of the mass to the order (f / f_lump)², and one more is above."""
    mass = PointMass.near(where, where.grids.position(25))
    x = at(lump, 0.05, 40 * TOP)
    model = reduced.model_for(mass, np.zeros(3))
    ln_m = np.log(0.05 / mass.parameters[0].scale)
    due = evaluate(model, [mass], np.array([ln_m, 0, 0]), False).lam[6:12]
    found = evaluate(model, [lump], x, False).lam
    assert_allclose(found[6:12], due, rtol=(1 / 40) ** 2)
    assert len(found) == len(model.K0) + 1


def test_far_below_the_band_it_is_cut_off_but_for_its_own_mode(reduced, lump):
    model, x = reduced.model_for(lump, at(lump, 0.02, 1.0)), at(lump, 0.02, 1.0)
    without = evaluate(model, [], x[:0], False).lam[6:12]
    assert_allclose(evaluate(model, [lump], x, False).lam[7:13], without, rtol=2e-3)


def errors(times):
    """Relative errors of frequencies of a lump tuned into the band, against the full structure."""
    deck = plate(0.4, 0.3, 8 * times, 6 * times, 1.5e-3)
    reduced = reduced_problem(deck, TOP)
    setup = Setup((), (), float(reduced.groups.weight.sum()), TOP)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    k = int(np.argmin(np.linalg.norm(where.grids.point - [0.25, 0.1, 0], axis=1)))
    lump = LocalResonator.near(where, k)
    x = at(lump, 0.03, 110.0)
    model = reduced.model_for(lump, x)
    found = accuracy(reduced, model, [lump], x, TOP)
    due = normal_modes(structure(lump.apply(deck, x)).system, 18).frequency[6:]
    plain = evaluate(model, [], x[:0], False).lam[6:]
    few = int((plain < (2 * np.pi * TOP) ** 2).sum())
    assert len(found.frequency) == few + 1  # one mode more in the band
    return np.abs(found.frequency / due[: few + 1] - 1).max()


def test_the_written_lump_is_the_one_of_the_reduced_model():
    """All modes, its own too: under a point force w is r² ln r, so its interpolation errs as h²."""
    coarse, fine = errors(1), errors(3)
    assert coarse < 0.01
    assert 6 < coarse / fine < 12


def test_what_the_basis_lacks_is_found_with_the_lump_on_it(reduced, lump):
    """Without its static response the estimate sees the error, and mends it."""
    x = at(lump, 0.1, 150.0)
    poor = accuracy(reduced, reduced.model, [lump], x, TOP)
    mended = accuracy(reduced, poor.refined(reduced.model), [lump], x, TOP)
    assert poor.worst > LIMIT
    assert mended.worst < poor.worst / 4
