"""A plane cut through sheets and solids."""

from dataclasses import dataclass

import numpy as np

from .facets import cell_normals

OBLIQUE = 3.0  # a sheet that lies nearly in the plane is drawn at most this many times as thick


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The cuts of faces by a plane normal to an axis."""

    axis: int  # 0, 1 or 2: x, y or z is constant
    # (k, 2, 2) ends of the cuts in the plane, along the two other axes in order [m]
    lines: np.ndarray
    face: np.ndarray  # (k,) int; index of the face of each cut


def cross_section(points: np.ndarray, faces: np.ndarray, axis: int, at: float) -> CrossSection:
    """Cuts of the faces (m, 4), each as two triangles, with the plane where ``axis`` is ``at`` [m].

    Triangles that lie in the plane are not cut.
    """
    from trimesh import Trimesh
    from trimesh.intersections import mesh_plane

    second = np.flatnonzero(faces[:, 2] != faces[:, 3])
    halves = np.vstack([faces[:, :3], faces[second][:, [0, 2, 3]]])
    owner = np.concatenate([np.arange(len(faces)), second])
    mesh = Trimesh(points, halves, process=False)
    normal, origin = np.eye(3)[axis], at * np.eye(3)[axis]
    lines, cut = mesh_plane(mesh, normal, origin, return_faces=True)
    others = [k for k in range(3) if k != axis]
    return CrossSection(axis, lines.reshape(-1, 2, 3)[:, :, others], owner[cut])


def thick_lines(
    section: CrossSection, points: np.ndarray, faces: np.ndarray, thickness: np.ndarray
) -> np.ndarray:
    """Quadrilaterals (k, 4, 2) [m] of the cut sheets in the plane.

    A sheet of thickness t (m,) whose normal has the angle α to the plane has the width t / cos α.
    """
    along = np.diff(section.lines, axis=1)[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.where(length > 0, length, 1.0)
    normal = np.delete(cell_normals(points, faces)[section.face], section.axis, axis=1)
    cosine = np.maximum(np.linalg.norm(normal, axis=1), 1 / OBLIQUE)
    half = (thickness[section.face] / cosine / 2)[:, None] * across
    a, b = section.lines[:, 0], section.lines[:, 1]
    return np.stack([a + half, b + half, b - half, a - half], axis=1)
