"""Places away from grids: the nearest shell and the weights of its corners."""

import numpy as np
import scipy.sparse as sp

from ..geometry.nearest import ClosestPoints, ShellSurface
from ..model.assembly import Assembly
from .assemble import Structure

ON_SURFACE = 0.1  # of a step, along the surface, at least: a shorter one is along its normal


def rows_at(
    structure: Structure, closest: ClosestPoints, directions: np.ndarray, turning: bool = False
) -> sp.csr_array:
    """Translation of points of shells along directions (k, 3): rows over the free dofs (k, n).

    With ``turning``, rotation about the directions.
    """
    k = len(directions)
    columns = 6 * closest.nodes[:, :, None] + (3 if turning else 0) + np.arange(3)
    values = closest.weight[:, :, None] * directions[:, None, :]
    pick = (values.ravel(), (np.repeat(np.arange(k), 9), columns.ravel()))
    return sp.csr_array(sp.csr_array(pick, shape=(k, structure.T.shape[0])) @ structure.T)


def rows_of(
    structure: Structure, grids: np.ndarray, points: np.ndarray, directions: np.ndarray,
    turning: bool = False,
) -> sp.csr_array:  # fmt: skip
    """Translation of places along directions over the free dofs (k, n).

    Parameters
    ----------
    grids : (k,) int        id, 0 where a place is no grid and lies on the nearest shell
    points : (k, 3)         [m], used where there is no grid
    directions : (k, 3)     unit vectors, basic frame
    turning : rotation about the directions instead [rad]
    """
    out = sp.lil_array((len(grids), structure.T.shape[1]))
    on, off = np.flatnonzero(grids > 0), np.flatnonzero(grids <= 0)
    if len(on):
        out[on] = structure.along(grids[on], directions[on], turning)
    if len(off):
        shells = ShellSurface.whole(structure.assembly)
        out[off] = rows_at(structure, shells.closest_points(points[off]), directions[off], turning)
    return sp.csr_array(out)


def change_of(
    structure: Structure, points: np.ndarray, step: np.ndarray, directions: np.ndarray
) -> sp.csr_array:
    """Change of the motion along directions where places (k, 3) move by a step (k, 3): (k, n).

    It is the mean slope over the surface on both sides; a step off the surface changes nothing.
    """
    surface, k = ShellSurface.whole(structure.assembly), len(points)
    ends = surface.closest_points(np.concatenate([points + step, points - step]))
    moved = np.linalg.norm(ends.place[:k] - ends.place[k:], axis=1)
    size = np.linalg.norm(step, axis=1)
    share = np.where(moved > ON_SURFACE * size, size / np.maximum(moved, 1e-30), 0.0)
    rows = rows_at(structure, ends, np.tile(directions, (2, 1)))
    return sp.csr_array(sp.diags_array(share) @ (rows[:k] - rows[k:]))


Share = tuple[tuple[int, float], ...]  # (grid id, weight) of one place, the weights add up to 1


def shares_of(assembly: Assembly, grids: np.ndarray, points: np.ndarray) -> list[Share]:
    """Grids and weights of each place: its grid, or the corners of the nearest shell.

    Parameters
    ----------
    grids : (k,) int        id, 0 where a place is no grid
    points : (k, 3)         [m], used where there is no grid
    """
    out: list[Share] = [((int(grid), 1.0),) for grid in grids]
    off = np.flatnonzero(grids <= 0)
    if len(off):
        found = ShellSurface.whole(assembly).closest_points(points[off])
        for k, nodes, weights in zip(off, found.nodes, found.weight, strict=True):
            pairs = zip(assembly.ids[nodes].tolist(), weights.tolist(), strict=True)
            out[k] = tuple((grid, w) for grid, w in pairs if w > 0)
    return out
