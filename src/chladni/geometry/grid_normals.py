"""The surface normal at grids of an assembly, as used in labels such as ``12:n``."""

import numpy as np

from ..errors import LabelError
from ..model.assembly import Assembly
from .facets import point_normals
from .solid_faces import skin


def grid_normals(assembly: Assembly, rows: np.ndarray) -> np.ndarray:
    """Unit normals of the surface at rows of the points (k,): (k, 3), zero without a surface.

    The normal is that of the shells around the grid, with the sign of :mod:`.facets`. Without
    shells it is the outward normal of the solids.
    """
    kinds = [assembly.shells.nodes, *(skin(s.nodes, s.part)[0] for s in assembly.solids)]
    out = np.zeros((len(rows), 3))
    for faces in kinds:
        near = faces[np.isin(faces, rows).any(axis=1)]
        found = point_normals(assembly.points, near)[rows]
        out = np.where(out.any(axis=1, keepdims=True), out, found)
    return out


def normals_at(assembly: Assembly, ids: np.ndarray) -> np.ndarray:
    """Unit normals of the surface at grids (k,) by id: (k, 3)."""
    normals = grid_normals(assembly, assembly.rows(ids))
    if np.any(bare := ~normals.any(axis=1)):
        raise LabelError(
            f"grid {ids[bare][0]} is on no shell, so it has no normal; give +X, +Y, +Z"
        )
    return normals
