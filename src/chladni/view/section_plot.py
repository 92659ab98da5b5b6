"""Cuts through a structure, walls drawn with their thickness."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .paper import LEGEND, TITLE, save

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#111111")
_GREY = "#999999"


def section_plot(
    path: Path | str,
    walls: np.ndarray,
    part: np.ndarray,
    names: Sequence[str],
    solids: np.ndarray,
    axes: str,
    title: str,
    unit: str,
) -> Path:
    """Draw walls (k, 4, 2) coloured by part (k,), outlines of solids (j, 2, 2) grey, to scale.

    ``axes`` are the names of the two axes of the plane, ``unit`` that of length. The longer extent
    is horizontal.
    """
    extent = np.ptp(np.concatenate([walls.reshape(-1, 2), solids.reshape(-1, 2)]), axis=0)
    if extent[1] > extent[0]:
        walls, solids, axes, extent = walls[..., ::-1], solids[..., ::-1], axes[::-1], extent[::-1]
    height = float(np.clip(10 * extent[1] / extent[0], 1.5, 8))
    figure = Figure(figsize=(11, height + 1), layout="constrained")
    ax = figure.subplots()
    present = np.unique(part)
    colour = {p: _COLOURS[k % len(_COLOURS)] for k, p in enumerate(present.tolist())}
    shades = [colour[p] for p in part.tolist()]
    ax.add_collection(PolyCollection(list(walls), facecolors=shades, edgecolors=shades, lw=0.6))
    ax.add_collection(LineCollection(list(solids), colors=_GREY, lw=0.8))
    ax.autoscale()
    ax.set_aspect("equal")
    label = [f"{a} [{unit}]" if unit else a for a in axes]
    ax.set(xlabel=label[0], ylabel=label[1])
    ax.set_title(title, loc="left", **TITLE)
    ax.grid(lw=0.3, alpha=0.5)
    keys = [Patch(color=colour[p], label=names[p]) for p in present.tolist()]
    if len(solids):
        keys.append(Patch(color=_GREY, label="welds, adhesive, solids"))
    figure.legend(handles=keys, loc="outside lower left", ncols=4, **LEGEND)
    return save(figure, path)
