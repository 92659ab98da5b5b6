"""Kratos against closed forms and our elements; what its articles hide; cases of the set."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Assembly
from chladni.model.ground_springs import with_ground_bushes
from chladni.model.properties import BeamSection, Part
from chladni_evidence.hidden import with_lumps
from chladni_evidence.kratos import Stretched, installed, kratos_modes
from chladni_evidence.kratos_structures import STEEL, half_cylinder
from chladni_specimens import plate

kratos = pytest.mark.skipif(not installed(), reason="no Python with KratosMultiphysics")
FREE_SQUARE = (13.468, 19.596, 24.271, 34.801, 34.801, 61.093)  # Leissa 1973, J. Sound Vib. 31, 257
T = 2e-3


def frequencies(a: Assembly, top: float, triangles: bool = False) -> np.ndarray:
    """Elastic frequencies by Kratos [Hz]."""
    f = kratos_modes(a, np.arange(3), np.array([len(a.points) // 2]), top, triangles)[0]
    return f[f > 0]


@pytest.fixture(scope="module")
def square() -> Assembly:
    return plate(0.5, 0.5, 20, 20, T)


@kratos
@pytest.mark.parametrize("triangles", [False, True], ids=["quadrilaterals", "triangles"])
def test_free_square_plate(square, triangles):
    """Leissa's λ = ω a² √(ρ t / D), and our elements, within 1 %."""
    f = frequencies(square, 150.0, triangles)[:6]
    D = STEEL.E * T**3 / 12 / (1 - STEEL.nu**2)
    factor = 2 * np.pi * 0.25 * np.sqrt(STEEL.rho * T / D)
    np.testing.assert_allclose(f * factor, FREE_SQUARE, rtol=0.01)
    ours = normal_modes(structure(square).system, 12).frequency[6:]
    np.testing.assert_allclose(f, ours, rtol=0.01)


@kratos
@pytest.mark.parametrize("strain", [-1e-5, 5e-5])
def test_stretched_plate(strain):
    """ω² = (D k⁴ + N k²)/(ρ t) of a simply supported plate under an even force."""
    square = plate(0.5, 0.5, 30, 30, T)
    x, y = square.points[:, :2].T
    edge = np.flatnonzero((np.abs(x - 0.25) > 0.2499) | (np.abs(y - 0.25) > 0.2499))
    held = replace(square, supports=np.array([(r, c) for r in edge for c in (1, 2, 3)]))
    state = Stretched(**vars(held), moved=strain * square.points)
    D = STEEL.E * T**3 / 12 / (1 - STEEL.nu**2)
    k2 = np.sort([(m**2 + n**2) * (np.pi / 0.5) ** 2 for m in (1, 2, 3) for n in (1, 2, 3)])[:5]
    N = STEEL.E * T / (1 - STEEL.nu) * strain
    due = np.sqrt((D * k2**2 + N * k2) / (STEEL.rho * T)) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(state, 250.0)[:5], due, rtol=0.01)


@kratos
def test_half_cylinder_is_ours_on_a_fine_mesh():
    a = half_cylinder({"length": 0.4, "radius": 0.15, "t": 1.5e-3}, 0.016)
    ours = normal_modes(structure(a).system, 14).frequency[6:]
    np.testing.assert_allclose(frequencies(a, 1.1 * ours[-1])[:8], ours, rtol=0.01)


@kratos
def test_springs_and_masses_at_points(square):
    """A rigid plate on four soft springs with a lump: f = √(4 k / m) / 2π across; m exact."""
    corners = np.flatnonzero(np.abs(square.points[:, :2] - 0.25).min(axis=1) > 0.2499)
    heavy = with_lumps(square, corners, 5.0)
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    f = frequencies(with_ground_bushes(heavy, corners, up, 100.0), 30.0)
    m = mass_properties(heavy)[0]
    assert np.abs(f - np.sqrt(4 * 100.0 / m) / (2 * np.pi)).min() < 1e-3 * f[0]


@kratos
def test_beams():
    """A round cantilever: λ = 1.8751 in both planes, and λ for torsion by our own bars."""
    x = np.linspace(0, 0.5, 21)
    rows = np.column_stack([np.arange(20), np.arange(1, 21)])
    R = 5e-3
    I = np.pi * R**4 / 4
    section = BeamSection(STEEL, np.pi * R**2, I, I, 0.0, 2 * I)
    empty = plate(1.0, 1.0, 1, 1, T)
    a = Assembly(
        np.arange(1, 22), np.column_stack([x, 0 * x, 0 * x]), (Part(1, "rod", section),),
        beams=type(empty.beams)(
            np.arange(1, 21), rows, np.zeros(20, int), np.tile([0, 0, 1.0], (20, 1)),
            np.zeros((20, 2, 3)), np.zeros((20, 2, 6), bool),
        ),
        supports=np.array([(0, c) for c in range(1, 7)]),
    )  # fmt: skip
    due = 1.8751**2 / 0.25 * np.sqrt(STEEL.E * I / (STEEL.rho * np.pi * R**2)) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(a, 5 * due)[:2], due, rtol=0.005)
