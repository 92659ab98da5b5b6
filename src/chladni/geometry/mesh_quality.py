"""Checks of a shell mesh before anything is computed: element shape, edges, parts, normals."""

from dataclasses import dataclass

import numpy as np

from ..model.assembly import Assembly
from .cells import components, corner_quality, directed_edges, edges_of
from .connected_points import components as connected
from .facets import cell_normals

LEAST_SINE, MOST_ASPECT, MOST_WARP = 0.3, 20.0, 0.15


@dataclass(frozen=True, eq=False)
class ElementQuality:
    """Shape of every shell (n,)."""

    sine: np.ndarray  # least sine of a corner angle; 1 is best, a folded shell is negative
    aspect: np.ndarray  # longest side over shortest
    warp: np.ndarray  # distance of the corners from the mean plane over the mean side length


def element_quality(assembly: Assembly) -> ElementQuality:
    """Shape measures of every shell."""
    nodes, points = assembly.shells.nodes, assembly.points
    x = points[nodes]
    sides = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    sides[nodes[:, 2] == nodes[:, 3], 2] = np.nan
    normal = cell_normals(points, nodes)
    off = np.abs(np.einsum("nki,ni->nk", x - x.mean(axis=1, keepdims=True), normal)).max(axis=1)
    off[nodes[:, 2] == nodes[:, 3]] = 0.0
    return ElementQuality(
        corner_quality(points, nodes),
        np.nanmax(sides, axis=1) / np.maximum(np.nanmin(sides, axis=1), 1e-12),
        off / np.nanmean(sides, axis=1),
    )


@dataclass(frozen=True)
class PartCheck:
    """The mesh of one part."""

    part: str
    shells: int
    triangles: int
    bad: int  # shells beyond a limit of shape
    worst_sine: float
    free_edge: float  # length of its free edges [m]
    pieces: int  # connected sheets
    turned: int  # edges across which the normals disagree
    branched: int  # edges of more than two shells
    joined: bool  # tied to any other part


@dataclass(frozen=True, eq=False)
class MeshCheck:
    """The checks of all parts, and the parts that are not connected."""

    parts: tuple[PartCheck, ...]
    bad: np.ndarray  # (k,) int; ids of shells beyond a limit of shape
    loose: tuple[str, ...]  # parts not connected to the largest structure

    @property
    def fit(self) -> bool:
        """True if no part is loose, no shell is folded and all normals agree."""
        return not self.loose and all(p.worst_sine > 0 and not p.turned for p in self.parts)


def free_edges(nodes: np.ndarray) -> np.ndarray:
    """Sides (k, 2) of one cell only."""
    sides, count = np.unique(edges_of(nodes), axis=0, return_counts=True)
    return sides[count == 1]


def edge_faults(nodes: np.ndarray) -> tuple[int, int]:
    """Number of edges whose two cells have opposite normals, and of edges with more cells."""
    sides = directed_edges(nodes)[0]
    key, at, count = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    ahead = np.bincount(at.ravel(), sides[:, 0] < sides[:, 1], minlength=len(key))
    return int(np.sum((count == 2) & (ahead != 1))), int(np.sum(count > 2))


def check_mesh(assembly: Assembly) -> MeshCheck:
    """Shape, edges, normals and connection of every part with shells."""
    quality = element_quality(assembly)
    bad = (quality.sine < LEAST_SINE) | (quality.aspect > MOST_ASPECT) | (quality.warp > MOST_WARP)
    piece = connected(assembly)
    shells = assembly.shells
    main = np.bincount(piece[shells.nodes[:, 0]]).argmax() if len(shells) else 0
    parts, loose = [], []
    for p in np.unique(shells.part):
        rows = shells.part == p
        check = _part(assembly, int(p), rows, bad, quality, piece)
        parts.append(check)
        if np.any(piece[shells.nodes[rows, 0]] != main):
            loose.append(check.part)
    return MeshCheck(tuple(parts), shells.ids[bad], tuple(loose))


def _part(
    assembly: Assembly,
    part: int,
    rows: np.ndarray,
    bad: np.ndarray,
    quality: ElementQuality,
    piece: np.ndarray,
) -> PartCheck:
    nodes = assembly.shells.nodes[rows]
    edges = free_edges(nodes)
    length = np.linalg.norm(np.diff(assembly.points[edges], axis=1)[:, 0], axis=1).sum()
    sheet = components(nodes, len(assembly.points))[nodes[:, 0]]
    turned, branched = edge_faults(nodes)
    others = assembly.shells.nodes[~rows, 0]
    return PartCheck(
        assembly.parts[part].name,
        int(rows.sum()),
        int((nodes[:, 2] == nodes[:, 3]).sum()),
        int(bad[rows].sum()),
        float(quality.sine[rows].min()),
        float(length),
        len(np.unique(sheet)),
        turned,
        branched,
        bool(np.isin(piece[nodes[:, 0]], piece[others]).all()),
    )
