"""Assembly: sums, frames, supports, rigid motion, units; and the generated specimens."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from tests.builders.elements import bush
from tests.builders.refusals import says

from chladni.dynamics.eigen import normal_modes
from chladni.fem import shell
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties, rigid_motions
from chladni.fem.shell_section import section_arrays
from chladni.fem.sparse_assembly import blocks, congruence
from chladni.model.assembly import Masses
from chladni_specimens.plates import STEEL, box, folded_panel, plate

RNG = np.random.default_rng(11)


def turned_axes(n):
    axes, _ = np.linalg.qr(RNG.normal(size=(n, 3, 3)))
    return axes * np.sign(np.linalg.det(axes))[:, None, None]


SPECIMENS = pytest.mark.parametrize("make", [folded_panel, box], ids=["panel", "box"])


@SPECIMENS
def test_only_six_modes_are_rigid(make):
    """K R = 0 for the rigid motions of space, and no other motion is free (warped shells too)."""
    shape = make()
    s = structure(shape)
    f = normal_modes(s.system, 8).frequency
    assert (f[:6] < 1e-3).all()
    assert f[6] > 10
    K = s.system.K
    assert np.abs(K @ rigid_motions(shape)).max() < 1e-9 * np.abs(K.data).max()


@SPECIMENS
@pytest.mark.parametrize("lumped", [False, True])
def test_mass_of_rigid_motion(make, lumped):
    """Rᵀ M R holds the mass, its first moment and (consistent) nothing but physical inertia."""
    shape = replace(make(), coupled_mass=not lumped)
    s = structure(replace(shape, auto_spc=False))
    R = rigid_motions(shape)
    q = s.T.T @ R
    inertia = q.T @ (s.system.M @ q)
    area = shell.geometry(shape.points, shape.shells).area.sum()
    assert inertia[0, 0] == pytest.approx(7850 * 1e-3 * area, rel=1e-12)
    mass, centre = mass_properties(shape)
    assert mass == pytest.approx(inertia[0, 0], rel=1e-12)
    np.testing.assert_allclose(centre[0], inertia[2, 4] / -inertia[0, 0], rtol=1e-9)


def test_inertia_of_a_rectangle():
    """m (a² + b²)/12 about the normal and m (b² + t²)/12 about x, with mid-surface offset d."""
    a, b, t, d = 0.4, 0.3, 0.02, 0.05
    shape = plate(a, b, 4, 3, t)
    shells = replace(shape.shells, offset=np.full(12, d))
    shape = replace(shape, points=shape.points - [a / 2, b / 2, 0], shells=shells)
    R, M = rigid_motions(shape), structure(shape).system.M
    m = 7850 * a * b * t
    G = R.T @ (M @ R)
    assert G[5, 5] == pytest.approx(m * (a**2 + b**2) / 12)
    assert G[3, 3] == pytest.approx(m * ((b**2 + t**2) / 12 + d**2))
    assert G[0, 4] == pytest.approx(m * d)
    mass, centre = mass_properties(shape)
    np.testing.assert_allclose(centre, [0, 0, d], atol=1e-15)
    assert mass == pytest.approx(m)


def test_sum_of_elements():
    """The sparse sum equals the dense one, whatever the pieces' order."""
    m, n = 300, 60
    nodes = np.array([RNG.choice(n, 4, replace=False) for _ in range(m)])
    nodes[::7, 3] = nodes[::7, 2]  # triangles repeat a node
    A = RNG.normal(size=(m, 24, 24))
    dense = np.zeros((6 * n, 6 * n))
    at = (6 * nodes[:, :, None] + np.arange(6)).reshape(m, 24)
    np.add.at(dense, (at[:, :, None], at[:, None, :]), A)
    np.testing.assert_allclose(blocks(A, nodes, n).toarray(), dense, atol=1e-12)


def test_congruence_is_the_triple_product():
    """Picked rows, scaled rows, mixed rows, empty rows and shared columns."""
    n = 40
    A = sp.random_array((n, n), density=0.3, rng=RNG)
    A = sp.csr_array(A + A.T)
    T = np.zeros((n, 25))
    T[np.arange(20), RNG.permutation(20)] = 1
    T[20] = RNG.normal(size=25)
    T[21, 3], T[22, 24], T[23, [2, 7]] = 1, -2.5, 0.5
    T[24:30, 20:] = RNG.normal(size=(6, 5))
    expected = T.T @ A.toarray() @ T
    np.testing.assert_allclose(congruence(sp.csr_array(T), A).toarray(), expected, atol=1e-12)
    P = np.eye(n)[RNG.permutation(n)]  # every row selects a dof, in another order
    expected = P.T @ A.toarray() @ P
    np.testing.assert_allclose(congruence(sp.csr_array(P), A).toarray(), expected, atol=1e-12)


