"""Springs to ground at grids of a structure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .assembly import Assembly, appended

AN_AXIS = 1 - 1e-6  # cosine from which a direction is an axis of the grid's own frame


def with_springs(
    assembly: Assembly, grids: Sequence[int], directions: np.ndarray, k: float
) -> Assembly:
    """Add springs k d dᵀ to ground at grids, one along each of ``directions`` (n, 3), unit length.

    A direction along an axis of the grid's frame gives a scalar spring (CELAS2), any other a bush
    in its own frame (CBUSH).
    """
    rows = assembly.rows(list(grids))
    d = np.asarray(directions, float)
    local = d if assembly.axes is None else np.einsum("kij,kj->ki", assembly.axes[rows], d)
    straight = np.abs(local).max(axis=1) > AN_AXIS
    component = 1 + np.abs(local[straight]).argmax(axis=1)
    old, n = assembly.springs, len(component)
    new = appended(
        old, ids=int(old.ids.max(initial=0)) + 1 + np.arange(n), nodes=_to_ground(rows[straight]),
        component=np.column_stack([component, np.ones(n, int)]), value=np.full(n, float(k)),
    )  # fmt: skip
    made = replace(assembly, springs=new)
    return with_ground_bushes(made, rows[~straight], d[~straight], k)


def with_ground_bushes(
    assembly: Assembly, rows: np.ndarray, directions: np.ndarray, k: float | np.ndarray,
    places: np.ndarray | None = None,
) -> Assembly:  # fmt: skip
    """Add springs k d dᵀ to ground at rows of points, along ``directions`` (n, 3) of unit length.

    Optional ``places`` (n, 3) [m] are connected to the points by rigid arms. A k of shape (n, 6) is
    the stiffness along, and about, that direction and two directions normal to it.
    """
    old, n = assembly.bushes, len(rows)
    places = assembly.points[rows] if places is None else places
    if not n:
        return assembly
    stiffness = np.zeros((n, 6))
    stiffness[:, : 6 if np.ndim(k) else 1] = k
    new = appended(
        old, ids=int(old.ids.max(initial=0)) + 1 + np.arange(n), nodes=_to_ground(rows),
        frame=np.array([_frame(d) for d in directions]), place=places, stiffness=stiffness,
    )  # fmt: skip
    return replace(assembly, bushes=new)


def _to_ground(rows: np.ndarray) -> np.ndarray:
    return np.column_stack([rows, np.full(len(rows), -1)])


def _frame(x: np.ndarray) -> np.ndarray:
    """Unit vectors (3, 3), the first along x."""
    z = np.cross(x, np.eye(3)[np.abs(x).argmin()])
    z = z / np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])
