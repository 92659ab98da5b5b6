"""Cuts of shapes whose sections are known."""

import numpy as np
import pytest

from chladni.geometry.cross_section import cross_section, thick_lines
from chladni.view.surface import surface
from chladni_specimens.plates import box, plate


def _length(lines):
    return np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1).sum()


@pytest.mark.parametrize(("axis", "at"), [(0, 0.1), (0, 0.13), (1, 0.07), (2, 0.05)])
def test_a_closed_box_is_cut_along_its_perimeter(axis, at):
    """Through nodes (0.1, 0.05 are on the mesh) and between them."""
    seen = surface(box(0.3, 0.2, 0.1, h=0.05))
    sides = np.delete([0.3, 0.2, 0.1], axis)
    found = cross_section(seen.points, seen.faces, axis, at)
    assert _length(found.lines) == pytest.approx(2 * sides.sum())
    assert np.ptp(found.lines.reshape(-1, 2), axis=0) == pytest.approx(sides)


def test_beside_the_structure_nothing_is_cut():
    seen = surface(plate(0.4, 0.3, 4, 3, 1e-3))
    assert not len(cross_section(seen.points, seen.faces, 0, 0.5).face)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0])
def test_a_leaning_wall_is_cut_wider(degrees):
    """A strip whose normal is at α to the plane: area = length t / cos α."""
    a, t = np.radians(degrees), 2e-3
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    flat = plate(0.4, 0.3, 4, 3, t)
    upright = flat.points[:, [1, 0, 2]] @ np.roll(np.eye(3), 1, axis=0).T  # y-z plane, normal x
    leaning = upright @ turn.T
    found = cross_section(leaning, flat.shells.nodes, 2, leaning[:, 2].mean())
    walls = thick_lines(found, leaning, flat.shells.nodes, np.full(12, t))
    x, y = walls[..., 0], walls[..., 1]
    area = np.abs((x * np.roll(y, -1, 1) - np.roll(x, -1, 1) * y).sum(axis=1)).sum() / 2
    assert area == pytest.approx(_length(found.lines) * t / np.cos(a))
    assert _length(found.lines) > 0.2
