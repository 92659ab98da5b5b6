"""Scans of real parts: triangulated surfaces in STL, PLY or OBJ files, looked over as they come."""

import logging
import re
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from struct import error

import numpy as np

from ..errors import FileError, ModelError
from ..geometry.cells import check_surface, edges_of
from ..geometry.facets import cell_areas
from ..geometry.mesh_quality import edge_faults, free_edges
from .file_size import refuse_large

_FACET = re.compile(rb"facet\s+normal", re.IGNORECASE)
_STL_HEAD = 84  # bytes of a binary STL up to its first triangle; the last four are their number
_NOT_COUNTED = re.compile(rb"(?m)^f\b[^\n]*?\s(-\d+|0+)(?=[/\s]|\Z)")
_ELEMENT = re.compile(rb"(?m)^element +\S+ +(\d+)")
SUFFIXES = (".stl", ".ply", ".obj")
UNREADABLE = (
    ValueError,
    TypeError,
    AttributeError,
    LookupError,
    ArithmeticError,
    RuntimeError,
    error,
)


@dataclass(frozen=True, eq=False)
class ScannedSurface:
    """A triangulated surface."""

    points: np.ndarray  # (n, 3) [m]
    cells: np.ndarray  # (m, 4) int; triangles as rows of points, the third repeated
    volume: float  # inside, nan unless the surface is closed and wound one way [m³]
    notes: tuple[str, ...]  # what is remarkable about it


def read_scan(path: Path, length: float = 1.0) -> ScannedSurface:
    """A scan whose coordinates are in units of ``length`` [m]."""
    from trimesh import Trimesh, load_mesh

    if path.suffix.lower() not in SUFFIXES:
        raise FileError(f"{path}: a scan is one of {', '.join(SUFFIXES)}, not {path.suffix or '?'}")
    if not path.is_file():
        raise FileError(f"no file {path}")
    refuse_large(path)
    logging.getLogger("trimesh").addHandler(logging.NullHandler())  # it logs what it passes over
    try:
        data = BytesIO(path.read_bytes())  # of a path, the materials an OBJ names would be opened
        mesh = load_mesh(data, file_type=path.suffix[1:].lower(), process=False)
    except UNREADABLE as broken:
        raise FileError(f"{path} cannot be read as a triangulated surface: {broken}") from broken
    held = len(mesh.faces) if isinstance(mesh, Trimesh) else 0
    _refuse_cut(path, held)
    if not held:
        raise FileError(f"{path} holds no triangles; save the scan as a triangulated surface")
    try:
        check_surface(length * np.array(mesh.vertices), np.array(mesh.faces))
    except ModelError as error:
        raise FileError(f"{path}: {error}") from error
    mesh.merge_vertices()
    points, faces = length * np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    cells = faces[:, [0, 1, 2, 2]]
    real = cell_areas(points, cells) > 1e-12 * np.ptp(points, axis=0).max() ** 2
    if not real.any():
        raise FileError(f"{path}: none of its {len(cells)} triangles has an area")
    closed = mesh.is_watertight and mesh.is_winding_consistent
    volume = abs(float(mesh.volume)) * length**3 if closed else np.nan
    return ScannedSurface(points, cells[real], volume, tuple(_remarks(points, cells[real], ~real)))


def _refuse_cut(path: Path, held: int) -> None:
    """Refuse a file that does not hold what it says, which its reader passes over.

    A binary STL states the number of its triangles, and an STL of text has a line for each. A PLY
    of text has a line for each element that its head states. An OBJ counts its vertices from 1.
    """
    data, suffix, due, what = path.read_bytes(), path.suffix.lower(), held, "triangles"
    if suffix == ".stl" and (facets := len(_FACET.findall(data))):
        due = facets
    elif suffix == ".stl" and len(data) > _STL_HEAD:
        due, held = int.from_bytes(data[80:_STL_HEAD], "little"), (len(data) - _STL_HEAD) // 50
    elif suffix == ".ply" and b"\nformat ascii" in data[:200]:
        head, _, body = data.partition(b"end_header")
        due, what = sum(int(n) for n in _ELEMENT.findall(head)), "lines"
        held = min(due, sum(bool(line.strip()) for line in body.splitlines()))
    elif suffix == ".obj" and (wrong := _NOT_COUNTED.search(data)):
        line = data[: wrong.start()].count(b"\n") + 1
        raise FileError(
            f"{path}, line {line}: a face names vertex {wrong[1].decode()}; only vertices counted "
            "from 1 are read"
        )
    if due and held != due:
        raise FileError(
            f"{path} states {due} {what}, but only {held} can be read: it is cut off or damaged"
        )


def _remarks(points: np.ndarray, cells: np.ndarray, flat: np.ndarray) -> list[str]:
    """Triangles without area, open edges, branches, neighbours wound against each other."""
    out = []
    if flat.any():
        out.append(f"{flat.sum()} triangles of the scan have no area and were left out.")
    open_ = free_edges(cells)
    if len(open_):
        length = np.linalg.norm(np.diff(points[open_], axis=1), axis=2).sum()
        share = len(open_) / len(np.unique(edges_of(cells), axis=0))
        out.append(
            f"The scan is open: {len(open_)} free edges ({100 * share:.2g} %), {length:.3g} m in "
            "total; it has no volume."
        )
    turned, branched = edge_faults(cells)
    if turned:
        out.append(
            f"The triangles on both sides of {turned} edges of the scan have opposite winding."
        )
    if branched:
        out.append(f"{branched} edges of the scan are shared by more than two triangles.")
    return out
