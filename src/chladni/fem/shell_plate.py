"""Bending and transverse shear of the four-node shell: MITC4.

Bathe and Dvorkin (1985), Int. J. Numer. Methods Eng. 21, 367-383. Rotations are those of the
normal about x and y, u(z) = u + z ry and v(z) = v - z rx.
"""

import numpy as np

from .shell_membrane import CORNERS, GAUSS, derivatives, gradients, symmetric


def curvature(grad: np.ndarray) -> np.ndarray:
    """κ = (ry,x  -rx,y  ry,y - rx,x): (..., 2, k) -> (..., 3, 2k), nodal order rx ry."""
    B = symmetric(grad)  # of the field (ry, -rx)
    C = np.empty_like(B)
    C[..., 0::2], C[..., 1::2] = -B[..., 1::2], B[..., 0::2]
    return C


def plate(corners: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Curvatures and tied transverse shear at the Gauss points.

    γ = (w,x + ry  w,y - rx); its covariant parts are sampled at the middle of the sides only.

    Parameters
    ----------
    corners : (m, 4, 2)      [m]
    inverse : (m, 4, 2, 2)   of the Jacobian at the Gauss points

    Returns
    -------
    (m, 4, 3, 8), (m, 4, 2, 12)
        κ from rx1 ry1 rx2 ..., and γ from w1 rx1 ry1 w2 ...
    """
    xi, eta = GAUSS.T[:, None, :, None]
    bottom, top = (_covariant(corners, 0.0, b, 0)[:, None] for b in (-1.0, 1.0))
    left, right = (_covariant(corners, a, 0.0, 1)[:, None] for a in (-1.0, 1.0))
    along_xi = ((1 - eta) * bottom + (1 + eta) * top) / 2
    along_eta = ((1 - xi) * left + (1 + xi) * right) / 2
    return curvature(gradients(inverse)), inverse @ np.stack([along_xi, along_eta], axis=2)


def _covariant(corners: np.ndarray, xi: float, eta: float, k: int) -> np.ndarray:
    """γ along natural direction k at one point, w,k + x,k ry - y,k rx; (m, 12)."""
    shape = np.prod(1 + np.array([xi, eta]) * CORNERS, axis=1) / 4
    slope = derivatives(xi, eta)[k]
    x, y = (slope @ corners).T[:, :, None]
    B = np.zeros((len(corners), 12))
    B[:, 0::3], B[:, 1::3], B[:, 2::3] = slope, -y * shape, x * shape
    return B
