"""Topology that can be counted: rims, skins, folds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.specimens.test_calculix import WELDS, coupon

from chladni.errors import ShapeError
from chladni.geometry.solid_faces import skin
from chladni.model.assembly import Assembly, Solids
from chladni.view.camera import best_view, needed_views, visible
from chladni.view.surface import Surface, surface
from chladni_specimens.joints.builders import spot_welds
from chladni_specimens.plates import box, folded_panel, plate


def block(n):
    """Hexahedra of a unit cube cut n times each way."""
    x = np.linspace(0, 1, n + 1)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), -1).reshape(-1, 3)
    k = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    lower = [k[:-1, :-1, :-1], k[1:, :-1, :-1], k[1:, 1:, :-1], k[:-1, 1:, :-1]]
    upper = [k[:-1, :-1, 1:], k[1:, :-1, 1:], k[1:, 1:, 1:], k[:-1, 1:, 1:]]
    return points, np.stack(lower + upper, -1).reshape(-1, 8)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_skin_of_a_cube_is_its_surface(n):
    """6 n² faces, total area 6, and Σ a = 0 as for every closed surface."""
    points, hexahedra = block(n)
    faces, _, owner = skin(hexahedra, np.zeros(len(hexahedra), int))
    areas = Surface(points, faces).areas()
    assert len(faces) == 6 * n**2 == len(owner)
    np.testing.assert_allclose(np.linalg.norm(areas, axis=1).sum(), 6)
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-12)


@pytest.mark.parametrize("kind", [6, 4, 5, 10, 13, 15, 20])
def test_skin_of_one_solid_is_closed(kind):
    """Σ a = 0, whatever other nodes there are on the edges."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]])
    points = np.vstack([points, np.random.default_rng(0).normal(size=(14, 3))])
    nodes = np.arange(kind)[None]
    faces, _, _ = skin(nodes, np.zeros(1, int))
    np.testing.assert_allclose(Surface(points, faces).areas().sum(axis=0), 0, atol=1e-15)


@given(st.integers(1, 7), st.integers(1, 7))
def test_outline_of_a_plate_is_its_rim(nx, ny):
    assert len(surface(plate(1.0, 0.7, nx, ny, 1e-3)).outline()) == 2 * (nx + ny)


def test_outline_of_a_box_is_its_twelve_edges():
    edges = surface(box(0.3, 0.2, 0.1, h=0.05)).outline()
    assert len(edges) == 4 * (6 + 4 + 2)


def test_outline_shows_where_parts_meet():
    """Two parts in one plane have a line between them, one part has none."""
    points = np.array([[x, y, 0.0] for x in range(3) for y in range(2)])
    quads = np.array([[0, 2, 3, 1], [2, 4, 5, 3]])
    one, two = Surface(points, quads), Surface(points, quads, part=np.array([0, 1]))
    assert len(two.outline()) == len(one.outline()) + 1


def test_values_of_wrong_shape_are_refused():
    with pytest.raises(ShapeError, match="due is"):
        Surface(np.zeros((3, 2)))


@given(st.integers(0, 10_000))
def test_a_plate_is_seen_nearly_face_on(seed):
    """The normal of a turned plate is within the tilt (24 and 17 degrees) of the line of sight."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    flat = surface(plate(1.0, 0.7, 5, 4, 1e-3))
    turned = Surface(flat.points @ Q.T, flat.faces)
    camera = best_view(turned)
    assert abs(camera.toward @ Q[:, 2]) > np.cos(np.radians(24 + 17 + 5))


@pytest.mark.parametrize("structure", [box(), folded_panel(), plate(1, 2, 3, 4, 1e-3)])
def test_camera_is_a_right_handed_frame_that_holds_everything(structure):
    seen = surface(structure)
    camera = best_view(seen)
    frame = np.stack([camera.right, camera.up, camera.toward])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    u0, u1, v0, v1 = camera.window
    uv = camera.project(seen.points)
    assert np.all((uv > [u0, v0]) & (uv < [u1, v1]))


def test_two_sheets_need_two_views_and_one_needs_one():
    """Of two plates over each other one is hidden: half of the faces; a plate hides nothing."""
    one = surface(plate(1.0, 0.7, 20, 14, 1e-3))
    n = len(one.points)
    below = one.points + np.array([0, 0, 0.1])
    two = Surface(np.vstack([one.points, below]), np.vstack([one.faces, one.faces + n]))
    assert len(needed_views(one)) == 1
    front, back = needed_views(two)
    middle = two.points[two.faces].mean(axis=1)
    assert front.toward @ back.toward < 0
    for camera in (front, back):
        assert 0.5 < visible(camera, two, middle).mean() < 0.75
    assert np.all(visible(front, two, middle) | visible(back, two, middle))


def test_joints_are_left_out_of_pictures_of_sheets():
    """The solids of a weld are joints, a block of its own is not."""
    welded, _ = spot_welds(coupon(), WELDS, ("a", "b"))
    seen = surface(welded)
    assert np.asarray(seen.joint).sum() == 6 * len(WELDS)
    assert len(seen.without_joints().faces) == len(welded.shells)
    points, nodes = block(1)
    solids = (Solids(np.array([1]), nodes, np.zeros(1, int)),)
    alone = Assembly(np.arange(1, 9), points, welded.parts[:1], solids=solids)
    assert not np.asarray(surface(alone).joint).any()


def test_short_lines_are_left_out_of_an_outline():
    """A window of a tenth of the plate is a short line, the rim a long one."""
    seen = surface(plate(1.0, 1.0, 10, 10, 1e-3))
    holed = Surface(seen.points, np.delete(seen.faces, 44, axis=0))
    assert len(holed.outline()) == 40 + 4
    assert len(holed.outline(least=0.3)) == 40
