"""Pictures of an environment's state as pixels, drawn without a display."""

from typing import Any

import numpy as np


def places(
    n: int, points: np.ndarray | None, outline: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Positions in the picture (n, 2) and the structure's edges (k, 2, 2) behind them.

    Points in space are seen along the axis of their least extent.  Without points the positions
    form a circle.
    """
    if points is None:
        angle = 2 * np.pi * np.arange(n) / n
        return np.column_stack([np.cos(angle), np.sin(angle)]), np.zeros((0, 2, 2))
    points = np.asarray(points)
    broad = np.sort(np.argsort(-np.ptp(points, axis=0), kind="stable")[:2])
    lines = np.zeros((0, 2, 2)) if outline is None else outline[:, :, broad]
    return points[:, broad], lines


def layout(
    xy: np.ndarray,
    chosen: np.ndarray,
    legal: np.ndarray,
    title: str,
    lines: np.ndarray,
    size: float = 4.0,
) -> np.ndarray:
    """Draw dots on the structure: chosen ones filled, legal ones outlined (h, w, 3) uint8."""
    from matplotlib.collections import LineCollection

    figure, ax = _sheet(size, title)
    ax.add_collection(LineCollection(list(lines), colors="0.85", linewidths=0.5))
    ax.scatter(*xy[~chosen & ~legal].T, s=8, c="0.8", linewidths=0)
    ax.scatter(*xy[legal & ~chosen].T, s=22, facecolors="none", edgecolors="0.5", linewidths=0.8)
    ax.scatter(*xy[chosen].T, s=30, c="#1f4e79", linewidths=0)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_axis_off()
    return _pixels(figure)


def bars(values: np.ndarray, marked: np.ndarray, title: str, size: float = 4.0) -> np.ndarray:
    """Draw values as bars, marked ones dark (h, w, 3) uint8."""
    figure, ax = _sheet(size, title)
    colours = ["#1f4e79" if m else "0.75" for m in marked]
    ax.bar(np.arange(len(values)), values, color=colours)
    ax.axhline(0, color="0.3", linewidth=0.8)
    ax.set_xticks(np.arange(len(values)))
    return _pixels(figure)


def curves(x: np.ndarray, pairs: list[tuple[np.ndarray, str]], title: str) -> np.ndarray:
    """Draw curves of logarithmic magnitude over frequency [Hz] (h, w, 3) uint8."""
    figure, ax = _sheet(4.0, title)
    for (y, label), style in zip(pairs, ("0.3", "#b5432a"), strict=False):
        ax.semilogy(x, y, color=style, label=label, linewidth=1.2)
    ax.set_xlabel("Hz")
    ax.legend(frameon=False, fontsize=8)
    return _pixels(figure)


def _sheet(size: float, title: str) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size, 0.8 * size), dpi=80, layout="constrained")
    ax = figure.add_subplot()
    ax.set_title(title, fontsize=9)
    return figure, ax


def _pixels(figure: Any) -> np.ndarray:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]
