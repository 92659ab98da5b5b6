"""Elements as cells of a mesh for other programs, and cells of other programs as elements.

The kinds are those of meshio. VTK numbers the nodes on the edges of a solid in another order than
Nastran (:data:`.solid_shapes.EDGES`): those of the second face come before those between the faces.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.assembly import Assembly, Beams, Shells, Solids, concatenated
from .solid_shapes import CORNERS, EDGES

SOLID_KINDS = {8: "hexahedron", 6: "wedge", 5: "pyramid", 4: "tetra"}  # by corners
DIMENSION, NODES = (  # of the kinds that become elements, and their number of nodes
    {
        "line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "quad": 2, "quad8": 2, "quad9": 2,
        "tetra": 3, "tetra10": 3, "pyramid": 3, "pyramid13": 3, "wedge": 3, "wedge15": 3,
        "hexahedron": 3, "hexahedron20": 3, "hexahedron27": 3,
    },
    {
        "line": 2, "line3": 3, "triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8, "quad9": 9,
        "tetra": 4, "tetra10": 10, "pyramid": 5, "pyramid13": 13, "wedge": 6, "wedge15": 15,
        "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27,
    },
)  # fmt: skip
_RING = {3: ((0, 1), (1, 2), (2, 0)), 4: ((0, 1), (1, 2), (2, 3), (3, 0))}
VTK_EDGES = {  # ends of the edges of solids in the order of VTK, by the number of corners
    8: (*_RING[4], *((a + 4, b + 4) for a, b in _RING[4]), *((k, k + 4) for k in range(4))),
    6: (*_RING[3], *((a + 3, b + 3) for a, b in _RING[3]), *((k, k + 3) for k in range(3))),
    5: EDGES[5],
    4: EDGES[4],
}
MIRRORED = {  # corners of the same solid wound the other way
    8: (0, 3, 2, 1, 4, 7, 6, 5), 6: (0, 2, 1, 3, 5, 4), 5: (0, 3, 2, 1, 4), 4: (0, 2, 1, 3),
}  # fmt: skip
_COLLAPSED = {  # hexahedra with repeated corners, by the first position of each: what they are
    (0, 1, 2, 2, 4, 5, 6, 6): (0, 1, 2, 4, 5, 6),
    (0, 1, 2, 3, 4, 4, 6, 6): (0, 4, 1, 3, 6, 2),
    (0, 1, 2, 2, 4, 4, 4, 4): (0, 1, 2, 4),
    (0, 1, 2, 3, 3, 3, 3, 3): (0, 1, 2, 3),
    (0, 1, 2, 3, 4, 4, 4, 4): (0, 1, 2, 3, 4),
}


@dataclass(frozen=True, eq=False)
class MeshCells:
    """Elements of one kind as cells of a mesh, drawn by their corners."""

    kind: str  # as meshio names it
    nodes: np.ndarray  # (n, k) int: rows of points
    element: np.ndarray  # (n,) int: ids
    part: np.ndarray  # (n,) int: ids of their parts
    thickness: np.ndarray  # (n,) [m]; 0 for solids and beams
    row: np.ndarray  # (n,) int: among all shells, then all solids, then all beams


def mesh_cells(assembly: Assembly) -> list[MeshCells]:
    """Shells, solids and beams; only the kinds that have members."""
    shells, beams, found = assembly.shells, assembly.beams, []
    ids = np.array([p.id for p in assembly.parts], dtype=np.int64)
    three = shells.triangle
    for kind, which, corners in (("quad", ~three, 4), ("triangle", three, 3)):
        t, rows = shells.thickness[which].mean(axis=1), np.flatnonzero(which)
        nodes = shells.nodes[which][:, :corners]
        found.append(MeshCells(kind, nodes, shells.ids[which], ids[shells.part[which]], t, rows))
    first = len(shells)
    others: tuple[Solids | Beams, ...] = (*assembly.solids, beams)
    for group in others:
        nodes, rows = group.nodes, first + np.arange(len(group))
        corners = CORNERS.get(nodes.shape[1], 2)
        kind = SOLID_KINDS.get(corners, "line")
        part, none = ids[group.part], np.zeros(len(group))
        found.append(MeshCells(kind, nodes[:, :corners], group.ids, part, none, rows))
        first += len(group)
    return [cells for cells in found if len(cells.nodes)]


@dataclass(frozen=True, eq=False)
class ForeignCells:
    """Cells of one kind and one part, their nodes in the order of VTK."""

    kind: str
    ids: np.ndarray  # (n,) int
    nodes: np.ndarray  # (n, k) int: rows of points
    part: int  # position in the parts of the assembly
    thickness: np.ndarray | float = 0.0  # of shells: one, (n,) or (n, 4)
    axis: np.ndarray | None = None  # (n, 3) material axis 1 of shells; None: their first side
    offset: float = 0.0  # of shells
    up: np.ndarray | None = None  # (n, 3) orientation vectors of beams


def elements(
    cells: Sequence[ForeignCells], points: np.ndarray
) -> tuple[Shells, tuple[Solids, ...], Beams]:
    """Shells, solids and beams of these cells.

    A quad or hexahedron that repeats corners becomes the element that it is. A solid that is
    turned inside out is wound the other way. A line with a node in its middle becomes two beams.
    """
    shells, beams = [Shells()], [Beams()]
    solids: dict[int, list[Solids]] = {}
    for one in cells:
        dimension = DIMENSION[one.kind]
        if dimension == 1:
            beams.append(_beams(one))
        elif dimension == 2:
            shells.append(_shells(one))
        else:
            for nodes, rows in _solids(one.nodes, points):
                part = np.full(len(rows), one.part)
                group = Solids(one.ids[rows], nodes, part)
                solids.setdefault(nodes.shape[1], []).append(group)
    return concatenated(*shells), tuple(concatenated(*g) for g in solids.values()), _joined(beams)


def across(ends: np.ndarray) -> np.ndarray:
    """Orientation vectors (n, 3) of lines (n, 2, 3): the basic axis that lies most across each."""
    along = ends[:, 1] - ends[:, 0]
    return np.asarray(np.eye(3)[np.argmin(np.abs(along), axis=1)])


def _joined(beams: list[Beams]) -> Beams:
    joined: Beams = concatenated(*beams)
    return joined


def _beams(cells: ForeignCells) -> Beams:
    nodes, ids, up = cells.nodes, cells.ids, cells.up
    up = np.zeros((len(ids), 3)) if up is None else up
    if cells.kind == "line3":
        nodes = np.concatenate([nodes[:, [0, 2]], nodes[:, [2, 1]]])
        ids = np.concatenate([ids, np.zeros_like(ids)])  # the export numbers them
        up = np.concatenate([up, up])
    n = len(nodes)
    part, none = np.full(n, cells.part), np.zeros((n, 2, 6), bool)
    return Beams(ids, nodes, part, up, np.zeros((n, 2, 3)), none)


def _shells(cells: ForeignCells) -> Shells:
    n, corners = len(cells.ids), 3 if cells.kind.startswith("triangle") else 4
    ends, middle = cells.nodes[:, :corners], np.full((n, 4), -1)
    more = cells.nodes[:, corners : 2 * corners]
    middle[:, : more.shape[1]] = more
    if corners == 3:
        ends = ends[:, [0, 1, 2, 2]]
    else:  # the side between equal corners has no node of its own
        short = ends[:, 2] == ends[:, 3]
        middle[short, 2], middle[short, 3] = middle[short, 3], -1
    t = np.asarray(cells.thickness, float)
    t = np.broadcast_to(t[:, None] if t.ndim == 1 else t, (n, 4)).copy()
    axis = np.zeros((n, 3)) if cells.axis is None else cells.axis
    offset = np.full(n, float(cells.offset))
    return Shells(cells.ids, ends, np.full(n, cells.part), t, axis, offset, middle)


def _solids(nodes: np.ndarray, points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """(nodes in Nastran's order, their rows) by what the cells are once collapsed."""
    nodes = nodes[:, :20]  # no nodes on faces
    corners = CORNERS[nodes.shape[1]]
    same = nodes[:, :corners, None] == nodes[:, None, :corners]
    patterns, which = np.unique(same.argmax(axis=2), axis=0, return_inverse=True)
    found = []
    for k, pattern in enumerate(patterns):
        rows = np.flatnonzero(which.ravel() == k)
        take = _COLLAPSED.get(tuple(pattern.tolist()), tuple(range(corners)))
        found.append((_ordered(nodes[rows], take, pattern, points), rows))
    return found


def _ordered(
    nodes: np.ndarray, take: Sequence[int], pattern: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Corners ``take`` and the nodes on the edges between them, wound to a positive volume."""
    out = _taken(nodes, take, pattern)
    a, b, c, d = (points[out[:, k]] for k in _HANDED[len(take)])
    inside_out = np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a) < 0
    if inside_out.any():
        other = [take[k] for k in MIRRORED[len(take)]]
        out[inside_out] = _taken(nodes[inside_out], other, pattern)
    return out


_HANDED = {8: (0, 1, 3, 4), 6: (0, 1, 2, 3), 5: (0, 1, 3, 4), 4: (0, 1, 2, 3)}


def _taken(nodes: np.ndarray, take: Sequence[int], pattern: np.ndarray) -> np.ndarray:
    """Chosen corners, then the nodes on the edges between them where there are any."""
    corners = len(pattern)
    if nodes.shape[1] == corners:
        return nodes[:, list(take)]
    between = {
        frozenset((int(pattern[a]), int(pattern[b]))): corners + k
        for k, (a, b) in enumerate(VTK_EDGES[corners])
    }
    ends = [(take[a], take[b]) for a, b in EDGES[len(take)]]
    edges = [between.get(frozenset((a, b)), a) for a, b in ends]
    return nodes[:, [*take, *edges]]
