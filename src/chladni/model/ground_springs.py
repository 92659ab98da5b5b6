"""Springs to ground at grids of a structure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .assembly import Assembly, Bushes, Scalars

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
    component = np.abs(local[straight]).argmax(axis=1)
    made = replace(assembly, springs=_scalars(assembly.springs, rows[straight], component, k))
    askew = ~straight
    return with_ground_bushes(made, rows[askew], d[askew], k)


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
    none = np.zeros((n, 6))
    new = Bushes(
        np.append(old.ids, int(old.ids.max(initial=0)) + 1 + np.arange(n)),
        np.concatenate([old.nodes, np.column_stack([rows, np.full(n, -1)])]),
        np.concatenate([old.frame, np.array([_frame(d) for d in directions])]),
        np.concatenate([old.place, places]),
        np.concatenate([old.stiffness, stiffness]),
        np.concatenate([old.viscous, none]),
        np.concatenate([old.loss, none]),
    )
    return replace(assembly, bushes=new)


def _frame(x: np.ndarray) -> np.ndarray:
    """Unit vectors (3, 3), the first along x."""
    z = np.cross(x, np.eye(3)[np.abs(x).argmin()])
    z = z / np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


def _scalars(old: Scalars, rows: np.ndarray, component: np.ndarray, k: float) -> Scalars:
    n = len(rows)
    return Scalars(
        np.append(old.ids, int(old.ids.max(initial=0)) + 1 + np.arange(n)),
        np.concatenate([old.nodes, np.column_stack([rows, np.full(n, -1)])]),
        np.concatenate([old.component, np.column_stack([component + 1, np.ones(n, int)])]),
        np.append(old.value, np.full(n, float(k))),
        np.append(old.damping, np.zeros(n)),
    )
