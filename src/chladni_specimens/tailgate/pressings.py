"""The tailgate's nine pressings as meshes of one size: strips along borders, the rest filled.

Window frames are only 50 to 70 mm wide.  They are meshed in strips from hem to window, so that a
size of 25 to 30 mm still has well-shaped cells there.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..forms.mesh_pieces import stops
from ..mesher.flat_regions import fill, grid, strip
from ..mesher.plane_curves import (
    Loop,
    arc_length,
    counterclockwise,
    in_step,
    rectangle,
    resampled,
    rounded,
    stadium,
)
from ..mesher.pressed_sheets import Patches, PressedSheet, fold, mirrored
from ..mesher.round_holes import bored
from .skin import Skin

INNER, OUTER_UPPER, OUTER_LOWER = "inner", "outer upper", "outer lower"
UPPER, LOWER, LATCH, BRACKET = (
    "upper reinforcements",
    "lower reinforcements",
    "latch reinforcement",
    "wiper motor bracket",
)
FOLD_GAP = 0.009  # least distance of folds that are meshed as two at any size
LEFT, RIGHT = " left", " right"  # sheets of one part; y is positive on the left


def without_side(sheet: str) -> str:
    """The part of a sheet; left and right share one."""
    return sheet.removesuffix(LEFT).removesuffix(RIGHT)


def cut(loop: np.ndarray, s: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut a closed line at height s: the arc above (from +y over the top), the arc below."""
    up = loop[:, 1] >= s
    rise = np.flatnonzero(up & ~np.roll(up, 1) & (loop[:, 0] > 0))[0]
    p, up = np.roll(loop, -rise, axis=0), np.roll(up, -rise)
    fall = int(np.argmin(up))

    def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a + (s - a[1]) / (b[1] - a[1]) * (b - a)

    start, end = between(p[-1], p[0]), between(p[fall - 1], p[fall])
    return np.vstack([start, p[:fall], end]), np.vstack([end, p[fall:], start])


def even(line: np.ndarray, size: float) -> np.ndarray:
    """The open line in an even number of pieces of about this size."""
    return resampled(line, count=2 * max(1, round(arc_length(line)[-1] / size / 2)), closed=False)


def wall(start: float, width: float, depth: float, size: float) -> np.ndarray:
    """Planform offsets across a wall whose slant height is cut into pieces of about `size`."""
    count = max(1, round(np.hypot(width, depth) / size))
    return start + np.linspace(0, width, count + 1)[1:]


@dataclass(frozen=True, eq=False)
class Borders:
    """Outline and window as evenly spaced points; both have `frame` pieces above the waist."""

    # outline, window: (n, 2) closed, the frame's arc first, from the left (+y) over the top
    outline: np.ndarray
    window: np.ndarray
    frame: int


def frame_lines(skin: Skin) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle line of the window frame and its feet on outline and window, dense (n, 2)."""
    arcs = [cut(loop.points, skin.design.frame)[0] for loop in (skin.outline, skin.window)]
    return in_step(skin.outline, skin.window, *arcs)


def borders(skin: Skin) -> Borders:
    """Outline and window at mesh size, in step along the frame."""
    size, (middle, *_) = skin.design.size, frame_lines(skin)
    points = even(middle, size)
    closed = []
    for loop in (skin.outline, skin.window):
        top = loop.nearest(points)
        closed.append(np.vstack([top[:-1], even(loop.between(top[-1], top[0]), size)[:-1]]))
    return Borders(closed[0], closed[1], len(points) - 1)


def _across(a: np.ndarray, b: np.ndarray, size: float) -> list[np.ndarray]:
    """Rows between two lines in step, both included."""
    count = max(1, round(np.linalg.norm(b - a, axis=1).mean() / size))
    return [a + t * (b - a) for t in np.linspace(0, 1, count + 1)]


def _offsets(loop: Loop, line: np.ndarray, inward: np.ndarray) -> list[np.ndarray]:
    return [loop.offset(line, x) for x in inward]


def _around(rows: list[np.ndarray], outer: np.ndarray, inner: np.ndarray, frame: int) -> np.ndarray:
    """Border of the region below a frame: outer arc, right cut, window's arc back, left cut.

    `outer` runs from the frame's end (-y) under the region to its start (+y). `inner` is the closed
    window row, `rows` are the frame's rows from outer to inner.
    """
    start = np.array([row[0] for row in rows[1:-1]]).reshape(-1, 2)
    end = np.array([row[-1] for row in rows[-2:0:-1]]).reshape(-1, 2)
    back = np.vstack([inner[:1], inner[:frame:-1], inner[frame : frame + 1]])
    return np.vstack([outer, start, back, end])


def inner_panel(skin: Skin, edge: Borders) -> PressedSheet:
    """Inner panel: hem and window flanges with their walls, frame strips, field with openings."""
    d, h = skin.design, skin.design.size
    flat = d.flange[0] - d.hem_clearance
    pieces = max(1, round(flat / min(h, 0.012)))
    offsets = np.linspace(d.hem_clearance, d.flange[0], pieces + 1)
    rows = _offsets(skin.outline, edge.outline, np.r_[offsets, wall(*d.flange, 0.055, h)])
    pieces = max(1, round(d.window_flange[0] / min(h, 0.013)))
    offsets = np.r_[np.linspace(0, d.window_flange[0], pieces + 1)]
    offsets = np.r_[offsets, wall(*d.window_flange, 0.055, h)]
    window = _offsets(skin.window, edge.window, -offsets[::-1])
    n = edge.frame
    frame = _across(rows[-1][: n + 1], window[0][: n + 1], h)
    loop = _around(frame, np.vstack([rows[-1][n:], rows[-1][:1]]), window[0], n)
    holes = [resampled(rectangle(y - a, s - b, y + a, s + b, r), h) for y, s, a, b, r in d.openings]
    out = Patches()
    out.add(strip(rows, closed=True), skin.inner)
    out.add(strip(window, closed=True), skin.inner)
    out.add(strip(frame, closed=False), skin.inner)
    out.add(fill(loop, h, holes, _inner_features(skin), closest=FOLD_GAP), skin.inner)
    return out.sheet(INNER, skin.at)


def _inner_features(skin: Skin) -> list[np.ndarray]:
    """Foot and top of the plateau's wall and of every bead."""
    d, h = skin.design, skin.design.size
    top = resampled(skin.plateau.points, h)
    lines = [top, skin.plateau.offset(top, -d.plateau_depth[1])]
    for a, b, half, _ in d.beads:
        lines += [resampled(stadium(a, b, half + w), h) for w in (d.bead_depth[1], 0.0)]
    return lines


