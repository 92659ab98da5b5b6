"""Style and saving of figures: colours that survive grey print, no global state, no display."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.text import Text

from ..output import atomic

TEST, BEFORE, AFTER = "#111111", "#d55e00", "#0072b2"  # Okabe and Ito 2008
RED = (0.80, 0.08, 0.13)
TITLE: dict[str, Any] = {"fontsize": 11, "fontweight": "bold"}
LEGEND: dict[str, Any] = {"frameon": False, "fontsize": 9}


def save(figure: Figure, path: Path | str, dpi: int = 180) -> Path:
    """Write a PNG (or SVG, PDF by the suffix) under a temporary name, then rename it."""
    FigureCanvasAgg(figure)
    _no_formulas(figure)
    with matplotlib.rc_context({"svg.fonttype": "path"}):
        look: dict[str, Any] = {"facecolor": "white", "bbox_inches": "tight", "pad_inches": 0.08}
        return atomic(path, lambda part: figure.savefig(part, dpi=dpi, **look))


def _no_formulas(figure: Figure) -> None:
    """Show dollar signs in names as text; numbers of axes may still be formulas."""
    for text in _texts(figure):
        said = text.get_text()
        if "$" in said and r"\$" not in said and r"\mathdefault" not in said:
            text.set_parse_math(False)


def _texts(artist: Artist) -> Iterator[Text]:
    """Texts within an artist; axes that are switched off make no ticks for it."""
    if isinstance(artist, Text):
        yield artist
    off = isinstance(artist, Axes) and not artist.axison
    for child in artist.get_children():
        if not (off and isinstance(child, Axis)):
            yield from _texts(child)


def pixels(figure: Figure, dpi: int = 100) -> np.ndarray:
    """Pixels of a figure (height, width, 3), as bytes."""
    _no_formulas(figure)
    figure.set_facecolor("white")
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def save_gif(images: list[np.ndarray], path: Path | str, seconds: float = 1.2) -> Path:
    """Write a looping GIF with one palette for all frames, so that colours do not flicker."""
    from PIL import Image

    palette = Image.fromarray(np.concatenate(images[:: max(1, len(images) // 4)])).quantize(256)
    none = Image.Dither.NONE
    frames = [Image.fromarray(image).quantize(palette=palette, dither=none) for image in images]
    _whiten(frames)
    data = io.BytesIO()
    pause = max(20, round(1e3 * seconds / len(frames)))
    frames[0].save(
        data, "GIF", save_all=True, append_images=frames[1:], duration=pause, loop=0, optimize=False
    )
    return atomic(path, lambda part: part.write_bytes(data.getvalue()))


def colour_bar(
    figure: Figure,
    ax: Axes,
    cmap: str,
    limits: tuple[float, float],
    text: str,
    extend: Literal["neither", "both", "min", "max"] = "neither",
) -> None:
    """Draw a colour bar next to the axes, 0.15 inches wide; ``extend`` points its ends."""
    box, wide = ax.get_position(), figure.get_size_inches()[0]
    place = (box.x1 + 0.1 / wide, box.y0 + 0.1 * box.height, 0.15 / wide, 0.8 * box.height)
    side = figure.add_axes(place)
    mapped = ScalarMappable(Normalize(*limits), colormaps[cmap])
    figure.colorbar(mapped, cax=side, extend=extend).set_label(text, fontsize=9)
    side.tick_params(labelsize=8)


def motion_bar(figure: Figure, left: float, low: float, width: float, cmap: str) -> None:
    """Draw a flat bar from 0 to 1 as the legend of the colours of a mode."""
    side = figure.add_axes((left, low, width, 0.09 / figure.get_size_inches()[1]))
    mapped = ScalarMappable(Normalize(0, 1), colormaps[cmap])
    figure.colorbar(mapped, cax=side, orientation="horizontal", ticks=[0, 0.5, 1])
    side.set_title("displacement / largest", fontsize=8, pad=3)
    side.tick_params(labelsize=7, length=2, pad=1)


def halo_text(ax: Axes, place: np.ndarray, text: str, colour: str, size: float = 7.5) -> None:
    """Draw text that is readable on any background."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.2, foreground="white")]
    style: dict[str, Any] = {"fontsize": size, "color": colour, "ha": "center", "va": "center"}
    u, v = place.tolist()
    ax.text(u, v, text, **style, path_effects=halo, zorder=7, clip_on=False)


def _whiten(frames: list[Any]) -> None:
    """Make the background (colour of the first pixel) pure white, unlike the palette's."""
    ground = frames[0].getpixel((0, 0))
    for frame in frames:
        colours = frame.getpalette()
        colours[3 * ground : 3 * ground + 3] = [255, 255, 255]
        frame.putpalette(colours)
