"""Meshes of other programs from their files: by meshio, or by the readers of this room."""

from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ...errors import FileError
from ...geometry.vtk_data_set import vtk_data_set
from ..file_size import refuse_large
from ..formed_files import read_by_meshio
from ..mesh_format import ANSYS, DYNA, UNIVERSAL, VTK, foreign_format
from .ansys_archive import read_archive
from .dyna_model import read_dyna_model
from .foreign_model import ForeignMesh
from .universal_mesh import read_universal_mesh

_VTK = {  # numbers of VTK
    3: "line", 5: "triangle", 9: "quad", 10: "tetra", 12: "hexahedron", 13: "wedge",
    14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 1: "vertex",
}  # fmt: skip


class MeshObject(Protocol):
    """A data set of pyvista or a mesh of meshio."""

    points: Any  # (n, 3)
    cell_data: Any  # arrays by name: part, thickness, material


def read_mesh(path: Path) -> ForeignMesh:
    """The mesh in a file of another program.

    Raises
    ------
    FileError
        If the file is damaged, or of a program that is not known.
    """
    refuse_large(path)
    own = {ANSYS: read_archive, DYNA: read_dyna_model, UNIVERSAL: read_universal_mesh}
    kind = foreign_format(path)
    if kind in own:
        return own[kind](path)
    try:
        return mesh_of(read_by_meshio(path), str(path))
    except FileError:
        if kind != VTK or path.suffix.lower() == ".vtu":
            raise
        return mesh_of(vtk_data_set(path), str(path))  # sections that meshio does not know


def mesh_of(given: Any, name: str = "the mesh") -> ForeignMesh:
    """A ``meshio.Mesh``, or a data set of pyvista, which need not be installed."""
    if hasattr(given, "cast_to_unstructured_grid"):
        given = _of_pyvista(given.cast_to_unstructured_grid())
    return ForeignMesh(given, name)


def _of_pyvista(grid: Any) -> Any:
    """The cells of an unstructured grid by kind, with their arrays."""
    import meshio

    if not grid.n_cells:
        raise FileError("the data set has no cells")
    kinds, nodes = np.asarray(grid.celltypes), np.asarray(grid.cell_connectivity)
    offset = np.asarray(grid.GetCells().GetOffsetsArray())
    cells, rows = [], []
    for kind in np.unique(kinds):
        mine = np.flatnonzero(kinds == kind)
        size = int(np.diff(offset)[mine].min())
        table = nodes[offset[mine][:, None] + np.arange(size)]
        known = int(kind) in _VTK
        cells.append((_VTK[kind], table) if known else ("polygon", np.zeros((len(mine), 3), int)))
        rows.append(mine)
    data = {name: [np.asarray(grid.cell_data[name])[r] for r in rows] for name in grid.cell_data}
    points = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    return meshio.Mesh(np.asarray(grid.points, float), cells, points, data)
