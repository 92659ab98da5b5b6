"""Mass and strain energy against what geometry and the modes themselves say."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.elements import CUBE, bars

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import mass_over_all_motions, over_all_motions, structure
from chladni.fem.energy import (
    effective_masses,
    kinetic_energies,
    mass_properties,
    only,
    part_energies,
    rigid_motions,
    shell_energies,
)
from chladni.model.assembly import Assembly, Masses, Solids
from chladni.model.properties import BeamSection, Part, SolidSection
from chladni_specimens.plates import STEEL, folded_panel, plate


def test_mass_and_centre_of_a_plate():
    """m = ρ t A, c = the middle; supports take no mass away."""
    flat = plate(0.6, 0.4, 6, 5, 2e-3)
    held = replace(flat, supports=np.array([[0, k] for k in range(1, 7)]))
    for assembly in (flat, held):
        m, c = mass_properties(assembly)
        assert m == pytest.approx(STEEL.rho * 2e-3 * 0.24, rel=1e-12)
        np.testing.assert_allclose(c, [0.3, 0.2, 0], atol=1e-12)


def test_centre_moves_with_the_structure():
    panel, shift = folded_panel(), np.array([3.0, -2.0, 1.0])
    m, c = mass_properties(panel)
    moved = mass_properties(replace(panel, points=panel.points + shift))
    assert moved[0] == pytest.approx(m, rel=1e-12)
    np.testing.assert_allclose(moved[1], c + shift, atol=1e-9)


def test_shares_of_all_parts_add_up():
    """Σ_p φᵀ K_p φ = φᵀ K φ = ω², and Σ_e ½ φᵀ K_e φ = ½ ω²."""
    s = structure(folded_panel())
    modal = normal_modes(s.system, 12)
    elastic = modal.sel(np.arange(6, 12))
    share = part_energies(s, elastic.shapes)
    np.testing.assert_allclose(share.sum(axis=0), 1, rtol=1e-9)
    assert share.min() > 0
    energy = shell_energies(s, elastic.shapes)
    omega = 2 * np.pi * elastic.frequency
    np.testing.assert_allclose(energy.sum(axis=0), omega**2 / 2, rtol=1e-6)
    u = s.T @ elastic.shapes
    flanges = np.einsum("nr,nr->r", u, over_all_motions(only(s.assembly, 1))[2] @ u)
    np.testing.assert_allclose(flanges / omega**2, share[1], rtol=1e-6)


@pytest.mark.parametrize("coupled", [False, True])
def test_the_mass_alone_is_that_of_all_matrices(coupled):
    lossy = replace(STEEL, damping=0.1)
    for made in (replace(folded_panel(), coupled_mass=coupled), plate(0.4, 0.3, 3, 2, 1e-3, lossy),
                 block_with_a_mast()):  # fmt: skip
        difference = mass_over_all_motions(made) - over_all_motions(made)[0]
        assert abs(difference).max() == 0


def block_with_a_mast():
    """Two bricks on top of each other, clamped below, and a mast of two beams on a corner."""
    points = np.vstack([CUBE, CUBE[4:] + np.array([0, 0, 1]), [[1, 1, 3.0], [1, 1, 4.0]]])
    solids = Solids(np.array([1, 2]), np.array([range(8), range(4, 12)]), np.array([0, 1]))
    block = SolidSection(STEEL)
    mast = Part(3, "mast", BeamSection(STEEL, 1e-3, 1e-6, 2e-6, 0, 3e-6))
    held = [(n, c) for n in range(4) for c in (1, 2, 3)] + [(10, c) for c in (4, 5, 6)]
    masses = Masses(np.array([9]), np.array([13]), 5 * np.diag([1.0, 1, 1, 0, 0, 0])[None])
    return Assembly(
        np.arange(1, 15), points, (Part(1, "low", block), Part(2, "high", block), mast),
        solids=(solids,), beams=bars([[10, 12], [12, 13]], 2, (1, 0, 0)), masses=masses,
        supports=np.array(held),
    )  # fmt: skip


def test_bricks_and_beams_hold_all_the_energy():
    """Σ_p φᵀ K_p φ = φᵀ K φ: nothing of the strain energy is lost between the families."""
    built = structure(block_with_a_mast())
    share = part_energies(built, normal_modes(built.system, 6).shapes)
    np.testing.assert_allclose(share.sum(axis=0), 1, rtol=1e-8)
    assert (share > 0).all()
    assert share[0, 0] > share[1, 0]  # the first mode bends the block at its foot


def test_effective_masses_add_up_to_what_moves():
    """Σ_r (φᵀMR)² = Rᵀ M R of what no support holds; a point mass is in no part."""
    built = structure(block_with_a_mast())
    every = normal_modes(built.system, len(built.system.dofs)).shapes
    about = np.array([0.3, -0.2, 1.0])
    found = effective_masses(built, every, about)
    R = rigid_motions(replace(built.assembly, points=built.assembly.points - about))
    M = over_all_motions(built.assembly)[0]
    loads = built.T.T @ (M @ R)
    inner = loads.T @ np.linalg.pinv(built.system.M.toarray(), hermitian=True) @ loads
    np.testing.assert_allclose(found.sum(axis=1), np.diag(inner), rtol=1e-8)
    share = kinetic_energies(built, every[:, :4])
    assert ((share.sum(axis=0) > 0) & (share.sum(axis=0) < 1)).all()


def test_a_free_structure_moves_as_a_whole():
    """Rigid modes alone carry all of the mass, and the inertia about the centre."""
    free = folded_panel()
    built = structure(free)
    m, c = mass_properties(free)
    modal = normal_modes(built.system, 12)
    found = effective_masses(built, modal.shapes, c)
    np.testing.assert_allclose(found[:3, :6].sum(axis=1), m, rtol=1e-6)
    assert found[:, 6:].max() < 1e-6 * m
