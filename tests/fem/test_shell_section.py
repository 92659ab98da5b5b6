"""Section values of shells and every derivative handed to calibration and diagnosis."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem import shell
from chladni.fem.shell_section import modulus_derivative, section_arrays
from chladni.model.properties import Anisotropic, Isotropic, Orthotropic, ShellSection, SolidSection
from chladni_specimens.plates import STEEL, folded_panel, sheet

PLY = Orthotropic(140e9, 9e9, 0.3, 5e9, 4e9, 3e9, 1600.0)
RNG = np.random.default_rng(7)


def panel(material=PLY):
    """A small warped panel with triangles, uneven thickness and a slanting material axis."""
    shape = folded_panel(0.3, 0.2, 0.03, 0.02, 0.05, 2e-2, material)
    nodes = shape.shells.nodes.copy()
    nodes[::3, 3] = nodes[::3, 2]
    shells = replace(
        shape.shells,
        nodes=nodes,
        thickness=2e-2 * np.random.default_rng(3).uniform(0.7, 1.3, nodes.shape),
        axis=np.tile([1.0, 0.7, 0.2], (len(nodes), 1)),
    )
    return replace(shape, shells=shells)


def of_all(assembly, **section):
    """The assembly with other section values of all parts."""
    return assembly.with_parts(tuple(p.with_section(**section) for p in assembly.parts))


def element_matrices(assembly):
    geo = shell.geometry(assembly.points, assembly.shells)
    sections = section_arrays(assembly, geo)
    return geo, sections, shell.stiffness(geo, assembly.shells.thickness, **sections.stiffness)


def orders(value, derivative, h=1e-2):
    """Order of |f(h) - f(0) - h f'|: of forces on forces, and of moments on turns (bending)."""

    def remainder(step):
        gap = (value(step) - f_0 - step * derivative).reshape(-1, 4, 6, 4, 6)
        return np.array([np.abs(gap[:, :, k, :, k]).max() for k in (slice(0, 3), slice(3, 6))])

    f_0 = value(0.0)
    return np.log2(remainder(h) / remainder(h / 2))


def test_thickness_derivative():
    assembly = panel()
    t = assembly.shells.thickness
    change = t * RNG.uniform(-1, 1, t.shape)
    geo, s, _ = element_matrices(assembly)
    dK = shell.thickness_derivative(
        geo, t, change, s.Qm, s.Qb, s.Qc,
        s.shear_by_thickness(geo, t, change), s.drill_by_thickness(geo, t, change),
    )  # fmt: skip

    def K(h):
        shells = replace(assembly.shells, thickness=t + h * change)
        return element_matrices(replace(assembly, shells=shells))[2]

    assert orders(K, dK) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("name", ["E1", "E2", "G12", "nu12"])
def test_modulus_derivative_of_orthotropic_elements(name):
    """Membrane (with its bubbles), bending and residual bending follow; uniform t, so exact."""
    assembly = panel()
    thick = np.full_like(assembly.shells.thickness, 2e-2)
    assembly = replace(assembly, shells=replace(assembly.shells, thickness=thick))
    geo, s, _ = element_matrices(assembly)
    scale = getattr(PLY, name)
    dQ = scale * modulus_derivative(PLY, name)
    dK = shell.stiffness(
        geo, thick, Qm=dQ, Qb=dQ, S=s.shear_by_bending(geo, dQ),
        drill=s.drill_by_membrane(dQ), reference=s.Qm,
    )  # fmt: skip

    def K(h):
        material = replace(PLY, **{name: scale * (1 + h)})
        return element_matrices(of_all(assembly, membrane=material, bending=material))[2]

    assert orders(K, dK) == pytest.approx(2.0, abs=0.05)


def test_transverse_modulus_derivative():
    assembly = panel()
    geo, s, _ = element_matrices(assembly)
    t = assembly.shells.thickness
    dK = shell.stiffness(geo, t, S=s.shear_by_modulus(1.0))

    def K(h):
        soft = replace(PLY, G1z=PLY.G1z * (1 + h), G2z=PLY.G2z * (1 + h))
        return element_matrices(of_all(assembly, shear=soft))[2]

    assert orders(K, dK) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("material", [STEEL, replace(STEEL, G=70e9)])
@pytest.mark.parametrize("name", ["E", "nu"])
def test_isotropic_modulus_derivatives(material, name):
    dQ = modulus_derivative(material, name)
    h = 1e-6 * getattr(material, name)
    step = [
        replace(material, **{name: getattr(material, name) + sign * h}).plane_stress()
        for sign in (1, -1)
    ]
    np.testing.assert_allclose((step[0] - step[1]) / (2 * h), dQ, rtol=1e-6, atol=1e-6 * dQ.max())


def test_orthotropic_moduli_of_an_isotropic_sheet():
    """E dQ/dE = E1 dQ/dE1 + E2 dQ/dE2 + G dQ/dG12: all moduli scaled together."""
    parts = sum(
        value * modulus_derivative(STEEL, name)
        for name, value in (("E1", STEEL.E), ("E2", STEEL.E), ("G12", STEEL.shear_modulus))
    )
    np.testing.assert_allclose(parts, STEEL.E * modulus_derivative(STEEL, "E"), rtol=1e-12)
    says("E1, E2", modulus_derivative, STEEL, "E3")


