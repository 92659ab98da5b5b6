"""Models of other programs: a structure in the numbers of its file, and what was left out of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import FileError, named
from ...geometry.mesh_cells import DIMENSION, ForeignCells, across, elements
from ...model.assembly import Assembly, Masses
from ...model.properties import Part
from ...units import Units
from ..formed_files import THICKNESS_NAMES
from .part_statement import WAY, PartStatement, part_statement

_PARTS = ("part", "gmsh:physical", "medit:ref", "cell_tags", "flac3d:group", "partid", "material")
_NOUNS = {1: "lines", 2: "surfaces", 3: "volumes"}


@dataclass(frozen=True)
class LeftOut:
    """Something in a file of another program that the deck does not have."""

    name: str
    count: int
    why: str


@dataclass(frozen=True, eq=False)
class ForeignModel:
    """A structure in the numbers of its file."""

    assembly: Assembly
    left_out: tuple[LeftOut, ...] = ()

    def said(self) -> tuple[str, ...]:
        """One sentence that lists all that was left out; none where it is nothing."""
        each = [f"{x.name} ({x.count}; {x.why})" for x in self.left_out]
        return (f"Left out of the deck: {named(each, 30)}.",) if each else ()


@dataclass(frozen=True, eq=False)
class ForeignMesh:
    """A mesh of meshio, and what its file says of its parts."""

    mesh: Any  # meshio.Mesh; cell data part, element, thickness, material; point data grid
    name: str  # for sentences
    names: Mapping[int, str] = field(default_factory=dict)  # of parts by number
    known: tuple[PartStatement, ...] = ()
    masses: tuple[tuple[int, float], ...] = ()  # (number of the node, mass)
    left_out: tuple[LeftOut, ...] = ()
    supports: tuple[tuple[int, int], ...] = ()  # (number of the node, component)


def numbered_mesh(name: str, ids: np.ndarray, points: np.ndarray, cells: Mapping[str, Any]) -> Any:
    """A ``meshio.Mesh`` of nodes and cells by their numbers.

    Parameters
    ----------
    cells : by kind, rows of the number of an element, that of its part, and those of its nodes

    Raises
    ------
    FileError
        If there are no cells, or one names a node that is not there.
    """
    import meshio

    if not len(ids) or not any(map(len, cells.values())):
        raise FileError(f"{name} has no shells, solids or beams that are known")
    tables = {kind: np.asarray(rows, dtype=np.int64) for kind, rows in cells.items() if len(rows)}
    order = np.argsort(ids)
    blocks = []
    for kind, table in tables.items():
        at = np.searchsorted(ids, table[:, 2:], sorter=order)
        at = order[np.minimum(at, len(ids) - 1)]
        if (lost := ids[at] != table[:, 2:]).any():
            raise FileError(f"{name}: an element names node {table[:, 2:][lost][0]}, which is "
                            "not there")  # fmt: skip
        blocks.append((kind, at))
    data = {what: [t[:, k] for t in tables.values()] for k, what in ((0, "element"), (1, "part"))}
    return meshio.Mesh(points, blocks, {"grid": ids}, data)


@dataclass(frozen=True, eq=False)
class _Block:
    """Cells of one kind, one part and one material."""

    kind: str
    nodes: np.ndarray  # (n, k) int: rows of points
    ids: np.ndarray  # (n,) int
    number: int  # of the part; 0: the mesh does not number its parts
    name: str
    material: str
    thickness: np.ndarray  # (n,) or (n, 4); nan where the mesh has none


def foreign_model(
    given: ForeignMesh, stated: Sequence[PartStatement] = (), units: Units | None = None
) -> ForeignModel:
    """The structure of a mesh; lines and surfaces around volumes need a statement by name.

    Parameters
    ----------
    stated : by the user; they override those of the file
    units : of the mesh, where it names materials

    Raises
    ------
    FileError
        If parts have no properties; the sentence lists them.
    """
    blocks, left_out = _blocks(given)
    points = np.zeros((len(given.mesh.points), 3))
    points[:, : np.shape(given.mesh.points)[1]] = given.mesh.points
    _refuse_unknown(given.name, stated, blocks)
    highest = max(DIMENSION[b.kind] for b in blocks)
    parts: dict[tuple[str, int, str], Part] = {}
    cells, lacking = [], dict[str, str]()
    for block in blocks:
        dimension = DIMENSION[block.kind]
        statement = _statement(block, given, stated, units)
        if dimension < highest and not statement.name:
            what = f"{_NOUNS[dimension]} of part {block.name}"
            left_out.append(LeftOut(what, len(block.ids), "no --part names it"))
        elif why := statement.lacks(dimension):
            lacking[block.name] = why
        else:
            key = (block.name, dimension, block.material)
            own = Part(len(parts) + 1, _title(key), statement.section(dimension))
            at = list(parts).index(key) if key in parts else len(parts)
            parts.setdefault(key, own)
            t = np.where(block.thickness > 0, block.thickness, statement.values.get("t", 0.0))
            up = across(points[block.nodes]) if dimension == 1 else None
            cells.append(ForeignCells(block.kind, block.ids, block.nodes, at, t, up=up))
    if lacking:
        each = [f"{name} lacks {why}" for name, why in lacking.items()]
        raise FileError(f"{given.name}: part {named(each, 12)}; {WAY}")
    assembly = _assembly(given, points, tuple(parts.values()), cells)
    return ForeignModel(assembly, tuple(left_out))


def _title(key: tuple[str, int, str]) -> str:
    name, _, material = key
    return f"{name} {material}" if material else name


def _refuse_unknown(name: str, stated: Sequence[PartStatement], blocks: Sequence[_Block]) -> None:
    """Refuse a statement of a part that the mesh does not have."""
    idle = [s.name for s in stated if not any(s.is_of(b.name, b.number) for b in blocks)]
    if idle:
        there = named(dict.fromkeys(b.name for b in blocks), 20)
        raise FileError(f"{name} has no part {named(idle)}; there are {there}")


def _statement(
    block: _Block, given: ForeignMesh, stated: Sequence[PartStatement], units: Units | None
) -> PartStatement:
    """Everything that is known of a block, with its mean thickness; named if a statement names it.

    A thickness that the user states replaces that of the mesh.
    """
    own = [s for s in stated if s.is_of(block.name, block.number)]
    said = [s for s in (*given.known, *own) if s.name and s.is_of(block.name, block.number)]
    if block.material:
        said = [part_statement(block.material, units, f"{given.name}, array material:"), *said]
    values: dict[str, float] = {}
    for one in (*(s for s in own if not s.name), *said):
        values |= one.values
    if any("t" in s.values for s in own):
        block.thickness[:] = np.nan
    known = block.thickness[block.thickness > 0]
    if len(known) and ("t" in values or len(known) == block.thickness.size):
        values["t"] = float(known.mean())
    return PartStatement(next((s.name for s in said if s.name), ""), values)


def _blocks(given: ForeignMesh) -> tuple[list[_Block], list[LeftOut]]:
    """Cells by kind, part and material, and the kinds that are left out."""
    mesh, found, count = given.mesh, list[_Block](), 0
    left_out = list(given.left_out)
    data = {name.lower(): values for name, values in mesh.cell_data.items()}
    for k, block in enumerate(mesh.cells):
        n = len(block.data)
        if block.type not in DIMENSION:
            if n and block.type != "vertex":
                left_out.append(LeftOut(f"cells {block.type}", n, "no element has this shape"))
            continue
        own = {name: np.asarray(values[k]) for name, values in data.items()}
        ids = own.get("element", np.arange(count + 1, count + n + 1)).astype(np.int64).ravel()
        count += n
        nodes = np.asarray(block.data, dtype=np.int64)
        t = _thickness_of(own, mesh, nodes)
        for rows, number, name, material in _parts_of(given, k, own, n):
            one = (block.type, nodes[rows], ids[rows], number, name, material, t[rows].copy())
            found.append(_Block(*one))
    if not found:
        raise FileError(f"{given.name} has no lines, surfaces or volumes")
    return found, left_out


def _parts_of(
    given: ForeignMesh, k: int, own: Mapping[str, np.ndarray], n: int
) -> Iterator[tuple[np.ndarray, int, str, str]]:
    """(rows, number, name, material) of the parts within a block."""
    stuff = own.get("material", np.full(n, ""))
    text = stuff.dtype.kind in "OUS"
    materials = stuff.astype(str).ravel() if text else np.full(n, "")
    tags = [own[name] for name in _PARTS if name in own and not (name == "material" and text)]
    label = tags[0].ravel() if tags else _of_sets(given.mesh, k, n)
    names = {int(tag): name for name, (tag, *_) in given.mesh.field_data.items()}
    names |= given.names
    pairs = list(zip(label.tolist(), materials.tolist(), strict=True))
    rows: dict[tuple[Any, str], list[int]] = {}
    for row, pair in enumerate(pairs):
        rows.setdefault(pair, []).append(row)
    for (part, material), mine in rows.items():
        number = 0 if isinstance(part, str | bytes) else int(part)
        name = names.get(number, str(number or "mesh")) if number == part else str(part)
        yield np.array(mine), number, name, material


def _of_sets(mesh: Any, k: int, n: int) -> np.ndarray:
    """The first set of cells that each cell of a block is in, by name; 0 without sets."""
    sets = {name: rows[k] for name, rows in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    label = np.zeros(n, dtype=object)
    for name, rows in reversed(sets.items()):
        if rows is not None and len(rows):
            label[np.asarray(rows, dtype=np.int64)] = name
    return label


def _thickness_of(own: Mapping[str, np.ndarray], mesh: Any, nodes: np.ndarray) -> np.ndarray:
    """Thickness of cells (n, 4) at their corners; nan where the mesh has none."""
    at_points = {name.lower(): values for name, values in mesh.point_data.items()}
    corners = {3: [0, 1, 2, 2], 6: [0, 1, 2, 2]}.get(nodes.shape[1], [0, 1, 2, 3])
    for name in THICKNESS_NAMES:
        if name in own:
            t = np.asarray(own[name], float).reshape(len(nodes), -1)
            return np.repeat(t, 4, axis=1) if t.shape[1] == 1 else t[:, :4]
        if name in at_points and nodes.shape[1] in (3, 4, 6, 8, 9):
            return np.asarray(at_points[name], float).ravel()[nodes[:, corners]]
    return np.full((len(nodes), 4), np.nan)


def _assembly(
    given: ForeignMesh, points: np.ndarray, parts: tuple[Part, ...], cells: list[ForeignCells]
) -> Assembly:
    """The structure over the points that it uses, ids increasing."""
    grid = np.asarray(given.mesh.point_data.get("grid", np.arange(1, len(points) + 1)))
    grid = grid.astype(np.int64).ravel()
    if len(np.unique(grid)) < len(grid) or grid.min() <= 0:
        grid = np.arange(1, len(points) + 1)
    used = np.isin(grid, [id for id, _ in given.masses])
    for one in cells:
        used[one.nodes.ravel()] = True
    rows = np.flatnonzero(used)[np.argsort(grid[used])]
    new = np.full(len(points), -1)
    new[rows] = np.arange(len(rows))
    ids, points = grid[rows], points[rows]
    if not np.isfinite(points).all():
        raise FileError(f"{given.name}: a coordinate is not a number")
    at = {id: k for k, id in enumerate(ids.tolist())}
    held = sorted({(at[id], c) for id, c in given.supports if id in at})
    lumped = np.array([at[id] for id, _ in given.masses], dtype=np.int64)
    M = np.array([m for _, m in given.masses]).reshape(-1, 1, 1) * np.diag([1.0, 1, 1, 0, 0, 0])
    return Assembly(
        ids,
        points,
        parts,
        *elements([replace(c, nodes=new[c.nodes]) for c in cells], points),
        masses=Masses(np.zeros(len(lumped), np.int64), lumped, M),
        supports=np.array(held, dtype=np.int64).reshape(-1, 2),
    )
