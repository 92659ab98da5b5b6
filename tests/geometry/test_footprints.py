"""Joints of a refined mesh hang on shells half as large; what no mesh decides stays."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from chladni.effects.model_errors import JointFootprint, mesh_errors
from chladni.fem.modelled import modelled
from chladni.geometry.footprints import on_smaller_shells, on_whole_shells, regions_of_joints
from chladni.geometry.refine import refined
from chladni.model.added_points import with_points
from chladni.model.assembly import Average, Beams, RigidBody
from chladni.model.properties import BeamSection, Part
from chladni_specimens.forms import FORMS
from chladni_specimens.plates import STEEL, plate

ALL = (1, 2, 3, 4, 5, 6)
UP = np.array([0, 0, 0.01])
SPOT = BeamSection(STEEL, 28.3e-6, 63.6e-12, 63.6e-12, J=127.2e-12)  # 6 mm in diameter


def held(rows, place, kind="mean", weights=None):
    """A plate of 6 x 4 shells of 50 mm with something over it that hangs on these rows."""
    assembly, (top,) = with_points(plate(0.3, 0.2, 6, 4, 1e-3), np.array([place]))
    if kind == "spider":
        return replace(assembly, rigid=(RigidBody(99, int(top), rows, (ALL,) * len(rows)),))
    weights = weights or [1.0] * len(rows)
    terms = tuple((row, (1, 2, 3), w) for row, w in zip(rows, weights, strict=True))
    return replace(assembly, rigid=(Average(99, int(top), (1, 2, 3), terms),))


def rows_of(body):
    return body.dependent if isinstance(body, RigidBody) else tuple(r for r, _, _ in body.terms)


def smaller(assembly):
    fine = refined(assembly)
    return fine, on_smaller_shells(assembly, fine)[0]


CELL = plate(0.3, 0.2, 6, 4, 1e-3).shells.nodes[8]  # one of the inner shells


@pytest.mark.parametrize("kind", ["mean", "spider"])
def test_a_joint_on_one_shell_moves_to_the_quarter_under_it(kind):
    corner = plate(0.3, 0.2, 6, 4, 1e-3).points[CELL]
    place = 0.8 * corner[2] + 0.2 * corner[0] + [0, 0, 0.002]
    fine, body = smaller(held(tuple(CELL.tolist()), place, kind))
    at = fine.points[list(rows_of(body))]
    assert len(at) == 4
    assert_allclose(np.ptp(at, axis=0)[:2], np.ptp(corner, axis=0)[:2] / 2)
    assert_allclose(at.mean(axis=0)[:2], (0.75 * corner[2] + 0.25 * corner[0])[:2])


def test_weights_say_where_a_mean_hangs():
    corner = plate(0.3, 0.2, 6, 4, 1e-3).points[CELL]
    body = held(tuple(CELL.tolist()), corner.mean(axis=0), weights=[0.1, 0.1, 0.1, 0.7])
    fine, found = smaller(body)
    middle = fine.points[list(rows_of(found))].mean(axis=0)
    assert_allclose(middle, 0.75 * corner[3] + 0.25 * corner[1])


def test_a_joint_on_many_shells_shrinks_about_its_middle():
    assembly = plate(0.3, 0.2, 6, 4, 1e-3)
    patch = np.unique(assembly.shells.nodes[[8, 9, 14, 15]])
    middle = assembly.points[patch].mean(axis=0)
    fine, body = smaller(held(tuple(patch.tolist()), middle + UP, "spider"))
    at = fine.points[list(body.dependent)]
    assert_allclose(np.ptp(at, axis=0), np.ptp(assembly.points[patch], axis=0) / 2)
    assert_allclose(at.mean(axis=0), middle)


def test_the_rim_of_a_hole_stays():
    whole = plate(0.3, 0.2, 6, 4, 1e-3)
    shells = whole.shells
    keep = np.arange(len(shells)) != 8
    holed = {n: v[keep] for n, v in vars(shells).items() if isinstance(v, np.ndarray)}
    assembly = held(tuple(CELL.tolist()), whole.points[CELL].mean(axis=0) + UP, "spider")
    assembly = replace(assembly, shells=replace(shells, **holed))
    _, body = smaller(assembly)
    assert set(body.dependent) == set(CELL.tolist())


def test_what_holds_a_point_or_a_line_is_as_it_was():
    assembly = held(tuple(CELL[:2].tolist()), [0, 0, 0.01], "spider")
    _, body = smaller(assembly)
    assert body is assembly.rigid[0]


def test_regions_hold_whole_joints():
    """Four screws of two spiders each: each screw is a region, however few are asked for."""
    bracket = FORMS["bolted bracket"].made(3)
    found = regions_of_joints(bracket, range(8), 9)
    assert sorted(n for _, n in found) == [1, 1, 1, 1]
    assert all(len(rows) == 2 for rows, _ in found)
    two = regions_of_joints(bracket, range(8), 2)
    assert sum(n for _, n in two) == 4
    assert sorted(np.concatenate([rows for rows, _ in two])) == list(range(8))


def test_footprints_are_what_another_mesh_of_a_bolted_bracket_differs_by():
    """Of the change of frequency to a mesh 1.7 times finer, screws as that mesher hangs them."""
    form, top = FORMS["bolted bracket"], 500.0
    deck = modelled(form.made(3), 2 * top)
    article = modelled(form.made(3, 1.7), top).modes.frequency[6:]
    errors = mesh_errors(deck, top)
    assert [type(e) is JointFootprint for e in errors] == [False, True, True, True, True, True]
    f = deck.modes.frequency[6 : 6 + len(article)]
    due = np.log(article / f)
    slopes = []
    for error in errors[:2]:
        b = error.rows @ deck.modes.shapes[:, 6 : 6 + len(article)]
        slopes.append(np.einsum("ir,ij,jr->r", b, error.log, b) / 2)
    shells, both = (np.stack(slopes[:n], axis=1) for n in (1, 2))
    left = [due - A @ np.linalg.lstsq(A, due, rcond=None)[0] for A in (shells, both)]
    assert np.linalg.norm(left[1]) < 0.5 * np.linalg.norm(left[0])


def spotted(n):
    """Two sheets of 6 n x 4 n shells, 2 mm apart, on six spot welds: bars from grid to grid."""
    low = plate(0.3, 0.2, 6 * n, 4 * n, 1e-3)
    m, shells = len(low.points), low.shells
    twice = {
        name: np.concatenate([v, v]) for name, v in vars(shells).items()
        if isinstance(v, np.ndarray) and name != "nodes"
    }  # fmt: skip
    twice["nodes"] = np.concatenate([shells.nodes, shells.nodes + m])
    points = np.concatenate([low.points, low.points + 0.2 * UP])
    spots = [[x, y, 0.0] for x in (0.05, 0.15, 0.25) for y in (0.05, 0.15)]
    at = np.array([np.linalg.norm(low.points - place, axis=1).argmin() for place in spots])
    bars = Beams(
        9000 + np.arange(len(at)), np.column_stack([at, at + m]), np.ones(len(at), int),
        np.tile([1.0, 0, 0], (len(at), 1)), np.zeros((len(at), 2, 3)),
        np.zeros((len(at), 2, 6), bool),
    )  # fmt: skip
    return replace(
        low, ids=np.arange(1, 2 * m + 1), points=points, shells=replace(shells, **twice),
        beams=bars, parts=(*low.parts, Part(2, "spots", SPOT)), axes=None,
    )  # fmt: skip


def test_a_load_on_a_spot_weld_acts_on_refined_grids_as_on_the_shells_of_the_deck():
    """By the shape functions of the grid: 1, 1/2 and 1/4, which are 4 together."""
    coarse = spotted(1)
    fine = refined(coarse)
    made = on_whole_shells(coarse, fine)
    assert len(made.rigid) == 12
    weights = [w for _, _, w in made.rigid[0].terms]
    assert sorted(weights) == [0.25] * 4 + [0.5] * 4 + [1.0]
    ends = made.points[made.beams.nodes.ravel()]
    assert_allclose(ends, fine.points[fine.beams.nodes.ravel()])
    assert not np.isin(made.beams.nodes, made.shells.nodes).any()
    assert on_whole_shells(plate(0.3, 0.2, 6, 4, 1e-3), fine) is fine


def test_footprints_of_spot_welds_are_what_a_finer_mesh_differs_by():
    """Shells of half and of a third of the deck's, the bars on the same grids."""
    top = 300.0
    deck = modelled(spotted(2), 2 * top)
    shells, joints = mesh_errors(deck, top)
    assert isinstance(joints, JointFootprint)
    halved, third = (modelled(spotted(n), top).modes.frequency[6:] for n in (4, 6))
    assert_allclose(shells.file._frequency(1.0)[: len(halved)], halved, rtol=1e-6)
    omega = shells.omega

    def left(x):
        """Errors of ln f with x times the change by each mesh."""
        w, V = np.linalg.eigh(sum(v * e.log for v, e in zip(x, (shells, joints), strict=False)))
        lam = np.linalg.eigvalsh(omega[:, None] * ((V * np.exp(w)) @ V.T) * omega)
        return np.log(np.sqrt(lam[: len(third)]) / (2 * np.pi * third))

    alone, both = (least_squares(left, np.ones(n)) for n in (1, 2))
    assert both.cost < 0.05 * alone.cost
    assert_allclose(both.x, 4 / 3, atol=0.15)
