"""Patches of a sheet at their limits: as large as the sheet they are its ordinary numbers."""

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.element_groups import COMPONENTS
from chladni.effects.sheet_patch import BANDS, levels
from chladni.effects.sheets import MassPatch, StiffnessPatch, spread_mass
from chladni.fem.energy import mass_properties
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel, plate

WIDE = np.log(1e4)  # of ln R: q is one everywhere


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), 300.0)


@pytest.fixture(scope="module")
def coarse():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), 300.0, groups=12)


def lam(reduced, effect, x):
    return evaluate(reduced.model, [effect], np.array(x), False).lam


def test_a_patch_as_large_as_the_sheet_is_its_modulus(reduced):
    patch, E = (
        StiffnessPatch.on(reduced.groups, 0, 1),
        calibration_parameter(reduced.groups, "E", [0]),
    )
    got, due = (
        lam(reduced, patch, [0.3, WIDE, 0, 0, 0]),
        lam(reduced, E, [np.log(1 - StiffnessPatch.lost(0.3))]),
    )
    assert_allclose(got[6:], due[6:], rtol=1e-6)


def test_a_mass_as_large_as_the_sheet_is_its_density(reduced):
    patch, rho = (
        MassPatch.on(reduced.groups, 0, 1),
        calibration_parameter(reduced.groups, "rho", [0]),
    )
    m = patch.parameters[0].value(0.5)
    due = lam(reduced, rho, [np.log1p(m / reduced.groups.weight.sum())])
    assert_allclose(lam(reduced, patch, [0.5, WIDE, 0, 0, 0])[6:], due[6:], rtol=1e-6)


@pytest.mark.parametrize("ln_R", [-3.0, -1.5, 0.0])
def test_the_mass_is_all_there_whatever_its_radius(reduced, ln_R):
    """In the reduced model and in the deck; and on a folded sheet its groups share it."""
    patch, x = MassPatch.on(reduced.groups, 5, 1), np.array([0.2, ln_R, 0.05, 0.02, 0.4])
    m = patch.parameters[0].value(0.2)
    plain = float(reduced.groups.weight.sum())
    assert evaluate(reduced.model, [patch], x, False).weight == pytest.approx(plain + m, rel=1e-9)
    written = patch.apply(reduced.structure.assembly, x)
    assert mass_properties(written)[0] == pytest.approx(plain + m, rel=1e-9)


def test_a_small_patch_has_groups_of_its_own():
    """K and M of a patch of two shells' size are those of the shells themselves.

    They are far from it over the groups of the sheet, each of several shells.
    """
    plate_ = reduced_problem(plate(0.5, 0.35, 20, 14, 2e-3), 250.0)
    x = np.array([1.5, np.log(0.08), 0.03, -0.02, 0.9])
    coarse = MassPatch.on(plate_.groups, 20, 1)
    fine = coarse.resolved(plate_.groups, x)
    model = plate_.model_for(fine, x)
    q = coarse.bump(x, plate_.groups.each.centre)
    exact = spread_over(plate_, q / (q @ plate_.groups.each.area) * coarse.parameters[0].value(1.5))
    errors = [
        abs(evaluate(m, [e], x, False).lam[6:14] / exact[6:14] - 1).max()
        for m, e in ((plate_.model, coarse), (model, fine))
    ]
    assert len(model.groups) < 3 * len(plate_.groups)
    assert errors[1] < 0.1 * errors[0]


def spread_over(problem, load):
    """λ of the reduced structure with masses per area (m,) on its shells."""
    groups, model = problem.groups, problem.model
    heavier = 1 + load * groups.each.area / groups.mass[:, ::6, ::6].sum(axis=(1, 2))
    whole = groups.divided(np.arange(len(groups.group)))
    M = model.M0 + sum(
        heavier[whole.first][g] * m
        for g, m in enumerate(whole.project([groups.mass], model.vectors)[0])
    )
    K, _ = model.with_fields(
        {n: np.zeros(len(groups)) for n in ("t", "E", "rho", "bending", *COMPONENTS)}
    )
    return sl.eigh(K, M, eigvals_only=True)


def test_divided_groups_hold_what_whole_ones_hold(coarse):
    """Any field that is one number over a group is the same field over its pieces."""
    parts = np.random.default_rng(1).integers(0, 3, len(coarse.groups.group))
    model = coarse.model.divided(parts)
    assert len(model.groups) > len(coarse.groups)
    E = calibration_parameter(coarse.groups, "E", [0])
    patch = StiffnessPatch.on(coarse.groups, 5, 1)
    for effect, x in ((E, [0.2]), (patch, [0.3, -1.5, 0.05, 0.02, 0.4])):
        got, due = (evaluate(m, [effect], np.array(x)) for m in (model, coarse.model))
        assert_allclose(got.lam[6:], due.lam[6:], rtol=1e-9)
        assert got.weight == pytest.approx(due.weight, rel=1e-12)
        z = np.eye(len(due.lam))[:, 6:9]
        assert_allclose(got.dK.times(z), due.dK.times(z), atol=1e-9 * abs(due.dK.times(z)).max())


def test_two_patches_have_pieces_of_both(coarse):
    """Over the groups of both, each is what it is alone: their weights add."""
    groups = coarse.groups
    x = np.array([0.2, np.log(0.1), 0.0, 0.0, 0.7])
    one, other = (MassPatch.on(groups, g, 1).resolved(groups, x) for g in (1, 10))
    model = coarse.model.split_for(one, x).split_for(other, x)
    both = evaluate(model, [one, other], np.concatenate([x, x]), False).weight
    m = one.parameters[0].value(0.2)
    product = float(groups.weight.sum()) + 2 * m
    assert both == pytest.approx(product, rel=2e-3)  # where they overlap, factors multiply


def test_a_patch_has_a_rim_from_a_bell_to_a_disc(reduced):
    """p = 1: a Gaussian; p large: 1 within √2 R, 0 beyond, and 1/e at √2 R whatever it is."""
    patch = StiffnessPatch.on(reduced.groups, 5, 1)
    ln_R, R = np.log(0.2), 0.2 * patch.size

    def q(p, away):
        x = np.array([0.3, ln_R, 0.0, 0.0, np.log(p)])
        return patch.bump(x, patch.at(x) + np.outer(away, patch.surface.axes[0]))

    away = np.array([0.0, 0.5, 1.3, 2.0]) * R
    assert_allclose(q(1.0, away), np.exp(-(away**2) / (2 * R**2)), rtol=1e-12)
    assert_allclose(q(50.0, away), [1, 1, 1, 0], atol=1e-2)
    for p in (0.7, 1.0, 3.0):
        assert_allclose(q(p, np.sqrt([2.0]) * R), np.exp(-1), rtol=1e-9)


def test_bands_hold_the_mass_and_every_shell_within_half_a_step():
    panel = folded_panel(0.6, 0.3, 0.04, 0.01, 0.02, 1e-3)
    q = np.exp(-((panel.points[panel.shells.nodes].mean(axis=1) - 0.15) ** 2).sum(axis=1) / 0.02)
    heavier = spread_mass(panel, q, 0.2)
    assert mass_properties(heavier)[0] - mass_properties(panel)[0] == pytest.approx(0.2, rel=1e-9)
    level, step = levels(q)
    assert np.abs(level * step - q).max() <= step / 2 * (1 + 1e-12)
    assert len(heavier.parts) <= 2 * (BANDS + 1)
    assert not levels(0 * q)[0].any()
