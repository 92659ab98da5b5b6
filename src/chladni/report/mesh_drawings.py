"""Drawings on the mesh: shapes that move, maps of the faces, the places of sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import live_mesh
from .blocks import Drawing, Spatial
from .shown import Shown

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from ..case import Case
    from ..model.assembly import Assembly
    from ..view.paired_shapes import PairedShapes
    from ..view.surface import Surface
    from .blocks import Still

TURN = "Drag to turn; click, then scroll to zoom."
EXPANDED = "expanded"  # side of the test on the whole mesh, as the page calls it
_PAIRED = "The test moves at its sensors, the model as a whole."
ON_MESH = (
    "The test is expanded to the whole mesh by the mixture of the model's modes that fits it best "
    "(SEREP). Choose the test to see it at its sensors alone."
)
_PAIRS = 8  # in a picture
_OUTSIDE = 0.02  # of the structure's size: as far from a wall a place is looked at


def mesh_of(seen: Surface, assembly: Assembly) -> Shown:
    """A structure with the names of its parts and grids."""
    return Shown(seen, [p.name for p in assembly.parts], assembly.ids)


def case_shown(case: Case) -> Shown:
    """The structure of a case with its sensors, shakers and cords."""
    from ..view.surface import surface
    from ..workflows.case_model import cords, markers

    return replace(
        mesh_of(surface(case.assembly), case.assembly),
        outputs=markers(case.outputs), inputs=markers(case.inputs), cords=cords(case),
    )  # fmt: skip


def spatial(draw: str, shown: Shown, data: Callable[[], Mapping[str, Any]]) -> Spatial | None:
    """Numbers of a drawing on a mesh that a browser can turn; None of a larger one."""
    small = len(shown.seen.faces) <= live_mesh.MOST_FACES
    return Spatial(draw, data(), shown) if small else None


def _picture(function: str, **given: Any) -> Still:
    """A picture by a function of ``view/scene.py``, which is loaded when it draws."""

    def draw(path: Path) -> object:
        from ..view import scene

        return getattr(scene, function)(path, **given)

    return draw


def mode_shapes(
    shown: Shown,
    motion: np.ndarray,
    f: np.ndarray,
    numbers: Sequence[int],
    drawn: int = 12,
    what: str = "",
    picture: str = "shapes",
    mac: Mapping[str, np.ndarray] | None = None,
) -> list[Drawing]:
    """Shapes (n, 3, r) of a model that move; the ``picture`` has the first of them."""
    side = live_mesh.ModeSet(f, motion, numbers=numbers)
    rows = [[k] for k in range(len(f))]
    return _beside({"model": side}, rows, shown, drawn, what, picture, mac)


def two_models(
    shown: Shown, other: str, shapes: np.ndarray, f_other: np.ndarray, numbers_other: Sequence[int],
    motion: np.ndarray, f: np.ndarray, numbers: Sequence[int], pairs: Sequence[tuple[int, int]],
    mac: np.ndarray, drawn: int = 12,
) -> list[Drawing]:  # fmt: skip
    """Shapes (n, 3, r) of another model next to those of the model; MAC (other, model)."""
    partner, shapes = dict(pairs), _as_partners(shapes, motion, pairs)
    sides = {
        other: live_mesh.ModeSet(f_other, shapes, numbers=numbers_other),
        "model": live_mesh.ModeSet(f, motion, numbers=numbers),
    }
    rows, alike = [[k, partner.get(k)] for k in range(len(f_other))], {f"{other}|model": mac}
    return _beside(sides, rows, shown, drawn, f"shapes of {other}", "shapes", alike)


def _beside(
    sides: Mapping[str, live_mesh.ModeSet], rows: Sequence[Sequence[int | None]], shown: Shown,
    drawn: int, what: str, picture: str, mac: Mapping[str, np.ndarray] | None,
) -> list[Drawing]:  # fmt: skip
    """Modes of whole models side by side; the ``picture`` has some of the first side."""
    first, some = next(iter(sides.values())), slice(drawn)
    assert first.motion is not None
    if not len(first.f):
        return []
    still = _picture("montage", seen=shown.seen, shapes=first.motion[:, :, some],
                     frequency=first.f[some], numbers=first.numbers[some])  # fmt: skip
    content = spatial("shapes", shown, lambda: live_mesh.shapes(sides, rows, shown, mac=mac))
    return [Drawing("shapes", content, TURN, {picture: still}, what)]


def _as_partners(
    shapes: np.ndarray, motion: np.ndarray, pairs: Sequence[tuple[int, int]]
) -> np.ndarray:
    """Shapes (n, 3, r) that move the way of their partners in ``motion`` (n, 3, q)."""
    out = shapes.copy()
    for k, j in pairs:
        out[:, :, k] *= np.sign((shapes[:, :, k] * motion[:, :, j]).sum()) or 1.0
    return out


def shape_pairs(
    shown: Shown, found: PairedShapes | None, sensors: Sequence[str], mac: np.ndarray | None,
    expanded: np.ndarray | None = None,
) -> list[Drawing]:  # fmt: skip
    """Draw test next to model; MAC (test, model), and the test ``expanded`` (n, 3, r) if it is."""
    if found is None or not len(found.f_test):
        return []

    def moving() -> Mapping[str, Any]:
        from ..view.annotations import Marker

        at = zip(found.points.tolist(), found.directions.tolist(), sensors, strict=True)
        partner = dict(found.pairs)
        model = live_mesh.ModeSet(found.f_model, found.motion, found.model, found.numbers)
        tests = {"test": live_mesh.ModeSet(found.f_test, sensors=found.test)}
        if expanded is not None:
            whole = _as_partners(expanded, found.motion, found.pairs)
            tests = {EXPANDED: live_mesh.ModeSet(found.f_test, whole, found.test), **tests}
        rows = [[*[k] * len(tests), partner.get(k)] for k in range(len(found.f_test))]
        places = [Marker(x, n, label) for x, n, label in at]
        alike = {} if mac is None else {f"{name}|model": mac for name in tests}
        return live_mesh.shapes({**tests, "model": model}, rows, shown, places, alike)

    def draw(path: Path) -> object:
        from ..view.shape_pairs import shape_pairs as picture

        return picture(path, shown.seen, found, _PAIRS)

    stills: dict[str, Still] = {"shapes": draw} if len(found.pairs) else {}
    said = _PAIRED if expanded is None else ON_MESH
    return [Drawing("shapes", spatial("shapes", shown, moving), f"{TURN} {said}", stills,
                    "shapes", wide=mac is None)]  # fmt: skip


def layout(name: str, shown: Shown, picture: str, caption: str, what: str = "",
           shaker: str = "shaker") -> Drawing:  # fmt: skip
    """Sensors, shakers and cords on the mesh; ``picture`` is the name of the file."""

    def placed() -> Mapping[str, Any]:
        chosen = shown.inputs or shown.outputs
        at, along = (np.array([getattr(m, k) for m in chosen]).reshape(-1, 3)
                     for k in ("point", "direction"))  # fmt: skip
        seen_from = live_mesh.view_of(at + _OUTSIDE * shown.seen.size * along, shown)
        return {"spots": [], "setup": live_mesh.setup(shown), "from": seen_from}

    still = _picture("sensors", seen=shown.seen, outputs=shown.outputs, inputs=shown.inputs,
                    cords=shown.cords, shaker=shaker)  # fmt: skip
    return Drawing(name, spatial("structure", shown, placed), caption, {picture: still}, what)


def field(
    shown: Shown, values: np.ndarray, limits: tuple[float, float], name: str, title: str,
    caption: str = "", colours: str = "YlGnBu_r",
) -> Drawing:  # fmt: skip
    """Colours by a value of each face (m,); ``title`` is the quantity with its unit."""
    still = _picture("scalar_map", seen=shown.seen, values=values, name=title, cmap=colours,
                    limits=limits)  # fmt: skip
    data = spatial(
        "remainder", shown, lambda: live_mesh.field(values, shown, limits, title, colours)
    )
    return Drawing(name, data, caption, {name: still}, title)
