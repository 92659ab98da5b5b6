"""Sensors on a structure: grids, places between them, the base, places known to millimetres."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.elements import row_of_bars

from chladni.fem.assemble import structure
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.geometry.facets import tangents
from chladni.model.properties import BeamSection
from chladni_specimens.plates import STEEL, plate, solid_plate

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def built():
    return structure(plate(0.4, 0.3, 8, 6, 1.5e-3))


def dofs(built, points, grids=None, sd=0.0):
    k = len(points)
    grids = np.zeros(k, int) if grids is None else np.asarray(grids)
    labels = tuple(f"{i}:+Z" for i in range(k))
    points, up = np.asarray(points, dtype=float), np.tile(UP, (k, 1))
    return MeasuredDofs(labels, grids, points, up, np.full(k, sd), np.zeros(k))


def deflection(built, w):
    """Motion over the free dofs in which every grid's z is w(x, y), without rotations."""
    x, y, _ = built.assembly.points.T
    u = np.zeros((len(x), 6))
    u[:, 2] = w(x, y)
    return built.T.T @ u.ravel()  # T is a selection of dofs here


def test_a_grid_and_the_same_place_without_its_number_are_one(built):
    a = built.assembly
    there = [a.points[20], a.points[31]]
    by_number = dofs(built, there, a.ids[[20, 31]]).rows(built)
    assert_allclose((by_number - dofs(built, there).rows(built)).toarray(), 0, atol=1e-12)


def test_the_base_has_no_row_of_its_own(built):
    a = built.assembly
    both = dofs(built, [a.points[20], np.full(3, np.nan)], [a.ids[20], 0])
    assert both.base.tolist() == [False, True]
    rows = both.rows(built).toarray()
    assert rows[0].any()
    assert not rows[1].any()


def test_rows_around_a_place_have_its_variance(built):
    """A tilted plane w = a x + b y differs among the four by (a² + b²) sd² in the mean square."""
    sd, a, b = 4e-3, 3.0, -2.0
    sensor = dofs(built, [[0.21, 0.14, 0.0]], sd=sd)
    seen = sensor.around(built) @ deflection(built, lambda x, y: a * x + b * y)
    assert len(seen) == 5
    assert seen[0] == pytest.approx(a * 0.21 + b * 0.14)
    assert seen[1:].mean() == pytest.approx(seen[0])
    assert ((seen[1:] - seen[0]) ** 2).mean() == pytest.approx((a**2 + b**2) * sd**2)


def test_only_uncertain_places_have_rows_around_them(built):
    assert dofs(built, [[0.2, 0.1, 0], [0.3, 0.1, 0]]).around(built).shape[0] == 2


def test_channels_of_one_place_are_of_one_sensor(built):
    """Within a millimetre; the motion of the base is of none beside it."""
    away, base = [0.2, 0.1, 2e-3], np.full(3, np.nan)
    found = dofs(built, [[0.2, 0.1, 0], away, [0.2, 0.1, 5e-4], base, base])
    assert found.device.tolist() == [0, 1, 0, 3, 4]
    assert found.channels.tolist() == [2, 1, 2, 1, 1]
    none = dofs(built, np.zeros((0, 3)))  # where only poles were given
    assert (none.device.tolist(), none.channels.tolist()) == ([], [])


@pytest.mark.parametrize("on_grids", [True, False])
@pytest.mark.parametrize("made", [plate(0.4, 0.3, 8, 6, 2e-3), solid_plate(0.4, 0.3, 2e-3, 8, 6)])
def test_places_move_in_a_rigid_rotation_alike_on_sheets_and_solids(made, on_grids):
    """u = ω × x, so a place that moves by dx changes n · u by (ω × dx) · n; at edges as well."""
    rng, by = np.random.default_rng(3), np.array([1e-3, 2e-3, 5e-4, 0.0])
    top = np.flatnonzero(made.points[:, 2] == made.points[:, 2].max())
    at = top[[0, 20, 41, 30]]
    points = made.points[at] * (1.0 if on_grids else np.array([0.97, 0.98, 1.0]))
    grids = made.ids[at] if on_grids else np.zeros(4, int)
    built, omega, normal = structure(made), rng.normal(size=3), np.tile(UP, (4, 1))
    sensors = dofs(made, points, grids)
    motion = np.hstack([np.cross(omega, made.points), np.tile(omega, (len(made.points), 1))])
    q = built.T.T @ motion.ravel()
    for rows, along in zip(sensors.moved(built, by), tangents(normal), strict=True):
        assert_allclose(rows @ q, by * (np.cross(omega, along)[:, 2]), atol=1e-12)


def test_places_without_rotations_do_not_move_where_no_solid_is():
    """A row of bars that supports keep in a plane, and rods: neither has a face to move on."""
    for kind, held in (("bar", (3, 4, 5)), ("rod", (3,))):
        section = BeamSection(STEEL, 1e-4, 1e-9, 1e-9, 0.0, 2e-9, kind=kind)
        supports = np.array([(row, c) for row in range(6) for c in held])
        built = structure(row_of_bars(5, 0.5, section, supports=supports))
        sensors = dofs(built, built.assembly.points[1:3], built.assembly.ids[1:3])
        along_y = replace(sensors, directions=np.tile([0.0, 1.0, 0.0], (2, 1)))
        seen = sorted(rows.nnz for rows in along_y.moved(built, np.full(2, 1e-3)))
        assert seen[0] == 0, "no bar turns about one of both axes"
        assert seen[1] > 0
