"""Shear and rotary inertia that bars lack, against Timoshenko's beam on two supports."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.elements import row_of_bars

from chladni.dynamics.eigen import normal_modes
from chladni.effects.beam_theory import LACKING, as_deep_beams, theory_prior
from chladni.effects.model_errors import BeamTheory, mesh_errors
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.fem.modelled import modelled
from chladni.model.properties import BeamSection, Isotropic

STEEL = Isotropic(210e9, 0.3, 7850.0)
SIDE, LENGTH = 0.02, 0.3
SECTION = BeamSection(STEEL, SIDE**2, SIDE**4 / 12, SIDE**4 / 12, 0.0, 0.141 * SIDE**4)


def held(n):
    """A bar on two supports that bends in its x-y plane alone, or twists."""
    held = [(row, c) for row in range(n + 1) for c in (1, 3, 5)]
    return row_of_bars(
        n, LENGTH, SECTION, supports=np.array([*held, (0, 2), (n, 2), (0, 4), (n, 4)])
    )


def timoshenko(mode, k=LACKING):
    """Lower root of ρ²I/kG ω⁴ - (ρA + ρI β² (1 + E/kG)) ω² + EI β⁴ = 0, β = nπ/L [Hz]."""
    rho, E, A, I = STEEL.rho, STEEL.E, SECTION.area, SECTION.I1
    kG, b2 = k * STEEL.shear_modulus, (mode * np.pi / LENGTH) ** 2
    roots = np.roots([rho**2 * I / kG, -(rho * A + rho * I * b2 * (1 + E / kG)), E * I * b2**2])
    return np.sqrt(roots.min()) / (2 * np.pi)


def bernoulli(mode):
    """Without shear and rotary inertia [Hz]."""
    stiff = STEEL.E * SECTION.I1 / (STEEL.rho * SECTION.area)
    return (mode * np.pi / LENGTH) ** 2 * np.sqrt(stiff) / (2 * np.pi)


def bending(assembly):
    return normal_modes(structure(assembly).system, 3).frequency


def test_members_with_shear_and_rotary_inertia_are_timoshenkos_beam():
    due = [timoshenko(n) for n in (1, 2, 3)]
    assert_allclose(bending(as_deep_beams(held(60))), due, rtol=2e-3)
    assert_allclose(bending(held(60)), [bernoulli(n) for n in (1, 2, 3)], rtol=2e-3)


def test_mass_stays_and_the_error_at_1_is_the_beam_of_timoshenko():
    made = held(30)
    assert mass_properties(as_deep_beams(made))[0] == pytest.approx(mass_properties(made)[0])
    top = 1.1 * bending(made)[2]
    errors = mesh_errors(modelled(made, 3 * top), top)
    (theory,) = (e for e in errors if type(e) is BeamTheory)
    off = theory.largest(1.0)
    assert off == pytest.approx(1 - timoshenko(3) / bernoulli(3), rel=0.1)
    assert theory.parameters[0].mean == theory_prior(made)[0] == 1.0
