"""The map of information: more where a sensor tells more, kept with a run, not without places."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose
from tests.builders.commands import ran

from chladni.inference.expected_information import Predicted, Rivals
from chladni.output import write_npz
from chladni.report.information_map import information_map, shown_of_run, with_surface
from chladni.report.mesh_drawings import mesh_of
from chladni.search.next_measurement import FILE, FurtherTest, Outlook, arrays_of
from chladni.view.surface import surface
from chladni_specimens import plate

DECK = plate(0.4, 0.3, 8, 6, 2e-3)
SEEN = surface(DECK)


def sided():
    """Two explanations that only sensors at the end x = 0.4 tell apart, a bit for those alone."""
    p = DECK.points
    rows = np.flatnonzero(np.isin(p[:, 0], (p[:, 0].min(), p[:, 0].max())))
    tests = tuple(
        FurtherTest("sensor", f"a sensor at {k}", f"{k}:n", tuple(p[k].tolist())) for k in rows
    )
    seen = tuple(
        Predicted(np.array([[0.0], [60.0 * (p[k, 0] > 0.2)]]), (np.zeros((1, 0)),) * 2)
        for k in rows
    )
    return Outlook(("crack", "mass"), Rivals(np.full(2, 0.5)), tests, seen)


def test_faces_have_the_bits_of_the_sensors_near_them():
    (drawn,) = information_map(mesh_of(SEEN, DECK), [sided()])
    content = drawn.content.data
    value = content["step"] * np.array(content["value"], float)
    x = SEEN.points[SEEN.faces].mean(axis=1)[:, 0]
    assert_allclose(value[x > 0.35], 1, atol=2e-3)
    assert_allclose(value[x < 0.05], 0, atol=2e-3)


def test_several_outlooks_give_their_mean():
    blind = replace(sided(), seen=tuple(replace(s, mean=0 * s.mean) for s in sided().seen))
    (drawn,) = information_map(mesh_of(SEEN, DECK), [sided(), blind])
    assert_allclose(drawn.content.data["top"], 0.5, atol=2e-3)


def test_a_run_keeps_its_mesh_and_next_draws_on_it(tmp_path):
    write_npz(tmp_path / FILE, **with_surface(arrays_of(sided()), SEEN))
    shown = shown_of_run(tmp_path)
    assert_allclose(shown.seen.points, SEEN.points, atol=1e-6)
    assert (shown.seen.faces == SEEN.faces).all()
    ran("next", tmp_path, "--pictures", "--out", tmp_path / "out")
    assert (tmp_path / "out" / "information.png").is_file()
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Information expected of one more sensor" in page


def test_a_run_without_a_mesh_has_a_page_without_a_map(tmp_path):
    write_npz(tmp_path / FILE, **arrays_of(sided()))
    assert shown_of_run(tmp_path) is None
    ran("next", tmp_path, "--out", tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Next measurement" in page
    assert "Information expected of one more sensor" not in page
    nowhere = replace(
        sided(), candidates=tuple(replace(c, point_m=None) for c in sided().candidates)
    )
    assert information_map(mesh_of(SEEN, DECK), [nowhere]) == []
