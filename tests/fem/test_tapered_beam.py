"""Tapered beams against uniform ones, closed forms and their own refinement."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from chladni.fem.energy import mass_properties, rigid_motions
from chladni.model.properties import BeamStation

from .test_beam import GENERAL, I1, SECTION, STEEL, A, assembled, line, tip

END = BeamStation(1.0, 0.5, 0.4, 0.3, 0.2, 0.6, 1.0, 0.01, (0.03, 0.01), (0.0, 0.02))
MIDDLE = replace(  # between the ends, axes and places of masses are on straight lines
    END, x=0.3, area=1.2, I1=1.5, nonstructural=5.0, nonstructural_inertia=0.003,
    neutral=(0.016, -0.011), nonstructural_at=(0.0, 0.006),
)  # fmt: skip
TAPERED = replace(GENERAL, stations=(MIDDLE, END))
L = 2.0


def at(section, x):
    """The section that a tapered one has at x, uniform."""
    own = replace(END, x=0, area=1, I1=1, I2=1, I12=section.I12 / section.I1, J=1,
                  nonstructural=section.nonstructural, neutral=section.neutral,
                  nonstructural_inertia=section.nonstructural_inertia,
                  nonstructural_at=section.nonstructural_at)  # fmt: skip
    rows = (own, *section.stations)

    def value(name):
        table = np.array([getattr(r, name) for r in rows]).reshape(len(rows), -1).T
        found = tuple(float(np.interp(x, [r.x for r in rows], c)) for c in table)
        return found if len(found) > 1 else found[0]

    s = section
    return replace(
        s, stations=(), area=s.area * value("area"), I1=s.I1 * value("I1"), I2=s.I2 * value("I2"),
        I12=s.I1 * value("I12"), J=s.J * value("J"), nonstructural=value("nonstructural"),
        nonstructural_inertia=value("nonstructural_inertia"), neutral=value("neutral"),
        nonstructural_at=value("nonstructural_at"),
    )  # fmt: skip


def stepped(section, n, **more):
    """N uniform beams, each with the section at its middle."""
    made = line(section, n, L, **more)
    parts = tuple(
        replace(made.parts[0], section=at(section, (k + 0.5) / n), id=k + 1) for k in range(n)
    )
    return replace(made, parts=parts, beams=replace(made.beams, part=np.arange(n)))


@pytest.mark.parametrize("coupled", [True, False])
def test_stations_like_end_A_are_the_uniform_beam(coupled):
    same = replace(END, area=1, I1=1, I2=1, I12=GENERAL.I12 / GENERAL.I1, J=1,
                   nonstructural=GENERAL.nonstructural, neutral=GENERAL.neutral,
                   nonstructural_at=(0.0, 0.0), nonstructural_inertia=0.0)  # fmt: skip
    both = [
        assembled(line(s, 2, L, coupled_mass=coupled))
        for s in (GENERAL, replace(GENERAL, stations=(replace(same, x=0.4), same)))
    ]
    for one, other in zip(*both, strict=True):
        assert_allclose(one, other, atol=1e-9 * one.max())


def test_rigid_motions_are_free():
    rng = np.random.default_rng(1)
    made = line(TAPERED, 3, offset=rng.normal(size=(3, 2, 3)) / 10)
    K, R = assembled(made)[0], rigid_motions(made)
    assert_allclose(K @ R, 0, atol=1e-9 * K.max())
    assert np.linalg.matrix_rank(K, tol=1e-9 * K.max()) == K.shape[0] - 6


def test_timoshenko_cantilever_with_linear_sections():
    """One element: v = P ∫ (L-x)²/EI + P ∫ 1/kGA, the latter P L ln(A_B/A_A)/kG(A_B - A_A)."""
    end = replace(END, I12=0, neutral=(0, 0), nonstructural_at=(0, 0))
    s = replace(SECTION, shear=(0.5, 0.5), stations=(end,))
    bent = quad(lambda x: (1 - x) ** 2 / (1 + (0.4 - 1) * x), 0, 1)[0] * L**3 / (STEEL.E * I1)
    sheared = L * np.log(0.5) / (0.5 * STEEL.shear_modulus * A * (0.5 - 1))
    stretched = L * np.log(0.5) / (STEEL.E * A * (0.5 - 1))
    assert tip(line(s, 1, L), [0, 1, 0, 0, 0, 0])[1] == pytest.approx(bent + sheared, rel=1e-9)
    assert tip(line(s, 1, L), [1, 0, 0, 0, 0, 0])[0] == pytest.approx(stretched, rel=1e-9)


def test_steps_converge_to_the_taper_with_second_order():
    """Coupled moments, a neutral axis that tilts, shear: the steps' error falls fourfold."""
    due = tip(line(TAPERED, 1, L), [3, 1, 2, 0.5, 0.1, 0.2])
    error = [np.abs(tip(stepped(TAPERED, n), [3, 1, 2, 0.5, 0.1, 0.2]) - due) for n in (10, 20, 40)]
    assert np.all(error[2] < 2e-3 * np.abs(due).max())
    assert_allclose(error[1] / error[2], 4, atol=0.4)


@pytest.mark.parametrize("coupled", [True, False])
def test_mass_and_its_centre_are_those_of_many_steps(coupled):
    one, many = (
        mass_properties(made)
        for made in (line(TAPERED, 1, L, coupled_mass=coupled), stepped(TAPERED, 2000))
    )
    assert one[0] == pytest.approx(many[0], rel=1e-6)
    assert_allclose(one[1], many[1], atol=1e-5 * L)
