"""The rotatable mesh: places of effects, residual, mode shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry.cells import directed_edges
from ..view.camera import best_view

if TYPE_CHECKING:
    from ..effects.estimate import Location
    from ..inference.result import LeftPlace
    from ..view.annotations import Marker
    from ..view.surface import Surface
    from .shown import Shown

MOST_FACES = 150_000  # a browser still turns
_ALL_EDGES = 5000  # faces up to which every edge is drawn
_SHAPE_VALUES = 1_500_000  # of all motions on a page: about 4 MB
_FINE = 1e-5  # of the structure's size: how exactly places are kept
_THOUSANDTH = 1e-3


def rounded(values: np.ndarray, step: float) -> list[Any]:
    """Values over ``step`` as whole numbers, nan as None: short when compressed."""
    finite = np.isfinite(values)
    whole = np.rint(np.where(finite, values, 0.0) / step).astype(int).astype(object)
    whole[~finite] = None
    return list(whole.tolist())


def mesh(shown: Shown) -> dict[str, Any]:
    """Points, triangles, edges and names; of solids the skin, without the bodies of joints."""
    seen = shown.seen.without_joints()
    used, step = seen.used, _FINE * seen.size
    row = np.zeros(len(seen.points), int)
    row[used] = np.arange(len(used))
    triangles, face = _triangles(seen)
    edges = seen.outline()
    fine = directed_edges(seen.faces)[0] if len(seen.faces) <= _ALL_EDGES else edges[:0]
    camera = best_view(seen)
    place = zip("xyz", seen.points[used].T, strict=True)
    return {
        "step": step,
        "size": seen.size,
        "unit": seen.unit,
        **{axis: rounded(values, step) for axis, values in place},
        **{side: row[triangles[:, k]] for k, side in enumerate("ijk")},
        "face": face,
        "part": np.asarray(seen.part),
        "parts": [str(name) for name in shown.parts],
        "ids": shown.ids[used] if len(shown.ids) else [],
        "edges": row[edges],
        "fine": row[np.unique(np.sort(fine, axis=1), axis=0)] if len(fine) else [],
        "eye": camera.toward,
        "up": camera.up,
    }


def _triangles(seen: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3) of the triangles that faces are cut into, and the face of each (n,)."""
    four = seen.faces[:, 3] != seen.faces[:, 2]
    corners = np.concatenate([seen.faces[:, :3], seen.faces[four][:, [0, 2, 3]]])
    return corners, np.concatenate([np.arange(len(seen.faces)), np.flatnonzero(four)])


def marked(where: Location | LeftPlace, shown: Shown) -> tuple[np.ndarray, float]:
    """Points (k, 3) of a place, and the radius about its only one: several grids, else a point."""
    grids, point = getattr(where, "grids", ()), where.point_m
    if len(shown.ids) and (len(grids) > 1 or point is None) and np.isin(shown.ids, grids).any():
        return shown.seen.points[np.isin(shown.ids, grids)], 0.0  # rows as ids
    known = np.array([] if point is None else point, dtype=float)
    return known.reshape(-1, 3), getattr(where, "radius_m", None) or 0.0


def spots(
    places: Sequence[tuple[str, str, Location | LeftPlace, int]], shown: Shown
) -> list[dict[str, Any]]:
    """Places (name, words, place, rank): points with a radius, else channels, else parts."""
    found = []
    for name, text, where, rank in places:
        at, radius = marked(where, shown)
        if not len(at) and (channels := getattr(where, "channels", ())):
            sensors = [m.point for m in shown.outputs if m.label in channels]
            at = np.array(sensors).reshape(-1, 3)
        parts = [] if len(at) else [k for k, p in enumerate(shown.parts) if p in where.parts]
        if len(at) or parts:
            found.append({"name": name, "text": text, "at": at, "radius": radius, "parts": parts,
                          "rank": rank})  # fmt: skip
    return found


