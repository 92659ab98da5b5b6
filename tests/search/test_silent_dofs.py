"""A drive or a sensor at which the model does not respond is refused with its label."""

import numpy as np
import pytest
from tests.builders.structures import held_along_x0

from chladni.errors import LabelError
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.fem.modelled import modelled
from chladni.search.silent_dofs import refuse_silent, silent_sensors
from chladni_specimens import plate

ACROSS, ALONG = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def places(model, *where):
    """Dofs at grids of the plate: (grid, direction)."""
    grids = np.array([grid for grid, _ in where])
    n, count = np.array([way for _, way in where]), len(where)
    labels = tuple(f"{g}:{'+Z' if way == ACROSS else '+X'}" for g, way in where)
    points = model.assembly.points[model.assembly.rows(grids)]
    return MeasuredDofs(labels, grids, points, n, np.zeros(count), np.zeros(count))


@pytest.fixture(scope="module")
def free():
    return modelled(plate(0.4, 0.3, 8, 6, 1.5e-3), 300.0)


@pytest.fixture(scope="module")
def held():
    return modelled(held_along_x0(plate(0.4, 0.3, 8, 6, 1.5e-3)), 300.0)


SENSORS = ((9, ACROSS), (33, ACROSS), (52, ACROSS))


@pytest.mark.parametrize(
    ("structure", "outputs", "drive", "said"),
    [
        # a force in the plane of a sheet moves no sensor across it
        ("free", SENSORS, (18, ALONG), r"drive 18:\+X of the model.* along \+Z it would"),
        ("held", SENSORS, (18, ALONG), r"drive 18:\+X of the model.* along \+Z it would"),
        ("held", [(9, ACROSS), (33, ALONG)], (18, ACROSS),
         r"sensor 33:\+X of the model.* along \+Z it would"),
        ("held", [(3, ACROSS), (9, ACROSS)], (1, ACROSS), r"hold drive 1:\+Z and sensor 3:\+Z"),
    ],
)  # fmt: skip
def test_what_is_silent_is_refused_with_its_label(request, structure, outputs, drive, said):
    model = request.getfixturevalue(structure)
    with pytest.raises(LabelError, match=said):
        refuse_silent(model, places(model, *outputs), places(model, drive))


def test_sensors_in_the_plane_of_a_sheet_are_silent(held):
    """A force across a flat sheet moves no point along it; the others keep their labels."""
    outputs = places(held, (9, ACROSS), (33, ALONG), (52, ALONG))
    assert silent_sensors(held, outputs, places(held, (18, ACROSS))) == outputs.labels[1:]
    assert silent_sensors(held, outputs, places(held, (18, ACROSS), (12, ALONG))) == ()


def test_what_a_support_leaves_free_is_said():
    """Held across the sheet alone, an edge still moves along it."""
    model = modelled(held_along_x0(plate(0.4, 0.3, 8, 6, 1.5e-3), (3,)), 300.0)
    with pytest.raises(LabelError, match=r"along \+X or \+Y it would"):
        refuse_silent(model, places(model, (1, ACROSS), (9, ACROSS)), places(model, (33, ACROSS)))


def test_what_responds_only_statically_is_no_rounding(held):
    """Along a clamped sheet no mode moves below 300 Hz, but a force along it stretches it."""
    refuse_silent(held, places(held, (33, ALONG)), places(held, (18, ALONG)))


def test_a_node_line_of_one_mode_is_no_node_line_of_all(free, held):
    """The middle of a plate lies on node lines of half of its modes."""
    for model in (free, held):
        outputs = places(model, (32, ACROSS), (12, ACROSS))
        refuse_silent(model, outputs, places(model, (9, ACROSS)))
