"""A structure as an unstructured grid of pyvista."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.mesh_cells import mesh_cells
from ..model.assembly import Assembly

if TYPE_CHECKING:
    from pyvista import UnstructuredGrid

_NUMBERS = {  # of VTK
    "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14,
}  # fmt: skip


def mesh_grid(
    assembly: Assembly,
    at_points: Mapping[str, np.ndarray] | None = None,
    of_elements: Mapping[str, np.ndarray] | None = None,
) -> "UnstructuredGrid":
    """Shells, solids and beams, by their corners, with the arrays of a VTU.

    Parameters
    ----------
    at_points : further arrays (n_points, ...)
    of_elements : further arrays (n, ...) over all shells, then all solids, then all beams
    """
    from pyvista import UnstructuredGrid

    cells = mesh_cells(assembly)
    packed, kinds = [], []
    for one in cells:
        n, corners = one.nodes.shape
        packed.append(np.column_stack([np.full(n, corners), one.nodes]).ravel())
        kinds.append(np.full(n, _NUMBERS[one.kind], np.uint8))
    empty = [np.zeros(0, np.int64)]
    grid = UnstructuredGrid(
        np.concatenate(packed or empty), np.concatenate(kinds or empty), assembly.points.copy()
    )
    grid.point_data["grid"] = assembly.ids.copy()
    for name in ("element", "part", "thickness"):
        grid.cell_data[name] = np.concatenate([getattr(c, name) for c in cells] or empty)
    rows = np.concatenate([c.row for c in cells] or empty)
    for name, values in (at_points or {}).items():
        grid.point_data[name] = np.ascontiguousarray(values)
    for name, values in (of_elements or {}).items():
        grid.cell_data[name] = np.ascontiguousarray(values[rows])
    return grid
