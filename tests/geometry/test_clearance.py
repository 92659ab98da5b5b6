"""Clearance of sheets whose distance is known, and their opening in given shapes."""

import numpy as np
import pytest
from tests.geometry.test_thickness_mapping import assembled

from chladni.geometry.clearance import all_gaps, gaps, summary
from chladni_specimens.joints.builders import spot_welds
from chladni_specimens.mesher.flat_regions import grid
from chladni_specimens.plates import folded_panel


def two(surface_a, surface_b, h=0.01, t=1e-3):
    plan, quads = grid(np.linspace(0, 0.2, round(0.2 / h) + 1), np.linspace(0, 0.1, round(0.1 / h)))
    surfaces = (np.column_stack([plan, f(*plan.T)]) for f in (surface_a, surface_b))
    return assembled(*((points, quads) for points in surfaces), gauge=t)


def clearances(assembly, within=0.010):
    """What there is to say about every pair of parts."""
    return [summary(assembly, g) for g in all_gaps(assembly, within=within)]


def flat(z):
    return lambda x, y: 0 * x + z


def test_plane_sheets():
    """Distance less half of both thicknesses, no uncertainty, one pair."""
    assembly = two(flat(0), flat(0.003))
    (pair,) = clearances(assembly)
    assert pair.least == pytest.approx(0.002)
    assert pair.uncertainty == pytest.approx(0, abs=1e-9)
    assert not pair.touching
    assert clearances(assembly, within=0.002) == []


@pytest.mark.parametrize("h", [0.02, 0.01])
def test_a_curved_gap_is_known_to_its_facets(h):
    """Cylinders of radius R and R + c: the clearance is c - t within h² κ/8 of either."""
    R, c = 0.3, 0.004

    def arc(radius):
        return lambda x, y: np.sqrt(radius**2 - (x - 0.1) ** 2) - R + 0 * y

    found = gaps(two(arc(R), arc(R + c), h), "sheet 0", "sheet 1")
    inner = np.abs(found.clearance - (c - 1e-3)) <= found.uncertainty * 1.5 + 1e-5
    assert inner.mean() > 0.9
    assert np.median(found.uncertainty) == pytest.approx(2 * h**2 / R / 8, rel=0.3)


def test_touching_within_the_uncertainty():
    R = 0.3

    def arc(x, y):
        return np.sqrt(R**2 - (x - 0.1) ** 2) - R + 0 * y

    near = two(arc, lambda x, y: arc(x, y) + 1.05e-3, 0.02)
    assert clearances(near)[0].touching
    assert clearances(near)[0].close > 0


def test_opening_of_given_motions():
    """Rigid motions open nothing; b lifted by w(x) opens by w at each place."""
    assembly = two(flat(0), flat(0.003))
    found = gaps(assembly, "sheet 0", "sheet 1")
    x = assembly.points
    n = len(x)
    shapes = np.zeros((n, 3, 8))
    for k in range(3):
        shapes[:, k, k] = 1
        shapes[:, :, 3 + k] = np.cross(np.eye(3)[k], x)
    b = x[:, 2] > 0.001
    shapes[b, 2, 6] = x[b, 0]
    shapes[b, 0, 7] = 1.0  # sliding
    opening = found.relative_motion(shapes)
    np.testing.assert_allclose(opening[:, :3], 0, atol=1e-12)
    np.testing.assert_allclose(opening[:, 5], 0, atol=1e-9)
    np.testing.assert_allclose(opening[:, 3:5], 0, atol=1e-9)
    np.testing.assert_allclose(opening[:, 6], x[found.rows, 0], atol=1e-9)
    np.testing.assert_allclose(opening[:, 7], 0, atol=1e-12)


def test_force_until_first_contact():
    """F = c 2ζω²/(|φ_f||δ|): at that force the amplitude at resonance is the clearance."""
    assembly = two(flat(0), flat(0.003))
    found = gaps(assembly, "sheet 0", "sheet 1")
    shapes = np.zeros((len(assembly.points), 3, 1))
    shapes[assembly.points[:, 2] > 0.001, 2, 0] = 0.7
    f, zeta, drive = np.array([50.0]), 0.01, np.array([0.3])
    force = found.first_contact(shapes, f, zeta, drive)
    omega = 2 * np.pi * 50
    amplitude = force * 0.3 / (2 * zeta * omega**2) * 0.7
    np.testing.assert_allclose(amplitude[:, 0], 0.002, rtol=1e-9)


def test_places_near_a_joint_are_not_free():
    assembly, _ = spot_welds(two(flat(0), flat(0.003)), np.array([(0.1, 0.05, 0.0015)]))
    found = gaps(assembly, "sheet 0", "sheet 1", away=0.018)
    distance = np.linalg.norm(assembly.points[found.rows, :2] - (0.1, 0.05), axis=1)
    assert not found.free[distance < 0.014].any()
    assert found.free[distance > 0.023].all()


def test_a_fold_is_no_gap():
    """Two parts that share the grids of a fold are held together there: no place is free."""
    g = gaps(folded_panel(), "panel", "flanges")
    assert len(g.rows)
    assert not g.free.any()
