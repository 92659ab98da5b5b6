"""Annotations on a picture of a structure: places, arrows, a scale bar, the axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from . import paper
from .camera import Camera


@dataclass(frozen=True)
class Marker:
    """A sensor or a shaker: place [m], unit direction, text."""

    point: tuple[float, float, float]
    direction: tuple[float, float, float]
    label: str = ""


def circle(ax: Axes, camera: Camera, point: np.ndarray, radius: float) -> None:
    """Draw the outline of a sphere, which is a circle in parallel projection."""
    from matplotlib.patches import Circle

    u, v = camera.project(np.asarray(point)[None])[0]
    if radius > 0:
        style = {"fc": (*paper.RED, 0.16), "ec": paper.RED, "lw": 1.8, "zorder": 5}
        ax.add_patch(Circle((u, v), radius, clip_on=False, **style))
    ax.plot(u, v, "+", ms=13, mew=2.4, color=paper.RED, zorder=6, clip_on=False)


def arrows(
    ax: Axes, camera: Camera, markers: Sequence[Marker], colour: str, reach: float, name: str
) -> None:
    """Draw places as dots with directions and labels; ``reach`` is an arrow's length [m]."""
    if not markers:
        return
    uv = camera.project(np.array([m.point for m in markers]))
    tip = camera.project(np.array([m.direction for m in markers])) * reach
    ax.plot(*uv.T, "o", ms=5, mfc=colour, mec="white", mew=0.7, zorder=6, label=name, clip_on=False)
    for place, arrow, marker in zip(uv, tip, markers, strict=True):
        style = {"arrowstyle": "-|>", "color": colour, "lw": 1.5, "shrinkA": 0, "shrinkB": 0}
        ends = (tuple(place + arrow), tuple(place))  # keeps the arrow of a place at the rim
        if any(marker.direction):
            ax.annotate("", *ends, arrowprops=style, zorder=6, annotation_clip=False)
        paper.halo_text(ax, place + 1.12 * arrow, marker.label, colour)


def scale_bar(ax: Axes, camera: Camera, unit: str) -> None:
    """Draw a round length of about a fifth of the window, below the picture."""
    u0, u1, v0, v1 = camera.window
    length = round_length((u1 - u0) / 5)
    v = v0 - 0.05 * (v1 - v0)
    ax.plot(
        [u0, u0 + length], [v, v], color="#222222", lw=2.2, solid_capstyle="butt", clip_on=False
    )
    text = f"{length:g} {unit}" if unit != "m" or length >= 1 else f"{1e3 * length:g} mm"
    label_style: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 8}
    ax.annotate(text.strip(), (u0 + length, v), (5, 0), **label_style, annotation_clip=False)
    ax.set(xlim=(u0, u1), ylim=(v0, v1))


def triad(ax: Axes, camera: Camera, small: bool = False) -> None:
    """Draw the basic axes as three short lines below the lower right corner."""
    u0, u1, v0, v1 = camera.window
    reach = (0.05 if small else 0.06) * min(u1 - u0, v1 - v0)
    origin = np.array([u1 - 1.8 * reach, v0 - 0.2 * reach])
    tips = camera.project(np.eye(3)) * reach
    for tip, name in zip(tips, "xyz", strict=True):
        style = {"arrowstyle": "-", "color": "#555555", "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tuple(origin + tip), tuple(origin), arrowprops=style, annotation_clip=False)
        if np.linalg.norm(tip) > 0.3 * reach:
            paper.halo_text(ax, origin + 1.45 * tip, name, "#555555", 6.0 if small else 7.5)


def round_length(most: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above ``most``.

    >>> round_length(0.37)
    0.2
    """
    base = 10.0 ** np.floor(np.log10(most))
    return float(max(k * base for k in (1, 2, 5) if k * base <= most * (1 + 1e-12)))
