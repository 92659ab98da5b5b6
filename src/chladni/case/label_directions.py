"""What labels say of directions, held against what the table of sensors says."""

import re
from collections.abc import Iterable

import numpy as np

from ..errors import named
from ..fem.measured_dofs import MeasuredDofs
from ..geometry.nearest import ShellSurface
from ..io.tables.sensor_table import direction
from ..model.assembly import Assembly

_WAY = re.compile(r"[+-]?[XYZ]|N", re.IGNORECASE)  # of a label, behind its last colon
_SAME = 0.7  # cosine: directions farther apart are two


def ways_said(made: Assembly, found: MeasuredDofs, tabled: Iterable[str]) -> list[str]:
    """A sentence where the labels of a table say other directions than its columns.

    Nothing is said of a deck that counts displacements in axes of its grids: a label may mean
    those.
    """
    if made.axes is not None:
        return []
    normal, other, known = surface_normals(made, found), list[str](), set(tabled)
    for label, given, n in zip(found.labels, found.directions, normal, strict=True):
        _, colon, way = label.rpartition(":")
        if label not in known or not colon or not _WAY.fullmatch(way.strip()):
            continue
        own = direction(label, label)
        along = float(np.abs(n @ given)) if own is None else float(own @ given)
        if along < _SAME and (own is not None or n.any()):
            other.append(label)
    if not other:
        return []
    is_ = "says" if len(other) == 1 else "say"
    return [
        f"{named(other)} {is_} another direction than the table of sensors: the table counts; "
        "mend it, or the label"
    ]


def surface_normals(made: Assembly, dofs: MeasuredDofs) -> np.ndarray:
    """Unit normals of the shells where dofs sit (k, 3); zero for the base and without shells."""
    out = np.zeros((len(dofs.labels), 3))
    real = np.flatnonzero(~dofs.base)
    if len(made.shells) and len(real):
        out[real] = ShellSurface.whole(made).feet(dofs.points[real]).normal
    return out
