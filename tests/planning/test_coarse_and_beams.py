"""Plans of what has no wide flat sheet: frames, coarsely meshed tubes, towers."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.errors import ModelError
from chladni.io.tables.sensor_table import read_sensors
from chladni.model.assembly import Assembly, Beams, Scalars
from chladni.model.properties import Part
from chladni_planning import PlanSettings, find_sensor_candidates, plan_test, sensors_csv
from chladni_planning.plan_page import notes
from chladni_specimens.forms import FORMS
from chladni_specimens.forms.tube_frame import pipe
from chladni_specimens.plates import plate, sheet


@pytest.fixture(scope="module")
def frame():
    return FORMS["tube frame"].made(520)


@pytest.fixture(scope="module")
def planned(frame):
    return plan_test(frame, PlanSettings(sensors=10, modes=6, draws=3))


def test_places_of_a_frame_lie_across_its_beams(frame):
    """Two axes a grid, which with the beams' own direction tell all of its motion."""
    places = find_sensor_candidates(frame, 2 * len(frame.points))
    nodes = frame.beams.nodes
    assert set(places.ids) == set(frame.ids[np.unique(nodes)])
    assert np.bincount(places.nodes[:, 0])[np.unique(nodes)].tolist() == [2] * len(set(places.ids))
    ends, count = np.unique(nodes, return_counts=True)
    inner = set(ends[count == 2])
    for node, normal in zip(places.nodes[:, 0], places.normals, strict=True):
        beams = nodes[(nodes == node).any(axis=1)]
        along = frame.points[beams[:, 1]] - frame.points[beams[:, 0]]
        along /= np.linalg.norm(along, axis=1)[:, None]
        if node in inner and abs(along[0] @ along[1]) > 0.999:  # elsewhere beams go both ways
            assert abs(along[0] @ normal) <= np.sqrt(0.5) + 1e-9


def test_few_places_are_spread_over_the_frame(frame):
    places = find_sensor_candidates(frame, 16)
    assert len(places) == 16
    assert len(set(places.ids)) == 8
    whole = np.ptp(frame.points, axis=0)
    assert (np.ptp(places.points, axis=0) > 0.7 * whole).all()


def test_a_frame_is_planned_and_its_table_read_back(frame, planned, tmp_path):
    assert planned.visible.min() > 0.4
    assert len(set(planned.mounts.labels)) == len(planned.mounts.labels)
    assert planned.settings.draws == 3  # walls of tubes are drawn
    (tmp_path / "sensors.csv").write_text(sensors_csv(planned))
    sensors = read_sensors(tmp_path / "sensors.csv")
    assert [s.label for s in sensors[:-1]] == [planned.mounts.labels[i] for i in planned.layout]
    assert {s.grid for s in sensors} <= set(frame.ids)
    assert "grids of the beams" in notes(planned)[0]


def test_solid_bars_have_no_wall_to_draw(frame):
    parts = tuple(
        replace(p, section=replace(p.section, J=0.2 * min(p.section.I1, p.section.I2)))
        for p in frame.parts
    )
    found = plan_test(replace(frame, parts=parts), PlanSettings(sensors=6, modes=3, draws=3))
    assert found.settings.draws == 0
    assert not [n for n in notes(found) if "drawn" in n]


def tower():
    """A square tower of four tubes and rings, its feet held: its modes come in pairs."""
    corners = 0.3 * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    points = np.array([(x, y, 0.3 * k) for k in range(5) for x, y in corners])
    legs = [(4 * k + c, 4 * k + 4 + c) for k in range(4) for c in range(4)]
    rings = [(4 * k + c, 4 * k + (c + 1) % 4) for k in range(1, 5) for c in range(4)]
    nodes = np.array([*legs, *rings])
    m = len(nodes)
    up = np.eye(3)[np.abs(points[nodes[:, 1]] - points[nodes[:, 0]]).argmin(axis=1)]
    tubes = Beams(np.arange(1, m + 1), nodes, np.zeros(m, int), up, np.zeros((m, 2, 3)),
                  np.zeros((m, 2, 6), bool))  # fmt: skip
    held = np.array([(k, c) for k in range(4) for c in range(1, 7)])
    return Assembly(np.arange(1, len(points) + 1), points, (Part(1, "tubes", pipe(0.03, 0.002)),),
                    beams=tubes, supports=held)  # fmt: skip


def test_where_no_shaker_drives_all_modes_the_surest_is_taken():
    """Of two modes of one frequency one force drives one: every condition number is infinite."""
    found = plan_test(tower(), PlanSettings(sensors=8, modes=6))
    f = found.modal.frequency
    assert np.isclose(f[1:], f[:-1], rtol=1e-6).any()
    assert not np.isfinite(found.actuators.condition).any()
    best = found.actuators.residue[found.together[0]]
    assert best == found.actuators.residue.max() > 0
    assert found.mounts.points[found.together[0], 2] > 0  # not at a foot that is held
    assert any("--shakers 2" in note for note in notes(found))


@pytest.mark.parametrize("divisions", [12, 16])
def test_a_tube_of_flat_strips_has_places_in_their_middle(divisions):
    """Strips of 10 to 13 mm: nowhere is a whole foot of 8 mm flat, half of it is."""
    a = np.linspace(0, 2 * np.pi, divisions + 1)[:-1]
    ring = 0.0254 * np.stack([np.cos(a), np.sin(a)], axis=1)
    z = np.linspace(0, 0.2, 13)
    points = np.array([(x, y, h) for h in z for x, y in ring])
    k, c = (g.ravel() for g in np.meshgrid(range(12), range(divisions), indexing="ij"))
    d = (c + 1) % divisions
    quads = np.stack([k * divisions + c, k * divisions + d, (k + 1) * divisions + d,
                      (k + 1) * divisions + c], axis=1)  # fmt: skip
    tube = sheet(points, quads, 1e-3)
    places = find_sensor_candidates(tube, 1000)
    assert places.foot == 0.5
    assert not places.is_grid.any()
    assert (places.side == np.sign(np.einsum("ij,ij->i", places.normals[:, :2],
                                             places.points[:, :2]))).all()  # fmt: skip
    found = plan_test(tube, PlanSettings(sensors=8, modes=4))
    assert "whole base" in " ".join(notes(found))


def test_a_wide_sheet_asks_for_a_whole_foot():
    assert find_sensor_candidates(plate(0.4, 0.3, 8, 6, 1e-3), 100).foot == 1


def test_nothing_to_glue_a_sensor_to_is_said(frame):
    ends = np.array([[0, 1]])
    springs = Scalars(np.array([1]), ends, np.array([[1, 1]]), np.array([1e3]), np.zeros(1))
    with pytest.raises(ModelError, match="no sheet, solid or beam for a sensor"):
        find_sensor_candidates(replace(frame, beams=Beams(), springs=springs))


def test_a_small_structure_takes_as_many_sensors_as_it_has_room_for():
    """Asked for thirty, as by default, it is planned with those that fit."""
    found = plan_test(plate(0.1, 0.08, 4, 4, 1e-3), PlanSettings(sensors=30, modes=4))
    assert len(found.layout) == len(found.places) == found.settings.sensors < 30
    assert any("Every place has a sensor" in note for note in notes(found))
