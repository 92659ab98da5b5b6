"""A test plan of a structure: where a sensor may sit, what is seen, what is written down."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from tests.builders.structures import joined

import chladni
import chladni_planning as pretest
from chladni.errors import ModelError, ShapeError
from chladni.fem.assemble import structure
from chladni.geometry.sampling import farthest_point_sample
from chladni.io.tables.sensor_table import read_sensors
from chladni.model.assembly import Scalars
from chladni_planning import PlanSettings, find_sensor_candidates, plan_test, sensors_csv, summary
from chladni_planning.plan_page import as_page
from chladni_planning.whole_plan import target_modes
from chladni_specimens.plates import box, folded_panel, plate

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def panel():
    return folded_panel()


@pytest.fixture(scope="module")
def built(panel):
    return structure(panel)


@pytest.fixture(scope="module")
def found(panel, built):
    return plan_test(panel, PlanSettings(sensors=14, modes=10, candidates=150), built=built)


def test_places_keep_off_edges_and_folds(panel):
    """No place within a foot of the outline of panel or flanges; all grids are of the panel."""
    places = find_sensor_candidates(panel, 1000, foot=0.015)
    x, y, _ = places.points.T
    on_top = np.abs(places.normals[:, 2]) > 0.9
    assert 50 < len(places) < len(panel.points)
    assert np.all((x > 0.0149) & (x < 0.6 - 0.0149))
    assert np.all((y[on_top] > 0.0149) & (y[on_top] < 0.3 - 0.0149))


def test_normals_are_those_of_the_surface():
    """On a flat plate they are the normal, all with the sense of its shells."""
    places = find_sensor_candidates(plate(0.4, 0.3, 8, 6, 1e-3), 1000)
    np.testing.assert_allclose(places.normals, np.tile([0, 0, 1.0], (len(places), 1)), atol=1e-12)
    assert len(places) == 7 * 5
    assert np.all(places.side == 1)


def test_a_closed_box_is_reached_from_outside_only():
    """The side that can be reached is the one that looks away from the middle."""
    specimen = box()
    places = find_sensor_candidates(specimen, 500)
    outward = np.einsum("ij,ij->i", places.normals, places.points - specimen.points.mean(axis=0))
    np.testing.assert_array_equal(places.side, np.sign(outward))


def test_a_covered_sheet_is_not_reachable():
    """Two plates 20 mm apart: each can be reached from its free side; 3 mm apart likewise."""
    lower = plate(0.4, 0.3, 8, 6, 1e-3)
    for gap in (0.02, 0.003):
        upper = replace(lower, points=lower.points + gap * UP)
        both = joined(lower, upper)
        places = find_sensor_candidates(both, 500)
        assert np.all(places.side == np.where(places.points[:, 2] > gap / 2, 1, -1))
        three = joined(both, replace(lower, points=lower.points + gap / 2 * UP))
        middle = find_sensor_candidates(three, 500).points[:, 2]
        inner = np.abs(middle - gap / 2) < 1e-9
        assert not inner.any() or find_sensor_candidates(three, 500).points[inner][:, 0].min() < 0.1


def test_a_sensor_needs_room():
    """Under a narrow strip 10 mm above there is no room for it, though light falls in: below."""
    lower = plate(0.4, 0.3, 16, 12, 1e-3)
    strip = plate(0.4, 0.008, 16, 1, 1e-3)
    strip = replace(strip, points=strip.points + np.array([0.0, 0.146, 0.01]))
    both = joined(lower, strip)
    for room, below in ((0.03, True), (0.004, False)):
        places = find_sensor_candidates(both, 500, room=room)
        under = (np.abs(places.points[:, 1] - 0.15) < 0.006) & (places.points[:, 2] == 0)
        assert under.sum() > 5
        assert np.all((places.side[under] == -1) == below)
        far = (np.abs(places.points[:, 1] - 0.15) > 0.06) & (places.points[:, 2] == 0)
        assert np.all(places.side[far] == 1)


def test_places_do_not_depend_on_the_unit_of_length(panel):
    """A deck in an unknown unit gets a foot in proportion to its size: the same places in mm."""
    here = find_sensor_candidates(panel, 100, unit="")
    mm = replace(panel, points=1e3 * panel.points)
    np.testing.assert_array_equal(find_sensor_candidates(mm, 100, unit="").ids, here.ids)


def test_a_mesh_of_edges_only_is_refused():
    with pytest.raises(ModelError, match=r"flat within 2 mm and as far from .* refine the mesh"):
        find_sensor_candidates(plate(0.003, 0.003, 1, 1, 1e-3))


def test_a_strip_without_inner_grids_has_places_at_its_centres(tmp_path):
    """One shell across 20 mm: no grid keeps 8 mm off the edge, the middles do."""
    strip = plate(0.4, 0.02, 20, 1, 1e-3)
    places = find_sensor_candidates(strip, 500)
    assert not places.is_grid.any()
    assert not set(places.ids) & set(strip.ids)
    np.testing.assert_allclose(places.points[:, 1], 0.01)
    linear = strip.points @ np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(places.moving(linear), places.points @ np.array([1.0, 2.0, 3.0]))
    planned = plan_test(strip, PlanSettings(sensors=6, modes=3, floor=0.05))
    (tmp_path / "sensors.csv").write_text(sensors_csv(planned))
    for sensor, i in zip(read_sensors(tmp_path / "sensors.csv"), planned.layout, strict=False):
        assert sensor.grid is None
        np.testing.assert_allclose(sensor.place, planned.mounts.points[i], atol=1e-6)


def test_a_wide_sheet_has_places_at_grids(panel):
    """Where a corner of a shell will do its centre is not offered."""
    places = find_sensor_candidates(panel, 1000)
    corners = {int(g) for g in places.ids[places.is_grid]}
    rows = places.nodes[~places.is_grid]
    assert not any(corners & set(panel.ids[r].tolist()) for r in rows)


def test_modes_are_told_apart(panel, built):
    """The AutoMAC at the sensors obeys the ceiling, or is lower than without one."""
    settings = PlanSettings(sensors=12, modes=10, candidates=150)
    told, plain = (plan_test(panel, replace(settings, alike=a), built=built) for a in (0.1, 1.0))
    off = [(p.auto_mac - np.eye(10)).max() for p in (told, plain)]
    assert off[0] <= max(0.12, 0.5 * off[1])
    assert "with modes distinguished" not in plain.log_det


def test_shakers_are_vetoed_by_rattle_and_access(found):
    result = summary(found)
    for a in result.actuators:
        low = a.rattles_from_n is not None and a.rattles_from_n < found.settings.force
        assert a.vetoed == (low or not a.straight_way_to_it)
    assert found.actuators.allowed[found.together].all()


def test_spread_covers():
    """Every point is within the distance of the last one chosen (Gonzalez)."""
    points = np.random.default_rng(0).uniform(size=(200, 2))
    order = farthest_point_sample(points, 20)
    assert len(set(order)) == 20
    nearest = np.linalg.norm(points[:, None] - points[order], axis=2).min(axis=1)
    before = np.linalg.norm(points[order[-1]] - points[order[:-1]], axis=1).min()
    assert nearest.max() <= before + 1e-12


def test_target_modes_are_flexible(built):
    modal, above, first = target_modes(built, PlanSettings(modes=5))
    assert first == 6
    assert len(modal) == 5
    assert modal.frequency[0] > 1
    assert above.frequency[5] > modal.frequency[-1]
    with pytest.raises(ModelError, match="no flexible mode below 1 Hz"):
        target_modes(built, PlanSettings(f_max=1.0))
    with pytest.raises(ModelError, match="below 0 Hz"):
        target_modes(built, PlanSettings(f_max=0.0))


def test_the_plan_is_that_of_the_methods(found):
    """EFI and exchange on the plan's own shapes; ranked so that the last is least needed."""
    m = found.mounts
    normals = found.phi[m.normal]
    best = pretest.log_det_fisher(normals[pretest.best_layout(normals, 14)])
    assert found.log_det["with exchange"] == pytest.approx(best)
    assert found.log_det["pivoted QR"] <= found.log_det["with exchange"]
    if not found.moves:
        left = pretest.log_det_fisher(found.phi[found.layout[:-1]])
        others = [
            pretest.log_det_fisher(np.delete(found.phi[found.layout], k, axis=0)) for k in range(14)
        ]
        assert left == pytest.approx(max(others))
    assert found.observable == (20, 20)
    assert np.all(found.auto_mac >= 0)


