"""Pictures of a parameter study: slopes, parallel coordinates, results over parameters."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from chladni.errors import ShapeError
from chladni.view.paper import AFTER, BEFORE, TITLE, save

_COLOURS = "viridis"
_MOST = 1000  # most lines of parallel coordinates; more would form a grey block


def slope_map(
    path: Path | str, values: np.ndarray, rows: Sequence[str], columns: Sequence[str], title: str
) -> Path:
    """Draw signed values (r, c) as squares with their numbers, blue above zero, red below."""
    if values.shape != (len(rows), len(columns)):
        raise ShapeError(f"values are {values.shape}, labels say {(len(rows), len(columns))}")
    size = (1.0 * len(columns) + 2.6, 0.32 * len(rows) + 1.5)
    figure = Figure(figsize=size, layout="constrained")
    ax = figure.subplots()
    most = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    shown = ax.imshow(values, cmap="RdBu", vmin=-most, vmax=most, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if abs(value) > 0.6 * most else "#333333"
            text = f"{round(value, 2) + 0.0:.2f}"  # avoids "-0.00"
            ax.text(j, i, text, ha="center", va="center", fontsize=8, color=colour)
    ax.set_xticks(range(len(columns)), columns, rotation=30, ha="right", fontsize=8)
    ax.set_yticks(range(len(rows)), rows, fontsize=8)
    ax.set_title(title, loc="left", **TITLE)
    figure.colorbar(shown, ax=ax, shrink=0.8)
    return save(figure, path)


def parallel_coordinates(
    path: Path | str,
    axes: Mapping[str, np.ndarray],
    colour: str,
    logarithmic: Collection[str] = (),
) -> Path:
    """Draw every sample as a line across the axes, coloured by one of them.

    Parameters
    ----------
    axes : {label: (n,)}   each axis runs from its least value (below) to its largest
    colour : label of the axis that gives the colour
    logarithmic : labels of axes whose values, above zero, run over decades
    """
    whole = np.stack([np.asarray(v, float) for v in axes.values()], axis=1)
    good = whole[np.isfinite(whole).all(axis=1)][:_MOST]
    figure = Figure(figsize=(1.5 * len(axes) + 1.5, 4.2), layout="constrained")
    ax, at = figure.subplots(), range(len(axes))
    low, high = good.min(axis=0), good.max(axis=0)
    place = np.full(good.shape, 0.5)
    for k, name in enumerate(axes):
        if high[k] > low[k]:
            run = np.log if name in logarithmic else np.asarray
            place[:, k] = (run(good[:, k]) - run(low[k])) / (run(high[k]) - run(low[k]))
    shade = place[:, list(axes).index(colour)]
    cmap = colormaps[_COLOURS]
    alpha = float(np.clip(40 / max(len(good), 1), 0.12, 0.9))
    for line, s in zip(place, shade, strict=True):
        ax.plot(at, line, color=cmap(s), lw=0.9, alpha=alpha)
    for k in at:
        ax.plot([k, k], [0.0, 1.0], color="#333333", lw=0.8)
        for y, value in ((-0.05, low[k]), (1.02, high[k])):
            ax.text(k, y, f"{value:.4g}", ha="center", va="top" if y < 0 else "bottom", fontsize=7)
    ax.set_xticks(at, list(axes), rotation=20, ha="right", fontsize=8)
    ax.tick_params(axis="x", pad=14, length=0)
    ax.set(ylim=(-0.02, 1.1), yticks=[], xlim=(-0.3, len(axes) - 0.7))
    ax.spines[:].set_visible(False)
    c = list(axes).index(colour)
    mapped = ScalarMappable(Normalize(low[c], high[c]), cmap)
    figure.colorbar(mapped, ax=ax, shrink=0.8, label=colour)
    return save(figure, path)


def response_plots(
    path: Path | str,
    results: Mapping[str, np.ndarray],
    parameters: Mapping[str, np.ndarray],
    nominal: Mapping[str, float],
    logarithmic: Collection[str] = (),
) -> Path:
    """Plot every result (row) over every parameter (column); lines show the deck's own values.

    Parameters
    ----------
    results, parameters : {label: (n,)}
    nominal : {label: value} of either
    logarithmic : labels of parameters that run over decades
    """
    shape = (len(results), len(parameters))
    figure = Figure(figsize=(2.5 * shape[1] + 0.8, 1.9 * shape[0] + 0.6), layout="constrained")
    axes = figure.subplots(*shape, sharex="col", sharey="row", squeeze=False)
    for i, (y_name, y) in enumerate(results.items()):
        for j, (x_name, x) in enumerate(parameters.items()):
            ax = axes[i, j]
            ax.plot(x, y, ".", color=AFTER, ms=3.5, alpha=0.6)
            for draw, name in ((ax.axvline, x_name), (ax.axhline, y_name)):
                if np.isfinite(value := nominal.get(name, np.nan)):
                    draw(value, color=BEFORE, lw=0.8, ls=(0, (4, 2)))
            if x_name in logarithmic:
                ax.set_xscale("log")
            else:
                ax.locator_params(axis="x", nbins=4)
                ax.ticklabel_format(axis="x", scilimits=(-3, 4))
            ax.tick_params(labelsize=7)
            ax.grid(lw=0.3, alpha=0.5)
            if i == shape[0] - 1:
                ax.set_xlabel(x_name, fontsize=8)
            if j == 0:
                ax.set_ylabel(y_name, fontsize=8)
    return save(figure, path)