def test_stiffness_is_linear_in_every_part():
    """The operators of diagnosis: weighted sums of Q, S and drilling give weighted sums of K."""
    assembly = panel()
    geo, s, K = element_matrices(assembly)
    t, keep = assembly.shells.thickness, dict(reference=s.Qm)
    parts = [
        shell.stiffness(geo, t, Qm=s.Qm, **keep),
        shell.stiffness(geo, t, Qb=s.Qb, **keep),
        shell.stiffness(geo, t, S=s.S, **keep),
        shell.stiffness(geo, t, drill=s.drill, **keep),
    ]
    np.testing.assert_allclose(sum(parts), K, atol=1e-12 * np.abs(K).max())
    weight = RNG.uniform(0.5, 2, len(geo))[:, None, None]
    first, second = (
        s.Qm * [[1, 0, 0], [0, 0, 0], [0, 0, 1]],
        s.Qm * [[0, 1, 0], [1, 1, 0], [0, 0, 0]],
    )
    apart = shell.stiffness(geo, t, Qm=first, **keep) * weight
    apart += shell.stiffness(geo, t, Qm=second, **keep)
    whole = shell.stiffness(geo, t, Qm=weight * first + second, **keep)
    np.testing.assert_allclose(apart, whole, atol=1e-12 * np.abs(K).max())


def test_membrane_goes_with_t_and_bending_with_its_cube():
    assembly = panel(STEEL)
    geo, s, _ = element_matrices(assembly)
    t = assembly.shells.thickness
    for name, power in (("Qm", 1), ("Qb", 3)):
        Q = {name: getattr(s, name)}
        np.testing.assert_allclose(
            shell.stiffness(geo, 1.7 * t, **Q), 1.7**power * shell.stiffness(geo, t, **Q),
            rtol=1e-9, atol=1e-9,
        )  # fmt: skip


def test_isotropic_shear_and_residual_bending():
    """S⁻¹ = 6/5Gt + L²/12D for the mean of γ; without the option 5/6 G t."""
    points = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0], [0, 0.2, 0.0]])
    shape = sheet(points, np.array([[0, 1, 2, 3]]), 2e-3, STEEL)
    G, D = STEEL.shear_modulus, STEEL.E * 2e-3**3 / 12 / (1 - 0.09)
    plain = section_arrays(shape, residual_bending=False).S[0]
    np.testing.assert_allclose(plain, np.tile(5 / 6 * G * 2e-3 * np.eye(2), (2, 1, 1)))
    mean = section_arrays(shape).S[0, 0]
    due = 1 / (6 / (5 * G * 2e-3) + np.array([0.3, 0.2]) ** 2 / 12 / D)
    np.testing.assert_allclose(mean, np.diag(due))


def test_sections_without_bending_or_shear():
    """A membrane has no plate stiffness; MID3 blank has residual bending alone."""
    shape = panel(STEEL)
    s = section_arrays(of_all(shape, bending=None))
    assert not s.S.any()
    assert not s.Qb.any()
    stiff, soft = section_arrays(of_all(shape, rigid_shear=True)), section_arrays(shape)
    np.testing.assert_allclose(stiff.residual_flexibility, soft.residual_flexibility)
    assert (stiff.shear_flexibility / soft.shear_flexibility[0, 0, 0, 0]).max() < 0.01


def test_anisotropic_axes_turn():
    """A sheet given by its Q in axes turned by 90 degrees is the sheet with 1 and 2 exchanged."""
    Q = PLY.plane_stress()
    swapped = Q[np.ix_([1, 0, 2], [1, 0, 2])]
    np.testing.assert_allclose(shell.turned(Q, np.array([np.pi / 2]))[0], swapped, atol=1e-3)
    K = element_matrices(panel(Anisotropic(Q, np.diag([4e9, 3e9]))))[2]
    np.testing.assert_allclose(K, element_matrices(panel(PLY))[2])


def test_faults_are_named():
    shape = panel(STEEL)
    thin = replace(shape.shells, thickness=np.zeros_like(shape.shells.thickness))
    says("no thickness", section_arrays, replace(shape, shells=thin))
    solid = tuple(replace(p, section=SolidSection(STEEL)) for p in shape.parts)
    says("panel", section_arrays, shape.with_parts(solid))


def test_rho_and_nonstructural_mass_come_from_the_section():
    section = ShellSection(1e-3, None, Isotropic(1e9, 0.3, 900.0), nonstructural=2.5)
    shape = panel(STEEL)
    s = section_arrays(shape.with_parts(tuple(replace(p, section=section) for p in shape.parts)))
    assert (s.rho == 900.0).all()
    assert (s.nsm == 2.5).all()


def test_a_plate_without_membrane_is_a_plate():
    """MID1 blank: the stiffness is finite and that of bending and shear alone."""
    shape = panel(STEEL)
    _, s, K = element_matrices(of_all(shape, membrane=None))
    _, whole, _ = element_matrices(shape)
    geo = shell.geometry(shape.points, shape.shells)
    due = shell.stiffness(geo, shape.shells.thickness, Qb=whole.Qb, S=whole.S)
    assert not s.Qm.any()
    np.testing.assert_allclose(K, due)
