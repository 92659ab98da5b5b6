"""Curvature of known surfaces, at the right rate; candidates where a sensor fits."""

import numpy as np
import pytest

from chladni.meshing.curvature import blocked, candidates, curvature
from chladni.model.mesher import grid
from chladni.model.mesher_sheets import MAIN, Sheet
from chladni.model.plates import plate
from chladni.model.properties import Isotropic, Part, ShellSection
from chladni.model.tailgate import of_sheets

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


def stacked(gap):
    """Two plates; the upper covers half of the lower."""
    made, parts = {}, []
    for k, (x1, z) in enumerate(((0.6, 0.0), (0.3, gap))):
        plan, quads = grid(np.linspace(0, x1, round(x1 / 0.02) + 1), np.linspace(0, 0.4, 21))
        points = np.column_stack([plan, np.full(len(plan), z)])
        made[f"s{k}"] = Sheet(f"s{k}", points, points, quads, np.full(len(quads), MAIN))
        parts.append(Part(k + 1, f"s{k}", ShellSection(1e-3, STEEL, STEEL)))
    return of_sheets(made, tuple(parts))[0]


def test_candidates_are_flat_reachable_and_apart():
    """Between two sheets no sensor fits: there the free side is the other one."""
    assembly = stacked(0.03)
    found = candidates(assembly, spacing=0.05)
    assert set(found.part) == {"s0", "s1"}
    lower = np.array(found.part) == "s0"
    covered = lower & (found.points[:, 0] < 0.28)
    assert covered.any()
    assert np.all(found.normal[covered, 2] < 0)
    assert np.all(found.normal[~lower, 2] > 0)
    for side in (lower, ~lower):
        x = found.points[side]
        away = np.linalg.norm(x[:, None] - x[None], axis=2) + np.eye(len(x))
        assert away.min() >= 0.05 - 1e-12
    edge = np.minimum(found.points[:, 1], 0.4 - found.points[:, 1])
    assert edge.min() >= 0.012
    assert len(candidates(assembly, spacing=0.05, parts=("s1",)).ids) == (~lower).sum()


def test_a_box_has_no_inside():
    """All directions from the middle of a closed box are blocked; outward ones are not."""
    from chladni.model.plates import box

    walls = box()
    middle = (walls.points.min(axis=0) + walls.points.max(axis=0)) / 2
    rng = np.random.default_rng(2)
    d = rng.normal(size=(30, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    start = np.tile(middle, (30, 1))
    assert blocked(walls, start, d, 10.0).all()
    assert not blocked(walls, start + 20 * d, d, 10.0).any()
    assert not blocked(
        plate(1.0, 1.0, 4, 4, 1e-3), start[:1] * 0 + 0.5, np.array([[0, 0, 1.0]]), 0.3
    ).any()


@pytest.mark.parametrize("flat", [0.5, 5.0])
def test_folds_are_no_place_for_a_sensor(flat):
    """A roof of two planes: no candidate on the ridge."""
    plan, quads = grid(np.linspace(-0.3, 0.3, 31), np.linspace(0, 0.4, 21))
    points = np.column_stack([plan, -np.abs(plan[:, 0])])
    sheet = Sheet("roof", points, points, quads, np.full(len(quads), MAIN))
    part = Part(1, "roof", ShellSection(1e-3, STEEL, STEEL))
    found = candidates(of_sheets({"roof": sheet}, (part,))[0], flat=flat)
    assert len(found.ids) > 20
    assert np.abs(found.points[:, 0]).min() > 0.015
