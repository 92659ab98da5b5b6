"""Curvature of known surfaces, at the right rate; candidates where a sensor fits."""

import numpy as np

from chladni.geometry.curvature import curvature
from chladni.model.properties import Isotropic
from chladni_specimens.mesher.flat_regions import grid

STEEL = Isotropic(210e9, 0.3, 7850.0)


def patch(n, surface):
    plan, quads = grid(np.linspace(-0.5, 0.5, n + 1), np.linspace(-0.4, 0.4, n + 1))
    points = np.column_stack([plan, surface(*plan.T)])
    inner = np.abs(plan).max(axis=1) < 0.3
    return points, quads, inner


def test_sphere():
    """κ₁ = κ₂ = 1/R, normals along the radius."""
    R = 2.0
    points, quads, inner = patch(40, lambda x, y: np.sqrt(R**2 - x**2 - y**2))
    found = curvature(points, quads)
    np.testing.assert_allclose(np.abs(found.first[inner]), 1 / R, rtol=0.01)
    np.testing.assert_allclose(np.abs(found.second[inner]), 1 / R, rtol=0.01)
    np.testing.assert_allclose(found.normal[inner], points[inner] / R, atol=1e-3)


def test_cylinder_and_saddle():
    """κ = (1/R, 0); opposite signs on a saddle; zero on a plane."""
    points, quads, inner = patch(40, lambda x, y: np.sqrt(1 - x**2) + 0 * y)
    found = curvature(points, quads)
    np.testing.assert_allclose(np.abs(found.first[inner]), 1, rtol=0.02)
    np.testing.assert_allclose(found.second[inner], 0, atol=0.02)
    points, quads, _ = patch(40, lambda x, y: 0.2 * (x**2 - y**2))
    found = curvature(points, quads)
    middle = np.linalg.norm(points[:, :2], axis=1) < 0.1
    np.testing.assert_allclose(found.first[middle] * found.second[middle], -0.16, rtol=0.05)
    points, quads, _ = patch(10, lambda x, y: 0.3 * x - 0.1 * y)
    assert np.abs(curvature(points, quads).total).max() < 1e-9


def test_convergence():
    """The error of κ falls at least as fast as the mesh size."""
    errors = []
    for n in (10, 20, 40):
        points, quads, inner = patch(n, lambda x, y: np.sqrt(1 - x**2) + 0 * y)
        errors.append(np.abs(curvature(points, quads).total[inner] - 1).max())
    assert errors[0] / errors[2] > 4


def test_turning_the_mesh_changes_nothing():
    points, quads, _ = patch(16, lambda x, y: 0.3 * x**2 + 0.1 * x * y)
    Q = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    a, b = curvature(points, quads), curvature(points @ Q.T, quads)
    np.testing.assert_allclose(a.first, b.first, atol=1e-9)
    np.testing.assert_allclose(a.normal @ Q.T, b.normal, atol=1e-9)
