"""Triangles to quadrilaterals: best pairs first, unpaired triangles joined along chains.

A triangle is a quadrilateral that repeats its third node, as everywhere in this package.
Remacle et al., Blossom-Quad, Int. J. Numer. Meth. Engng 89 (2012) 1102-1119, pair in the same way.
"""

import numpy as np

from chladni.geometry.cells import corner_quality, edges_of

from .matching import augment

GOOD_PAIR, FIRST_PAIRS = 0.2, 0.6  # least corner sine of any pair, and of the first pairs


def _across(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangle and side on either side of every inner edge, each (k, 2)."""
    a, b = triangles, np.roll(triangles, -1, axis=1)
    low, high = np.minimum(a, b).ravel(), np.maximum(a, b).ravel()
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    first, second = order[:-1][same], order[1:][same]
    return np.column_stack(np.divmod(first, 3)), np.column_stack(np.divmod(second, 3))


def candidate_pairs(
    points: np.ndarray, triangles: np.ndarray, folds: set[tuple[int, int]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of neighbours (k, 2), their quads (k, 4) and the quality of these, best first."""
    (t0, k0), (t1, k1) = (x.T for x in _across(triangles))
    T = triangles
    quads = np.column_stack(
        [T[t0, (k0 + 2) % 3], T[t0, k0], T[t1, (k1 + 2) % 3], T[t0, (k0 + 1) % 3]]
    )
    quality = corner_quality(points, quads)
    shared = np.sort(quads[:, [1, 3]], axis=1)
    fold = np.array([tuple(e) in folds for e in shared.tolist()], dtype=bool)
    keep = np.flatnonzero((quality > GOOD_PAIR) & ~fold)
    keep = keep[np.argsort(-quality[keep].round(9), kind="stable")]
    return np.column_stack([t0, t1])[keep], quads[keep], quality[keep]


def paired(points: np.ndarray, triangles: np.ndarray, folds: set[tuple[int, int]]) -> np.ndarray:
    """Quads (n, 4) that cover the triangles; edges in `folds` stay edges."""
    pairs, quads, quality = candidate_pairs(points, triangles, folds)
    near: list[list[int]] = [[] for _ in triangles]
    mate: dict[int, int] = {}
    shape = {}
    for (a, b), quad, good in zip(pairs.tolist(), quads, quality > FIRST_PAIRS, strict=True):
        near[a].append(b)
        near[b].append(a)
        shape[a, b] = shape[b, a] = quad
        if good and a not in mate and b not in mate:
            mate[a], mate[b] = b, a
    for t in range(len(triangles)):
        if t not in mate:
            augment(t, near, mate)
    whole = [shape[t, u] for t, u in sorted(mate.items()) if t < u]
    alone = [triangles[t][[0, 1, 2, 2]] for t in range(len(triangles)) if t not in mate]
    return np.array(whole + alone)


def without_doublets(quads: np.ndarray, fixed: int) -> np.ndarray:
    """The quads without inner nodes of only two quads, which become one quad."""
    while True:
        count = np.bincount(quads.ravel(), minlength=fixed)
        for v in np.flatnonzero(count == 2):
            pair = np.flatnonzero((quads == v).any(axis=1))
            if v < fixed or len(pair) != 2 or (quads[pair, 2] == quads[pair, 3]).any():
                continue
            first, second = (np.roll(q, -np.flatnonzero(q == v)[0]) for q in quads[pair])
            if first[1] == second[3] and first[3] == second[1]:
                merged = [first[1], first[2], first[3], second[2]]
                quads = np.vstack([np.delete(quads, pair, axis=0), merged])
                break
        else:
            return quads


def split_folded(
    points: np.ndarray, quads: np.ndarray, least: float = 0.2
) -> tuple[np.ndarray, np.ndarray]:
    """The cells with each quad of a quality below `least` cut into its two better triangles.

    Returns the cells and, for each, the row of its original quad. Quads that are good in the plane
    may fold over where a pressing turns sharply; a triangle cannot.
    """
    bad = corner_quality(points, quads) < least
    bad &= quads[:, 2] != quads[:, 3]
    rows = np.flatnonzero(bad)
    cuts = [
        quads[rows][:, list(c)] for c in ((0, 1, 2, 2), (2, 3, 0, 0), (1, 2, 3, 3), (3, 0, 1, 1))
    ]
    quality = [corner_quality(points, c) for c in cuts]
    first = np.minimum(quality[0], quality[1]) >= np.minimum(quality[2], quality[3])
    halves = [np.where(first[:, None], cuts[k], cuts[k + 2]) for k in range(2)]
    source = np.r_[np.flatnonzero(~bad), rows, rows]
    return np.vstack([quads[~bad], *halves]), source


def _neighbour_mean(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean of each node's neighbours (n, 2)."""
    total, count = np.zeros_like(points), np.zeros(len(points))
    for a, b in (edges.T, edges.T[::-1]):
        np.add.at(total, a, points[b])
        np.add.at(count, a, 1)
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], points)


def smoothed(points: np.ndarray, quads: np.ndarray, fixed: int, sweeps: int = 8) -> np.ndarray:
    """Move free nodes half way to the mean of their neighbours, x += (x̄ - x)/2.

    A move is undone where a cell of the node becomes worse and its quality falls below 0.7.  So
    smoothing never makes the worst cell worse.
    """
    edges = np.unique(edges_of(quads), axis=0)
    for _ in range(sweeps):
        before = corner_quality(points, quads)
        moved = points.copy()
        moved[fixed:] += 0.5 * (_neighbour_mean(points, edges) - points)[fixed:]
        for _ in range(6):
            after = corner_quality(moved, quads)
            worse = quads[(after < before - 1e-9) & (after < 0.7)]
            if not len(worse):
                break
            moved[worse.ravel()] = points[worse.ravel()]
        else:
            return points
        points = moved
    return points
