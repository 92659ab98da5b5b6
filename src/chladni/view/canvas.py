"""A shaded picture of a surface in matplotlib axes, by VTK where it works, else by painting.

Both draw the same parallel projection.  Scale bar, labels, arrows and markers are drawn over it in
metres of the picture plane, so they are the same with either.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from .camera import Camera
from .probe import prepare
from .surface import Surface

GREY = (0.80, 0.82, 0.85)
_AMBIENT, _DIFFUSE = 0.52, 0.54
_TILES = 12_000  # polygons the painter may cut faces into
_KEY = 0.6  # share of the light over the shoulder; the rest comes from the eye


@dataclass(frozen=True, eq=False)
class Paint:
    """Colours of a surface."""

    # (n,) per point, (m,) per face or None: quantity shown by the colours
    values: np.ndarray | None = None
    limits: tuple[float, float] = (0.0, 1.0)  # (low, high) values at the ends of the colour map
    cmap: str = "viridis"
    edges: bool = True  # True to draw element edges
    ghost: np.ndarray | None = None  # (k, 2, 3) or None: segments of an undeformed outline [m]
    tiles: int | None = None  # of the painter; None: VTK where it works


def draw(ax: Axes, seen: Surface, camera: Camera, paint: Paint) -> None:
    """Draw the picture in the axes, whose data units become metres of the picture plane."""
    u0, u1, v0, v1 = camera.window
    ax.set(xlim=(u0, u1), ylim=(v0, v1), aspect="equal")
    ax.set_axis_off()
    if paint.tiles is None and prepare():
        width = ax.get_window_extent().width
        ax.imshow(_photo(seen, camera, paint, int(2 * width)), extent=camera.window, zorder=1)
    else:
        _painted(ax, seen, camera, paint)
    ax.set(xlim=(u0, u1), ylim=(v0, v1))


def _photo(seen: Surface, camera: Camera, paint: Paint, width: int) -> np.ndarray:
    """Image (height, width, 4) by VTK."""
    import pyvista as pv

    width = max(64, min(width, 3200))
    height = max(64, round(width / camera.aspect))
    plotter = pv.Plotter(off_screen=True, window_size=[width, height], lighting="none")
    for lamp, power in ((_lamp(camera), _KEY), (camera.toward, 1 - _KEY)):
        light = pv.Light(position=tuple(lamp), light_type="scene light", intensity=power)
        plotter.add_light(light)
    if len(seen.faces):
        plotter.add_mesh(_polydata(seen), **_look(seen, paint, width))
    if len(seen.lines):
        plotter.add_mesh(_segments(seen.points[seen.lines]), **_line_look(seen, paint))
    if paint.ghost is not None and len(paint.ghost):
        plotter.add_mesh(_segments(paint.ghost), color="#8a8f98", line_width=2, lighting=False)
    _aim(plotter, seen, camera)
    image = plotter.screenshot(None, return_img=True, transparent_background=True)
    plotter.close()
    return np.asarray(image)


def _aim(plotter: Any, seen: Surface, camera: Camera) -> None:
    u0, u1, v0, v1 = camera.window
    used = seen.points[seen.used]
    depth = camera.depth(used)
    focus = (u0 + u1) / 2 * camera.right + (v0 + v1) / 2 * camera.up
    reach = float(np.ptp(depth)) + (u1 - u0) + (v1 - v0)
    focus = focus + float(depth.mean()) * camera.toward
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + 2 * reach * camera.toward
    plotter.camera.up = camera.up
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (v1 - v0) / 2
    plotter.camera.clipping_range = (0.5 * reach, 4 * reach)


def _polydata(seen: Surface) -> Any:
    import pyvista as pv

    triangle = seen.faces[:, 2] == seen.faces[:, 3]
    size = np.where(triangle, 3, 4)
    rows = np.column_stack([size, seen.faces])
    keep = np.ones(rows.shape, bool)
    keep[triangle, 4] = False
    return pv.PolyData(np.array(seen.points), faces=rows[keep])


def _look(seen: Surface, paint: Paint, width: int) -> dict[str, Any]:
    look: dict[str, Any] = {
        "ambient": _AMBIENT,
        "diffuse": _DIFFUSE,
        "show_edges": paint.edges,
        "edge_color": "#20242a",
        "edge_opacity": 0.25,
        "line_width": max(1.0, width / 1500),
        "show_scalar_bar": False,
    }
    if paint.values is None:
        return {**look, "color": GREY}
    on_points = len(paint.values) == len(seen.points)
    return {
        **look,
        "scalars": np.asarray(paint.values, dtype=float),
        "preference": "point" if on_points else "cell",
        "clim": paint.limits,
        "cmap": paint.cmap,
        "nan_color": GREY,
        "interpolate_before_map": True,
    }


def _line_look(seen: Surface, paint: Paint) -> dict[str, Any]:
    """Options for lines: coloured by point values if there are any, else dark."""
    if paint.values is None or len(paint.values) != len(seen.points):
        return {"color": "#333333", "line_width": 4}
    values = np.asarray(paint.values, dtype=float)[seen.lines].ravel()
    colours = {"scalars": values, "clim": paint.limits, "cmap": paint.cmap}
    return {**colours, "line_width": 6, "lighting": False, "show_scalar_bar": False}


def _segments(ends: np.ndarray) -> Any:
    import pyvista as pv

    k = 2 * np.arange(len(ends))
    lines = np.column_stack([np.full(len(ends), 2), k, k + 1]).ravel()
    return pv.PolyData(np.array(ends).reshape(-1, 3), lines=lines)


def _lamp(camera: Camera) -> np.ndarray:
    """Direction of the light: over the left shoulder."""
    lamp = camera.toward + 0.45 * camera.up - 0.35 * camera.right
    return lamp / np.linalg.norm(lamp)


def _painted(ax: Axes, seen: Surface, camera: Camera, paint: Paint) -> None:
    """Paint by the painter's algorithm: farthest face first, Lambert shading, no library."""
    if len(seen.faces):
        polygons, colours, lines = _tiles(seen, camera, paint)
        style: dict[str, Any] = {"facecolors": colours, "edgecolors": lines, "linewidths": 0.35}
        ax.add_collection(PolyCollection(list(polygons), **style, zorder=1))
    _stroked(ax, camera, seen.points[seen.lines], _line_colours(seen, paint), 1.8)
    if paint.ghost is not None:
        _stroked(ax, camera, paint.ghost, "#8a8f98", 0.7, behind=True)


