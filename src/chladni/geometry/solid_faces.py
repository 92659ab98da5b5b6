"""The outer faces of solids."""

import numpy as np

from .solid_shapes import CORNERS

SIDES = {  # faces of a solid by its number of corners; a triangle repeats its last node
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    6: ((0, 2, 1, 1), (3, 4, 5, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    5: ((0, 3, 2, 1), (0, 1, 4, 4), (1, 2, 4, 4), (2, 3, 4, 4), (3, 0, 4, 4)),
    4: ((0, 2, 1, 1), (0, 1, 3, 3), (1, 2, 3, 3), (2, 0, 3, 3)),
}


def skin(nodes: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of outer faces (m, 4), their part (m,) and their solid (m,) of solids of one kind."""
    sides = np.array(SIDES[CORNERS[nodes.shape[1]]])
    faces = nodes[:, sides].reshape(-1, 4)
    owner = np.repeat(np.arange(len(nodes)), len(sides))
    _, at, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    at = np.sort(at[count == 1])
    return faces[at], np.asarray(part)[owner[at]], owner[at]


def least_warp_cosine(X: np.ndarray) -> np.ndarray:
    """Least cosine (m,) of corner normals n_1, n_3 and n_2, n_4 of a face with four corners.

    It is Nastran's HEX_WARP (MSC Nastran Quick Reference, GEOMCHECK): 1 for a plane face, less than
    0.707 for one warped by more than 45 degrees. A corner without area counts as plane.

    Parameters
    ----------
    X : (m, 8 or 6, 3)   corners of solids
    """
    sides = np.array([s for s in SIDES[X.shape[1]] if s[2] != s[3]])
    face = X[:, sides]
    ahead, back = (np.roll(face, shift, axis=2) - face for shift in (-1, 1))
    n = np.cross(ahead, back)
    size = np.linalg.norm(n, axis=3)
    size = size[:, :, :2] * size[:, :, 2:]
    cosine = np.einsum("mfki,mfki->mfk", n[:, :, :2], n[:, :, 2:])
    return np.where(size > 0, cosine / np.where(size > 0, size, 1), 1.0).min(axis=(1, 2))
