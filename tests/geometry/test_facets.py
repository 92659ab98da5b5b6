"""Normals and areas of shells: the divergence theorem, and the sign rule as it is written."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.effect_context import element_grids
from chladni.effects.element_groups import element_groups
from chladni.fem.assemble import structure
from chladni.geometry.facets import cell_areas, point_normals, tangents, vector_areas
from chladni.geometry.grid_normals import grid_normals, normals_at
from chladni.view.surface import surface
from chladni.workflows.loaded_model import Model
from chladni_planning import find_sensor_candidates
from chladni_specimens.plates import box, folded_panel, plate

PLATE = plate(0.4, 0.3, 8, 6, 1e-3)
UP = np.array([0.0, 0.0, 1.0])


def _turned(assembly, which):
    """The same shells, some numbered the other way round."""
    nodes = assembly.shells.nodes.copy()
    nodes[which] = nodes[which][:, [0, 3, 2, 1]]
    return replace(assembly, shells=replace(assembly.shells, nodes=nodes))


def test_vector_areas_of_a_closed_surface_add_up_to_nothing():
    closed = box(0.3, 0.2, 0.1, h=0.05)
    faces = surface(closed).faces
    assert_allclose(vector_areas(closed.points, faces).sum(axis=0), 0, atol=1e-15)
    assert_allclose(cell_areas(closed.points, faces).sum(), 2 * (0.06 + 0.03 + 0.02))


def test_a_triangle_counts_once_at_each_of_its_corners():
    """On a roof of a triangle and a quad the mean is by area, though a node stands twice."""
    points = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [-1, 1, -1], [-1, 0, -1]])
    triangle, quad = [0, 2, 1, 1], [0, 1, 3, 4]
    areas = vector_areas(points, np.array([triangle, quad]))
    due = areas.sum(axis=0) / np.linalg.norm(areas.sum(axis=0))
    assert_allclose(point_normals(points, np.array([triangle, quad]))[[0, 1]], [due, due])


def test_the_normal_turns_with_the_order_of_the_grids():
    assert_allclose(point_normals(PLATE.points, PLATE.shells.nodes), np.tile(UP, (63, 1)))
    down = PLATE.shells.nodes[:, ::-1]
    assert_allclose(point_normals(PLATE.points, down), np.tile(-UP, (63, 1)))


def test_some_shells_numbered_the_other_way_leave_the_majority_s_sense():
    """One of four turned over: nothing changes; two of four, evenly: the first shell's sense."""
    inner = np.linalg.norm(PLATE.points - [0.2, 0.15, 0], axis=1).argmin(keepdims=True)
    around = np.flatnonzero((PLATE.shells.nodes == inner[0]).any(axis=1))
    for turned in (around[:1], around[3:]):
        made = _turned(PLATE, turned)
        assert_allclose(grid_normals(made, inner[:1])[0], UP)
    for turned, due in ((around[:2], -UP), (around[2:], UP)):
        made = _turned(PLATE, turned)
        assert_allclose(grid_normals(made, inner[:1])[0], due, atol=1e-12)


def test_a_flange_folded_flat_has_the_sheet_s_normal():
    """A hem's return: its shells look the other way, and the mean would be rounding alone."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1e-6], [0, 0, 1e-6]])
    points = np.vstack([points, [[1, 1, 1e-6], [0, 1, 1e-6]]])
    folded = np.array([[0, 1, 2, 3], [3, 2, 6, 7]])  # the fold is the edge 2-3
    folded[1] = [3, 2, 4, 5]
    assert_allclose(point_normals(points, folded)[[2, 3]], [UP, UP], atol=1e-5)


@pytest.mark.parametrize("seed", range(8))
def test_a_fold_of_ninety_degrees_keeps_both_faces(seed):
    """Rounding decides nothing there: the mean lies half way, whatever the frame."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, -1], [0, 1, -1]])
    cells = np.array([[0, 1, 2, 3], [3, 2, 4, 5]])
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)  # no reflection, which would turn the right-hand rule over
    found = point_normals(points @ rotation.T, cells)[[2, 3]]
    assert_allclose(found @ rotation, np.tile([0, np.sqrt(0.5), np.sqrt(0.5)], (2, 1)), atol=1e-12)


def test_label_effect_candidate_and_arrow_agree():
    """12:n of a label, an attachment's, a planned sensor's: one normal, shells turned or not."""
    panel = _turned(folded_panel(), slice(None, None, 5))
    built = structure(panel)
    attached = element_grids(element_groups(built, 8))
    planned = find_sensor_candidates(panel, 40)
    due = normals_at(panel, attached.grids)
    assert_allclose(attached.normal, due, atol=1e-12)
    ids = planned.ids[planned.is_grid]
    assert_allclose(planned.normals[planned.is_grid], normals_at(panel, ids), atol=1e-12)
    model = Model(None, panel)
    rows = model.directions([f"{g}:n" for g in attached.grids[:5]])
    assert_allclose((rows - attached.rows[:5]).toarray(), 0, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_tangents_and_normal_are_a_right_handed_frame(seed):
    n = np.random.default_rng(seed).normal(size=(50, 3))
    n = np.vstack([n / np.linalg.norm(n, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    u, v = tangents(n)
    frame = np.stack([u, v, n], axis=1)
    assert_allclose(frame @ frame.swapaxes(1, 2), np.tile(np.eye(3), (len(n), 1, 1)), atol=1e-12)
    assert_allclose(np.linalg.det(frame), 1)
