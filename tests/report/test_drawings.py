"""What a page draws: packed and taken out again, its pictures where they are asked for."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.effects.estimate import Location
from chladni.report import frf_charts, live_mesh
from chladni.report.blocks import Drawing, Section, Table, still, write_pictures
from chladni.report.drawings import drawings_of
from chladni.report.frf_charts import responses, thinned
from chladni.report.live_mesh import ModeSet, rounded, shapes, spots
from chladni.report.page import write_sections
from chladni.report.shown import Shown
from chladni.view import charts
from chladni.view.chart_page import page
from chladni.view.surface import Surface

STEPS = charts.steps({"fitted": {"nominal": 1.0, "after": 0.5}})


def resonances(damping=0.01, lines=4000, channels=2, gain=1.0, coherence=None):
    f = np.linspace(10, 200, lines)
    H = sum(1 / (f0**2 - f**2 + 2j * damping * f0 * f) for f0 in (40.0, 90.0, 150.0))
    values = gain * H[:, None, None] * np.arange(1, channels + 1)[None, :, None]
    outputs = tuple(f"{k}:+Z" for k in range(channels))
    return FRF(values, f, outputs, ("1:+Z",), coherence=coherence)


def test_a_page_gives_back_what_it_draws(tmp_path):
    """Word for word, whatever a name holds; a page without drawings or a damaged one has none."""
    name = '</script><script>alert("ö")</script>'
    made = Drawing(name, STEPS, name, {"waterfall": still(STEPS)}, place="scores")
    path = write_sections(tmp_path / "report.html", "t", [Section("s", [made])])
    _, (again,) = drawings_of(path)
    assert (again.name, again.caption, again.place) == (name, name, "scores")
    assert list(again.pictures) == ["waterfall"]
    assert again.content["layout"] == page(STEPS)["layout"]
    twice = write_sections(tmp_path / "again.html", "t", [Section("s", [again])])
    assert drawings_of(twice)[1][0].content == again.content
    text = path.read_text()
    path.write_text(text.replace('class="numbers">', 'class="numbers">AAAA'))
    assert drawings_of(path) == drawings_of(tmp_path / "none.html") == ({}, [])


@pytest.mark.parametrize(
    ("change", "every", "files"),
    [
        ({}, False, []),
        ({}, True, ["steps.png"]),
        ({"first": "steps"}, False, ["steps.png"]),
        ({"content": None, "stills": {"a": still(STEPS)}}, False, ["a.png"]),
        ({"stills": {}}, True, []),
    ],
)  # fmt: skip
def test_pictures_are_drawn_where_they_are_due(tmp_path, change, every, files):
    """Where they are asked for, on the first screen, and where a page cannot draw."""
    drawing = replace(Drawing("steps", STEPS), **change)
    assert [name for name, _ in write_pictures(tmp_path, [drawing], every)] == files
    assert sorted(p.name for p in tmp_path.iterdir()) == files
    figures = {name.removesuffix(".png"): tmp_path / name for name in files}
    body = [Section("s", [drawing])]
    text = write_sections(tmp_path / "p.html", "t", body, figures=figures).read_text()
    assert text.count("data:image/png") == len(files)
    assert ("A script draws this" in text) == (not files)


def test_a_page_without_drawings_carries_no_library(tmp_path):
    page = write_sections(tmp_path / "p.html", "t", [Section("s", [])])
    assert page.stat().st_size < 100_000


def test_rounding_keeps_half_a_step():
    values = np.array([0.1234, np.nan, -5.0])
    whole = rounded(values, 1e-3)
    assert whole[1] is None
    np.testing.assert_allclose([whole[0] * 1e-3, whole[2] * 1e-3], values[[0, 2]], atol=5e-4)


def test_thinning_keeps_peaks_and_troughs():
    sharp = resonances(damping=0.0005)
    at = thinned(sharp, 300)
    size = np.abs(sharp.values[:, 0, 0])
    assert len(at) <= 300
    assert size[at].max() == size.max()
    assert size[at].min() == size.min()


def test_each_channel_says_how_far_each_deck_is_off():
    """A gain of 10 is one decade: Q is 1."""
    curves = {"test": resonances(), "before": resonances(gain=10.0), "after": resonances()}
    chart, rows = responses(curves, held_out=["1:+Z"])
    one, two = chart.views
    assert one.startswith("0:+Z from 1:+Z, Q of curves: before 1, after ")
    assert two.startswith("1:+Z from 1:+Z (held out), Q of curves: before 1, after ")
    np.testing.assert_allclose([off for *_, off in rows], 0, atol=1e-9)
    test = chart.panels[0].series[0]
    assert test.x[np.argmax(test.y)] == pytest.approx(40.0, abs=0.1)


def test_a_channel_at_a_support_is_drawn_without_a_deviation():
    """A response of exactly zero has no logarithm; the other channels keep theirs."""
    free = np.array([1.0, 0.0])[None, :, None]
    test, deck = (replace(r, values=r.values * free) for r in (resonances(), resonances(gain=2.0)))
    chart, rows = responses({"test": test, "after": deck})
    (*_, moving), (*_, held) = rows
    assert moving == pytest.approx(np.log10(2.0) ** 2, rel=1e-2)
    assert held == 0.0
    assert set(page(chart)["choices"][0]["options"][1]["data"][0]["y"]["log"]) == {None}


def test_where_channels_are_many_the_worst_stay(monkeypatch):
    monkeypatch.setattr(frf_charts, "_VALUES", 3 * 3 * 300)
    test = resonances(channels=6)
    gains = np.array([1.0, 3.0, 1.0, 5.0, 1.0, 9.0])[None, :, None]
    off = FRF(test.values * gains, test.frequency, test.outputs, test.inputs)
    chart, _ = responses({"test": test, "before": off, "after": off})
    assert [name.split()[0] for name in chart.views] == ["1:+Z", "3:+Z", "5:+Z"]
    assert chart.marked["worst"] == 2


def test_the_coherence_of_a_channel_goes_with_its_response():
    """On the same lines; none where the recording has none."""
    gamma = np.repeat(np.linspace(0.5, 1, 4000)[:, None, None], 2, axis=1)
    chart, _ = responses({"test": resonances(coherence=gamma)})
    (line,) = chart.panels[2].series
    due = np.interp(line.x, np.linspace(10, 200, 4000), gamma[:, 0, 0])
    np.testing.assert_allclose(line.y, due, atol=1e-3)
    assert len(responses({"test": resonances()})[0].panels) == 2


def test_many_recordings_share_the_room_of_a_page():
    frf, lines = resonances(lines=30_000, channels=1), []
    for share in (1, 100):
        chart, _ = responses({"test": frf}, share=share)
        lines.append(len(chart.panels[0].series[0].x))
    alone, of_many = lines
    assert of_many < alone / 2


def test_what_is_not_fitted_is_grey():
    """Between the fitted bands, and where lines are left out; nothing where nothing is fitted."""
    both = {"test": resonances(), "model": resonances()}
    grey = responses(both, [(20.0, 80.0), (100.0, 300.0)], [(30.0, 35.0)])[0].panels[0].grey
    assert grey == [(10.0, 20.0), (80.0, 100.0), (30.0, 35.0)]
    assert responses(both, (), [(5.0, 15.0)])[0].panels[0].grey == [(10.0, 15.0)]


@pytest.fixture
def plate():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    return Shown(Surface.of(square, np.array([[0, 1, 2, 3]])))


def modes_of(f, **more):
    return ModeSet(np.array(f), np.ones((4, 3, len(f))) * np.arange(1, len(f) + 1), **more)


def test_modes_of_every_side_are_kept_with_those_that_belong_together(plate):
    """Every mode over its largest motion; a mode without a partner, and a row without any mode."""
    sensors = np.array([[1.0, 2.0, -4.0]])
    sides = {
        "test": ModeSet(np.array([10.0, 20.0, 30.0]), sensors=sensors, damping=[0.01, None, 0.02]),
        "model": modes_of([11.0, 21.0], numbers=[7, 8]),
    }
    held = shapes(sides, [[0, 0], [1, None], [None, None]], plate, mac={"test|model": np.eye(3, 2)})
    assert held["rows"] == [[0, 0], [1, None]]
    assert [m["motion"] for m in held["sides"]["test"]] == [[1000], [1000], [-1000]]
    assert [m["number"] for m in held["sides"]["model"]] == [7, 8]
    whole = np.array(held["sides"]["model"][1]["motion"])
    assert whole.shape == (3, 4)
    np.testing.assert_allclose(np.linalg.norm(whole, axis=0), 1000, atol=1)
    assert held["mac"] == {"test|model": [[1, 0], [0, 1], [0, 0]]}


def test_a_page_has_room_for_so_many_modes(plate, monkeypatch):
    """The highest are left out, and no row refers to them."""
    monkeypatch.setattr(live_mesh, "_SHAPE_VALUES", 24)
    held = shapes({"model": modes_of([1.0, 2.0, 3.0])}, [[0], [1], [2]], plate)
    assert len(held["sides"]["model"]) == 2
    assert held["rows"] == [[0], [1]]


def test_rows_of_a_table_name_what_they_open(tmp_path):
    table = Table(("mode",), [("1",), ("2",), ("3",)], opens="shapes", at=[0, None])
    text = write_sections(tmp_path / "p.html", "t", [Section("s", [table])]).read_text()
    body = text[text.index("<tbody>") : text.index("</tbody>")]
    assert body.count("data-opens") == 1
    assert 'data-opens="shapes" data-at="0"' in body


def test_a_folded_section_is_closed_until_it_is_opened_or_printed(tmp_path):
    section = Section("The recording", [Table(("a",), [("1",)])], folded="3 checks")
    text = write_sections(tmp_path / "p.html", "t", [section]).read_text()
    assert "<details><summary>The recording: 3 checks</summary>" in text


def test_places_that_the_data_cannot_distinguish_are_drawn_and_named(plate):
    """Rank 1, next to the finding; a place without any number is left out."""
    found = spots([("point-mass", "at 7", Location(point_m=(0.0, 0.0, 0.0)), 0),
                   ("crack", "on a", Location(parts=("a",)), 1),
                   ("suspension", "", Location(channels=("9:+Z",)), 1)],
                  replace(plate, parts=["a"]))  # fmt: skip
    assert [(s["name"], s["rank"]) for s in found] == [("point-mass", 0), ("crack", 1)]


def test_a_rib_is_its_grids_and_a_lump_a_ball(plate):
    """The radius of a place of several grids is its extent, which the grids show."""
    shown = replace(plate, ids=np.arange(len(plate.seen.points)) + 1)
    rib, lump = (Location(grids=grids, point_m=(0.0, 0.0, 0.0), radius_m=0.1)
                 for grids in ((1, 2, 3), (1,)))  # fmt: skip
    found = spots([("stiffener", "", rib, 0), ("point-mass", "", lump, 1)], shown)
    assert [(len(s["at"]), s["radius"]) for s in found] == [(3, 0.0), (1, 0.1)]