def _folded(out: Patches, skin: Skin, arc: np.ndarray) -> None:
    """Add the base of the hem's U and the flange folded under the sheet, along an open arc."""
    d = skin.design
    fold(out, arc, skin.outline.offset(arc, d.hem_width), d.gap, closed=False)


def outer_upper_panel(skin: Skin, edge: Borders) -> PressedSheet:
    """Outer upper panel: frame in strips, the waist with the tongue of the seam filled."""
    d, h = skin.design, skin.design.size
    arc, start = _upper_arc(skin, edge)
    rows = _offsets(skin.outline, arc, np.array([0.0, 1, 2]) * (d.hem_width + 0.001))
    window = _offsets(skin.window, edge.window, -np.array([0.027, 0.013, 0.0]))
    n = edge.frame
    frame = _across(rows[-1][start : start + n + 1], window[0][: n + 1], h)
    row = rows[-1]
    under = np.vstack([row[start + n :], _tongue(skin, row)[1:-1], row[: start + 1]])
    out = Patches()
    _folded(out, skin, arc)
    out.add(strip(rows, closed=False), skin.outer_upper)
    out.add(strip(window, closed=True), skin.outer_upper)
    out.add(strip(frame, closed=False), skin.outer_upper)
    out.add(fill(_around(frame, under, window[0], n), h), skin.outer_upper)
    return out.sheet(OUTER_UPPER, skin.at)


def _upper_arc(skin: Skin, edge: Borders) -> tuple[np.ndarray, int]:
    """Outline above the seam (from +y over the top), and the start of the frame's arc in it."""
    size, over = skin.design.size, cut(skin.outline.points, skin.design.split)[0]
    frame = edge.outline[: edge.frame + 1]
    left, right = skin.outline.between(over[0], frame[0]), skin.outline.between(frame[-1], over[-1])
    left, right = even(left, size), even(right, size)
    return np.vstack([left[:-1], frame, right[1:]]), len(left) - 1


def seam_half(skin: Skin, row: np.ndarray) -> float:
    """Half width of the tongue that lies under the lower skin [m]."""
    return float(np.abs(row[[0, -1], 0]).min() - 0.012)


def _tongue(skin: Skin, row: np.ndarray) -> np.ndarray:
    """Lower border of the outer upper panel, from the end of a hem row (-y) to its start."""
    d, half = skin.design, seam_half(skin, row)
    low = d.split - d.tongue[0]
    stops = [row[-1], (-half, d.split), (-half, low), (half, low), (half, d.split), row[0]]
    line = [np.array(stops[:1])]
    for a, b in pairwise(stops):
        piece = np.array([a, b], dtype=float)
        cut_piece = (
            even(piece, d.size) if b[0] - a[0] > 0.3 else resampled(piece, d.size, closed=False)
        )
        line.append(cut_piece[1:])
    return np.vstack(line)


def outer_lower_panel(skin: Skin, edge: Borders) -> PressedSheet:
    """Outer lower panel with hem, licence plate recess and crease."""
    d, h = skin.design, skin.design.size
    _, under = cut(skin.outline.points, d.split)
    arc = even(under, h)
    rows = _offsets(skin.outline, arc, np.array([0.0, 1, 2]) * (d.hem_width + 0.001))
    top = even(rows[-1][[-1, 0]], h)
    half, s0, s1, _, w = d.plate
    y = np.arange(-0.5, 0.5 + h / 2, h)
    at, _, width = d.crease
    recess = [(w, w), (w / 2, w / 2), (0.0, 0.003)]  # foot, middle and top of its wall
    lines = [
        *(resampled(rectangle(-half - x, s0 - x, half + x, s1 + x, r), h) for x, r in recess),
        *(np.column_stack([y, np.full(len(y), at + k * width)]) for k in (-1, 0, 1)),
    ]
    out = Patches()
    _folded(out, skin, arc)
    out.add(strip(rows, closed=False), skin.outer_lower)
    out.add(
        fill(np.vstack([rows[-1][:-1], top[:-1]]), h, (), lines, closest=FOLD_GAP), skin.outer_lower
    )
    return out.sheet(OUTER_LOWER, skin.at)


