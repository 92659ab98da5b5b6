"""Patches of a sheet at their limits: as large as the sheet they are its ordinary numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
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
