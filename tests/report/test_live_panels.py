"""Curves of a page: nothing that stands out is lost, and every value is the result's own."""

import json
from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.ema.level_table import LevelRow, LevelTable, TriedElement
from chladni.report import live_curves, live_pages, live_panels
from chladni.report.blocks import Live, Picture
from chladni.report.drawings import drawings_of
from chladni.report.level_blocks import level_section
from chladni.report.page import write_sections
from chladni.report.shown import Shown
from chladni.view import plots
from chladni.view.surface import Surface

N = 30_000


def measured(coherence):
    f = np.linspace(1, 300, N)
    H = 1 / (1 - (f / 100) ** 2 + 0.02j * f / 100)
    return FRF(H[:, None, None], f, ("7:+Z",), ("2:+Z",), coherence=coherence)


def test_no_peak_is_thinned_away():
    """Of every block the highest and the lowest value stay, whatever lies between."""
    rng = np.random.default_rng(5)
    y = rng.standard_normal(N)
    y[17_017], y[23_023] = 50, -50
    at = live_curves.extremes(y, 400)
    assert len(at) <= 400
    assert {17_017, 23_023} <= set(at.tolist())
    np.testing.assert_array_equal(live_curves.extremes(y[:300], 400), np.arange(300))


def test_the_coherence_of_a_channel_goes_with_its_response():
    """On the same lines, in thousandths; none where the recording has none."""
    gamma = np.linspace(0.5, 1, N)[:, None, None]
    shown = Shown(Surface(np.zeros((0, 3))), curves={"test": measured(gamma)})
    data = live_curves.frf(shown)
    (channel,) = data["channels"]
    expected = np.interp(data["frequency"], np.linspace(1, 300, N), gamma[:, 0, 0])
    np.testing.assert_allclose(np.array(channel["coherence"]) / 1e3, expected, atol=1e-3)
    bare = replace(shown, curves={"test": measured(None)})
    assert live_curves.frf(bare)["channels"][0]["coherence"] is None


def test_many_recordings_share_the_room_of_a_page():
    shown = Shown(Surface(np.zeros((0, 3))), curves={"test": measured(None)})
    alone, of_many = (len(live_curves.frf(shown, share)["frequency"]) for share in (1, 100))
    assert of_many < alone / 2
    f, flat = np.linspace(1, 300, N), {"a": np.zeros(N)}
    alone, of_many = (
        len(live_panels.over_frequency(f, flat, "x", share=share)["panels"][0]["curves"][0]["x"])
        for share in (1, 100)
    )
    assert of_many < alone / 2


def table():
    rows = tuple(
        LevelRow(k, 1e-4 * k, 50 - k, 0.1, 0.01 * k, 0.001, foretold_hz=48.0, foretold_damping=0.02)
        for k in (1, 2, 3)
    )
    curve = ((1e-4, 49.0, 0.01), (3e-4, 47.0, 0.03))
    return LevelTable("7:+Z", "softening", rows=rows, elements=(TriedElement("<b>", 1, 3, 2, 0.5),),
                      mean_hz=48.5, mean_damping=0.02, curve=curve)  # fmt: skip


def test_levels_show_what_was_measured_fitted_and_predicted():
    data = live_panels.over_levels(table())
    frequency, damping = ({c["name"]: c for c in p["curves"]} for p in data["panels"])
    assert list(frequency) == ["measured", "<b>, fitted to all", "predicted from the others",
                               "one linear model"]  # fmt: skip
    assert frequency["measured"]["y"] == [49, 48, 47]
    assert frequency["measured"]["x"] == pytest.approx([0.1, 0.2, 0.3])  # mm
    assert damping["measured"]["y"] == pytest.approx([1, 2, 3])  # %
    assert damping["measured"]["sd"] == pytest.approx([0.1] * 3)
    assert damping["one linear model"]["y"] == pytest.approx([2, 2])


def test_a_gap_is_no_number():
    """JSON has no nan: a page with one could not be read."""
    data = live_panels.over_frequency(np.arange(3.0), {"a": np.array([0.5, np.nan, 1])}, "x")
    assert data["panels"][0]["curves"][0]["y"] == [0.5, None, 1]
    json.dumps(data, allow_nan=False)


def test_a_mode_over_levels_is_drawn_by_the_page_with_its_picture(tmp_path):
    tables, page = (table(),), live_pages.Page()
    picture = plots.waterfall(tmp_path / "levels_1.png", {"a": 1.0, "b": 0.5})
    section = level_section(tables, live_pages.levels(page, tables, {0: picture}))
    (block,) = [b for b in section.blocks if isinstance(b, Live)]
    assert block.pictures == [Picture(picture)]
    path = write_sections(tmp_path / "p.html", "t", [section], drawings=page.drawings)
    assert drawings_of(path).by_name["levels_1"].draw == "panels"
