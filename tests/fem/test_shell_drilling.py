"""Two ways to hold the rotation about the normal, and what each must leave free."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.fem.test_shell import FLAT, SHAPES, one, rigid, rotation

from chladni.fem import shell
from chladni.fem.shell_drilling import corner_twist
from chladni.fem.shell_section import section_arrays
from chladni_specimens.plates import plate


@SHAPES
@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_rigid_motions_twist_no_corner(points, triangle, offset):
    points = points @ rotation().T
    geo, _ = one(points, 0.1, offset, triangle)
    assert_allclose(corner_twist(geo)[0] @ rigid(points, geo.nodes[0]), 0, atol=1e-14)


@pytest.mark.parametrize("triangle", [False, True])
def test_rz_of_the_spin_twists_no_corner(triangle):
    """Any constant strain of a flat element, with rz = ½ (v,x - u,y) at its corners."""
    geo, _ = one(FLAT, triangle=triangle)
    grad = np.array([[2.0, 0.7], [-0.3, -1.0]])  # rows: u,x u,y; v,x v,y
    u = np.zeros((4, 6))
    u[:, :2] = FLAT[:, :2] @ grad.T
    u[:, 5] = (grad[1, 0] - grad[0, 1]) / 2
    assert_allclose(corner_twist(geo)[0] @ u.ravel(), 0, atol=1e-14)


@pytest.mark.parametrize(("triangle", "size"), [(False, 4.0), (True, 3.0)])
def test_energy_of_turned_corners(triangle, size):
    """All rz = 1, nothing else: Σ |J| = 4 A of any quadrilateral, 6 A of a triangle."""
    geo, t = one(FLAT, triangle=triangle)
    s = np.array([[0.0, 5.0]])
    u = np.zeros((4, 6))
    u[: int(size), 5] = 1
    K = shell.stiffness(geo, t, drill=s)[0]
    J = geo.area[0] * (2 if triangle else 1)
    assert u.ravel() @ K @ u.ravel() == pytest.approx(5.0 * size * J, rel=1e-12)


def test_k6rot_of_a_section():
    """S = 1e-6 K6ROT G t at the corners; without it a tenth of G t over the field."""
    made = plate(0.2, 0.1, 2, 2, 1e-3)
    Gt = made.parts[0].section.membrane.shear_modulus * 1e-3
    for k6rot, due in ((None, (0.1, 0.0)), (0.0, (0.0, 0.0)), (100.0, (0.0, 1e-4))):
        found = section_arrays(replace(made, k6rot=k6rot)).drill
        assert_allclose(found, np.tile(due, (len(made.shells), 1)) * Gt, rtol=1e-12)
