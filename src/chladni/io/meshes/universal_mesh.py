"""Meshes in universal files: datasets 2411 (781), 2412 (780) and groups (2467, 2477, 2452).

Sources: SDRC, Universal File Datasets Summary. A parabolic element names its nodes in the order in
which one passes them, so that nodes on edges stand between corners.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import FileError
from .foreign_model import ForeignMesh, LeftOut, numbered_mesh

_RING6, _RING8 = [0, 2, 4, 1, 3, 5], [0, 2, 4, 6, 1, 3, 5, 7]
_KINDS: dict[int, tuple[str, list[int] | None]] = {  # kind, and where its nodes stand
    **dict.fromkeys((11, 21, 22), ("line", None)),
    **dict.fromkeys((23, 24), ("line3", [0, 2, 1])),
    **dict.fromkeys((41, 51, 61, 74, 91), ("triangle", None)),
    **dict.fromkeys((42, 52, 62, 72, 92), ("triangle6", _RING6)),
    **dict.fromkeys((44, 54, 64, 71, 94), ("quad", None)),
    **dict.fromkeys((45, 55, 65, 75, 95), ("quad8", _RING8)),
    111: ("tetra", None),
    118: ("tetra10", [0, 2, 4, 9, 1, 3, 5, 6, 7, 8]),
    112: ("wedge", None),
    113: ("wedge15", [0, 2, 4, 9, 11, 13, 1, 3, 5, 10, 12, 14, 6, 7, 8]),
    115: ("hexahedron", None),
    116: (
        "hexahedron20",
        [0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11],
    ),
}
_BEAMS = (11, 21, 22, 23, 24)  # their second line is of orientation and sections
_NODES, _ELEMENTS, _GROUPS = (2411, 781), (2412, 780), (2467, 2477, 2452, 2435)


def read_universal_mesh(path: Path) -> ForeignMesh:
    """Nodes, elements and groups of a universal file, lengths in its own unit."""
    ids, places = list[int](), list[list[float]]()
    elements: dict[int, list[list[int]]] = {}
    groups: dict[str, list[int]] = {}
    for kind, lines in _datasets(path):
        try:
            if kind in _NODES:
                ids += [int(line[:10]) for line in lines[::2]]
                places += [[float(x.replace("D", "E")) for x in t.split()] for t in lines[1::2]]
            elif kind in _ELEMENTS:
                _read_elements(kind, lines, elements)
            elif kind in _GROUPS:
                groups |= _read_groups(lines)
        except (ValueError, IndexError) as error:
            raise FileError(f"{path}: dataset {kind} is damaged: {error}") from error
    if not ids or not elements:
        raise FileError(
            f"{path} is a universal file without a mesh: it needs the datasets 2411 and 2412"
        )
    parts = {part: str(part) for table in elements.values() for _, part, *_ in table}
    part_of: dict[int, int] = {}
    for number, (name, members) in enumerate(groups.items(), start=max([*parts, 0]) + 1):
        parts[number] = name
        part_of |= dict.fromkeys(set(members) - set(part_of), number)
    cells: dict[str, list[list[int]]] = {}
    left_out = []
    for code, table in elements.items():
        shape, order = _KINDS.get(code, ("", None))
        if not shape:
            left_out.append(LeftOut(f"elements {code}", len(table), "no element has this number"))
        for id, part, *nodes in table if shape else ():
            placed = nodes if order is None else [nodes[k] for k in order]
            cells.setdefault(shape, []).append([id, part_of.get(id, part), *placed])
    mesh = numbered_mesh(str(path), np.array(ids), np.array(places), cells)
    return ForeignMesh(mesh, str(path), parts, left_out=tuple(left_out))


def _datasets(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(number, lines) of every dataset."""
    inside: list[str] | None = None
    for line in path.read_text(encoding="latin-1").splitlines():
        if line.strip() == "-1":
            if inside and inside[0].strip().isdigit():
                yield int(inside[0]), inside[1:]
            inside = [] if inside is None else None
        elif inside is not None:
            inside.append(line)


def _read_elements(kind: int, lines: list[str], found: dict[int, list[list[int]]]) -> None:
    """[id, physical property, nodes] of each element, by its number of kind."""
    at = 0
    while at < len(lines):
        head = [int(x) for x in lines[at].split()]
        code, count = head[1], head[-1]
        part = head[2] if kind == 2412 else head[3]
        at += 2 if code in _BEAMS else 1
        nodes: list[int] = []
        while len(nodes) < count:
            nodes += [int(x) for x in lines[at].split()]
            at += 1
        found.setdefault(code, []).append([head[0], part, *nodes])


def _read_groups(lines: list[str]) -> dict[str, list[int]]:
    """Elements (entities of type 8) of every group by its name."""
    found, at = {}, 0
    while at < len(lines):
        count, name = int(lines[at].split()[-1]), lines[at + 1].strip()
        at += 2
        numbers: list[int] = []
        while len(numbers) < 4 * count:
            numbers += [int(x) for x in lines[at].split()]
            at += 1
        entities = np.array(numbers[: 4 * count]).reshape(-1, 4)
        if members := entities[entities[:, 0] == 8, 1].tolist():
            found[name] = members
    return found