def view_of(points: np.ndarray, shown: Shown) -> dict[str, np.ndarray]:
    """The camera from which places (k, 3) are seen, for a drawing."""
    camera = best_view(shown.seen.without_joints(), points)
    return {"eye": camera.toward, "up": camera.up}


def setup(shown: Shown) -> dict[str, Any]:
    """Sensors, those held out, shakers and cords."""
    held = set(shown.held_out)
    sides = {
        "sensors": [m for m in shown.outputs if m.label not in held],
        "held-out sensors": [m for m in shown.outputs if m.label in held],
        "drive point": shown.inputs,
        "cords": shown.cords,
    }
    return {name: _markers(markers) for name, markers in sides.items() if markers}


def _markers(markers: Sequence[Marker]) -> list[dict[str, Any]]:
    return [{"at": m.point, "along": m.direction, "label": m.label} for m in markers]


def field(
    values: np.ndarray, shown: Shown, limits: tuple[float, float], title: str, colours: str
) -> dict[str, Any]:
    """Values (m,) of all faces; not finite: grey."""
    low, top = limits
    step = max(top - low, 1e-300) / 1000
    drawn = rounded(values[~np.asarray(shown.seen.joint)], step)
    return {"value": drawn, "step": step, "low": low, "top": top, "title": title,
            "colours": colours}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ModeSet:
    """Modes of the test or of a deck, as they are drawn next to others."""

    f: np.ndarray  # (r,) [Hz]
    motion: np.ndarray | None = None  # (n, 3, r) of all points; None: of the sensors alone
    sensors: np.ndarray | None = None  # (k, r) along the sensors' directions
    numbers: Sequence[int] = ()
    damping: Sequence[float | None] = ()

    def drawn(self, k: int, used: np.ndarray) -> dict[str, Any]:
        """One mode, the motion of the points in use over its largest, in thousandths."""
        mode: dict[str, Any] = {"hz": float(self.f[k])}
        mode |= {"number": int(self.numbers[k])} if len(self.numbers) else {}
        mode |= {"damping": self.damping[k]} if len(self.damping) else {}
        at_sensors = None if self.sensors is None else _shares(self.sensors[:, k])
        if self.motion is None:
            return mode | {"motion": at_sensors}
        return mode | {"motion": _shares(self.motion[used, :, k]), "sensors": at_sensors}


def _shares(motion: np.ndarray) -> list[Any]:
    """Motion (k,), or by axis of (n, 3), over the largest."""
    size = np.abs(motion) if motion.ndim == 1 else np.linalg.norm(motion, axis=1)
    return rounded(motion.T / max(float(size.max(initial=0.0)), 1e-300), _THOUSANDTH)


def shapes(
    sides: Mapping[str, ModeSet], rows: Sequence[Sequence[int | None]], shown: Shown,
    sensors: Sequence[Marker] = (), mac: Mapping[str, np.ndarray] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Modes of every side, and rows of those that belong together.

    Parameters
    ----------
    rows : positions of the modes in the sides, None without a partner
    mac : by "side|side", (modes of one, modes of the other)
    """
    used = shown.seen.without_joints().used
    decks = sum(side.motion is not None for side in sides.values())
    room = _SHAPE_VALUES // max(1, 3 * decks * len(used))  # modes of each deck

    def held(name: str) -> int:
        return len(sides[name].f) if sides[name].motion is None else min(room, len(sides[name].f))

    kept = [[None if k is None or k >= held(name) else k
             for name, k in zip(sides, row, strict=True)] for row in rows]  # fmt: skip
    return {
        "sides": {name: [side.drawn(k, used) for k in range(held(name))]
                  for name, side in sides.items()},
        "rows": [row for row in kept if row != [None] * len(sides)],
        "mac": {name: np.round(value, 3).tolist() for name, value in (mac or {}).items()},
        "sensors": _markers(sensors),
    }  # fmt: skip
