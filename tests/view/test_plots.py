"""Plots: written, of the right kind, without global state."""

import inspect
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

from chladni.errors import ShapeError
from chladni.view import level_plots, modal_plots, plots
from chladni_bench import bench_plots
from chladni_studies import study_plots

F = np.linspace(10, 200, 400)
H = sum(1 / ((f0**2 - F**2) + 0.02j * f0 * F) for f0 in (30.0, 80.0, 150.0))
CURVES = {"test": (F, H), "before": (F, 1.1 * H), "after": (F, H), "another": (F, 2 * H)}
R = np.array([30.0, 80.0, 150.0])

DRAWN = (bench_plots, level_plots, modal_plots, plots, study_plots)
PLOTS = {  # name: the drawing, and words that must stand on it
    "frf": (
        lambda p: plots.frf(p, CURVES, "1:+Z", "m/N", [(20, 100)], [(40, 45)]),
        ("1:+Z", "|H| [m/N]", "frequency [Hz]", "phase [deg]", *CURVES),
    ),
    "frf_grid": (
        lambda p: plots.frf_grid(p, {f"{k}:+Z": CURVES for k in range(3)}),
        ("0:+Z", "2:+Z", "frequency [Hz]", *CURVES),
    ),
    "frequency_ladder": (
        lambda p: plots.frequency_ladder(p, R, 0.9 * R, R * [1, np.nan, 1.01]), ("30", "%"),
    ),
    "mac_matrix": (lambda p: plots.mac_matrix(p, np.eye(3), "abc", "def"), ("a", "f", "MAC")),
    "stabilisation_classes": (
        lambda p: modal_plots.stabilisation_classes(
            p, np.array([4, 6, 8]), R, np.array(list("ofs")), R, R[:1], (F, np.abs(H))
        ),
        ("frequency [Hz]", "states", "all steady", "struck out"),
    ),
    "mode_indicators": (
        lambda p: modal_plots.mode_indicators(p, F, np.abs(H)[:, None], 0 * F, R),
        ("CMIF", "MIF", "frequency [Hz]"),
    ),
    "nyquist_grid": (
        lambda p: modal_plots.nyquist_grid(p, {f"{k} Hz": (H, H) for k in range(7)}),
        ("6 Hz", "Re H", "Im H", "test", "identified"),
    ),
    "evidence_bars": (
        lambda p: plots.evidence_bars(p, {"a": -3.0, "b": -300.0}), ("a", "b", "evidence"),
    ),
    "fit_test": (
        lambda p: plots.fit_test(p, {"misfit": (0.5, 1.0, 0.4, 2.5), "worst line": (9, 2, 1, 4)}),
        ("misfit", "worst line", "median"),
    ),
    "waterfall": (
        lambda p: plots.waterfall(p, {"nominal": 0.2, "with": 0.01}, 0.005), ("nominal", "Q"),
    ),
    "sine_schedule": (
        lambda p: bench_plots.sine_schedule(
            p, F, np.full(400, 30.0), np.full(400, 20.0), np.ones((2, 400)), 1 / F
        ),
        ("cycles", "force [N]", "transient left [%]", "frequency [Hz]", "waited", "measured"),
    ),
    "time_histories": (
        lambda p: bench_plots.time_histories(p, F, {"force [N]": F, "1:+Z [m/s²]": -F}, "a block"),
        ("force [N]", "1:+Z [m/s²]", "time [s]", "a block"),
    ),
    "frf_over_coherence": (
        lambda p: bench_plots.frf_over_coherence(p, F, H, 1.1 * H, 1 - 1 / F, "1:+Z", "m/s²/N"),
        ("1:+Z", "|H| [m/s²/N]", "coherence", "recorded", "ideal front end"),
    ),
    "slope_map": (
        lambda p: study_plots.slope_map(p, np.eye(2), ["f1", "f2"], ["t", "E"], "slopes"),
        ("f1", "E", "slopes", "1.00"),
    ),
    "parallel_coordinates": (
        lambda p: study_plots.parallel_coordinates(
            p, {"t [m]": F, "Q": 1 / F, "one": 0 * F}, "Q", ["t [m]"]
        ),
        ("t [m]", "Q", "one", "200"),
    ),
    "response_plots": (
        lambda p: study_plots.response_plots(
            p, {"Q": F, "f1": 2 * F}, {"t [m]": F, "E [Pa]": F}, {"Q": 90.0}, ["t [m]"]
        ),
        ("Q", "f1", "t [m]", "E [Pa]"),
    ),
    "mode_over_levels": (
        lambda p: level_plots.mode_over_levels(
            p, "friction: 30 Hz", R * 1e-6, (R, R / 100, np.array([np.nan, 81.0, np.nan])),
            (R / 1e4, R / 1e6, np.array([np.nan, 0.007, np.nan])),
            np.stack([R * 1e-6, R, R / 1e4], axis=1), "micro-slip", (70.0, 0.006),
        ),
        ("friction: 30 Hz", "amplitude [mm]", "natural frequency [Hz]", "damping [% of critical]",
         "micro-slip, fitted to all", "predicted from the others", "one linear model", "measured"),
    ),
}  # fmt: skip


