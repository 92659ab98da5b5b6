"""Element types of Abaqus and CalculiX as kinds of cells, and the faces that surfaces name."""

import re

from ...geometry.mesh_cells import DIMENSION, NODES, VTK_EDGES
from ...geometry.solid_shapes import CORNERS

_KINDS = (
    (r"S3R?S?|STRI3|M3D3", "triangle"),
    (r"STRI65|S6|M3D6", "triangle6"),
    (r"S4.*|M3D4R?", "quad"),
    (r"S8.*|M3D8R?", "quad8"),
    (r"S9R5", "quad9"),
    (r"C3D4H?", "tetra"),
    (r"C3D10.*", "tetra10"),
    (r"C3D5H?", "pyramid"),
    (r"C3D6H?", "wedge"),
    (r"C3D15H?", "wedge15"),
    (r"C3D8.*", "hexahedron"),
    (r"C3D20.*", "hexahedron20"),
    (r"C3D27.*", "hexahedron27"),
    (r"B31.*|B33H?|T3D2.*|PIPE31H?", "line"),
    (r"B32.*|T3D3.*|PIPE32H?", "line3"),
)
TRUSS, MEMBRANE = re.compile(r"T3D.*"), re.compile(r"M3D.*")
FULL, REDUCED = re.compile(r"C3D(8|20)H?"), re.compile(r"C3D(8|20)[RI].*")  # points of bricks
NO_ROTATION = re.compile(r"T3D.*|M3D.*")
# rigid and surface elements, and those that joints consist of
READ_ELSEWHERE = re.compile(
    r"R3D[34]|RB3D2|SFM3D.*|DCOUP3D|MASS|ROTARYI|SPRING[A12]|DASHPOT.|CONN.*"
)
_FACES = {  # S1, S2, ... by the number of corners
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    6: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
}


def kind_of(type: str) -> str:
    """Kind of cell of an element type; "" for types that are no shell, solid or beam.

    >>> kind_of("S4R"), kind_of("C3D10M"), kind_of("MASS")
    ('quad', 'tetra10', '')
    """
    return next((kind for pattern, kind in _KINDS if re.fullmatch(pattern, type)), "")


def nodes_of(type: str) -> int:
    """Number of nodes of an element type; 0: as many as its line names."""
    return NODES.get(kind_of(type), 0)


def faces_of(type: str, label: str) -> list[tuple[list[int], list[int]]]:
    """(corners, nodes on edges) of a face S1, S2 ... or edge E1 ...; without a label all faces."""
    kind = kind_of(type)
    if DIMENSION.get(kind) == 2:
        corners = 3 if kind.startswith("triangle") else 4
        between = list(range(corners, min(NODES[kind], 2 * corners)))
        if label[:1] == "E" and label[1:].isdecimal():
            side = int(label[1:]) - 1
            return [([side, (side + 1) % corners], between[side : side + 1])]
        return [(list(range(corners)), between)]
    corners = CORNERS.get(min(NODES.get(kind, 0), 20), 0)
    every = _FACES.get(corners, ())
    if label[:1] == "S" and label[1:].isdecimal():
        every = every[int(label[1:]) - 1 : int(label[1:])]
    edges = enumerate(VTK_EDGES[corners]) if every and NODES[kind] > corners else ()
    middle = [(corners + k, set(ends)) for k, ends in edges]
    return [(list(face), [k for k, ends in middle if ends <= set(face)]) for face in every]
