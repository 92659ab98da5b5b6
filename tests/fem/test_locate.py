"""Places on the sheet carry linear fields."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.fem.assemble import structure
from chladni.fem.locate import rows_at
from chladni.geometry.nearest import ShellSurface
from chladni_specimens.plates import plate

PLATE = plate(0.4, 0.3, 8, 6, 1.5e-3)


@pytest.fixture(scope="module")
def built():
    return structure(PLATE)


def test_rows_carry_any_rigid_motion(built):
    """u = a + ω × x is linear in x, so the rows must give it exactly."""
    rng = np.random.default_rng(2)
    where = np.column_stack([rng.uniform(0, [0.4, 0.3], (20, 2)), np.zeros(20)])
    directions = rng.normal(size=(20, 3))
    rows = rows_at(built, ShellSurface.whole(PLATE).closest_points(where), directions)
    a, omega = rng.normal(size=(2, 3))
    motion = np.hstack([a + np.cross(omega, PLATE.points), np.tile(omega, (63, 1))]).ravel()
    q = built.T.T @ motion  # T is a selection of dofs here
    expected = np.einsum("ki,ki->k", directions, a + np.cross(omega, where))
    assert_allclose(built.T @ q, motion, atol=1e-12)
    assert_allclose(rows @ q, expected, atol=1e-9)