def test_every_plot_is_drawn_here():
    own = {
        name
        for module in DRAWN
        for name, f in vars(module).items()
        if inspect.isfunction(f) and f.__module__ == module.__name__
    }
    assert {name for name in own if not name.startswith("_")} == PLOTS.keys()


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_is_written_and_says_what_it_shows(tmp_path, name, monkeypatch):
    """A picture that is not blank, labels with units, names of curves and of rows."""
    saved = []
    save = plots.save
    for module in DRAWN:
        monkeypatch.setattr(
            module, "save", lambda figure, path: saved.append(figure) or save(figure, path)
        )
    draw, words = PLOTS[name]
    with Image.open(draw(tmp_path / "plot.png")) as image:
        assert min(image.size) > 250
        assert np.asarray(image.convert("L")).std() > 5
    said = [text.get_text() for text in saved[0].findobj(Text) if text.get_visible()]
    assert not [word for word in words if not any(word in text for text in said)], said


def test_vector_graphics_by_suffix(tmp_path):
    assert "<svg" in PLOTS["frf"][0](tmp_path / "plot.svg").read_text()


def test_labels_must_fit_the_matrix(tmp_path):
    with pytest.raises(ShapeError, match="MAC"):
        plots.mac_matrix(tmp_path / "x.png", np.eye(3), "ab", "abc")
    with pytest.raises(ShapeError, match="labels"):
        study_plots.slope_map(tmp_path / "x.png", np.eye(3), "ab", "abc", "")


def test_phase_is_drawn_without_vertical_lines():
    """Nothing drawn jumps by more than 270 degrees, and nothing but the jumps is left out."""
    phase = np.degrees(np.angle(np.exp(1j * np.linspace(0, 20, 200))))
    shown = plots._broken(phase)
    steps = np.abs(np.diff(shown))
    assert np.nanmax(steps) < 270
    assert np.isnan(shown).sum() == (np.abs(np.diff(phase)) > 270).sum()


def test_no_global_state():
    code = "import sys, chladni.view.plots as p; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_name_is_no_formula(tmp_path):
    """Dollars in a label of a recording are dollars; powers of ten at an axis stay powers."""
    from matplotlib.figure import Figure

    from chladni.view.paper import save

    figure = Figure()
    ax = figure.add_subplot()
    ax.loglog([1, 10], [1, 100], label="$_$")
    ax.set_xlabel("$\\frac{$")
    ax.legend()
    assert save(figure, tmp_path / "a.png").stat().st_size > 1000
    assert "mathdefault" in ax.get_xticklabels()[0].get_text()


@pytest.mark.parametrize(("modes", "numbers"), [(5, 5), (31, 31), (90, 30)])
def test_a_ladder_of_many_modes_can_be_read_on_a_page(tmp_path, modes, numbers):
    """No wider than a page shows it without shrinking, and no number on another."""
    f = np.linspace(20, 300, modes)
    path = plots.frequency_ladder(tmp_path / "ladder.svg", f, 1.01 * f, 0.99 * f)
    root = ElementTree.fromstring(path.read_text())
    assert float(root.get("width").removesuffix("pt")) <= 72 * 9.3
    ticks = [x for x in root.iter() if (x.get("id") or "").startswith("xtick_")]
    assert len(ticks) == numbers


def test_what_is_none_at_all_is_drawn_at_the_edge_of_a_logarithmic_axis(tmp_path, monkeypatch):
    """A statistic of zero has a mark in the picture, left of all that are not zero."""
    drawn = []
    monkeypatch.setattr(plots, "save", lambda figure, path: drawn.append(figure) or path)
    plots.fit_test(tmp_path / "x.png", {"none": (0.0, 1.0, 0.4, 2.5), "some": (9.0, 2.0, 1.0, 4.0)})
    (ax,) = drawn[0].axes
    none, some = (float(line.get_xdata()[0]) for line in ax.lines if line.get_marker() == "o")
    left, right = ax.get_xlim()
    assert 0 < left == none < some == 4.5 < right
    assert not [line for line in ax.lines if line.get_clip_on() and line.get_marker() == "o"]
