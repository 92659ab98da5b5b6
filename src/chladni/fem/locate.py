"""Places that are no grids: the nearest shell and the weights of its corners."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ..model.assembly import Assembly
from .assemble import Structure

NEAR = 12  # shells whose centres are nearest are looked at closely


@dataclass(frozen=True, eq=False)
class Located:
    """Points on the sheet.

    Attributes
    ----------
    shell : (k,) int        position of the nearest shell
    nodes : (k, 3) int      corners of the triangle of it that is nearest
    weights : (k, 3)        barycentric, within the triangle
    normal : (k, 3)         unit normal of the triangle
    distance : (k,)         from the point to the triangle [m]
    """

    shell: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    normal: np.ndarray
    distance: np.ndarray


def locate(points: np.ndarray, quads: np.ndarray, where: np.ndarray) -> Located:
    """Nearest point of the shells to each place; both triangles of each near quad are tested.

    Parameters
    ----------
    points : (n, 3)     grids [m]
    quads : (m, 4)      shells as rows of points, a triangle repeats its third node
    where : (k, 3)      places [m]
    """
    tree = cKDTree(points[quads].mean(axis=1))
    near = tree.query(where, min(NEAR, len(quads)))[1].reshape(len(where), -1)
    best = np.full(len(where), np.inf)
    shell, nodes = np.zeros(len(where), int), np.zeros((len(where), 3), int)
    weights, normal = np.zeros((len(where), 3)), np.zeros((len(where), 3))
    for column in near.T:
        for corners in ((0, 1, 2), (0, 2, 3)):
            chosen = quads[column][:, corners]
            w, d, n = _nearest_in_triangle(points[chosen], where)
            better = d < best - 1e-12
            best, shell = np.where(better, d, best), np.where(better, column, shell)
            nodes = np.where(better[:, None], chosen, nodes)
            weights = np.where(better[:, None], w, weights)
            normal = np.where(better[:, None], n, normal)
    return Located(shell, nodes, weights, normal, best)


def _nearest_in_triangle(
    X: np.ndarray, where: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Barycentric weights of the nearest point of each triangle, its distance, unit normal."""
    a, e1, e2 = X[:, 0], X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    n = np.cross(e1, e2)
    area2 = np.maximum((n**2).sum(axis=1), 1e-300)
    r = where - a
    u = np.einsum("ki,ki->k", np.cross(r, e2), n) / area2
    v = np.einsum("ki,ki->k", np.cross(e1, r), n) / area2
    w = np.stack([1 - u - v, u, v], axis=1)
    w = np.where(np.all(w >= 0, axis=1, keepdims=True), w, _nearest_on_sides(X, where))
    d = np.linalg.norm(np.einsum("kc,kci->ki", w, X) - where, axis=1)
    d = np.where(area2 > 1e-290, d, np.inf)
    return w, d, n / np.sqrt(area2)[:, None]


def _nearest_on_sides(X: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Barycentric weights of the nearest point of each triangle's sides (k, 3)."""
    side = np.roll(X, -1, axis=1) - X
    along = np.einsum("kci,kci->kc", where[:, None] - X, side)
    s = np.clip(along / np.maximum((side**2).sum(axis=2), 1e-300), 0, 1)
    d2 = ((X + s[:, :, None] * side - where[:, None]) ** 2).sum(axis=2)
    best, k = d2.argmin(axis=1), np.arange(len(X))
    w = np.zeros((len(X), 3))
    w[k, best], w[k, (best + 1) % 3] = 1 - s[k, best], s[k, best]
    return w


def rows_at(structure: Structure, located: Located, directions: np.ndarray) -> sp.csr_array:
    """Translation of the located places along directions (k, 3): rows over the free dofs."""
    k = len(directions)
    columns = 6 * located.nodes[:, :, None] + np.arange(3)
    values = located.weights[:, :, None] * directions[:, None, :]
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
        shells = structure.assembly.shells.nodes
        located = locate(structure.assembly.points, shells, points[off])
        out[off] = rows_at(structure, located, directions[off])
    return sp.csr_array(out)


Share = tuple[tuple[int, float], ...]  # (grid id, weight) of one place, the weights add up to 1


def shares_of(assembly: Assembly, grids: np.ndarray, points: np.ndarray) -> list[Share]:
    """What each place hangs on: its grid, or the corners of the nearest shell by their weights.

    Parameters
    ----------
    grids : (k,) int        id, 0 where a place is no grid
    points : (k, 3)         [m], used where there is no grid
    """
    out: list[Share] = [((int(grid), 1.0),) for grid in grids]
    off = np.flatnonzero(grids <= 0)
    if len(off):
        found = locate(assembly.points, assembly.shells.nodes, points[off])
        for k, nodes, weights in zip(off, found.nodes, found.weights, strict=True):
            pairs = zip(assembly.ids[nodes].tolist(), weights.tolist(), strict=True)
            out[k] = tuple((grid, w) for grid, w in pairs if w > 0)
    return out
