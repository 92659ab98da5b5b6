"""Places on the sheet are found, with weights that reproduce linear fields."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from chladni.fem.assemble import structure
from chladni.fem.locate import locate, rows_at
from chladni_specimens.plates import plate

ROTATION = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
PLATE = plate(0.4, 0.3, 8, 6, 1.5e-3)


@pytest.fixture(scope="module")
def built():
    return structure(PLATE)


@settings(max_examples=50)
@given(st.floats(0, 0.4), st.floats(0, 0.3), st.floats(-0.01, 0.01))
@example(0.0, 5.960464477539063e-08, 0.0078125)
def test_weights_reproduce_the_foot_of_the_perpendicular(x, y, z):
    """In a tilted plate, so that no axis is special.

    Distances within 1e-12 m are a tie, which leaves the foot open by sqrt(2 |z| 1e-12).
    """
    points = PLATE.points @ ROTATION.T
    where = np.array([[x, y, z]]) @ ROTATION.T
    found = locate(points, PLATE.shells.nodes, where)
    assert_allclose(found.weights.sum(axis=1), 1)
    assert found.weights.min() >= 0
    foot = np.einsum("kc,kci->ki", found.weights, points[found.nodes])
    open_by = np.sqrt(2e-12 * abs(z)) + 1e-9
    assert_allclose(foot, np.array([[x, y, 0]]) @ ROTATION.T, atol=open_by)
    assert_allclose(found.distance, abs(z), atol=1e-9)
    assert_allclose(np.abs(found.normal @ ROTATION[:, 2]), 1)
    assert np.isin(found.nodes, PLATE.shells.nodes[found.shell]).all()


def test_middle_of_a_shell_is_in_that_shell():
    middle = PLATE.points[PLATE.shells.nodes].mean(axis=1) + np.array([1e-3, 2e-3, 0])
    found = locate(PLATE.points, PLATE.shells.nodes, middle)
    assert found.shell.tolist() == list(range(len(PLATE.shells)))


def test_corner_has_all_the_weight():
    found = locate(PLATE.points, PLATE.shells.nodes, PLATE.points)
    at = found.weights.argmax(axis=1)
    assert_allclose(found.weights.max(axis=1), 1)
    assert found.nodes[np.arange(len(at)), at].tolist() == list(range(len(PLATE.points)))


def test_beside_the_plate_the_distance_is_to_the_edge():
    found = locate(PLATE.points, PLATE.shells.nodes, np.array([[0.21, -0.02, 0.0]]))
    assert_allclose(found.distance, 0.02)


def test_rows_carry_any_rigid_motion(built):
    """u = a + ω × x is linear in x, so the rows must give it exactly."""
    rng = np.random.default_rng(2)
    where = np.column_stack([rng.uniform(0, [0.4, 0.3], (20, 2)), np.zeros(20)])
    directions = rng.normal(size=(20, 3))
    rows = rows_at(built, locate(PLATE.points, PLATE.shells.nodes, where), directions)
    a, omega = rng.normal(size=(2, 3))
    motion = np.hstack([a + np.cross(omega, PLATE.points), np.tile(omega, (63, 1))]).ravel()
    q = built.T.T @ motion  # T is a selection of dofs here
    expected = np.einsum("ki,ki->k", directions, a + np.cross(omega, where))
    assert_allclose(built.T @ q, motion, atol=1e-12)
    assert_allclose(rows @ q, expected, atol=1e-9)
