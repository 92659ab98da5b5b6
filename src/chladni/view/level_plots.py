"""Natural frequency and damping of a mode against the amplitude at which it was measured."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .paper import AFTER, BEFORE, LEGEND, TEST, TITLE, save

Points = tuple[np.ndarray, np.ndarray, np.ndarray]  # value, sd, predicted (nan: not held out)


def mode_over_levels(
    path: Path | str,
    title: str,
    amplitude: np.ndarray,
    frequency: Points,
    damping: Points,
    curve: np.ndarray | None = None,
    element: str = "",
    mean: tuple[float, float] | None = None,
) -> Path:
    """Plot frequency and damping in two panels over the amplitude.

    Parameters
    ----------
    amplitude : (k,) [m]
    frequency, damping : measured, standard deviation, predicted, each (k,): [Hz]; of critical
    curve : (n, 3) amplitude [m], frequency [Hz], damping of ``element``
    mean : frequency and damping of one linear model, where levels were held out
    """
    figure = Figure(figsize=(8.2, 3.6), layout="constrained")
    axes = figure.subplots(1, 2)
    sides: Sequence[tuple[Points, float, str]] = (
        (frequency, 1.0, "natural frequency [Hz]"), (damping, 100.0, "damping [% of critical]")
    )  # fmt: skip
    for k, (points, scale, what) in enumerate(sides):
        line = None if curve is None else (1e3 * curve[:, 0], scale * curve[:, 1 + k])
        level = None if mean is None else scale * mean[k]
        _panel(axes[k], 1e3 * amplitude, [scale * p for p in points], line, element, level)
        axes[k].set(xlabel="amplitude [mm]", ylabel=what)
    axes[1].set_ylim(bottom=0.0)
    figure.suptitle(title, **TITLE)
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, **LEGEND)
    return save(figure, path)


def _panel(
    ax: Axes,
    amplitude: np.ndarray,
    points: Sequence[np.ndarray],
    line: tuple[np.ndarray, np.ndarray] | None,
    element: str,
    mean: float | None,
) -> None:
    """Plot measured values with two standard deviations, the fitted curve and predictions."""
    value, sd, foretold = points
    ax.errorbar(
        amplitude, value, 2 * sd, fmt="o", ms=5, color=TEST, capsize=3, lw=1, label="measured"
    )
    if line is not None:
        ax.plot(*line, color=AFTER, lw=1.4, label=f"{element}, fitted to all")
    if np.isfinite(foretold).any():
        held = np.isfinite(foretold)
        look: dict[str, Any] = {"ms": 8, "mfc": "none", "mew": 1.4, "color": AFTER}
        ax.plot(amplitude[held], foretold[held], "D", label="predicted from the others", **look)
    if mean is not None:
        ax.axhline(mean, color=BEFORE, lw=1.2, ls="--", label="one linear model")
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.3g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.grid(which="both", lw=0.3, alpha=0.5)
