"""Structures and shapes for ParaView: VTK's XML unstructured grid, by meshio."""

from pathlib import Path

import numpy as np

from ..arguments import checked
from ..geometry.mesh_cells import mesh_cells
from ..model.assembly import Assembly
from ..output import atomic


@checked
def write_vtu(
    path: Path | str,
    assembly: Assembly,
    shapes: np.ndarray | None = None,
    frequency: np.ndarray | None = None,
) -> Path:
    """Write points, elements and shapes as vectors, for ParaView.

    The points have the array ``grid``, the elements ``element``, ``part`` (ids) and ``thickness``.

    Parameters
    ----------
    path : file, replaced if there
    assembly : the structure
    shapes : (n_points, 3, r)   translations of all points in the basic frame
    frequency : (r,) [Hz]       for the names of the modes
    """
    import meshio

    cells = mesh_cells(assembly)
    data = {name: [getattr(c, name) for c in cells] for name in ("element", "part", "thickness")}
    arrays = {"grid": np.asarray(assembly.ids)}
    motion = np.zeros((len(assembly.points), 3, 0)) if shapes is None else shapes
    for k in range(motion.shape[2]):
        hertz = "" if frequency is None else f" {frequency[k]:.6g} Hz"
        arrays[f"mode {k + 1}{hertz}"] = np.ascontiguousarray(motion[:, :, k])
    blocks = [(c.kind, c.nodes) for c in cells]
    mesh = meshio.Mesh(np.asarray(assembly.points), blocks, arrays, data if cells else None)
    return atomic(path, lambda part: mesh.write(part, file_format="vtu"))
