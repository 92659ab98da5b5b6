"""The rotatable mesh: places of effects, residual, mode shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry.cells import directed_edges
from ..view.camera import best_view

if TYPE_CHECKING:
    from ..effects.estimate import Location
    from ..fem.measured_dofs import MeasuredDofs
    from ..fem.modelled import Modelled
    from ..inference.result import FrequencyRow, LeftPlace
    from ..search.measured_modes import MeasuredModes
    from ..view.annotations import Marker
    from ..view.paired_shapes import PairedShapes
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


def spots(places: Sequence[tuple[str, Location | LeftPlace]], shown: Shown) -> list[dict[str, Any]]:
    """Named places: a point with its radius, else grids, else parts, else channels."""
    from ..effects.estimate import Location as Place

    found = []
    for text, where in places:
        at, radius = np.zeros((0, 3)), 0.0
        if where.point_m is not None:
            at = np.array([where.point_m], dtype=float)
        if isinstance(where, Place):
            radius = where.radius_m or 0.0
            if not len(at) and len(shown.ids):
                at = shown.seen.points[np.isin(shown.ids, where.grids)]
            if not len(at):
                at = np.array([m.point for m in shown.outputs if m.label in where.channels])
        parts = [] if len(at) else [k for k, p in enumerate(shown.parts) if p in where.parts]
        if len(at) or parts:
            found.append({"text": text, "at": at, "radius": radius, "parts": parts})
    return found


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


def shapes(
    test: MeasuredModes, rows: Sequence[FrequencyRow], stages: Mapping[str, Modelled],
    outputs: MeasuredDofs, shown: Shown,
) -> dict[str, Any]:  # fmt: skip
    """Every mode of the test at its sensors, and of its partners the whole motion."""
    used = shown.seen.without_joints().used
    room = _SHAPE_VALUES // max(1, 3 * len(used) * len(stages))
    motions = {name: _motions(model, name, rows[:room], shown, used, outputs)
               for name, model in stages.items()}  # fmt: skip
    modes = []
    for k, row in enumerate(rows[:room]):
        seen = None if test.shapes is None else test.shapes[:, k]
        mode: dict[str, Any] = {"test": {"hz": row.test_hz, "damping": row.damping}}
        sign = 1.0
        for name in stages:
            if k in motions[name]:
                motion, at_sensors = motions[name][k]
                if seen is not None:  # the test has no sign of its own, the first model lends it
                    sign = sign if len(mode) > 1 else np.sign(seen @ at_sensors) or 1.0
                    motion = motion * (np.sign(sign * seen @ at_sensors) or 1.0)
                mode[name] = {
                    "hz": getattr(row, f"{name}_hz"),
                    "mac": getattr(row, f"mac_{name}"),
                    "motion": [rounded(axis, _THOUSANDTH) for axis in motion.T],
                }
        if seen is not None:
            share = sign * seen / max(float(np.abs(seen).max()), 1e-300)
            mode["test"]["motion"] = rounded(share, _THOUSANDTH)
        modes.append(mode)
    return {"modes": modes, "left_out": len(rows) - len(modes), "sensors": _markers(shown.outputs)}


def model_shapes(
    motion: np.ndarray, f: np.ndarray, numbers: Sequence[int], shown: Shown
) -> dict[str, Any]:
    """Modes (n, 3, r) of a model alone, with their numbers."""
    used = shown.seen.without_joints().used
    room = _SHAPE_VALUES // max(1, 3 * len(used))
    modes = [
        {"model": {"hz": float(f[k]), "number": int(number), "motion": _axes(motion[used, :, k])}}
        for k, number in enumerate(numbers[:room])
    ]
    return {"modes": modes, "left_out": len(numbers) - len(modes), "sensors": []}


def paired_shapes(found: PairedShapes, sensors: Sequence[str], shown: Shown) -> dict[str, Any]:
    """Pairs of test and model."""
    used = shown.seen.without_joints().used
    room = _SHAPE_VALUES // max(1, 3 * len(used))
    modes = []
    for k in range(min(room, len(found.f_test))):
        of_model = {"hz": float(found.f_model[k]), "mac": float(found.mac[k]),
                    "motion": _axes(found.motion[used, :, k])}  # fmt: skip
        of_test = {"hz": float(found.f_test[k]), "motion": rounded(found.test[:, k], _THOUSANDTH)}
        modes.append({"test": of_test, "model": of_model})
    at = zip(found.points.tolist(), found.directions.tolist(), sensors, strict=True)
    places = [{"at": point, "along": along, "label": label} for point, along, label in at]
    return {"modes": modes, "left_out": len(found.f_test) - len(modes), "sensors": places}


def _axes(motion: np.ndarray) -> list[Any]:
    """Motion (n, 3) of largest 1, by axis."""
    largest = max(float(np.linalg.norm(motion, axis=1).max(initial=0.0)), 1e-300)
    return [rounded(axis, _THOUSANDTH) for axis in motion.T / largest]


def _motions(
    model: Modelled, name: str, rows: Sequence[FrequencyRow], shown: Shown, used: np.ndarray,
    outputs: MeasuredDofs,
) -> dict[int, tuple[np.ndarray, np.ndarray]]:  # fmt: skip
    """By row: the partner's motion of all points (n, 3), of largest 1, and at the sensors."""
    s, found = model.structure, {}
    at = s.assembly.rows(shown.ids[used])
    sensors = outputs.rows(s)
    for k, row in enumerate(rows):
        if f := getattr(row, f"{name}_hz"):
            phi = model.modes.shapes[:, np.abs(model.modes.frequency - f).argmin()]
            motion = np.asarray(s.T @ phi).reshape(-1, 6)[at, :3]
            largest = max(float(np.linalg.norm(motion, axis=1).max()), 1e-300)
            found[k] = motion / largest, np.asarray(sensors @ phi) / largest
    return found