def _tiles(
    seen: Surface, camera: Camera, paint: Paint
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polygons (p, 4, 2), face colours and edge colours (p, 4), in the order of painting.

    Values at points vary within a face.  So few large faces are cut into k by k tiles, and the
    outline of the face is painted over them.
    """
    corners, k = seen.points[seen.faces], _cuts(seen, paint)
    order = np.argsort(camera.depth(corners.mean(axis=1)))
    tiles = _bilinear(corners, k)  # (m, k², 4, 3)
    fill = _colours(seen, paint, k) * _shade(seen, camera)[:, None, None]
    fill = np.concatenate([np.clip(fill, 0, 1), np.ones((*fill.shape[:2], 1))], axis=2)
    line = np.where(np.arange(4) < 3, 0.82 * fill, fill) if paint.edges and k == 1 else fill
    if paint.edges and k > 1:
        tiles = np.concatenate([tiles, corners[:, None]], axis=1)
        fill = np.concatenate([fill, np.zeros((len(fill), 1, 4))], axis=1)
        rim = np.tile([0.1, 0.12, 0.15, 0.25], (len(fill), 1, 1))
        line = np.concatenate([line, rim], axis=1)
    flat = camera.project(tiles[order].reshape(-1, 3)).reshape(-1, 4, 2)
    return flat, fill[order].reshape(-1, 4), line[order].reshape(-1, 4)


def _shade(seen: Surface, camera: Camera) -> np.ndarray:
    """Brightness of each face (m,), equal from both sides."""
    n = seen.normals()
    lit = _KEY * np.abs(n @ _lamp(camera)) + (1 - _KEY) * np.abs(n @ camera.toward)
    return _AMBIENT + _DIFFUSE * lit


def _cuts(seen: Surface, paint: Paint) -> int:
    """Number of tiles along a side of a face; one unless values are at points."""
    if paint.values is None or len(paint.values) != len(seen.points):
        return 1
    return int(np.clip(np.sqrt((paint.tiles or _TILES) / len(seen.faces)), 1, 5))


def _bilinear(corners: np.ndarray, k: int) -> np.ndarray:
    """Corner values (m, 4, ...) at the corners of k by k tiles of each face (m, k², 4, ...)."""
    r = np.arange(k + 1) / k
    xi, eta = (g.ravel() for g in np.meshgrid(r, r, indexing="ij"))
    N = np.stack([(1 - xi) * (1 - eta), xi * (1 - eta), xi * eta, (1 - xi) * eta], axis=1)
    grid = np.tensordot(corners, N, axes=(1, 1))  # (m, ..., (k+1)²)
    at = np.arange((k + 1) ** 2).reshape(k + 1, k + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    return np.moveaxis(grid, -1, 1)[:, quads]


def _stroked(
    ax: Axes, camera: Camera, ends: np.ndarray, colours: Any, width: float, behind: bool = False
) -> None:
    flat = camera.project(ends.reshape(-1, 3)).reshape(-1, 2, 2)
    ax.add_collection(
        LineCollection(list(flat), colors=colours, linewidths=width, zorder=0.5 if behind else 2)
    )


def _line_colours(seen: Surface, paint: Paint) -> Any:
    if paint.values is None or len(paint.values) != len(seen.points) or not len(seen.lines):
        return "#333333"
    low, high = paint.limits
    mean = np.asarray(paint.values, dtype=float)[seen.lines].mean(axis=1)
    return colormaps[paint.cmap]((mean - low) / max(high - low, 1e-300))


def _colours(seen: Surface, paint: Paint, k: int = 1) -> np.ndarray:
    """Colour of each tile of each face (m, k², 3)."""
    if paint.values is None:
        return np.tile(GREY, (len(seen.faces), 1, 1))
    values = np.asarray(paint.values, dtype=float)
    if len(values) == len(seen.points):
        tiles = _bilinear(values[seen.faces], k).mean(axis=2)
    else:
        tiles = values[:, None]
    low, high = paint.limits
    rgba = colormaps[paint.cmap]((tiles - low) / max(high - low, 1e-300))
    rgba[~np.isfinite(tiles)] = (*GREY, 1.0)
    return rgba[:, :, :3]
