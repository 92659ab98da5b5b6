"""The middles of the sides of shells on the surface that a mesh stands for.

A coarse mesh of a cylinder turns by nearly the same angle from side to side, a fold by an angle
that stands out. Shells are curved up to the latter and across the former: a cubic through two
corners with given normals (Vlachos et al. 2001, Curved PN triangles) has its middle at
½ (X₁ + X₂) - ⅛ ((d·N₁) N₁ - (d·N₂) N₂), d = X₂ - X₁.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from .facets import cell_normals, unit

SHARP = np.radians(50.0)  # a larger angle is a fold: a circle of eight shells turns by 45
FLAT = np.radians(1.0)  # a smaller angle is none: its arc rises by 0.2 % of a side
STANDS_OUT = 2.0  # times the angle of the next parallel side, from which an angle is a fold
APART = 0.1  # least eigenvalue of Σ n nᵀ of a fold whose sides both place its middle: 35 degrees


@dataclass(frozen=True, eq=False)
class _Sides:
    """All sides of all shells: shell, corners (rows of points), edge; ``of`` (m, 4) as given."""

    cell: np.ndarray
    corner: np.ndarray
    edge: np.ndarray
    count: np.ndarray  # (m,) corners of each shell
    of: np.ndarray

    def turned(self, by: int) -> np.ndarray:
        """Edge of the side ``by`` sides further in the same shell."""
        return self.of[self.cell, (self.corner + by) % self.count[self.cell]]

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Both corners of each side, as numbers 4 shell + corner."""
        return 4 * self.cell + self.corner, 4 * self.cell + (self.corner + 1) % self.count[
            self.cell
        ]


def bulges(points: np.ndarray, cells: np.ndarray, edges: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Vectors from the middle of each edge to the smooth surface (k, 3) [m].

    Parameters
    ----------
    points : (n, 3)        [m]
    cells : (m, 4) int     rows of points; a triangle repeats its third
    edges : (k, 2) int     unique edges
    of : (m, 4) int        edge after each corner of each shell
    """
    count = np.where(cells[:, 2] == cells[:, 3], 3, 4)
    cell, corner = np.nonzero(np.arange(4) < count[:, None])
    sides = _Sides(cell, corner, of[cell, corner], count, of)
    facet = cell_normals(points, cells)
    start, end = sides.ends()
    rows = cells.ravel()
    d = points[rows[end]] - points[rows[start]]
    smooth = _smooth(sides, facet, rows, d, len(edges))
    N = _fan_normals(points, cells, sides, facet, smooth)
    N1, N2 = N[start], N[end]
    N2 = N2 * np.where(np.einsum("ij,ij->i", N1, N2) < 0, -1.0, 1.0)[:, None]
    w1, w2 = np.einsum("ij,ij->i", d, N1), -np.einsum("ij,ij->i", d, N2)
    on1, on2 = smooth[sides.turned(-1)], smooth[sides.turned(1)]
    w1, w2 = np.where(on2 & ~on1, w2, w1), np.where(on1 & ~on2, w1, w2)
    n = unit(N1 + N2)
    rise = -np.einsum("ij,ij->i", w1[:, None] * N1 + w2[:, None] * N2, n) / 8
    A, b = np.zeros((len(edges), 3, 3)), np.zeros((len(edges), 3))
    np.add.at(A, sides.edge, n[:, :, None] * n[:, None])
    np.add.at(b, sides.edge, rise[:, None] * n)
    return np.einsum("kij,kj->ki", np.linalg.pinv(A, rcond=APART, hermitian=True), b)


def _smooth(
    sides: _Sides, facet: np.ndarray, rows: np.ndarray, d: np.ndarray, count: int
) -> np.ndarray:
    """Edges (count,) of two shells whose angle does not stand out from the next parallel sides.

    It takes three such angles in a row: two are also those of a profile of three flat strips.
    """
    order = np.argsort(sides.edge, kind="stable")
    first = np.searchsorted(sides.edge[order], np.arange(count))
    shared = np.flatnonzero(np.bincount(sides.edge, minlength=count) == 2)
    a, b = order[first[shared]], order[first[shared] + 1]
    start, _ = sides.ends()
    same = np.where(rows[start[a]] == rows[start[b]], -1.0, 1.0)  # normals of a and b, by numbering
    n_a, n_b = facet[sides.cell[a]], same[:, None] * facet[sides.cell[b]]
    across = np.einsum("ij,ij->i", np.cross(n_a, n_b), unit(d[a]))
    angle = np.arctan2(across, np.einsum("ij,ij->i", n_a, n_b))
    of_first, of_second = np.full(count, np.nan), np.full(count, np.nan)
    of_first[shared], of_second[shared] = angle, same * angle  # with the normal of either shell
    leader = np.full(count, -1)
    leader[shared] = sides.cell[a]
    further = np.stack([sides.turned(2)[a], sides.turned(2)[b]])
    own = np.stack([angle, same * angle])
    leads = leader[further] == np.stack([sides.cell[a], sides.cell[b]])
    other = np.where(leads, of_first[further], of_second[further])
    other[np.stack([sides.count[sides.cell[a]], sides.count[sides.cell[b]]]) == 3] = np.nan
    alike = (other * own > 0) & (np.abs(own) <= STANDS_OUT * np.abs(other))
    number = np.zeros(count, int)
    number[shared] = alike.sum(axis=0)
    in_row = (number[shared] == 2) | (alike & (number[further] == 2)).any(axis=0)
    curve = in_row & (alike | np.isnan(other)).all(axis=0)
    size, smooth = np.abs(angle), np.zeros(count, bool)
    smooth[shared] = (size < FLAT) | ((size < SHARP) & curve)
    return smooth


def _fan_normals(
    points: np.ndarray, cells: np.ndarray, sides: _Sides, facet: np.ndarray, smooth: np.ndarray
) -> np.ndarray:
    """Unit normal at every corner (4 m, 3), common to the shells around it without a fold between.

    The principal axis of Σ w n nᵀ, which no numbering of the shells changes, with the weights of
    Max (1999), J. Graphics Tools 4(2), 1-6: |u x v| / (|u|² |v|²) of the sides u, v at the corner.
    They are exact on a sphere.
    """
    start, end = sides.ends()
    rows, m = cells.ravel(), len(cells)
    key = np.concatenate([sides.edge, sides.edge]), np.concatenate([rows[start], rows[end]])
    at = np.concatenate([start, end])
    on = smooth[key[0]]
    order = np.flatnonzero(on)[np.lexsort((key[1][on], key[0][on]))]
    pairs = at[order].reshape(-1, 2)  # both corners of two shells at one end of one edge
    joined = sp.csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (4 * m, 4 * m))
    _, fan = connected_components(joined, directed=False)
    v = points[rows[end]] - points[rows[start]]
    length2 = np.einsum("ij,ij->i", v, v)
    before = np.zeros((4 * m, 3))
    before[end] = v
    u = before[start]
    area = np.linalg.norm(np.cross(u, v), axis=1)
    weight = area / np.maximum(length2 * np.einsum("ij,ij->i", u, u), 1e-300)
    n = facet[sides.cell]
    T = np.zeros((4 * m, 3, 3))
    np.add.at(T, fan[start], weight[:, None, None] * n[:, :, None] * n[:, None])
    return np.linalg.eigh(T)[1][:, :, -1][fan]
