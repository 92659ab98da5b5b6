"""Drawings on the mesh: shapes that move, maps of the faces, the places of sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import live_mesh
from .blocks import Drawing, Spatial
from .shown import Shown

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from ..model.assembly import Assembly
    from ..view.paired_shapes import PairedShapes
    from ..view.surface import Surface
    from .blocks import Still

_SHAPES = "Choose a mode; drag to turn, scroll to zoom. Colour: share of the largest motion."
_PAIRS = 8  # in a picture


def mesh_of(seen: Surface, assembly: Assembly) -> Shown:
    """A structure with the names of its parts and grids."""
    return Shown(seen, [p.name for p in assembly.parts], assembly.ids)


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
) -> list[Drawing]:
    """Shapes (n, 3, r) of a model that move; the ``picture`` has the first of them."""
    if not len(f):
        return []
    some = slice(drawn)
    still = _picture("montage", seen=shown.seen, shapes=motion[:, :, some], frequency=f[some],
                      numbers=numbers[some])  # fmt: skip
    data = spatial("shapes", shown, lambda: live_mesh.model_shapes(motion, f, numbers, shown))
    return [Drawing("shapes", data, _SHAPES, {picture: still}, what)]


def shape_pairs(
    shown: Shown, found: PairedShapes | None, sensors: Sequence[str], caption: str
) -> list[Drawing]:
    """Draw test next to model."""
    if found is None or not len(found.f_test):
        return []
    data = spatial("shapes", shown, lambda: live_mesh.paired_shapes(found, sensors, shown))

    def draw(path: Path) -> object:
        from ..view.shape_pairs import shape_pairs as picture

        return picture(path, shown.seen, found.first(_PAIRS))

    stills: dict[str, Still] = {"shapes": draw}
    return [Drawing("shapes", data, f"{_SHAPES} {caption}".strip(), stills, "shapes")]


def layout(name: str, shown: Shown, picture: str, caption: str, what: str = "",
           shaker: str = "shaker") -> Drawing:  # fmt: skip
    """Sensors, shakers and cords on the mesh; ``picture`` is the name of the file."""
    data = spatial("structure", shown, lambda: {"spots": [], "setup": live_mesh.setup(shown)})
    still = _picture("sensors", seen=shown.seen, outputs=shown.outputs, inputs=shown.inputs,
                    cords=shown.cords, shaker=shaker)  # fmt: skip
    return Drawing(name, data, caption, {picture: still}, what)


def field(
    shown: Shown, values: np.ndarray, limits: tuple[float, float], name: str, title: str,
    caption: str = "", colours: str = "YlGnBu",
) -> Drawing:  # fmt: skip
    """Colours by a value of each face (m,); ``title`` is the quantity with its unit."""
    still = _picture("scalar_map", seen=shown.seen, values=values, name=title, cmap=colours,
                    limits=limits)  # fmt: skip
    data = spatial(
        "remainder", shown, lambda: live_mesh.field(values, shown, limits, title, colours)
    )
    return Drawing(name, data, caption, {name: still}, title)
