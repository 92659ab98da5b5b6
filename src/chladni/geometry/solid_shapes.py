"""Linear shape functions, quadrature and internal strains of hexahedron, wedge and tetrahedron.

Sources: Zienkiewicz, Taylor, The Finite Element Method 1 (shape functions); Andelfinger, Ramm, Int.
J. Num. Meth. Eng. 36 (1993) 1311-1337 (the 21 internal strains of the hexahedron).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_CUBE = np.array(
    [
        [-1, -1, -1],
        [1, -1, -1],
        [1, 1, -1],
        [-1, 1, -1],
        [-1, -1, 1],
        [1, -1, 1],
        [1, 1, 1],
        [-1, 1, 1],
    ],
    dtype=float,
)


@dataclass(frozen=True, eq=False)
class SolidFamily:
    """Shape functions of one kind of solid: values N(ξ) (k,), gradients dN/dξ (3, k)."""

    values: Callable[[np.ndarray], np.ndarray]
    gradients: Callable[[np.ndarray], np.ndarray]
    points: np.ndarray  # (g, 3) for the stiffness
    weights: np.ndarray
    centre: np.ndarray
    mass_points: np.ndarray
    mass_weights: np.ndarray
    enhanced: Callable[[np.ndarray], np.ndarray] | None = None


def _hexa_values(xi: np.ndarray) -> np.ndarray:
    """N_i = (1 + ξ_i ξ)(1 + η_i η)(1 + ζ_i ζ) / 8."""
    return np.prod(1 + _CUBE * xi, axis=1) / 8


def _hexa_gradients(xi: np.ndarray) -> np.ndarray:
    """dN_i/dξ = ξ_i (1 + η_i η)(1 + ζ_i ζ) / 8, and cyclically."""
    a, b, c = (1 + _CUBE * xi).T
    return np.stack([_CUBE[:, 0] * b * c, a * _CUBE[:, 1] * c, a * b * _CUBE[:, 2]]) / 8


def _hexa_enhanced(xi: np.ndarray) -> np.ndarray:
    """Strains (6, 21) along the element's axes, the nine of incompatible modes first.

    εξ gains ξ, then ξη and ξζ; γξη gains ξ and η, then ξζ and ηζ; the others follow cyclically.
    """
    cycle = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    linear = [(i, xi[i]) for i in range(3)]
    linear += [(3 + i, xi[k]) for i, j, _ in cycle for k in (i, j)]
    bilinear = [(i, xi[i] * xi[k]) for i, *others in cycle for k in others]
    bilinear += [(3 + i, xi[k] * xi[h]) for i, j, h in cycle for k in (i, j)]
    M = np.zeros((6, 21))
    for column, (row, value) in enumerate(linear + bilinear):
        M[row, column] = value
    return M


def _wedge_values(xi: np.ndarray) -> np.ndarray:
    """N = L_i (1 ∓ ζ) / 2 with L = (1 - ξ - η, ξ, η)."""
    L = np.array([1 - xi[0] - xi[1], xi[0], xi[1]])
    return np.concatenate([L * (1 - xi[2]), L * (1 + xi[2])]) / 2


def _wedge_gradients(xi: np.ndarray) -> np.ndarray:
    L = np.array([1 - xi[0] - xi[1], xi[0], xi[1]])
    dL = np.array([[-1.0, 1, 0], [-1, 0, 1]])
    low, high = (1 - xi[2]) / 2, (1 + xi[2]) / 2
    return np.vstack([np.hstack([dL * low, dL * high]), np.concatenate([-L, L]) / 2])


def _wedge_enhanced(xi: np.ndarray) -> np.ndarray:
    """Strains (6, 3): of one in-plane bubble Q = a² + ab + b² along ξ and along η, and εζ = ζ.

    a and b are ξ and η from the centroid; Q does not depend on the first corner.
    """
    a, b = xi[:2] - 1 / 3
    M = np.zeros((6, 3))
    M[0, 0] = M[3, 1] = 2 * a + b
    M[1, 1] = M[3, 0] = a + 2 * b
    M[2, 2] = xi[2]
    return M


def _tetra_values(xi: np.ndarray) -> np.ndarray:
    return np.array([1 - xi.sum(), *xi])


def _tetra_gradients(_: np.ndarray) -> np.ndarray:
    return np.array([[-1.0, 1, 0, 0], [-1, 0, 1, 0], [-1, 0, 0, 1]])


_G = 1 / np.sqrt(3)
_EDGES = np.array([[0.5, 0], [0.5, 0.5], [0, 0.5]])  # mid-points: exact for quadratics
_PRISM = np.array([[*ab, z] for z in (-_G, _G) for ab in _EDGES])
_TETRA4 = (5 + 3 * np.sqrt(5)) / 20 * np.eye(4)[:, 1:] + (5 - np.sqrt(5)) / 20 * (
    1 - np.eye(4)[:, 1:]
)
FAMILIES = {
    8: SolidFamily(
        _hexa_values,
        _hexa_gradients,
        _G * _CUBE,
        np.ones(8),
        np.zeros(3),
        _G * _CUBE,
        np.ones(8),
        _hexa_enhanced,
    ),
    6: SolidFamily(
        _wedge_values,
        _wedge_gradients,
        _PRISM,
        np.full(6, 1 / 6),
        np.array([1 / 3, 1 / 3, 0]),
        _PRISM,
        np.full(6, 1 / 6),
        _wedge_enhanced,
    ),
    4: SolidFamily(
        _tetra_values,
        _tetra_gradients,
        np.full((1, 3), 0.25),
        np.array([1 / 6]),
        np.full(3, 0.25),
        _TETRA4,
        np.full(4, 1 / 24),
    ),
}


def jacobians(X: np.ndarray) -> np.ndarray:
    """Det J (m, g) [m³] of solids (m, k, 3) at their integration points, then at their centre.

    The order of the nodes may be of either hand; det J then has either sign at all points.
    """
    family = FAMILIES[X.shape[1]]
    points = (*family.points, *family.mass_points, family.centre)
    return np.stack([np.linalg.det(family.gradients(xi) @ X) for xi in points], axis=1)
