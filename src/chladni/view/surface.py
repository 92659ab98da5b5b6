"""Surfaces for pictures: points, faces and lines, from plain arrays or from an assembly."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays import readonly
from ..errors import ModelError, ShapeError
from ..geometry.cells import directed_edges
from ..geometry.facets import cell_normals, vector_areas
from ..geometry.solid_faces import skin
from ..model.assembly import Assembly, Average


def _no_rows(columns: int) -> np.ndarray:
    return np.zeros((0, columns), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Surface:
    """Faces and lines over points."""

    points: np.ndarray  # (n, 3) [m]
    # (m, 4) int: rows of points; a triangle repeats its third node
    faces: np.ndarray = field(default_factory=lambda: _no_rows(4))
    # (k, 2) int: beams, bars, springs
    lines: np.ndarray = field(default_factory=lambda: _no_rows(2))
    # (m,) int: part of each face; outlines are drawn where parts meet
    part: np.ndarray | None = None
    unit: str = "m"  # "m"; "" where the deck's own unit of length is not known
    # (m,) bool: faces of welds and adhesive, which lie between or within sheets
    joint: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name, columns in (("points", 3), ("faces", 4), ("lines", 2)):
            shape = np.shape(getattr(self, name))
            if len(shape) != 2 or shape[1] != columns:
                raise ShapeError(f"{name} are {shape}, due is (n, {columns})")
            object.__setattr__(self, name, readonly(np.asarray(getattr(self, name))))
        if self.part is None:
            object.__setattr__(self, "part", np.zeros(len(self.faces), dtype=np.int64))
        if self.joint is None:
            object.__setattr__(self, "joint", np.zeros(len(self.faces), dtype=bool))

    @classmethod
    def of(cls, points: np.ndarray, quads: np.ndarray, tris: np.ndarray | None = None) -> Self:
        """Build a surface with quadrilaterals first, then triangles."""
        tris = np.zeros((0, 3), np.int64) if tris is None else np.asarray(tris)
        four = np.concatenate([np.asarray(quads).reshape(-1, 4), tris[:, [0, 1, 2, 2]]])
        return cls(np.asarray(points, dtype=float), four.astype(np.int64))

    def moved(self, displacement: np.ndarray) -> Self:
        """The surface with its points displaced (n, 3) [m]."""
        return replace(self, points=self.points + displacement)

    def without_joints(self) -> Self:
        """The sheets alone: solids of joints lie in the sheets' surface and would show through."""
        keep = ~np.asarray(self.joint)
        return replace(self, faces=self.faces[keep], part=np.asarray(self.part)[keep], joint=None)

    @property
    def size(self) -> float:
        """Diagonal of the box around the points in use [m]."""
        used = self.points[self.used]
        return float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 1.0

    @property
    def used(self) -> np.ndarray:
        """Rows of the points that faces or lines use."""
        held = np.concatenate([self.faces.ravel(), self.lines.ravel()])
        return np.unique(held) if len(held) else np.arange(len(self.points))

    def areas(self) -> np.ndarray:
        """Vector areas of the faces (m, 3) [m²]."""
        return vector_areas(self.points, self.faces)

    def normals(self) -> np.ndarray:
        """Unit normals of the faces (m, 3)."""
        return cell_normals(self.points, self.faces)

    def outline(self, crease: float = 35.0, least: float = 0.0) -> np.ndarray:
        """Edges (k, 2) of the form: free, between parts, or folded by ``crease`` degrees.

        Connected edges that reach less than ``least`` of the structure's size are left out.
        """
        edges, owner = directed_edges(self.faces)
        edges = np.sort(edges, axis=1)
        order = np.lexsort((edges[:, 1], edges[:, 0]))
        edges, owner = edges[order], owner[order]
        first = np.r_[True, np.any(edges[1:] != edges[:-1], axis=1)] if len(edges) else np.array([])
        begin = np.flatnonzero(first)
        count = np.diff(np.r_[begin, len(edges)])
        shown = count != 2
        pair = begin[~shown]
        one, two = owner[pair], owner[pair + 1]
        n, part = self.normals(), np.asarray(self.part)
        fold = np.abs(np.einsum("ij,ij->i", n[one], n[two])) < np.cos(np.radians(crease))
        shown[~shown] = fold | (part[one] != part[two])
        return np.concatenate([self._reaching(edges[begin[shown]], least), self.lines])

    def _reaching(self, edges: np.ndarray, least: float) -> np.ndarray:
        if not least or not len(edges):
            return edges
        n = len(self.points)
        graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
        line = connected_components(graph, directed=False)[1][edges[:, 0]]
        long = [
            k
            for k in np.unique(line)
            if np.linalg.norm(np.ptp(self.points[edges[line == k]].reshape(-1, 3), axis=0))
            >= least * self.size
        ]
        return edges[np.isin(line, long)]


def _at_joints(assembly: Assembly) -> np.ndarray:
    """Mask of points (n,) that are means of shells' points (RBE3), as corners of welds are."""
    means = [t.reference for t in assembly.rigid if isinstance(t, Average)]
    on = np.zeros(len(assembly.points), bool)
    on[means if len(assembly.shells) else []] = True
    return on


def surface(assembly: Assembly, unit: str = "m") -> Surface:
    """The visible surface of an assembly: shells, skins of solids, beams, springs, bushes.

    The shells' faces come first and in the deck's order, so a value per shell is a value per face.
    """
    faces, parts = [assembly.shells.nodes], [assembly.shells.part]
    joints, at_joints = [np.zeros(len(assembly.shells), bool)], _at_joints(assembly)
    for solids in assembly.solids:
        outer, part, _ = skin(solids.nodes, solids.part)
        faces.append(outer)
        parts.append(part)
        joints.append(at_joints[outer].all(axis=1))
    pairs = [assembly.beams.nodes, assembly.springs.nodes, assembly.bushes.nodes]
    lines = np.concatenate(pairs).astype(np.int64)
    seen = Surface(
        np.asarray(assembly.points, dtype=float),
        np.concatenate(faces).astype(np.int64),
        lines[(lines >= 0).all(axis=1)],
        np.concatenate(parts).astype(np.int64),
        unit,
        np.concatenate(joints),
    )
    if not len(seen.faces) + len(seen.lines):
        raise ModelError("the model has no shells, solids, beams or springs to draw")
    return seen
