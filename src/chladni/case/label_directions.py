"""Directions in labels, compared with the table of sensors."""

import re
from collections.abc import Iterable

import numpy as np

from ..errors import named
from ..fem.measured_dofs import MeasuredDofs
from ..geometry.nearest import ShellSurface
from ..io.tables.sensor_table import direction
from ..model.assembly import Assembly

_DIRECTION = re.compile(r"[+-]?[XYZ]|N", re.IGNORECASE)  # of a label, behind its last colon
_SAME = 0.7  # cosine: directions farther apart are two


def ways_said(made: Assembly, found: MeasuredDofs, tabled: Iterable[str]) -> list[str]:
    """A sentence where the labels of a table say other directions than its columns.

    Nothing is said of a deck that counts displacements in axes of its grids: a label may mean
    those.
    """
    if made.axes is not None:
        return []
    known = set(tabled)
    own = {
        k: direction(label, label)
        for k, label in enumerate(found.labels)
        if label in known
        and ":" in label
        and _DIRECTION.fullmatch(label.rpartition(":")[2].strip())
    }
    across = any(axis is None for axis in own.values())
    normal = surface_normals(made, found) if across else np.zeros_like(found.directions)
    other = [
        found.labels[k] for k, axis in own.items() if _apart(axis, found.directions[k], normal[k])
    ]
    if not other:
        return []
    is_ = "says" if len(other) == 1 else "say"
    return [
        f"{named(other)} {is_} another direction than the table of sensors: the table is used; "
        "correct the table or the label"
    ]


def _apart(own: np.ndarray | None, given: np.ndarray, normal: np.ndarray) -> bool:
    """True if a label has another direction; None is the normal, on either side."""
    if own is None:
        return bool(normal.any() and np.abs(normal @ given) < _SAME)
    return bool(own @ given < _SAME)


def surface_normals(made: Assembly, dofs: MeasuredDofs) -> np.ndarray:
    """Unit normals of the shells where dofs sit (k, 3); zero for the base and without shells."""
    out = np.zeros((len(dofs.labels), 3))
    real = np.flatnonzero(~dofs.base)
    if len(made.shells) and len(real):
        out[real] = ShellSurface.whole(made).closest_points(dofs.points[real]).normal
    return out
