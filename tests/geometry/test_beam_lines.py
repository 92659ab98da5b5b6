"""Members, fasteners, and the lines along which beams run."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.geometry.beam_lines import fastener_bars, lines, member_beams
from chladni.model.assembly import Beams, RigidBody
from chladni_specimens.forms import FORMS
from chladni_specimens.forms.sheet_forms import bolted_bracket
from chladni_specimens.plates import plate


def test_screws_between_sheets_are_no_members_and_tubes_are():
    form = FORMS["bolted bracket"]
    bracket = bolted_bracket(form.dimensions(1), 0.02)
    assert len(bracket.beams)
    assert len(np.concatenate(fastener_bars(bracket))) == len(bracket.beams)
    assert not len(member_beams(bracket))
    frame = FORMS["tube frame"].made(1)
    assert len(member_beams(frame)) == len(frame.beams)


def bars(ends):
    """Beams between pairs of rows of points."""
    n = len(ends)
    return Beams(
        np.arange(900, 900 + n), np.array(ends), np.zeros(n, int), np.tile([1.0, 0, 0], (n, 1)),
        np.zeros((n, 2, 3)), np.zeros((n, 2, 6), bool),
    )  # fmt: skip


def two_sheets(apart):
    """A plate of 4 x 3 shells of 0.1 m over another; the second has 20 points as the first."""
    low = plate(0.4, 0.3, 4, 3, 1e-3)
    nodes = np.concatenate([low.shells.nodes, low.shells.nodes + len(low.points)])
    twice = {
        name: np.concatenate([v, v]) for name, v in vars(low.shells).items()
        if isinstance(v, np.ndarray) and name != "nodes"
    }  # fmt: skip
    high = low.points + np.array([0, 0, apart])
    return replace(
        low, ids=np.arange(1, 41), points=np.vstack([low.points, high]), axes=None,
        shells=replace(low.shells, **twice, nodes=nodes),
    )  # fmt: skip


@pytest.mark.parametrize(("apart", "bridges"), [(0.002, True), (0.09, True), (0.12, False)])
def test_a_bar_from_sheet_to_sheet_is_a_spot_weld_if_it_is_short(apart, bridges):
    """A strut as long as shells are wide, and a stiffener along their sides, are members."""
    made = two_sheets(apart)
    spots, rib, brace = [(6, 26), (8, 28)], [(10, 11), (11, 12)], [(1, 7)]
    made = replace(made, beams=bars([*spots, *rib, *brace]))
    found = [piece.tolist() for piece in fastener_bars(made)]
    assert found == ([[0], [1]] if bridges else [])


def test_a_bolt_from_a_spider_to_a_grid_of_a_sheet_is_a_fastener():
    made = two_sheets(0.02)
    six = (1, 2, 3, 4, 5, 6)
    hub = np.vstack([made.points, made.points[26]])
    made = replace(made, ids=np.arange(1, 42), points=hub, beams=bars([(6, 40)]))
    assert fastener_bars(made) == []  # its end hangs on nothing
    led = replace(made, rigid=(RigidBody(1, 40, (25, 27), (six, six)),))
    assert [piece.tolist() for piece in fastener_bars(led)] == [[0]]


def test_a_short_strut_between_spiders_of_a_frame_without_sheets_is_a_member():
    frame = FORMS["tube frame"].made(1)
    a, b = frame.beams.nodes[0].tolist()
    six = (1, 2, 3, 4, 5, 6)
    rigid = tuple(RigidBody(k, n, (int(m),), (six,)) for k, n, m in ((1, a, 20), (2, b, 21)))
    alone = replace(
        frame, rigid=rigid,
        beams=type(frame.beams)(**{k: v[:1] for k, v in vars(frame.beams).items()}),
    )  # fmt: skip
    assert member_beams(alone).tolist() == [0]


def test_a_line_goes_on_through_a_junction_and_ends_at_a_bend():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0.1, 0], [1, 1, 0], [2, 2, 0], [2, -1, 0.0]])
    found = lines(points, np.array([[1, 0], [1, 2], [1, 3], [3, 4], [2, 5]]))
    assert found[0] == found[1]  # on, past a junction, whichever way they are numbered
    assert len(set(found.tolist())) == 4


def test_without_beams_there_is_no_line():
    assert lines(np.zeros((3, 3)), np.zeros((0, 2), int)).shape == (0,)
