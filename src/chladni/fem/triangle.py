"""Three-node shell: constant strain, constant curvature, tied transverse shear (MITC3).

Lee and Bathe (2004), Computers and Structures 82, 945-962. The fourth node of the arrays repeats
the third and takes no part.
"""

import numpy as np

from .shell_membrane import invert, spin, symmetric
from .shell_plate import curvature

POINTS = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])  # r, s; weights a third
N = np.column_stack([1 - POINTS.sum(axis=1), POINTS, np.zeros(3)])  # (3 points, 4)
SLOPES = np.array([[-1.0, 1, 0, 0], [-1, 0, 1, 0]])


def membrane(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ε and ω = ½(v,x - u,y), constant, given at three points: (m, 3, 3, 8), (m, 3, 1, 8)."""
    grad = _gradients(corners)
    return _thrice(symmetric(grad)), _thrice(spin(grad))


def plate(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """κ from rx1 ry1 ... (m, 3, 3, 8) and γ from w1 rx1 ry1 ... (m, 3, 2, 12)."""
    _, inverse = invert(SLOPES @ corners)
    e_r, e_s = (_covariant(corners, point) for point in ((0.5, 0.0), (0.0, 0.5)))
    slanted = _covariant(corners, (0.5, 0.5))
    at_r, at_s = e_r[:, 0], e_s[:, 1]
    c = (at_s - slanted[:, 1]) - (at_r - slanted[:, 0])
    r, s = POINTS.T[:, None, :, None]
    tied = np.stack([at_r[:, None] + c[:, None] * s, at_s[:, None] - c[:, None] * r], axis=2)
    return _thrice(curvature(_gradients(corners))), inverse[:, None] @ tied


def _thrice(B: np.ndarray) -> np.ndarray:
    return np.repeat(B[:, None], 3, axis=1)


def _gradients(corners: np.ndarray) -> np.ndarray:
    """∂N/∂x, ∂N/∂y (m, 2, 4)."""
    _, inverse = invert(SLOPES @ corners)
    return inverse @ SLOPES


def _covariant(corners: np.ndarray, point: tuple[float, float]) -> np.ndarray:
    """γ along r and s, w,k + x,k ry - y,k rx; (m, 2, 12)."""
    shape = np.array([1 - sum(point), *point, 0.0])
    J = SLOPES @ corners
    B = np.zeros((len(corners), 2, 12))
    B[:, :, 0::3] = SLOPES
    B[:, :, 1::3], B[:, :, 2::3] = -J[:, :, 1:] * shape, J[:, :, :1] * shape
    return B
