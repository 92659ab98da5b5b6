"""A map of the information that one more sensor would bring."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..search.next_measurement import FILE
from .blocks import Drawing
from .mesh_drawings import field
from .shown import Shown

if TYPE_CHECKING:
    from ..search.next_measurement import Outlook
    from ..view.surface import Surface

NEAREST = 3  # candidates whose mean a face shows
_CAPTION = (
    "Information expected of one more sensor along the normal at each place, from the candidates "
    "nearest to it."
)


def information_map(shown: Shown, every: Sequence[Outlook]) -> list[Drawing]:
    """Faces coloured by the bits of a sensor there, mean over the outlooks; none without places."""
    from scipy.spatial import cKDTree

    first, faces = every[0], shown.seen.faces
    at = [k for k, c in enumerate(first.candidates) if c.kind == "sensor" and c.point_m]
    if len(at) < NEAREST or not len(faces):
        return []
    bits = np.mean([[o.information([k]) for k in at] for o in every], axis=0) / np.log(2)
    places = np.array([first.candidates[k].point_m for k in at])
    middle = shown.seen.points[faces].mean(axis=1)
    values = bits[cKDTree(places).query(middle, NEAREST)[1]].mean(axis=1)
    limits = (0.0, max(float(values.max()), 1e-3))
    title = "information of one more sensor [bit]"
    return [field(shown, values, limits, "information", title, _CAPTION, "YlOrRd")]


def with_surface(arrays: dict[str, np.ndarray], seen: Surface) -> dict[str, Any]:
    """The arrays of an outlook with the mesh on which it is drawn."""
    return {**arrays, "points": seen.points.astype(np.float32), "faces": seen.faces}


def shown_of_run(folder: Path) -> Shown | None:
    """The mesh of a run; None where its outlook has none."""
    from ..view.surface import Surface

    with np.load(folder / FILE, allow_pickle=False) as held:
        if "points" not in held.files or "faces" not in held.files:
            return None
        return Shown(Surface(held["points"].astype(float), held["faces"]))