def upper_edges(skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """Feet on outline and window of the upper left reinforcement's middle line, in step (n, 2)."""
    y0, s0, _, _ = skin.design.upper
    middle, *_ = frame_lines(skin)
    middle = middle[(middle[:, 0] > y0) & (middle[:, 1] > s0)]
    middle = resampled(middle, skin.design.size, closed=False)
    return skin.outline.nearest(middle), skin.window.nearest(middle)


def upper_left(skin: Skin) -> PressedSheet:
    """Upper left reinforcement: a strip between hem wall and window wall round the corner."""
    d, h = skin.design, skin.design.size
    a, b = upper_edges(skin)
    count = max(2, round(0.024 / h) + 1)
    hem = np.linspace(d.flange[0] + d.upper[2], sum(d.flange) + 0.001, count)
    window = np.linspace(sum(d.window_flange) + 0.001, d.window_flange[0] + d.upper[3], count)
    rows, last = _offsets(skin.outline, a, hem), _offsets(skin.window, b, -window)
    out = Patches()
    out.add(strip(rows + _across(rows[-1], last[0], h)[1:-1] + last, closed=False), skin.upper)
    return out.sheet(UPPER + LEFT, skin.at)


def lower_left(skin: Skin) -> PressedSheet:
    """Lower left reinforcement, a plate behind the hinge column."""
    y0, y1, s0, s1 = skin.design.lower
    corners = [(y0, s0, 0.015), (y1 - 0.014, s0, 0.015), (y1, s1, 0.015), (y0, s1, 0.015)]
    out = Patches()
    size = skin.design.size
    out.add(fill(resampled(counterclockwise(rounded(corners)), size), size), skin.lower)
    return out.sheet(LOWER + LEFT, skin.at)


def latch(skin: Skin) -> PressedSheet:
    """Latch reinforcement."""
    half, s0, s1 = skin.design.latch
    out, size = Patches(), skin.design.size
    out.add(fill(resampled(rectangle(-half, s0, half, s1, 0.015), size), size), skin.latch)
    return out.sheet(LATCH, skin.at)


def bracket(skin: Skin) -> PressedSheet:
    """Wiper motor bracket: a grid that follows its folds."""
    half, s0, s1 = skin.design.bracket
    y = stops([-half, -0.085, -0.067, 0.067, 0.085, half], skin.design.size)
    s = stops([s0, s0 + 0.017, s0 + 0.031, s1 - 0.034, s1 - 0.020, s1], skin.design.size)
    out = Patches()
    out.add(grid(y, s), skin.bracket)
    return out.sheet(BRACKET, skin.at)


def pressings(skin: Skin, holes: bool = True) -> dict[str, PressedSheet]:
    """All sheets by name, with or without bolt holes; names of pairs end in left (+y) and right."""
    edge = borders(skin)
    fine = skin.at_size(skin.design.inner_size * skin.design.size)
    inner, held = inner_panel(fine, borders(fine)), _held(skin)
    if holes and skin.design.hole:
        inner, held = _bored(skin, inner, held)
    upper, lower = held[UPPER + LEFT], held[LOWER + LEFT]
    sheets = [
        inner,
        outer_upper_panel(skin, edge),
        outer_lower_panel(skin, edge),
        upper,
        mirrored(upper, UPPER + RIGHT, skin.at),
        lower,
        mirrored(lower, LOWER + RIGHT, skin.at),
        held[LATCH],
        held[BRACKET],
    ]
    return {sheet.name: sheet for sheet in sheets}


def _held(skin: Skin) -> dict[str, PressedSheet]:
    """Sheets that are welded to the inner panel, only the left ones of pairs."""
    sheets = (upper_left(skin), lower_left(skin), latch(skin), bracket(skin))
    return {sheet.name: sheet for sheet in sheets}


def _bored(
    skin: Skin, inner: PressedSheet, held: dict[str, PressedSheet]
) -> tuple[PressedSheet, dict[str, PressedSheet]]:
    """Bore bolt holes through the reinforcements, and through the inner panel at their places."""
    d, held = skin.design, dict(held)
    depth = dict(zip(held, (skin.upper, skin.lower, skin.latch, skin.bracket), strict=True))
    for y, s, part, both in d.holes:
        name = part + LEFT if both else part
        held[name], at = bored(held[name], np.array([y, s]), d.hole, depth[name], skin.at)
        for side in (1, -1) if both else (1,):
            inner, _ = bored(inner, at * (side, 1), d.hole, skin.inner, skin.at)
    return inner, held
