"""Drawings of the pages of the other commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..view.surface import Surface
from . import live_curves, live_mesh, live_panels
from .blocks import Live, Picture
from .drawings import Drawing, Drawings
from .shown import Shown

if TYPE_CHECKING:
    from ..dynamics.frf import FRF
    from ..ema.level_table import LevelTable
    from ..model.assembly import Assembly
    from ..view.paired_shapes import PairedShapes
    from ..workflows.identify import RecordingModes
    from .blocks import Block

_MOST_POLES = 5000
_KINDS = {"o": "new", "f": "frequency", "d": "and damping", "v": "and shape", "s": "all steady"}
_SHAPES = "Choose a mode; drag to turn, scroll to zoom. Colour: share of the largest motion."
_FRF = "Drag to zoom, double-click to see all, click a name to hide its curve."
_POLES = (
    "Poles of every order, compared with the order before (Heylen, Lammens and Sas, 1997). "
    "Lines: poles kept; dotted: poles rejected. Point at a pole for its numbers, click it to "
    "pick it."
)


class Page:
    """Drawings of a page, gathered as its blocks are made."""

    def __init__(self) -> None:
        self.by_name: dict[str, Drawing] = {}
        self.shared: dict[str, Any] = {}

    def live(
        self, name: str, draw: str, data: Mapping[str, Any], stills: Sequence[Picture] = (),
        caption: str = "",
    ) -> Live:  # fmt: skip
        """A block of the page, its numbers kept."""
        names = [picture.path.stem for picture in stills]
        self.by_name[name] = Drawing(draw, "", data, names, caption)
        return Live(name, draw, stills, caption)

    def mesh(self, shown: Shown) -> bool:
        """Keep the mesh if a browser can turn it; False if it is too large."""
        if len(shown.seen.faces) > live_mesh.MOST_FACES:
            return False
        self.shared = self.shared or {"mesh": live_mesh.mesh(shown)}
        return True

    @property
    def drawings(self) -> Drawings:
        """All that was gathered."""
        return Drawings(self.by_name, self.shared)


def mesh_of(seen: Surface, assembly: Assembly) -> Shown:
    """A structure with the names of its parts and grids."""
    return Shown(seen, [p.name for p in assembly.parts], assembly.ids)


def mode_shapes(
    page: Page, shown: Shown, motion: np.ndarray, f: np.ndarray, numbers: Sequence[int],
    stills: Sequence[Picture],
) -> Sequence[Block]:  # fmt: skip
    """Shapes (n, 3, r) of a model that move."""
    if not len(f) or not page.mesh(shown):
        return stills
    data = live_mesh.model_shapes(motion, f, numbers, shown)
    return [page.live("shapes", "shapes", data, stills, _SHAPES)]


def shape_pairs(
    page: Page, shown: Shown, found: PairedShapes | None, sensors: Sequence[str],
    stills: Sequence[Picture],
) -> Sequence[Block]:  # fmt: skip
    """Draw test next to model."""
    if found is None or not len(found.f_test) or not page.mesh(shown):
        return stills
    data = live_mesh.paired_shapes(found, sensors, shown)
    return [page.live("shapes", "shapes", data, stills, _SHAPES)]


def layout(page: Page, name: str, shown: Shown, stills: Sequence[Picture]) -> Sequence[Block]:
    """Sensors, shakers and cords on a mesh that turns."""
    if not page.mesh(shown):
        return stills
    data = {"spots": [], "setup": live_mesh.setup(shown)}
    return [page.live(name, "structure", data, stills, stills[0].caption if stills else "")]


def field(
    page: Page, shown: Shown, values: np.ndarray, limits: tuple[float, float], still: Picture,
    title: str,
) -> Block:  # fmt: skip
    """Colours by a value of each face (m,)."""
    if not page.mesh(shown):
        return still
    data = live_mesh.field(values, shown, limits, title)
    return page.live(still.path.stem, "remainder", data, [still], still.caption)


def responses(
    page: Page, name: str, curves: Mapping[str, FRF], stills: Sequence[Picture],
    bands: Sequence[Sequence[tuple[float, float]]] = ((), ()), share: int = 1,
) -> Live:  # fmt: skip
    """Every channel of curves on the same lines, ``bands`` fitted and left out.

    ``share`` is the number of such drawings on the page.
    """
    shown = Shown(Surface(np.zeros((0, 3))), curves=curves, fitted=bands[0], excluded=bands[1])
    return page.live(name, "responses", live_curves.frf(shown, share), stills, _FRF)


def levels(
    page: Page, tables: Sequence[LevelTable], pictures: Mapping[int, Path]
) -> dict[int, Block]:
    """Modes over levels by their positions, each with its picture."""
    return {
        k: panels(page, path.stem, live_panels.over_levels(tables[k]), Picture(path))
        for k, path in pictures.items()
    }


def panels(page: Page, name: str, data: Mapping[str, Any], still: Picture) -> Live:
    """Curves one below the other over one axis (``live_panels``)."""
    return page.live(name, "panels", data, [still], still.caption)


def likeness(
    page: Page, name: str, mac: np.ndarray, rows: np.ndarray, columns: np.ndarray, deck: str,
    pairs: Sequence[tuple[int, int]], stills: Sequence[Picture],
) -> Live:  # fmt: skip
    """MAC (rows, columns) with its numbers."""
    data = live_curves.mac_map(rows, {deck: (mac, columns, pairs)})
    return page.live(name, "assurance", data, stills, stills[0].caption if stills else "")


def poles(page: Page, name: str, r: RecordingModes, stills: Sequence[Picture]) -> Live:
    """The stabilisation diagram."""
    frf, d = r.recording.frf, r.diagram
    assert frf is not None
    low, high = r.modes.band
    at = np.flatnonzero((low <= d.frequency) & (d.frequency <= high))[:_MOST_POLES]
    lines = live_curves.thinned(frf, 2000)
    lines = lines[(low <= frf.frequency[lines]) & (frf.frequency[lines] <= high)]
    size = np.sqrt((np.abs(frf.values[lines]) ** 2).mean(axis=(1, 2)))
    data = {
        "states": d.states[at],
        "frequency": [round(float(f), 3) for f in d.frequency[at]],
        "damping": [round(100 * float(z), 3) for z in d.damping[at]],
        "kind": [str(kind) for kind in d.kind[at]],
        "kinds": _KINDS,
        "kept": r.modes.frequency[r.firm],
        "struck": r.modes.frequency[r.struck],
        "curve": [[float(f"{v:.5g}") for v in side] for side in (frf.frequency[lines], size)],
    }
    return page.live(name, "poles", data, stills, _POLES)
