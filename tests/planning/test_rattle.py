"""Which shaker places rattle, foretold from the mesh."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.model.properties import Isotropic, Part, ShellSection
from chladni_planning import rattle_margin
from chladni_planning.rattle import TAKE_UP, all_gaps, first_rattle, openings
from chladni_specimens.mesher.flat_regions import grid
from chladni_specimens.mesher.pressed_sheets import MAIN, PressedSheet
from chladni_specimens.tailgate.tailgate import of_sheets

STEEL = Isotropic(210e9, 0.3, 7850.0)
FREQUENCY, DAMPING = np.array([20.0, 50.0]), np.array([0.01, 0.02])


def sheets(*heights, t=1e-3):
    """Flat sheets one above the other."""
    plan, quads = grid(np.linspace(0, 0.2, 11), np.linspace(0, 0.1, 6))
    made, parts = {}, []
    for k, z in enumerate(heights, start=1):
        points = np.column_stack([plan, np.full(len(plan), z)])
        made[f"s{k}"] = PressedSheet(f"s{k}", points, points, quads, np.full(len(quads), MAIN))
        parts.append(Part(k, f"s{k}", ShellSection(t, STEEL, STEEL)))
    return of_sheets(made, tuple(parts))[0]


def opening_modes(assembly):
    """Mode 0: all above 1 mm rises by 1; mode 1: everything rises by 1, nothing opens."""
    motion = np.zeros((len(assembly.points), 3, 2))
    motion[assembly.points[:, 2] > 1e-3, 2, 0] = 1.0
    motion[:, 2, 1] = 1.0
    return motion


def test_the_force_is_that_of_the_resonance():
    """F = c 2ζω² / |φψ|: 2 mm between sheets of 1 mm whose mid-surfaces are 3 mm apart."""
    assembly = sheets(0.0, 0.003)
    found = openings(assembly, opening_modes(assembly))
    np.testing.assert_allclose(found.clearance, 0.002, atol=1e-12)
    np.testing.assert_allclose(np.abs(found.motion), np.tile([1.0, 0.0], (66, 1)), atol=1e-12)
    phi = np.array([[0.5, 9.0], [2.0, 9.0], [0.0, 9.0]])
    rattle = first_rattle(FREQUENCY, DAMPING, phi, found)
    due = 0.002 * 2 * 0.01 * (2 * np.pi * 20) ** 2 / np.array([0.5, 2.0, 0.0][:2])
    np.testing.assert_allclose(rattle.force[:2], due)
    assert rattle.force[2] == np.inf
    np.testing.assert_array_equal(rattle.mode, [0, 0, -1])
    np.testing.assert_array_equal(rattle.place[2], -1)


def test_it_is_the_margin_of_the_core_at_one_newton():
    rng = np.random.default_rng(0)
    assembly = sheets(0.0, 0.003, 0.008)
    found = openings(assembly, rng.normal(size=(len(assembly.points), 3, 2)))
    phi = rng.normal(size=(30, 2))
    force = first_rattle(FREQUENCY, DAMPING, phi, found).force
    due = rattle_margin(FREQUENCY, DAMPING, phi, found.motion, found.clearance, 1.0)
    np.testing.assert_allclose(force, due)


@pytest.mark.parametrize("rounding", [0.0, 2e-16, 1e-9])
def test_sheets_that_lie_on_each_other_rattle_at_little(rounding):
    """Flat sheets leave no doubt: what is taken up is all there is, whatever a last digit says."""
    assembly = sheets(0.0, 0.001 + rounding)
    motion = opening_modes(assembly)
    motion[assembly.points[:, 2] > 5e-4, 2, 0] = 1.0
    found = openings(assembly, motion)
    assert rounding or found.touching == (("s1", "s2"),)
    np.testing.assert_allclose(found.clearance, TAKE_UP)
    phi = np.array([[1.0, 0.0], [0.1, 0.0], [0.0, 1.0]])
    force = first_rattle(FREQUENCY, DAMPING, phi, found).force
    np.testing.assert_allclose(force[:2], TAKE_UP * 0.02 * (2 * np.pi * 20) ** 2 / phi[:2, 0])
    assert force[2] == np.inf, "what moves together does not rattle"


def test_a_gap_in_doubt_is_half_of_the_doubt():
    """Facets of a curved sheet lie up to h² κ / 8 inside of it, and so does the gap."""
    assembly = sheets(0.0, 0.0011)
    x = assembly.points[:, 0]
    points = assembly.points + np.outer(0.5 * 1.0 * (x - 0.1) ** 2, [0, 0, 1.0])
    bent = replace(assembly, points=points)
    (g,) = all_gaps(bent, within=0.01)
    found = openings(bent, opening_modes(assembly))
    doubt = g.touching[g.free]
    assert doubt.any()
    low = np.maximum(g.clearance - g.uncertainty, 0)[g.free][doubt]
    high = (g.clearance + g.uncertainty)[g.free][doubt]
    np.testing.assert_array_equal(found.known, ~doubt)
    np.testing.assert_allclose(found.clearance[doubt], np.maximum((low + high) / 2, TAKE_UP))


@pytest.mark.parametrize("gap", [0.003, 0.006])
def test_a_wider_gap_takes_more_force(gap):
    assembly = sheets(0.0, gap)
    found = openings(assembly, opening_modes(assembly))
    force = first_rattle(FREQUENCY, DAMPING, np.ones((1, 2)), found).force
    assert force[0] == pytest.approx((gap - 1e-3) * 0.02 * (2 * np.pi * 20) ** 2)
