"""A finer mesh of the holed plate holds every point of the coarser one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from chladni_specimens.holed_plate import holed_plate

HOLE = (0.22, 0.13, 0.05)


def made(times, h=0.03):
    return holed_plate(0.4, 0.3, HOLE, h, 1e-3, times=times)


def signed_area(assembly):
    X = assembly.points[assembly.shells.nodes]
    return np.cross(X[:, 2] - X[:, 0], X[:, 3] - X[:, 1])[:, 2] / 2


def from_hole(assembly):
    return np.hypot(assembly.points[:, 0] - HOLE[0], assembly.points[:, 1] - HOLE[1])


@pytest.mark.parametrize(("coarse", "fine"), [(1, 2), (1, 3), (2, 4)])
def test_every_point_of_the_coarse_is_one_of_the_fine(coarse, fine):
    a, b = made(coarse), made(fine)
    assert cKDTree(b.points).query(a.points)[0].max() < 1e-9
    assert len(b.shells) == (fine // coarse) ** 2 * len(a.shells)


@pytest.mark.parametrize("times", [1, 2])
def test_every_shell_faces_up_and_the_area_is_that_of_a_polygon(times):
    a = made(times)
    assert signed_area(a).min() > 0
    rim = np.flatnonzero(np.abs(from_hole(a) - HOLE[2]) < 1e-9)
    angle = np.sort(np.arctan2(a.points[rim, 1] - HOLE[1], a.points[rim, 0] - HOLE[0]))
    gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
    polygon = HOLE[2] ** 2 / 2 * np.sin(gaps).sum()
    assert_allclose(signed_area(a).sum(), 0.4 * 0.3 - polygon, rtol=1e-9)


def test_no_point_lies_in_the_hole_or_is_used_by_none():
    a = made(1)
    assert from_hole(a).min() > HOLE[2] - 1e-9
    assert np.array_equal(np.unique(a.shells.nodes), np.arange(len(a.points)))
    assert cKDTree(a.points).query(a.points, 2)[0][:, 1].min() > 1e-4


def test_edges_are_shared_by_two_but_for_the_border():
    """One outer and one inner border: points - edges + shells = 0, Euler's number of a ring."""
    a = made(1)
    sides = np.stack([a.shells.nodes, np.roll(a.shells.nodes, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert count.max() == 2
    assert len(a.points) - len(edges) + len(a.shells) == 0
