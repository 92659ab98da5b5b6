"""Plots: written, of the right kind, without global state."""

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from chladni.errors import ShapeError
from chladni.view import plots

F = np.linspace(10, 200, 400)
H = sum(1 / ((f0**2 - F**2) + 0.02j * f0 * F) for f0 in (30.0, 80.0, 150.0))
CURVES = {"test": (F, H), "before": (F, 1.1 * H), "after": (F, H), "another": (F, 2 * H)}
R = np.array([30.0, 80.0, 150.0])

PLOTS = {
    "frf": lambda p: plots.frf(p, CURVES, "1:+Z", "m/N", [(20, 100)], [(40, 45)]),
    "grid": lambda p: plots.frf_grid(p, {f"{k}:+Z": CURVES for k in range(3)}),
    "nyquist": lambda p: plots.nyquist(p, CURVES),
    "ladder": lambda p: plots.frequency_ladder(p, R, 0.9 * R, R * [1, np.nan, 1.01]),
    "mac": lambda p: plots.mac_matrix(p, np.eye(3), "abc", "def"),
    "stabilisation": lambda p: plots.stabilisation(
        p, [(n, R, np.array([True, False, True])) for n in (4, 6)], R, (F, np.abs(H))
    ),
    "evidence": lambda p: plots.evidence_bars(p, {"a": -3.0, "b": -300.0}),
    "waterfall": lambda p: plots.waterfall(p, {"nominal": 0.2, "with": 0.01}, 0.005),
    "deviation": lambda p: plots.deviation_map(p, np.eye(2), ["1:+Z", "2:+Z"], ["0-50", "50-100"]),
}


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_is_written(tmp_path, name):
    path = PLOTS[name](tmp_path / "plot.png")
    with Image.open(path) as image:
        assert min(image.size) > 250
        assert np.asarray(image.convert("L")).std() > 5


def test_vector_graphics_by_suffix(tmp_path):
    assert "<svg" in PLOTS["frf"](tmp_path / "plot.svg").read_text()


def test_labels_must_fit_the_matrix(tmp_path):
    with pytest.raises(ShapeError, match="MAC"):
        plots.mac_matrix(tmp_path / "x.png", np.eye(3), "ab", "abc")


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
