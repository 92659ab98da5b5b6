"""Formed thickness in: a keyword file of LS-DYNA, a mesh with a field of thickness, or a CSV."""

import io
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import ChladniError, FileError
from ..geometry.cells import check_surface, contradicted
from ..geometry.formed_mesh import FormedMesh
from ..units import Units
from ..units import units as units_named
from .damage import DAMAGED
from .dyna import read_keyword
from .file_size import refuse_large, refuse_outside
from .tables.csv_table import read_table

_NODE_IDS = ("node", "nid", "id", "grid")
THICKNESS_NAMES = ("thickness", "t", "thk", "shell thickness")


def read_formed(path: Path | str, units: str | Units = "mm-t-s") -> FormedMesh:
    """Formed thickness from a keyword file (.k, .key, .dyn, .dynain, .asc), a VTU or a CSV.

    A mesh file (whatever meshio reads) holds the thickness as point or cell data; a CSV has the
    columns node, x, y, z, thickness and no cells.
    """
    path = Path(path)
    unit = units_named(units)
    if path.is_file():
        refuse_large(path)
    read: Callable[[Path, Units], FormedMesh] = read_keyword
    if path.suffix.lower() == ".csv":
        read = _read_csv
    if path.suffix.lower() in (".vtu", ".vtk", ".msh", ".xdmf", ".ply"):
        read = _read_mesh
    try:
        return read(path, unit)
    except FileError:
        raise
    except ChladniError as error:  # of the mesh itself
        raise FileError(f"{path}: {error}") from error


def _read_csv(path: Path, unit: Units) -> FormedMesh:
    """Points with thickness, no cells; columns of other names are passed over."""
    table = read_table(path, ("x", "y", "z"), None)
    t = next((n for n in THICKNESS_NAMES if n in table), None)
    if t is None:
        raise FileError(f"{path} has columns {', '.join(table.columns)}, but none of thickness")
    points = np.column_stack([table.numbers(c) for c in "xyz"])
    id_ = next((n for n in _NODE_IDS if n in table), None)
    ids = table.numbers(id_).astype(np.int64) if id_ else np.arange(1, len(points) + 1)
    thickness = table.numbers(t)
    _, first, which = np.unique(ids, return_index=True, return_inverse=True)
    for k in contradicted(np.column_stack([points, thickness]), first[which])[:1]:
        before = table.line[first[which[k]]]
        raise FileError(
            f"{path}, line {table.line[k]}: node {ids[k]} occurs twice, with other values in line "
            f"{before}"
        )
    none = np.zeros((0, 4), np.int64)
    return FormedMesh(
        ids,
        points * unit.length,
        none,
        none[:, 0],
        np.zeros((0, 4)),
        nodal=thickness * unit.length,
    )


def _read_mesh(path: Path, unit: Units) -> FormedMesh:
    """Quads and triangles of a mesh file with nodal or elemental thickness."""
    mesh = read_by_meshio(path)
    try:
        return _formed_of(path, mesh, unit)
    except ChladniError:
        raise
    except DAMAGED as error:
        raise FileError(f"{path} cannot be read as a mesh: {error}") from error


def read_by_meshio(path: Path) -> Any:
    """A mesh by meshio, which prints the reason and ends the process where it cannot read one."""
    import meshio
    from meshio._exceptions import CorruptionError  # no ReadError, and not exported

    said = io.StringIO()
    if path.suffix.lower() == ".xdmf":
        # HDF5 is named from the folder of the XDMF, binary files from the current one
        with suppress(ElementTree.ParseError):  # meshio says so
            for item in ElementTree.parse(path).iter("DataItem"):
                name, form = (item.text or "").strip(), item.get("Format")
                if form in ("HDF", "Binary"):
                    folder = path.parent if form == "HDF" else Path()
                    refuse_outside(folder / name.split(":")[0], f"{path}: ")
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(path)
    except SystemExit:
        why = " ".join(said.getvalue().split())
        raise FileError(f"{path} cannot be read as a mesh: {why or 'it is damaged'}") from None
    except (*DAMAGED, meshio.ReadError, CorruptionError) as error:
        why = f"there is no {error}" if isinstance(error, KeyError) else str(error)
        raise FileError(f"{path} cannot be read as a mesh: {why}") from error


def _formed_of(path: Path, mesh: Any, unit: Units) -> FormedMesh:
    points = np.column_stack([mesh.points, np.zeros((len(mesh.points), 3 - mesh.points.shape[1]))])
    cells, t, part = [], [], []
    for k, block in enumerate(mesh.cells):
        if block.type in ("quad", "triangle"):
            nodes = block.data if block.type == "quad" else block.data[:, [0, 1, 2, 2]]
            check_surface(points, nodes)
            cells.append(nodes)
            t.append(_thickness_of(path, mesh, k, nodes))
            part.append(_part_of(mesh, k, len(nodes)))
    if not cells:
        raise FileError(f"{path} has no quads and no triangles")
    thickness = np.vstack(t)
    for wrong in np.flatnonzero(~np.isfinite(thickness).all(axis=1))[:1]:
        raise FileError(f"{path}: the thickness of cell {wrong} (counted from 0) is not a number")
    return FormedMesh(
        np.arange(1, len(points) + 1),
        points * unit.length,
        np.vstack(cells).astype(np.int64),
        np.concatenate(part),
        thickness * unit.length,
    )


def _thickness_of(path: Path, mesh: object, block: int, nodes: np.ndarray) -> np.ndarray:
    """Thickness at the corners of a block of cells (n, 4), in the file's unit."""
    at_points = {k.lower(): v for k, v in mesh.point_data.items()}  # type: ignore[attr-defined]
    at_cells = {k.lower(): v for k, v in mesh.cell_data.items()}  # type: ignore[attr-defined]
    for name in THICKNESS_NAMES:
        if name in at_points:
            return np.asarray(at_points[name], dtype=float).ravel()[nodes]
        if name in at_cells:
            return np.repeat(np.asarray(at_cells[name][block], float).reshape(-1, 1), 4, axis=1)
    known = ", ".join([*at_points, *at_cells]) or "no data at all"
    raise FileError(f"{path} has no field called thickness; it has {known}")


def _part_of(mesh: object, block: int, count: int) -> np.ndarray:
    data = {k.lower(): v for k, v in mesh.cell_data.items()}  # type: ignore[attr-defined]
    if "part" in data:
        return np.asarray(data["part"][block]).astype(np.int64).ravel()
    return np.ones(count, np.int64)