def test_displacement_frames_change_no_frequency():
    """Frames of the points turn rows and columns; rows() and along() give the same motions."""
    shape = folded_panel(h=0.05)
    axes = turned_axes(len(shape.points))
    plain, turned = structure(shape), structure(replace(shape, axes=axes))
    f, g = (normal_modes(s.system, 12).frequency for s in (plain, turned))
    np.testing.assert_allclose(g[6:], f[6:], rtol=1e-8)
    q = turned.T.T @ rigid_motions(shape)  # the frames' components of a rigid motion
    ids = shape.ids[[3, 8]]
    along = turned.along(ids, axes[[3, 8], 1]) @ q
    np.testing.assert_allclose((turned.rows(np.column_stack([ids, [2, 2]])) @ q), along, atol=1e-12)
    same = plain.along(ids, axes[[3, 8], 1]) @ rigid_motions(shape)
    np.testing.assert_allclose(same, along, atol=1e-12)


def test_supports_and_labels():
    shape = plate(0.4, 0.3, 4, 3, 1e-3)
    held = replace(shape, supports=np.array([[0, 1], [0, 2], [7, 3]]))
    s = structure(held)
    assert len(s.system.dofs) == 6 * 20 - 3
    assert [1, 1] not in s.system.dofs.tolist()
    assert [8, 3] not in s.system.dofs.tolist()
    assert s.rows(np.array([[8, 3]])).nnz == 0  # held: no motion
    says("no component 7", s.rows, np.array([[8, 7]]))
    everything = np.array([[k, c] for k in range(20) for c in range(1, 7)])
    says("supports", structure, replace(shape, supports=everything))


def test_points_without_stiffness_are_left_out():
    """A free grid, and the rotations of a membrane without drilling, do not make K singular."""
    shape = plate(0.4, 0.3, 4, 3, 1e-3)
    unattached = replace(
        shape, ids=np.append(shape.ids, 99), points=np.vstack([shape.points, [1.0, 1, 1]]),
        masses=Masses(np.array([1]), np.array([20]), np.eye(6)[None]),
    )  # fmt: skip
    assert 99 not in structure(unattached).system.dofs[:, 0]
    assert 99 in structure(replace(unattached, auto_spc=False)).system.dofs[:, 0]
    sheet = tuple(p.with_section(bending=None) for p in shape.parts)
    assert set(structure(shape.with_parts(sheet)).system.dofs[:, 1]) == {1, 2, 6}


@pytest.mark.parametrize("slanting", [False, True])
def test_a_point_sprung_in_two_directions_loses_one_dof(slanting):
    """Whatever the frame: the dof nearest to the free direction goes, the others stay."""
    shape = plate(0.4, 0.3, 4, 3, 1e-3)
    joint = bush((20, 0), np.zeros(3), [1e3, 2e3, 0, 0, 0, 0])
    axes = np.tile(np.eye(3), (21, 1, 1))
    if slanting:
        axes[20] = turned_axes(1)[0]
    joined = replace(
        shape, ids=np.append(shape.ids, 99), points=np.vstack([shape.points, [0.0, 0, 0]]),
        bushes=joint, axes=axes,
    )  # fmt: skip
    dofs = structure(joined).system.dofs
    kept = set(dofs[dofs[:, 0] == 99, 1])
    assert kept == {1, 2, 3} - {1 + int(np.argmax(np.abs(axes[20, :, 2])))}


def test_scatter_gives_back_the_stiffness():
    """Tᵀ Σ K_e T of the shells is the K of a structure of shells."""
    shape = folded_panel(h=0.05)
    shape = replace(shape, axes=turned_axes(len(shape.points)), supports=np.array([[0, 3], [5, 1]]))
    s = structure(shape)
    geo = shell.geometry(shape.points, shape.shells)
    K = shell.stiffness(geo, shape.shells.thickness, **section_arrays(shape, geo).stiffness)
    due = s.system.K.toarray()
    found = s.scatter(K, geo.nodes).toarray()
    np.testing.assert_allclose(found, due, atol=1e-12 * np.abs(due).max())


def test_material_damping_is_the_imaginary_part():
    """One loss factor for all: K_loss = eta K; PARAM,G adds its own."""
    material = replace(STEEL, damping=0.03)
    shape = replace(folded_panel(h=0.06, material=material), structural_damping=0.01)
    s = structure(shape)
    K, Z = s.system.K.toarray(), s.hysteretic().K.toarray()
    small = 1e-12 * K.max()
    np.testing.assert_allclose(s.loss.toarray(), 0.03 * K, atol=small)
    np.testing.assert_allclose(Z, (1 + 0.04j) * K, atol=small)
    assert structure(folded_panel(h=0.06)).loss.nnz == 0


def test_hole_removes_elements_and_points():
    shape = plate(1.0, 1.0, 20, 20, 1e-3, hole=0.25)
    assert np.hypot(*(shape.points[:, :2] - 0.5).T).min() > 0.2
    area = shell.geometry(shape.points, shape.shells).area.sum()
    assert area == pytest.approx(1 - np.pi * 0.25**2, rel=0.03)
