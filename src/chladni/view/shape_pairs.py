"""Pictures of test modes next to model modes, at the sensors."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from . import paper
from .camera import Camera
from .canvas import Paint, draw
from .paired_shapes import PairedShapes
from .scene import cell, for_mode, swung
from .surface import Surface

_PAIRS_A_ROW = 2
_LONG = 0.12  # the longest arrow, as a part of the structure's size


def shape_pairs(path: Path | str, seen: Surface, found: PairedShapes, most: int = 8) -> Path:
    """Draw two pictures of each low pair: test arrows on the sheet, model arrows on its shape.

    Length and colour of an arrow show the motion over the largest: orange along the direction of
    the sensor, blue against it.
    """
    seen, pairs = seen.without_joints(), found.pairs[:most]
    count = len(pairs)
    columns = 2 * min(_PAIRS_A_ROW, count)
    rows = -(-2 * count // columns)
    cameras = [for_mode(seen, found.motion[:, :, j]) for _, j in pairs]
    tile = 13.0 / columns
    height = rows * (tile / max(cameras[0][0].aspect, 0.7) + 0.45) + 0.5
    figure = Figure(figsize=(13.0, height))
    for k, ((camera, phi), (i, j)) in enumerate(zip(cameras, pairs, strict=True)):
        sign = -1.0 if (phi * found.motion[:, :, j]).sum() < 0 else 1.0
        left, right = (
            figure.add_axes(cell(2 * k + side, rows, columns, 0.45 / height)) for side in (0, 1)
        )
        draw(left, seen, camera, Paint(edges=False))
        _arrows(left, camera, seen, found, sign * found.test[:, i])
        left.set_title(f"test  {found.f_test[i]:.2f} Hz", fontsize=9)
        swung(right, seen, phi, camera, edges=False)
        _arrows(right, camera, seen, found, sign * found.model[:, j])
        name = f"model {found.numbers[j]}  {found.f_model[j]:.2f} Hz   MAC {found.mac[k]:.3f}"
        right.set_title(name, fontsize=9)
    paper.motion_bar(figure, 0.42, 0.2 / height, 0.16, "viridis")
    return paper.save(figure, path, dpi=140)


def _arrows(
    ax: Axes, camera: Camera, seen: Surface, found: PairedShapes, value: np.ndarray
) -> None:
    """Draw an arrow at every sensor along its direction, in proportion to its motion."""
    place = camera.project(found.points)
    tip = camera.project(found.directions * value[:, None]) * _LONG * seen.size
    for (x, y), (dx, dy), v in zip(place, tip, value, strict=True):
        colour = paper.BEFORE if v > 0 else paper.AFTER
        style: dict[str, Any] = {"arrowstyle": "-|>", "color": colour, "lw": 1.3}
        style |= {"shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        if np.hypot(dx, dy) > 0.004 * seen.size:
            ends = ((x + dx, y + dy), (x, y))
            ax.annotate("", *ends, arrowprops=style, zorder=6, annotation_clip=False)
        ax.plot(x, y, "o", ms=2.6, mfc=colour, mec="white", mew=0.4, zorder=7, clip_on=False)
