"""Membrane of the four-node shell: QM6 with the drilling rotation tied to it.

Taylor, Beresford and Wilson (1976), Int. J. Numer. Methods Eng. 10, 1211-1219 (QM6);
Hughes and Brezzi (1989), Comput. Methods Appl. Mech. Eng. 72, 105-121 (drilling).
"""

import numpy as np

CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
GAUSS = CORNERS / np.sqrt(3)  # 2 x 2 points, weights 1
N = (1 + GAUSS[:, :1] * CORNERS[:, 0]) * (1 + GAUSS[:, 1:] * CORNERS[:, 1]) / 4  # (4 points, 4)


def derivatives(xi: float, eta: float) -> np.ndarray:
    """∂N/∂ξ and ∂N/∂η (2, 4)."""
    a, b = CORNERS.T
    return np.stack([a * (1 + eta * b), b * (1 + xi * a)]) / 4


SLOPES = np.stack([derivatives(*point) for point in GAUSS])  # (4 points, 2, 4)
_CORNER_SLOPES = np.stack([derivatives(*point) for point in CORNERS])  # (4 corners, 2, 4)


def jacobians(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinant (m, 4) and inverse (m, 4, 2, 2) of J, rows ∂x/∂ξ, ∂x/∂η, at the Gauss points."""
    return invert((SLOPES.reshape(8, 4) @ corners).reshape(-1, 4, 2, 2))


def invert(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinant and inverse of 2 x 2 matrices (..., 2, 2)."""
    a, b, c, d = J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1]
    det = a * d - b * c
    adjugate = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], -2)
    return det, adjugate / det[..., None, None]


def gradients(inverse: np.ndarray) -> np.ndarray:
    """∂N/∂x and ∂N/∂y at the Gauss points (m, 4, 2, 4)."""
    return inverse @ SLOPES


def corner_slopes(corners: np.ndarray) -> np.ndarray:
    """∂N_l/∂x and ∂N_l/∂y at each of the four corners (m, 4 corners, 2, 4) [1/m]."""
    _, inverse = invert(_CORNER_SLOPES @ corners[:, None])
    return inverse @ _CORNER_SLOPES


def corner_jacobians(corners: np.ndarray) -> np.ndarray:
    """Jacobian of the unit square at each corner (m, 4), the area of a parallelogram [m²]."""
    return 4 * invert(_CORNER_SLOPES @ corners[:, None])[0]


def symmetric(grad: np.ndarray) -> np.ndarray:
    """(ux,x  uy,y  ux,y + uy,x) from a field's nodal ux uy: (..., 2, k) -> (..., 3, 2k)."""
    B = np.zeros((*grad.shape[:-2], 3, 2 * grad.shape[-1]))
    B[..., 0, 0::2] = B[..., 2, 1::2] = grad[..., 0, :]
    B[..., 1, 1::2] = B[..., 2, 0::2] = grad[..., 1, :]
    return B


def spin(grad: np.ndarray) -> np.ndarray:
    """½ (uy,x - ux,y) from a field's nodal ux uy: (..., 2, k) -> (..., 1, 2k)."""
    W = np.zeros((*grad.shape[:-2], 1, 2 * grad.shape[-1]))
    W[..., 0, 1::2], W[..., 0, 0::2] = grad[..., 0, :] / 2, -grad[..., 1, :] / 2
    return W


def membrane(
    corners: np.ndarray, det: np.ndarray, inverse: np.ndarray, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """ε = (B + A G) u with G = -(∫AᵀQA)⁻¹ ∫AᵀQB, and ω = ½(v,x - u,y), at the Gauss points.

    A contains the strains of the two incompatible bubbles 1-ξ², 1-η², condensed for the material
    ``reference``. By stationarity ∫(B+AG)ᵀ dQ (B+AG) is the exact derivative of the condensed
    stiffness at that material.

    Parameters
    ----------
    corners : (m, 4, 2)      [m]
    det, inverse             of :func:`jacobians`
    reference : (m, 3, 3)    plane stiffness of any scale

    Returns
    -------
    (m, 4, 3, 8), (m, 4, 1, 8)
        Strain and spin from the in-plane displacements u1 v1 u2 v2 ...
    """
    det_0, inverse_0 = invert(derivatives(0, 0) @ corners)
    bubble = inverse_0[:, None] * (-2 * GAUSS)[None, :, None, :]  # columns: 1-ξ², 1-η²
    bubble = bubble * (det_0[:, None] / det)[..., None, None]
    grad = gradients(inverse)
    B, A = symmetric(grad), symmetric(bubble)
    QA = reference[:, None] @ A * det[..., None, None]
    m = len(corners)
    QA, flat = QA.reshape(m, 12, 4).swapaxes(1, 2), A.reshape(m, 12, 4)
    G = -np.linalg.solve(QA @ flat, QA @ B.reshape(m, 12, 8))
    return B + A @ G[:, None], spin(grad)
