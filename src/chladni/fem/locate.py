"""Places that are no grids: the nearest shell and the weights of its corners."""

import numpy as np
import scipy.sparse as sp

from ..geometry.nearest import Feet, ShellSurface
from .assemble import Structure


def rows_at(structure: Structure, feet: Feet, directions: np.ndarray) -> sp.csr_array:
    """Translation of points of shells along directions (k, 3): rows over the free dofs (k, n)."""
    k = len(directions)
    columns = 6 * feet.nodes[:, :, None] + np.arange(3)
    values = feet.weight[:, :, None] * directions[:, None, :]
    pick = (values.ravel(), (np.repeat(np.arange(k), 9), columns.ravel()))
    return sp.csr_array(sp.csr_array(pick, shape=(k, structure.T.shape[0])) @ structure.T)


def rows_of(
    structure: Structure, grids: np.ndarray, points: np.ndarray, directions: np.ndarray
) -> sp.csr_array:
    """Translation of places along directions over the free dofs (k, n).

    Parameters
    ----------
    grids : (k,) int        id, 0 where a place is no grid and lies on the nearest shell
    points : (k, 3)         [m], used where there is no grid
    directions : (k, 3)     unit vectors, basic frame
    """
    out = sp.lil_array((len(grids), structure.T.shape[1]))
    on, off = np.flatnonzero(grids > 0), np.flatnonzero(grids <= 0)
    if len(on):
        out[on] = structure.along(grids[on], directions[on])
    if len(off):
        shells = ShellSurface.whole(structure.assembly)
        out[off] = rows_at(structure, shells.feet(points[off]), directions[off])
    return sp.csr_array(out)
