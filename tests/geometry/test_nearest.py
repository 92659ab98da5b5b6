"""The nearest point of a set of shells: theory on a plate, VTK's and trimesh's on a real one."""

import gc

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from chladni.geometry import nearest
from chladni.geometry.nearest import ShellSurface
from chladni_specimens import FORMS
from chladni_specimens.plates import plate, solid_plate

ROTATION = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
PLATE = plate(0.4, 0.3, 8, 6, 1.5e-3)


@settings(max_examples=50)
@given(st.floats(0, 0.4), st.floats(0, 0.3), st.floats(-0.01, 0.01))
@example(0.0, 5.960464477539063e-08, 0.0078125)
def test_weights_reproduce_the_foot_of_the_perpendicular(x, y, z):
    """In a tilted plate, so that no axis is special.

    Distances within 1e-12 m are a tie, which leaves the foot open by sqrt(2 |z| 1e-12).
    """
    points = PLATE.points @ ROTATION.T
    where = np.array([[x, y, z]]) @ ROTATION.T
    found = ShellSurface.over("plate", points, PLATE.shells.nodes).closest_points(where)
    assert_allclose(found.weight.sum(axis=1), 1)
    assert found.weight.min() >= 0
    foot = np.einsum("kc,kci->ki", found.weight, points[found.nodes])
    open_by = np.sqrt(2e-12 * abs(z)) + 1e-9
    assert_allclose(foot, np.array([[x, y, 0]]) @ ROTATION.T, atol=open_by)
    assert_allclose(found.place, foot, atol=1e-15)
    assert_allclose(found.distance, abs(z), atol=1e-9)
    assert_allclose(found.normal @ ROTATION[:, 2], 1)
    assert np.isin(found.nodes, PLATE.shells.nodes[found.shell]).all()


def test_middle_of_a_shell_is_in_that_shell():
    middle = PLATE.points[PLATE.shells.nodes].mean(axis=1) + np.array([1e-3, 2e-3, 0])
    found = ShellSurface.whole(PLATE).closest_points(middle)
    assert found.shell.tolist() == list(range(len(PLATE.shells)))


@pytest.mark.parametrize("facing", [False, True])
def test_many_places_are_looked_at_some_at_a_time(monkeypatch, facing):
    """Each place has its own foot, whatever is asked beside it."""
    places = np.random.default_rng(3).uniform(0, 0.4, (50, 3))
    normal = places / np.linalg.norm(places, axis=1, keepdims=True) if facing else None
    surface = ShellSurface.whole(PLATE)
    whole = vars(surface.closest_points(places, normal))
    monkeypatch.setattr(nearest, "AT_ONCE", 7)
    for name, part in vars(surface.closest_points(places, normal)).items():
        assert_allclose(part, whole[name], rtol=0, atol=0)


def test_corner_has_all_the_weight():
    found = ShellSurface.whole(PLATE).closest_points(PLATE.points)
    at = found.weight.argmax(axis=1)
    assert_allclose(found.weight.max(axis=1), 1)
    assert found.nodes[np.arange(len(at)), at].tolist() == list(range(len(PLATE.points)))


def test_beside_the_plate_the_distance_is_to_the_edge():
    found = ShellSurface.whole(PLATE).closest_points(np.array([[0.21, -0.02, 0.0]]))
    assert_allclose(found.distance, 0.02)


def _mixed(rng):
    """Long, warped, tiny and triangular cells side by side: centres say little about them."""
    fans = []
    for size in 10.0 ** rng.uniform(-2, 0, 60):
        corner = rng.uniform(-1, 1, 3)
        side, up = size * np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        four = np.array([corner, corner + 9 * side, corner + 9 * side + up, corner + up])
        fans.append(four + 0.2 * size * rng.normal(size=(4, 3)))
    cells = np.arange(240).reshape(60, 4)
    cells[::3, 3] = cells[::3, 2]
    return np.concatenate(fans), cells


def _halves(cells):
    second = cells[cells[:, 2] != cells[:, 3]][:, [0, 2, 3]]
    return np.vstack([cells[:, :3], second])


@pytest.mark.parametrize("near", [2, 12])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_nearest_of_all_whatever_was_tried_first(seed, near):
    """Against every triangle by trimesh; however few shells are tried first."""
    rng = np.random.default_rng(seed)
    points, cells = _mixed(rng)
    places = rng.uniform(-4, 4, (40, 3))
    found = ShellSurface.over("mixed", points, cells).closest_points(places, near=near)
    corners, least = points[_halves(cells)], np.full(len(places), np.inf)
    for triangle in corners:
        copies = np.repeat(triangle[None], len(places), axis=0)
        closest = trimesh.triangles.closest_point(copies, places)
        least = np.minimum(least, np.linalg.norm(closest - places, axis=1))
    assert_allclose(found.distance, least, atol=1e-9)
    assert_allclose(np.linalg.norm(found.place - places, axis=1), found.distance, atol=1e-12)


def test_the_surface_of_solids_is_their_outer_faces():
    """A place above a block lies on its top, with the normal outwards; inner faces do not count."""
    block = solid_plate(0.4, 0.3, 0.02, 8, 6)
    surface = ShellSurface.whole(block)
    assert len(surface.nodes) == 2 * (8 * 6 + 8 + 6)
    found = surface.closest_points(np.array([[0.21, 0.14, 0.03], [0.21, 0.14, 0.019]]))
    assert_allclose(found.place, [[0.21, 0.14, 0.02]] * 2, atol=1e-12)
    assert_allclose(found.normal[:, 2], 1.0)


def test_beams_alone_have_no_surface():
    assert len(ShellSurface.whole(FORMS["tube frame"].made(1)).nodes) == 0


def test_the_surface_of_a_structure_is_made_once_and_goes_with_it():
    made = plate(0.4, 0.3, 4, 3, 1.5e-3)
    assert ShellSurface.whole(made) is ShellSurface.whole(made)
    known = len(nearest._WHOLE)
    del made
    gc.collect()
    assert len(nearest._WHOLE) == known - 1
