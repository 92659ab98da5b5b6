"""Structures and shapes for ParaView: VTK's XML unstructured grid, by meshio."""

from pathlib import Path

import numpy as np

from ..arguments import checked
from ..geometry.solid_shapes import CORNERS
from ..model.assembly import Assembly
from ..output import atomic

_KINDS = {8: "hexahedron", 6: "wedge", 5: "pyramid", 4: "tetra"}  # by corners


@checked
def write_vtu(
    path: Path | str,
    assembly: Assembly,
    shapes: np.ndarray | None = None,
    frequency: np.ndarray | None = None,
) -> Path:
    """Write points, elements, thickness and part, and shapes as vectors, for ParaView.

    Parameters
    ----------
    path : file, replaced if there
    assembly : the structure
    shapes : (n_points, 3, r)   translations of all points in the basic frame
    frequency : (r,) [Hz]       for the names of the modes
    """
    import meshio

    blocks = _blocks(assembly)
    data: dict[str, list[np.ndarray]] = {"part": [part for _, _, part, _ in blocks]}
    data["thickness"] = [t for _, _, _, t in blocks]
    vectors = {}
    motion = np.zeros((len(assembly.points), 3, 0)) if shapes is None else shapes
    for k in range(motion.shape[2]):
        hertz = "" if frequency is None else f" {frequency[k]:.6g} Hz"
        vectors[f"mode {k + 1}{hertz}"] = np.ascontiguousarray(motion[:, :, k])
    cells = [(kind, nodes) for kind, nodes, _, _ in blocks]
    mesh = meshio.Mesh(np.asarray(assembly.points), cells, vectors, data if cells else None)
    return atomic(path, lambda part: mesh.write(part, file_format="vtu"))


def _blocks(assembly: Assembly) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """(meshio's kind, nodes, part ids, thickness [m]) of each family; only what has members."""
    shells, beams, found = assembly.shells, assembly.beams, []
    three = shells.triangle
    for kind, which, corners in (("quad", ~three, 4), ("triangle", three, 3)):
        thickness = shells.thickness[which].mean(axis=1)
        found.append((kind, shells.nodes[which][:, :corners], shells.part[which], thickness))
    for solids in assembly.solids:
        corners = CORNERS[solids.nodes.shape[1]]
        nodes = solids.nodes[:, :corners]
        found.append((_KINDS[corners], nodes, solids.part, np.zeros(len(solids))))
    found.append(("line", beams.nodes, beams.part, np.zeros(len(beams))))
    ids = np.array([p.id for p in assembly.parts], dtype=np.int64)
    return [(kind, nodes, ids[part], t) for kind, nodes, part, t in found if len(nodes)]