def test_sensors_load_the_structure(found):
    """Mass lowers every frequency, and the more so the more it weighs."""
    assert np.all(found.loaded <= found.modal.frequency + 1e-9)
    assert found.loaded.min() > 0


def test_every_mode_is_seen_or_said_not_to_be(found):
    result = summary(found)
    for k, mode in enumerate(result.modes):
        assert mode.seen == (found.visible[k] >= 0.2)
    assert np.all(found.visible[found.visible_before >= 0.2] >= 0.2)


def test_an_in_plane_mode_is_seen_with_a_block():
    """A plate on soft springs along x: two modes are along the sheet, unseen by any normal.

    The plan says so, gives up its least ranked sensors and puts them along the sheet.
    """
    sheet = plate(0.4, 0.3, 10, 8, 1e-3)
    x, y, _ = sheet.points.T
    corners = np.flatnonzero(((x == 0) | (x == x.max())) & ((y == 0) | (y == y.max())))
    springs = Scalars(
        ids=np.arange(4) + 1,
        nodes=np.column_stack([corners, np.full(4, -1)]),
        component=np.ones((4, 2), dtype=np.int64),
        value=np.full(4, 100.0),
        damping=np.zeros(4),
    )
    held = replace(sheet, springs=springs)
    planned = plan_test(held, PlanSettings(sensors=10, modes=7))
    due = np.sqrt(4 * 100.0 / (0.4 * 0.3 * 1e-3 * 7850)) / (2 * np.pi)
    assert planned.modal.frequency[0] == pytest.approx(due, rel=1e-3)
    np.testing.assert_array_equal(planned.aimed, 2 * [False] + 5 * [True])  # shift, turn in plane
    result = summary(planned)
    assert {m.mode for m in result.moves} <= {planned.first + 1, planned.first + 2}
    for move in result.moves:
        assert move.taken.endswith((":+X", ":+Y"))
        assert move.before < 1e-6
    assert np.all(planned.visible[:2] > 0.5)
    assert all(m.seen for m in result.modes)
    assert np.isfinite(result.actuators[0].condition)
    assert result.sensors[-1].at.mounted == "on a block"


