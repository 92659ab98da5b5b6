"""Members, fasteners, and the lines along which beams run."""

from dataclasses import replace

import numpy as np

from chladni.geometry.beam_lines import fastener_bars, lines, member_beams
from chladni.model.assembly import RigidBody
from chladni_specimens.forms import FORMS
from chladni_specimens.forms.sheet_forms import bolted_bracket


def test_screws_between_sheets_are_no_members_and_tubes_are():
    form = FORMS["bolted bracket"]
    bracket = bolted_bracket(form.dimensions(1), 0.02)
    assert len(bracket.beams)
    assert len(np.concatenate(fastener_bars(bracket))) == len(bracket.beams)
    assert not len(member_beams(bracket))
    frame = FORMS["tube frame"].made(1)
    assert len(member_beams(frame)) == len(frame.beams)


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
