from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import beam_energies, part_energies, part_kinetic_energies, solid_energies
from chladni.model.assembly import Assembly, Beams, Masses, Solids
from chladni.model.properties import BeamSection, Isotropic, Part, SolidSection

STEEL = Isotropic(210e9, 0.3, 7850.0)
CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)


def block_with_a_mast():
    """Two bricks on top of each other, clamped below, and a mast of two beams on a corner."""
    points = np.vstack([CUBE, CUBE[4:] + np.array([0, 0, 1]), [[1, 1, 3.0], [1, 1, 4.0]]])
    solids = Solids(np.array([1, 2]), np.array([range(8), range(4, 12)]), np.array([0, 1]))
    beams = Beams(
        np.array([3, 4]), np.array([[10, 12], [12, 13]]), np.array([2, 2]),
        np.tile([1.0, 0, 0], (2, 1)), np.zeros((2, 2, 3)), np.zeros((2, 2, 6), bool),
    )  # fmt: skip
    mast = BeamSection(STEEL, 1e-3, 1e-6, 2e-6, 0, 3e-6)
    parts = (
        Part(1, "low", SolidSection(STEEL)),
        Part(2, "high", SolidSection(STEEL)),
        Part(3, "mast", mast),
    )
    held = [(n, c) for n in range(4) for c in (1, 2, 3)] + [(10, c) for c in (4, 5, 6)]
    masses = Masses(np.array([9]), np.array([13]), 5 * np.diag([1.0, 1, 1, 0, 0, 0])[None])
    return Assembly(
        np.arange(1, 15), points, parts, solids=(solids,), beams=beams, masses=masses,
        supports=np.array(held),
    )  # fmt: skip


def modes():
    built = structure(block_with_a_mast())
    return built, normal_modes(built.system, 6)


def test_elements_add_up_to_the_eigenvalue():
    """Σ_e ½ uᵀ K_e u = ½ ω²: nothing of the strain energy is lost between the families."""
    built, modal = modes()
    total = beam_energies(built, modal.shapes).sum(axis=0)
    total = total + sum(e.sum(axis=0) for e in solid_energies(built, modal.shapes))
    assert_allclose(total, (2 * np.pi * modal.frequency) ** 2 / 2, rtol=1e-8)


def test_parts_equal_their_elements():
    built, modal = modes()
    share = part_energies(built, modal.shapes)
    whole = (2 * np.pi * modal.frequency) ** 2 / 2
    bricks = solid_energies(built, modal.shapes)[0]
    assert_allclose(share[:2], bricks / whole, rtol=1e-8, atol=1e-12)
    assert_allclose(share[2], beam_energies(built, modal.shapes).sum(axis=0) / whole, rtol=1e-8)


def test_kinetic_energy_is_shared_by_parts_and_point_masses():
    """Shares and the point mass's ½ m v² add up to one; a light mast leads the first mode."""
    built, modal = modes()
    share = part_kinetic_energies(built, modal.shapes)
    u = (built.T @ modal.shapes).reshape(-1, 6, 6)
    point = 5 * np.sum(u[13, :3] ** 2, axis=0)
    assert_allclose(share.sum(axis=0) + point, 1, rtol=1e-9)
    assert point[0] + share[2, 0] > 0.9


def test_scaling_a_part_scales_its_energy():
    """Strain energy of a fixed motion is proportional to the part's modulus."""
    built, modal = modes()
    a = built.assembly
    softer = replace(STEEL, E=STEEL.E / 2)
    parts = (a.parts[0].with_section(material=softer), *a.parts[1:])
    half = solid_energies(structure(a.with_parts(parts)), modal.shapes)[0]
    full = solid_energies(built, modal.shapes)[0]
    assert_allclose(half[0], full[0] / 2, rtol=1e-9)
    assert_allclose(half[1], full[1], rtol=1e-9)
