"""Off-screen pictures of structures: modes, maps, sensors, places. No display, no window.

Every function takes plain arrays (a :class:`~chladni.view.surface.Surface`), writes one PNG or GIF
and returns its path. Lengths are in metres; the scale bar uses the most readable unit.
"""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..errors import ShapeError
from . import paper
from .annotations import Marker, arrows, circle, scale_bar, triad
from .camera import Camera, best_view, both_views, needed_views, visible
from .canvas import Paint, draw
from .surface import Surface

_MOTION = "viridis"
_SWING = 0.07  # largest displacement drawn, as a part of the structure's size
_GHOST = 70.0  # [degree] smallest fold that the undeformed outline shows
_CORD = "#009e73"
_LABEL = 1.5  # lengths of an arrow to the far end of its label
_LONG = 0.35  # least length of a line of that outline, as a part of the structure's size
_PAINTED = 20_000  # polygons that are painted sooner than VTK starts
_CLUTTER = 1500  # faces above which a small picture is clearer without element edges
_MANY = 6000  # faces above which element edges would only blacken the picture


def mode_shape(
    path: Path | str, seen: Surface, shape: np.ndarray, frequency: float, name: str = "mode"
) -> Path:
    """Draw the deformed surface coloured by displacement, with its undeformed outline.

    Parameters
    ----------
    shape : (n, 3)   displacement of every point, any scale; complex is turned to its largest phase
    frequency :      [Hz]
    """
    seen = seen.without_joints()
    camera, phi = for_mode(seen, _real(shape))
    figure, (ax,) = _sheets([camera])
    swung(ax, seen, phi, camera)
    ax.set_title(f"{name}: {hertz(frequency)}", **paper.TITLE)
    triad(ax, camera)
    scale_bar(ax, camera, seen.unit)
    paper.motion_bar(figure, 0.45, 0.15 / figure.get_size_inches()[1], 0.22, _MOTION)
    return paper.save(figure, path)


