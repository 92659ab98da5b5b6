"""Pictures: something is drawn, where it should be, and alike with and without VTK."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from chladni.errors import ShapeError
from chladni.view import annotations, paper, probe, scene
from chladni.view.camera import best_view
from chladni.view.canvas import Paint, draw
from chladni.view.surface import Surface, surface
from chladni_specimens.plates import folded_panel

SEEN = surface(folded_panel(h=0.03))
SHAPE = np.zeros_like(SEEN.points)
SHAPE[:, 2] = np.sin(np.pi * SEEN.points[:, 0] / 0.6)


@pytest.fixture(params=["vtk", "matplotlib"])
def back_end(request, monkeypatch):
    if request.param == "matplotlib":
        monkeypatch.setenv("CHLADNI_GRAPHICS", "matplotlib")
        probe.window.cache_clear()
    elif probe.window() is None:
        pytest.skip("no graphics library here (libosmesa6 or libegl1): VTK cannot draw")
    yield request.param
    monkeypatch.undo()
    probe.window.cache_clear()


def image_of(paint):
    figure = Figure(figsize=(5, 4))
    ax = figure.add_axes((0, 0, 1, 1))
    draw(ax, SEEN, best_view(SEEN), paint)
    return paper.pixels(figure).astype(float)


def test_every_picture_is_written(tmp_path, back_end):
    t = np.linspace(0.6e-3, 0.9e-3, len(SEEN.faces))
    out = annotations.Marker((0.3, 0.15, 0.01), (0, 0, 1), "1:+Z")
    written = [
        scene.mode_shape(tmp_path / "mode.png", SEEN, SHAPE, 27.18),
        scene.montage(tmp_path / "m.png", SEEN, np.stack([SHAPE] * 5, -1), np.arange(1, 6.0)),
        scene.thickness_map(tmp_path / "t.png", SEEN, t),
        scene.sensors(tmp_path / "s.png", SEEN, [out], [out]),
        scene.location(tmp_path / "w.png", SEEN, np.array([0.3, 0.1, 0.0]), 0.05, "here"),
    ]
    for path in written:
        with Image.open(path) as image:
            assert min(image.size) > 300
            assert np.asarray(image.convert("L")).std() > 5, f"{path.name} is blank"
    assert [p for p in tmp_path.iterdir() if p not in written] == []


def test_every_place_has_its_cross(tmp_path, back_end):
    """Thirty sensors are not one cross in their middle."""

    def red(places):
        path = scene.location(tmp_path / "w.png", SEEN, np.array(places), 0.0)
        with Image.open(path) as image:
            r, g, b = np.moveaxis(np.asarray(image.convert("RGB")).astype(int), -1, 0)
        return int(((r > 150) & (g < 90) & (b < 90)).sum())

    apart = [[0.05, 0.05, 0.0], [0.3, 0.05, 0.0], [0.3, 0.25, 0.0]]
    one = red(apart[0])
    assert one > 10
    assert 2.5 * one < red(apart) < 3.5 * one


@pytest.mark.parametrize("point", [None, (0.3, 0.1, 0.0)])
def test_a_place_is_drawn_alike_wherever_the_origin_is(tmp_path, back_end, point):
    """A deck in the coordinates of a vehicle lies metres off: its title stays where it is."""
    faces, sizes = np.ones(len(SEEN.faces), bool), set()
    for off in (0.0, -5.0, 5.0):
        place = None if point is None else np.array(point) + off
        moved = replace(SEEN, points=SEEN.points + off)
        path = scene.location(tmp_path / "w.png", moved, place, 0.0, "here", faces)
        with Image.open(path) as image:
            sizes.add(image.size)
    assert len(sizes) == 1


def test_animation_has_its_frames_and_a_white_ground(tmp_path, back_end):
    path = scene.mode_gif(tmp_path / "m.gif", SEEN, SHAPE, 27.18, frames=6)
    with Image.open(path) as gif:
        assert gif.n_frames == 6
        assert gif.info["loop"] == 0
        for k in range(6):
            gif.seek(k)
            assert gif.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_a_place_is_marked_where_it_projects(tmp_path, back_end):
    """The red of the cross lies at the projection of the point."""
    figure = Figure(figsize=(5, 4))
    ax = figure.add_axes((0, 0, 1, 1))
    camera, point = best_view(SEEN), np.array([0.2, 0.1, 0.0])
    draw(ax, SEEN, camera, Paint())
    annotations.circle(ax, camera, point, 0.0)
    image = paper.pixels(figure).astype(float)
    red = np.argwhere(image[:, :, 0] - image[:, :, 1:].max(axis=2) > 120)
    u, v = ax.transData.transform(camera.project(point[None])[0])
    np.testing.assert_allclose(red.mean(axis=0)[::-1], [u, len(image) - v], atol=1.5)


def test_both_back_ends_draw_the_same_structure(monkeypatch):
    """Same projection: silhouettes agree on 98 % of their union, and colours on average."""
    if probe.window() is None:
        pytest.skip("no graphics library here (libosmesa6 or libegl1): VTK cannot draw")
    paint = Paint(SEEN.points[:, 0].copy(), (0.0, 0.6))
    with_vtk = image_of(paint)
    monkeypatch.setenv("CHLADNI_GRAPHICS", "matplotlib")
    probe.window.cache_clear()
    painted = image_of(paint)
    monkeypatch.undo()
    probe.window.cache_clear()
    one, two = (i.min(axis=2) < 240 for i in (with_vtk, painted))
    assert (one & two).sum() > 0.98 * (one | two).sum()
    assert np.abs(with_vtk - painted)[one & two].mean() < 25


def test_complex_shapes_are_shown_at_their_largest():
    """A real shape times any phase is shown as itself, up to sign."""
    shown = scene._real(SHAPE * np.exp(0.7j))
    np.testing.assert_allclose(np.abs(shown), np.abs(SHAPE), atol=1e-12)


def test_values_that_fit_neither_faces_nor_points_are_refused(tmp_path):
    with pytest.raises(ShapeError, match="faces"):
        scene.scalar_map(tmp_path / "x.png", SEEN, np.zeros(3), "x")
    assert not list(tmp_path.iterdir())


def test_triangles_and_bars_can_be_drawn(tmp_path, back_end):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.2]])
    mixed = Surface.of(points, np.zeros((0, 4), int), np.array([[0, 1, 2], [0, 2, 3]]))
    bars = Surface(points, lines=np.array([[0, 1], [1, 2], [2, 3]]))
    for name, seen in (("t", mixed), ("b", bars)):
        path = scene.mode_shape(tmp_path / f"{name}.png", seen, points[:, ::-1], 1.0)
        with Image.open(path) as image:
            assert np.asarray(image.convert("L")).std() > 3
