"""Mass and strain energy against what geometry and the modes themselves say."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties, part_energies, rigid_motions, shell_energies
from chladni_specimens.plates import STEEL, box, folded_panel, plate


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


def test_rigid_motions_cost_no_energy():
    s = structure(box())
    R = rigid_motions(s.assembly)
    assert np.abs(s.T.T @ R).max() > 0
    energy = np.einsum("nr,nr->r", s.T.T @ R, s.system.K @ (s.T.T @ R))
    assert energy.max() < 1e-9 * s.system.K.diagonal().max()


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
    of_flanges = energy[s.assembly.shells.part == 1].sum(axis=0) / energy.sum(axis=0)
    np.testing.assert_allclose(of_flanges, share[1], rtol=1e-6)
