"""What a page draws: packed and taken out again, thinned without losing a peak."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.report.blocks import Live, Section
from chladni.report.drawings import Drawing, Drawings, drawings_of, rounded
from chladni.report.live_curves import frf, mac_map, thinned
from chladni.report.page import write_sections


def resonances(damping=0.01, lines=4000, channels=2, gain=1.0):
    f = np.linspace(10, 200, lines)
    H = sum(1 / (f0**2 - f**2 + 2j * damping * f0 * f) for f0 in (40.0, 90.0, 150.0))
    values = gain * H[:, None, None] * np.arange(1, channels + 1)[None, :, None]
    outputs = tuple(f"{k}:+Z" for k in range(channels))
    return FRF(values, f, outputs, ("1:+Z",))


def seen(**curves):
    from chladni.report.shown import Shown

    return Shown(None, curves=curves, held_out=["1:+Z"])


def test_a_page_gives_back_what_it_draws(tmp_path):
    """Word for word, whatever a name holds; a page without drawings or a damaged one has none."""
    name = '</script><script>alert("ö")</script>'
    made = Drawings({name: Drawing("steps", "scores", {"x": [1, None], "y": name}, ("w",))})
    page = tmp_path / "report.html"
    write_sections(page, "t", [Section("s", [Live(name, "steps")])], drawings=made)
    again = drawings_of(page).by_name[name]
    assert (again.draw, again.data) == ("steps", {"x": [1, None], "y": name})
    text = page.read_text()
    page.write_text(text.replace('class="numbers">', 'class="numbers">AAAA'))
    assert not drawings_of(page).by_name
    assert not drawings_of(tmp_path / "none.html").by_name


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
    drawn = frf(seen(test=resonances(), before=resonances(gain=10.0), after=resonances()))
    off = [[c["off"][name] for name in ("before", "after")] for c in drawn["channels"]]
    np.testing.assert_allclose(off, [[1.0, 0.0]] * 2, atol=1e-9)
    assert [c["held"] for c in drawn["channels"]] == [False, True]
    level = drawn["channels"][0]["curves"]["test"][0]
    assert len(level) == len(drawn["frequency"])
    peak = drawn["frequency"][int(np.argmax(level))]
    assert peak == pytest.approx(40.0, abs=0.1)


def test_a_channel_at_a_support_is_drawn_without_a_deviation():
    """A response of exactly zero has no logarithm; the other channels keep theirs."""
    free = np.array([1.0, 0.0])[None, :, None]
    test, deck = (replace(r, values=r.values * free) for r in (resonances(), resonances(gain=2.0)))
    moving, held = frf(seen(test=test, after=deck))["channels"]
    assert moving["off"]["after"] == pytest.approx(np.log10(2.0) ** 2, rel=1e-2)
    assert held["off"]["after"] == 0.0


def test_where_channels_are_many_the_worst_stay(monkeypatch):
    from chladni.report import live_curves

    monkeypatch.setattr(live_curves, "_VALUES", 3 * 3 * 300)
    test = resonances(channels=6)
    gains = np.array([1.0, 3.0, 1.0, 5.0, 1.0, 9.0])[None, :, None]
    off = FRF(test.values * gains, test.frequency, test.outputs, test.inputs)
    drawn = frf(seen(test=test, before=off, after=off))
    assert [c["name"].split()[0] for c in drawn["channels"]] == ["1:+Z", "3:+Z", "5:+Z"]
    assert drawn["of"] == 6


def test_a_matrix_keeps_three_digits():
    drawn = mac_map(
        np.array([10.0]), {"after": (np.array([[0.98765]]), np.array([11.0]), [(0, 0)])}
    )
    assert drawn["maps"]["after"]["mac"] == [[988]]
    assert drawn["maps"]["after"]["pairs"] == [[0, 0]]
