"""Round holes cut into a meshed sheet, smaller or larger than its cells.

In a large enough cell the hole lies inside it, surrounded by four cells. Otherwise a node is
opened, and every cell around it loses that corner. No other cell changes.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chladni.errors import ModelError
from chladni.geometry.cells import edges_of

from .pressed_sheets import MAIN, Depth, PressedSheet

_ROOM = 1.8  # radii from a hole's middle to the sides of its cell, at least
_TIGHT = 1.45  # the least such distance as a last resort; the square's corners lie at 1.25
_SPOKE = 1.4  # radii from an opened node to its neighbours, at least
_CLOSE = 1.1  # the least such distance as a last resort
_LOOKED = 6  # nearest cells and nodes that are tried
_FAR = 8.0  # radii from the requested place beyond which a hole would be another hole


@dataclass(frozen=True, eq=False)
class _Choice:
    """A cell to hollow, or a node to open, and the place of the hole (y, s) [m]."""

    centre: np.ndarray
    row: int
    node: bool


def bored(
    sheet: PressedSheet, place: np.ndarray, radius: float, depth: Depth, surface: Depth
) -> tuple[PressedSheet, np.ndarray]:
    """The sheet with a hole at the feasible place nearest to (y, s), and that place (2,).

    The error of the hole's place is at most half a diagonal in cells smaller than four radii, and
    two radii in larger ones.
    """
    options = [*_cells(sheet, place, radius), *_nodes(sheet, place, radius)]
    options = options or _cells(sheet, place, radius, _TIGHT)
    options = options or _nodes(sheet, place, radius, _CLOSE)
    options = [o for o in options if np.linalg.norm(o.centre - place) < _FAR * radius]
    if not options:
        raise ModelError(
            f"{sheet.name}: no room for a hole of {2e3 * radius:g} mm near y {place[0]:.3f} m, "
            f"s {place[1]:.3f} m; move it or use another mesh size"
        )
    best = min(options, key=lambda o: float(np.linalg.norm(o.centre - place)))
    cells, new = (_opened if best.node else _hollowed)(sheet, best, radius)
    plan = np.vstack([sheet.plan, np.column_stack([new, depth(new)])])
    points = np.vstack([sheet.points, surface(plan[len(sheet.plan) :])])
    gone = np.arange(len(sheet.quads)) == best.row
    if best.node:
        gone = np.any(sheet.quads == best.row, axis=1)
    quads = np.vstack([sheet.quads[~gone], cells])
    zone = np.r_[sheet.zone[~gone], np.full(len(cells), MAIN)]
    made = replace(sheet, plan=plan, points=points, quads=quads, zone=zone)
    return (_without(made, best.row) if best.node else made), best.centre


def _cells(
    sheet: PressedSheet, place: np.ndarray, radius: float, room: float = _ROOM
) -> list[_Choice]:
    """Cells near the place that can hold the hole inside."""
    x = sheet.plan[sheet.quads][..., :2]
    whole = (sheet.zone == MAIN) & (sheet.quads[:, 2] != sheet.quads[:, 3])
    near = np.argsort(np.linalg.norm(x.mean(axis=1) - place, axis=1), kind="stable")
    found = []
    for row in near[whole[near]][:_LOOKED].tolist():
        u = (x[row, 1] + x[row, 2] - x[row, 0] - x[row, 3]) / 4
        v = (x[row, 2] + x[row, 3] - x[row, 0] - x[row, 1]) / 4
        middle = x[row].mean(axis=0)
        high = abs(u[0] * v[1] - u[1] * v[0]) / np.array([np.linalg.norm(v), np.linalg.norm(u)])
        play = 1 - room * radius / high  # of the natural coordinates
        if (play > 0).all():
            at = np.clip(np.linalg.solve(np.column_stack([u, v]), place - middle), -play, play)
            found.append(_Choice(middle + at @ np.stack([u, v]), row, False))
    return found


def _nodes(
    sheet: PressedSheet, place: np.ndarray, radius: float, spoke: float = _SPOKE
) -> list[_Choice]:
    """Inner nodes near the place whose neighbours are far enough away."""
    plan = sheet.plan[:, :2]
    sides, count = np.unique(edges_of(sheet.quads), axis=0, return_counts=True)
    rim = np.unique(np.r_[sides[count == 1].ravel(), sheet.quads[sheet.zone != MAIN].ravel()])
    near = np.argsort(np.linalg.norm(plan - place, axis=1), kind="stable")
    found = []
    for row in near[~np.isin(near, rim)][:_LOOKED].tolist():
        ends = sides[np.any(sides == row, axis=1)].sum(axis=1) - row
        if np.linalg.norm(plan[ends] - plan[row], axis=1).min() > spoke * radius:
            found.append(_Choice(plan[row], row, True))
    return found


def _hollowed(sheet: PressedSheet, at: _Choice, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Four cells round a square hole of the circle's area, and its corners (4, 2)."""
    corners = sheet.quads[at.row]
    x = sheet.plan[corners, :2]
    away = x - x.mean(axis=0)
    new = at.centre + np.sqrt(np.pi / 2) * radius * away / np.linalg.norm(away, axis=1)[:, None]
    ring = len(sheet.plan) + np.arange(4)
    after = np.roll(np.arange(4), -1)
    return np.column_stack([corners, corners[after], ring[after], ring]), new


def _opened(sheet: PressedSheet, at: _Choice, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells round a polygonal hole at a node, two for each quad there, and its corners (k, 2)."""
    plan, first = sheet.plan[:, :2], len(sheet.plan)
    new: dict[int, int] = {}

    def toward(node: int) -> int:
        return new.setdefault(node, first + len(new))

    cells = []
    for quad in sheet.quads[np.any(sheet.quads == at.row, axis=1)].tolist():
        ring = list(dict.fromkeys(quad))
        k = ring.index(at.row)
        a, *across, c = ring[k + 1 :] + ring[:k]
        stops = [a, *across, c]
        cells += [[toward(p), p, q, toward(q)] for p, q in pairwise(stops)]
    away = plan[list(new)] - at.centre
    places = at.centre + radius * away / np.linalg.norm(away, axis=1)[:, None]
    return np.array(cells), places


def _without(sheet: PressedSheet, row: int) -> PressedSheet:
    """The sheet without a node that no cell uses."""
    keep = np.arange(len(sheet.plan)) != row
    quads = sheet.quads - (sheet.quads > row)
    return replace(sheet, plan=sheet.plan[keep], points=sheet.points[keep], quads=quads)