def test_hang_points_are_quiet_and_apart(found):
    """Quieter than most places, and not side by side."""
    assert len(np.unique(found.hangers)) == len(found.hangers) >= 2
    assert found.quiet[0] <= np.median(found.quiet)
    at = found.places.points[[list(found.places.ids).index(g) for g in found.hangers]]
    apart = np.linalg.norm(at[:, None] - at, axis=2)
    size = np.linalg.norm(np.ptp(found.places.points, axis=0))
    assert apart[np.triu_indices(len(at), 1)].min() >= 0.3 * size - 1e-12


def test_a_clamped_structure_needs_no_cords(tmp_path):
    """The plan names none, nor does its page; cords would only add stiffness."""
    sheet = plate(0.3, 0.2, 6, 4, 1e-3)
    edge = np.flatnonzero(sheet.points[:, 0] == sheet.points[:, 0].min())
    held = replace(sheet, supports=np.array([(row, c) for row in edge for c in range(1, 7)]))
    made = chladni.plan(held, sensors=4, modes=3, draws=0)
    assert not len(made.hangers)
    assert "Shaker" in [s.title for s in as_page(tmp_path, made).sections]


def test_spacing_is_kept(panel, built):
    settings = PlanSettings(sensors=12, modes=8, candidates=120, spacing=0.08)
    planned = plan_test(panel, settings, built=built)
    x = planned.mounts.points[planned.layout]
    apart = np.linalg.norm(x[:, None] - x, axis=2)[np.triu_indices(12, 1)]
    assert apart.min() >= 0.08


def test_a_layout_for_an_ensemble(panel, built):
    """Drawn models move the layout; it serves their mean better than the nominal one does."""
    settings = PlanSettings(sensors=10, modes=8, candidates=60)
    nominal = plan_test(panel, settings, built=built)
    robust = plan_test(panel, replace(settings, draws=3, spread=0.2), built=built)
    assert robust.log_det["with exchange"] != nominal.log_det["with exchange"]
    assert "pivoted QR" not in robust.log_det  # it knows of one model only


def test_fewer_sensors_than_modes_is_refused(panel, built):
    with pytest.raises(ShapeError, match="4 sensors cannot distinguish 6 modes"):
        plan_test(panel, PlanSettings(sensors=4, modes=6, candidates=60), built=built)


def test_the_table_of_sensors_can_be_read_back(found, tmp_path):
    path = tmp_path / "sensors.csv"
    path.write_text(sensors_csv(found))
    sensors = read_sensors(path)
    assert [s.label for s in sensors[:-1]] == [found.mounts.labels[i] for i in found.layout]
    assert sensors[-1].role == "input"
    directions = np.array([s.direction for s in sensors[:-1]])
    np.testing.assert_allclose(directions, found.mounts.directions[found.layout], atol=1e-8)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert all(float(r["mass"]) == (0.005 if r["role"] == "output" else 0) for r in rows)
