"""The outer faces of solids."""

import numpy as np

_SIDES = {  # faces of a solid by its number of nodes; a triangle repeats its last node
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    6: ((0, 2, 1, 1), (3, 4, 5, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    4: ((0, 2, 1, 1), (0, 1, 3, 3), (1, 2, 3, 3), (2, 0, 3, 3)),
}


def skin(nodes: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outer faces (m, 4), their part (m,) and their solid (m,) of solids with 8, 6 or 4 nodes."""
    sides = np.array(_SIDES[nodes.shape[1]])
    faces = nodes[:, sides].reshape(-1, 4)
    owner = np.repeat(np.arange(len(nodes)), len(sides))
    _, at, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    at = np.sort(at[count == 1])
    return faces[at], np.asarray(part)[owner[at]], owner[at]
