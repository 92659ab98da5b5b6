"""The pictures of a diagnosis or calibration, from its JSON and its curves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics.frf import FRF, UNIT
from ..ema.correlation import deviation
from ..view import plots, scene
from ..view.surface import Surface

_GRID = 8  # channels in the overview
Bands = Sequence[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Shown:
    """What there is to draw beside the numbers of ``diagnosis.json``.

    Attributes
    ----------
    seen : Surface                 of the model
    parts : names, by the numbers in ``seen.part``; ids of the points of ``seen``
    curves : {"test", "before", "after"} or {"test", "model"} to FRF, same channels and lines
    held_out : labels of outputs that were not fitted
    fitted, excluded : bands [Hz]
    outputs, inputs : sensors and shakers as markers
    mac : (test modes, model modes) after, with their frequencies [Hz], or None
    """

    seen: Surface
    parts: Sequence[str] = ()
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    curves: Mapping[str, FRF] = field(default_factory=dict)
    held_out: Sequence[str] = ()
    fitted: Bands = ()
    excluded: Bands = ()
    outputs: Sequence[scene.Marker] = ()
    inputs: Sequence[scene.Marker] = ()
    mac: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None


def figures(folder: Path, d: Mapping[str, Any], shown: Shown) -> dict[str, Path]:
    """Draw all that the data allows into ``folder``: {name known to the page: path}."""
    made = _places(folder, d, shown)
    made |= _scores(folder, d)
    made |= _frequencies(folder, d, shown)
    return made | _curves(folder, shown)


def _places(folder: Path, d: Mapping[str, Any], shown: Shown) -> dict[str, Path]:
    made = {}
    for k, effect in enumerate(d.get("effects") or []):
        name = "where" if k == 0 else f"where_{k + 1}"
        if (path := _where(folder / f"{name}.png", effect, shown)) is not None:
            made[name] = path
    if shown.outputs or shown.inputs:
        path = folder / "setup.png"
        made["setup"] = scene.sensors(path, shown.seen, shown.outputs, shown.inputs)
    return made


def _where(path: Path, effect: Mapping[str, Any], shown: Shown) -> Path | None:
    """A marked point, else the middle of the grids, else the parts in colour."""
    where = effect.get("where") or {}
    point, grids = where.get("point_m"), list(where.get("grids") or [])
    if point is None and grids and len(shown.ids):
        point = shown.seen.points[np.isin(shown.ids, grids)].mean(axis=0)  # rows as ids
    faces = None if point is not None else _of_parts(where, shown)
    if point is None and faces is None:
        return None
    text = " – ".join(str(t) for t in (effect.get("name"), where.get("text")) if t)
    radius = float(where.get("radius_m") or 0.0)
    place = None if point is None else np.asarray(point, dtype=float)
    return scene.location(path, shown.seen, place, radius, text, faces)


def _of_parts(where: Mapping[str, Any], shown: Shown) -> np.ndarray | None:
    """Faces of the parts that are named (m,) bool."""
    named = np.isin(list(shown.parts), [str(p) for p in where.get("parts") or []])
    return named[np.asarray(shown.seen.part)] if named.any() else None


def _scores(folder: Path, d: Mapping[str, Any]) -> dict[str, Path]:
    made, fit = {}, d.get("fit") or {}
    for name, q in (("waterfall", fit), ("held_out", fit.get("held_out") or {})):
        steps = {label: q[key] for label, key in _STEPS if q.get(key) is not None}
        if len(steps) > 1:
            path = folder / f"{name}.png"
            made[name] = plots.waterfall(path, steps, q.get("Q_floor"))
    evidence = {
        str(h["name"]): float(h["log_evidence"])
        for h in [*(d.get("effects") or []), *(d.get("alternatives") or [])]
        if h.get("log_evidence") is not None
    }
    if len(evidence) > 1:
        made["evidence"] = plots.evidence_bars(folder / "evidence.png", evidence)
    return made


_STEPS = (
    ("nominal", "Q_nominal"),
    ("calibrated", "Q_calibrated"),
    ("with the effect", "Q_with_effect"),
)


def _frequencies(folder: Path, d: Mapping[str, Any], shown: Shown) -> dict[str, Path]:
    made, held = {}, [r for r in d.get("frequencies") or [] if r.get("test_hz")]
    if held:
        test, before, after = (
            np.array([r.get(key) or np.nan for r in held], dtype=float)
            for key in ("test_hz", "before_hz", "after_hz")
        )
        path = folder / "frequencies.png"
        changed = after if np.isfinite(after).any() else None
        made["frequencies"] = plots.frequency_ladder(path, test, before, changed)
    if shown.mac is not None:
        mac, test, model = shown.mac
        rows, columns = ([f"{f:.4g}" for f in side] for side in (test, model))
        title = "MAC: test (rows), model (columns)"
        made["mac"] = plots.mac_matrix(folder / "mac.png", mac, rows, columns, title)
    return made


def _curves(folder: Path, shown: Shown) -> dict[str, Path]:
    """One typical channel of each kind, and an overview: not the best ones, the median ones."""
    if "test" not in shown.curves:
        return {}
    test, made = shown.curves["test"], {}
    held = [o for o in test.outputs if o in set(shown.held_out)]
    kinds = {"frf_fitted": [o for o in test.outputs if o not in held], "frf_held_out": held}
    typical = {name: _typical(shown, labels) for name, labels in kinds.items() if labels}
    for name, (output, drive) in typical.items():
        title = f"{output} from {drive}" + (" (held out)" if name == "frf_held_out" else "")
        made[name] = plots.frf(
            folder / f"{name}.png",
            _channel(shown, output, drive),
            title,
            UNIT.get(test.quantity, ""),
            shown.fitted,
            shown.excluded,
        )
    if len(test.outputs) * len(test.inputs) > 2:
        made["frf_grid"] = _overview(folder / "frf_grid.png", shown, held)
    return made


def _overview(path: Path, shown: Shown, held: Sequence[str]) -> Path:
    """Channels spread evenly over the list."""
    test = shown.curves["test"]
    every = [(o, i) for i in test.inputs for o in test.outputs]
    some = [every[k] for k in np.unique(np.linspace(0, len(every) - 1, _GRID).astype(int))]
    channels = {
        f"{o} from {i}" + (" (held out)" if o in held else ""): _channel(shown, o, i)
        for o, i in some
    }
    return plots.frf_grid(path, channels, UNIT.get(test.quantity, ""), shown.fitted, shown.excluded)


def _channel(shown: Shown, output: str, drive: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    found = {}
    for name, frf in shown.curves.items():
        one = frf.sel(outputs=[output], inputs=[drive])
        found[name] = (one.frequency, one.values[:, 0, 0])
    return found


def _typical(shown: Shown, outputs: Sequence[str]) -> tuple[str, str]:
    """The channel whose deviation after is the median one."""
    test = shown.curves["test"].sel(outputs=outputs)
    names = [name for name in ("after", "before", "model") if name in shown.curves]
    model = shown.curves[names[0]] if names else None
    if model is None:
        return test.outputs[0], test.inputs[0]
    delta = np.abs(deviation(model.sel(outputs=outputs), test)) ** 2
    size = np.nanmean(delta, axis=0)
    i, j = np.unravel_index(np.argsort(size, axis=None)[size.size // 2], size.shape)
    return test.outputs[i], test.inputs[j]