def montage(
    path: Path | str,
    seen: Surface,
    shapes: np.ndarray,
    frequency: np.ndarray,
    numbers: Sequence[int] | None = None,
    columns: int = 4,
) -> Path:
    """Draw one small picture per mode; ``shapes`` is (n, 3, r), numbered from 1 by default.

    Each mode is seen from the side that shows more of its motion.
    """
    seen, r = seen.without_joints(), shapes.shape[2]
    names, columns = list(numbers or range(1, r + 1)), min(columns, r)
    rows, tile = -(-r // columns), 12.0 / columns
    chosen = [for_mode(seen, _real(shapes[:, :, k])) for k in range(r)]
    front = framed(seen, both_views(seen)[0])
    height = rows * (tile / max(front.aspect, 0.7) + 0.32) + 0.5
    figure = Figure(figsize=(12.0, height))
    few = _PAINTED // r if len(seen.faces) * r <= _PAINTED else None
    for k, (camera, phi) in enumerate(chosen):
        ax = figure.add_axes(cell(k, rows, columns, 0.5 / height))
        swung(ax, seen, phi, camera, edges=len(seen.faces) < _CLUTTER, tiles=few)
        ax.set_anchor("N")
        behind = "" if camera.toward @ front.toward > 0 else "  (from behind)"
        ax.set_title(f"{names[k]}    {hertz(frequency[k])}{behind}", fontsize=10, y=1.0)
        triad(ax, camera, small=True)
    paper.motion_bar(figure, 0.42, 0.2 / height, 0.16, _MOTION)
    return paper.save(figure, path, dpi=140)


def mode_gif(
    path: Path | str,
    seen: Surface,
    shape: np.ndarray,
    frequency: float,
    name: str = "mode",
    frames: int = 20,
) -> Path:
    """Draw one period Re(φ e^{iωt}) as a GIF that loops without a jump."""
    seen, phi, images = seen.without_joints(), np.asarray(shape), []
    camera, _ = for_mode(seen, _real(phi))
    for angle in 2 * np.pi * np.arange(frames) / frames:
        figure, (ax,) = _sheets([camera], width=5.0)
        swung(ax, seen, np.real(phi * np.exp(1j * angle)), camera, peak=_peak(phi))
        ax.set_title(f"{name}: {hertz(frequency)}", **paper.TITLE)
        triad(ax, camera)
        images.append(paper.pixels(figure))
    return paper.save_gif(images, path)


def scalar_map(
    path: Path | str,
    seen: Surface,
    values: np.ndarray,
    name: str,
    unit: str = "",
    cmap: str = "viridis",
    limits: tuple[float, float] | None = None,
    where: tuple[np.ndarray, float] | None = None,
) -> Path:
    """Draw colours by a value per face (m,) or per point (n,), with a colour bar.

    Values may be a thickness, an energy or a difference; not-a-number is grey. ``where`` adds a
    circle (point, radius) [m]. A second view from behind is added where much is hidden. Values
    beyond the limits have the colour of the limit, and the bar is pointed there.
    """
    seen, values = _sheets_of(seen, _fitting(seen, values))
    low, high = limits or _ends(values)
    cameras = needed_views(seen) if where is None else (best_view(seen, np.asarray([where[0]])),)
    figure, axes = _sheets(cameras, bar=True)
    for ax, camera in zip(axes, cameras, strict=True):
        draw(ax, seen, camera, Paint(values, (low, high), cmap, len(seen.faces) < _MANY))
        ax.set_anchor("S")
        triad(ax, camera)
        scale_bar(ax, camera, seen.unit)
    if where is not None:
        circle(axes[0], cameras[0], *where)
    text = f"{name} [{unit}]" if unit else name
    paper.colour_bar(figure, axes[-1], cmap, (low, high), text, _beyond(values, low, high))
    return paper.save(figure, path)


def _sheets_of(seen: Surface, values: np.ndarray) -> tuple[Surface, np.ndarray]:
    """The sheets without the solids of joints, and their values."""
    if len(values) == len(seen.faces) != len(seen.points):
        values = values[~np.asarray(seen.joint)]
    return seen.without_joints(), values


def _ends(values: np.ndarray) -> tuple[float, float]:
    """The smallest and the largest value, made different where they are equal."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    if low == high:
        return low - 0.5 * abs(low) - 1e-12, high + 0.5 * abs(high) + 1e-12
    return low, high


def _beyond(values: np.ndarray, low: float, high: float) -> Any:
    span = 1e-9 * (high - low)
    under, over = np.nanmin(values) < low - span, np.nanmax(values) > high + span
    return {(0, 0): "neither", (0, 1): "max", (1, 0): "min", (1, 1): "both"}[int(under), int(over)]


def usual_limits(seen: Surface, values: np.ndarray, share: float = 0.02) -> tuple[float, float]:
    """Limits of the values of faces (m,), with a share of the area beyond each limit."""
    ok = np.isfinite(values)
    area, v = np.linalg.norm(seen.areas(), axis=1)[ok], values[ok]
    order = np.argsort(v)
    part = np.cumsum(area[order]) / max(float(area.sum()), 1e-300)
    low, high = np.searchsorted(part, [share, 1 - share])
    return _ends(v[order][[low, min(int(high), len(v) - 1)]])


def thickness_map(path: Path | str, seen: Surface, thickness: np.ndarray) -> Path:
    """Draw the thickness [m] of every face in millimetres, the thinnest darkest."""
    scale, unit = (1e3, "mm") if seen.unit == "m" else (1.0, seen.unit)
    t = scale * np.asarray(thickness)
    return scalar_map(path, seen, t, "thickness", unit, "YlGnBu_r", usual_limits(seen, t))


def sensors(
    path: Path | str,
    seen: Surface,
    outputs: Sequence[Marker],
    inputs: Sequence[Marker] = (),
    cords: Sequence[Marker] = (),
    shaker: str = "shaker",
) -> Path:
    """Draw places and directions of sensors (blue), shakers (orange) and cords (green).

    Parameters
    ----------
    shaker : name of the inputs in the legend
    """
    drawn = (*outputs, *inputs, *cords)
    places = np.array([m.point for m in drawn]).reshape(-1, 3)
    seen = seen.without_joints()
    camera = best_view(seen, places)
    reach = 0.06 * max(camera.window[1] - camera.window[0], camera.window[3] - camera.window[2])
    tips = places + _LABEL * reach * np.array([m.direction for m in drawn]).reshape(-1, 3)
    camera = camera.framing(np.concatenate([seen.points[seen.used], tips]))
    figure, (ax,) = _sheets([camera])
    draw(ax, seen, camera, Paint(edges=len(seen.faces) < _MANY))
    triad(ax, camera)
    for markers, colour, name in (
        (outputs, paper.AFTER, "sensor"),
        (inputs, paper.BEFORE, shaker),
        (cords, _CORD, "cord"),
    ):
        arrows(ax, camera, markers, colour, reach, name)
    if outputs or inputs or cords:
        ax.legend(loc="upper center", bbox_to_anchor=(0.6, -0.01), ncols=3, **paper.LEGEND)
    scale_bar(ax, camera, seen.unit)
    return paper.save(figure, path)


def location(
    path: Path | str,
    seen: Surface,
    point: np.ndarray | None = None,
    radius: float = 0.0,
    text: str = "",
    faces: np.ndarray | None = None,
) -> Path:
    """Draw places on the structure: a cross, a circle of its uncertainty [m], a sentence.

    ``point`` is (3,) or (k, 3); ``faces`` (m,) bool are coloured: the parts or elements meant.
    """
    meant = seen.points[seen.faces[faces]].mean(axis=1) if faces is not None else np.zeros((0, 3))
    places = np.zeros((0, 3)) if point is None else np.atleast_2d(np.asarray(point, dtype=float))
    focus = places if len(places) else meant
    figure, (ax,) = _sheets([camera := best_view(seen, focus)])
    values = None if faces is None else np.where(faces, 0.55, np.nan)
    draw(ax, seen, camera, Paint(values, (0.0, 1.0), "Reds", len(seen.faces) < _MANY))
    for place in places:
        circle(ax, camera, place, radius)
    if text:
        top = (camera.project(places)[:, 1] + radius).max(initial=-np.inf)
        low, high = camera.window[2], camera.window[3]
        above = max(1.0, (top - low) / (high - low))  # clear of the circle
        ax.set_title(fill(text, 72), y=above, **paper.TITLE)
    scale_bar(ax, camera, seen.unit)
    return paper.save(figure, path)


def _sheets(
    cameras: Sequence[Camera], width: float = 7.0, bar: bool = False
) -> tuple[Figure, list[Axes]]:
    """A figure with views side by side, and room for a title (and a colour bar)."""
    n, margin, bar_width = len(cameras), 0.14, 0.9 if bar else 0.0
    picture = width - 2 * margin - (bar_width if n == 1 else 0.0)
    picture = picture if n == 1 else 0.75 * width
    height = min(max(picture / c.aspect for c in cameras), 1.3 * width)
    wide, high = n * picture + (n + 1) * margin + bar_width, height + 0.75
    figure = Figure(figsize=(wide, high))
    steps = [(margin + k * (picture + margin)) / wide for k in range(n)]
    return figure, [
        figure.add_axes((left, 0.35 / high, picture / wide, height / high)) for left in steps
    ]


def cell(k: int, rows: int, columns: int, foot: float) -> tuple[float, float, float, float]:
    """Place (left, low, width, height) of picture k of a grid above a foot, in the figure."""
    i, j = divmod(k, columns)
    row = (1 - foot) / rows
    return (j / columns, 1 - (i + 0.97) * row, 1 / columns, 0.85 * row)


def framed(seen: Surface, camera: Camera) -> Camera:
    """The view with room for the swing of a mode."""
    points, swing = seen.points[seen.used], _SWING * seen.size
    reach = [swing * d * s for d in (camera.right, camera.up) for s in (0.5, -0.5)]
    return camera.framing(np.concatenate([points + r for r in reach]), margin=0.02)


def for_mode(seen: Surface, phi: np.ndarray) -> tuple[Camera, np.ndarray]:
    """The view that shows more of ∫ |u|² dA, and the sign that moves the larger part to the eye.

    A sheet that moves away from the eye would vanish behind the next one.
    """
    front, back = (framed(seen, camera) for camera in both_views(seen))
    if not len(seen.faces):
        return front, phi
    u, middle = phi[seen.faces].mean(axis=1), seen.points[seen.faces].mean(axis=1)
    weight = np.linalg.norm(seen.areas(), axis=1) * (u * u).sum(axis=1)
    shown = [weight @ visible(camera, seen, middle) for camera in (front, back)]
    camera = back if shown[1] > 1.25 * shown[0] else front
    return camera, phi if weight @ camera.depth(u) >= 0 else -phi


def swung(
    ax: Axes,
    seen: Surface,
    shape: np.ndarray,
    camera: Camera,
    peak: float | None = None,
    edges: bool = True,
    tiles: int | None = None,
) -> None:
    """Draw a surface displaced by a shape, scaled to a fixed part of the structure's size."""
    peak = _peak(shape) if peak is None else peak
    moved = seen.moved(_SWING * seen.size / peak * shape)
    colours = Paint(
        np.linalg.norm(shape, axis=1) / peak,
        (0.0, 1.0),
        _MOTION,
        edges and len(seen.faces) < _MANY,
        seen.points[seen.outline(_GHOST, _LONG)],
        tiles,
    )
    draw(ax, moved, camera, colours)


def _peak(shape: np.ndarray) -> float:
    return float(np.linalg.norm(np.abs(shape), axis=1).max()) or 1.0


def _real(shape: np.ndarray) -> np.ndarray:
    """The real shape at the phase where Σ φ² is real and largest."""
    if not np.iscomplexobj(shape):
        return np.asarray(shape, dtype=float)
    return np.real(shape * np.exp(-0.5j * np.angle(np.sum(shape**2))))


def _fitting(seen: Surface, values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.shape not in ((len(seen.faces),), (len(seen.points),)):
        raise ShapeError(
            f"{values.shape} values for {len(seen.faces)} faces and {len(seen.points)} points"
        )
    return values


def hertz(f: float) -> str:
    """A frequency with four digits.

    >>> hertz(27.1828), hertz(27182.8)
    ('27.18 Hz', '27.18 kHz')
    """
    return f"{f:.4g} Hz" if f < 9999.5 else f"{f / 1e3:.4g} kHz"
