"""Solids: hexahedron, wedge and tetrahedron with linear shape functions (SI).

Element dofs are translations in the basic frame, ordered node by node. Either handedness of the
node order is accepted: the volume is |det J|.

Sources: Zienkiewicz, Taylor, The Finite Element Method 1 (shape functions); Simo, Rifai, Int. J.
Num. Meth. Eng. 29 (1990) 1595-1638 (enhanced assumed strain); Andelfinger, Ramm, Int. J. Num. Meth.
Eng. 36 (1993) 1311-1337 (its 21 strains of the hexahedron); Taylor, Beresford, Wilson, Int. J. Num.
Meth. Eng. 10 (1976) 1211-1219 (incompatible modes, which are the first nine).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.assembly import Assembly, Solids
from ..model.properties import Isotropic, SolidSection

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


_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # of strain components


@dataclass(frozen=True, eq=False)
class _Family:
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
    return np.asarray(np.prod(1 + _CUBE * xi, axis=1) / 8)


def _hexa_gradients(xi: np.ndarray) -> np.ndarray:
    """dN_i/dξ = ξ_i (1 + η_i η)(1 + ζ_i ζ) / 8, and so on round."""
    a, b, c = (1 + _CUBE * xi).T
    return np.stack([_CUBE[:, 0] * b * c, a * _CUBE[:, 1] * c, a * b * _CUBE[:, 2]]) / 8


def _hexa_enhanced(xi: np.ndarray) -> np.ndarray:
    """Strains (6, 21) along the element's own axes, the nine of incompatible modes first.

    εξ gains ξ, then ξη and ξζ; γξη gains ξ and η, then ξζ and ηζ; and so on round.
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


def _tetra_values(xi: np.ndarray) -> np.ndarray:
    return np.array([1 - xi.sum(), *xi])


def _tetra_gradients(_: np.ndarray) -> np.ndarray:
    return np.array([[-1.0, 1, 0, 0], [-1, 0, 1, 0], [-1, 0, 0, 1]])


_G = 1 / np.sqrt(3)
_TRIANGLE = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
_PRISM = np.array([[*ab, z] for z in (-_G, _G) for ab in _TRIANGLE])
_TETRA4 = (5 + 3 * np.sqrt(5)) / 20 * np.eye(4)[:, 1:] + (5 - np.sqrt(5)) / 20 * (
    1 - np.eye(4)[:, 1:]
)
_FAMILIES = {
    8: _Family(
        _hexa_values,
        _hexa_gradients,
        _G * _CUBE,
        np.ones(8),
        np.zeros(3),
        _G * _CUBE,
        np.ones(8),
        _hexa_enhanced,
    ),
    6: _Family(
        _wedge_values,
        _wedge_gradients,
        _PRISM,
        np.full(6, 1 / 6),
        np.array([1 / 3, 1 / 3, 0]),
        _PRISM,
        np.full(6, 1 / 6),
    ),
    4: _Family(
        _tetra_values,
        _tetra_gradients,
        np.full((1, 3), 0.25),
        np.array([1 / 6]),
        np.full(3, 0.25),
        _TETRA4,
        np.full(4, 1 / 24),
    ),
}


def stiffness_and_mass(assembly: Assembly) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(nodes (m, k), K (m, 3k, 3k) [N/m], M (m, 3k, 3k) [kg]) of every group of solids."""
    out = []
    for solids in assembly.solids:
        X = assembly.points[solids.nodes]
        _check(X, solids, assembly)
        sections, which = _sections(assembly, solids)
        C = np.array([elasticity(s.material) for s in sections])[which]
        rho = np.array([s.material.rho for s in sections])[which]
        modes = np.array([0 if s.full else s.modes for s in sections])[which]
        M = mass(X, rho) if assembly.coupled_mass else lumped_mass(X, rho)
        out.append((solids.nodes, stiffness(X, C, modes), M))
    return out


def _sections(assembly: Assembly, solids: Solids) -> tuple[list[SolidSection], np.ndarray]:
    """The sections in use, and which of them each element has."""
    used, which = np.unique(solids.part, return_inverse=True)
    found = []
    for part in (assembly.parts[k] for k in used):
        if not isinstance(part.section, SolidSection):
            raise ModelError(f"part {part.name} ({part.id}) has solids but no solid section")
        found.append(part.section)
    return found, which


def elasticity(material: object) -> np.ndarray:
    """C (6, 6) of σ = C ε, ε = (εx εy εz γxy γyz γzx), λ = E nu / (1+nu)(1-2nu) [Pa]."""
    if not isinstance(material, Isotropic):
        raise ModelError(f"solids need an isotropic material, not {type(material).__name__}")
    E, nu, G = material.E, material.nu, material.shear_modulus
    if not -1 < nu < 0.5:
        raise ModelError(
            f"material {material.id} has Poisson's ratio {nu}; solids need -1 < nu < 0.5"
        )
    lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    C = np.zeros((6, 6))
    C[:3, :3] = lam + E / (1 + nu) * np.eye(3)
    C[3:, 3:] = G * np.eye(3)
    return C


def _check(X: np.ndarray, solids: Solids, assembly: Assembly) -> None:
    """Raise where an element has no volume or turns inside out."""
    family = _FAMILIES[X.shape[1]]
    dV = np.stack([np.linalg.det(family.gradients(xi) @ X) for xi in family.mass_points])
    bad = (np.abs(dV).max(axis=0) == 0) | (dV.min(axis=0) < 0) & (dV.max(axis=0) > 0)
    if np.any(bad):
        raise ModelError(
            f"solid {solids.ids[bad][:3].tolist()} has no volume or turns inside out; "
            f"its first grid is {assembly.ids[solids.nodes[bad][0, 0]]}"
        )


def _strain(G: np.ndarray) -> np.ndarray:
    """B (m, 6, 3k) with ε = B u from dN/dx (m, 3, k)."""
    m, _, k = G.shape
    B = np.zeros((m, 6, k, 3))
    for row, (i, j) in enumerate(_PAIRS):
        B[:, row, :, i] = G[:, j]
        B[:, row, :, j] = G[:, i]
    return B.reshape(m, 6, 3 * k)


def stiffness(X: np.ndarray, C: np.ndarray, modes: np.ndarray | int = 21) -> np.ndarray:
    """K_e = ∫ Bᵀ C B dV, internal strains condensed out.

    Parameters
    ----------
    X : (m, k, 3)        corners [m]
    C : (m, 6, 6)        elasticity [Pa]
    modes : (m,) or int  internal strains of a hexahedron: 21, 9 (incompatible modes) or 0 (plain)

    Notes
    -----
    The internal strains vary along the element's axes at its centre and are scaled by
    det J₀ / det J, so that constant stress does no work on them: the patch test is passed. With
    them a brick bends without locking and nearly incompressible material does not lock. On a
    box 21 reproduce NX Nastran's hexahedron to its printed digits; plain is its ISOP=FULL.
    """
    modes = np.broadcast_to(np.asarray(modes), len(X))
    family = _FAMILIES[X.shape[1]]
    K = np.empty((len(X), 3 * X.shape[1], 3 * X.shape[1]))
    for n in np.unique(modes):
        at = modes == n
        K[at] = _integrated(family, X[at], C[at], int(n) if family.enhanced else 0)
    return K


def _integrated(family: _Family, X: np.ndarray, C: np.ndarray, modes: int) -> np.ndarray:
    """Σ w |det J| Bᵀ C B over displacements and the first ``modes`` internal strains."""
    J0 = family.gradients(family.centre) @ X
    turn = _to_basic(np.linalg.inv(J0)) * np.linalg.det(J0)[:, None, None]
    K: np.ndarray | float = 0.0
    for xi, w in zip(family.points, family.weights, strict=True):
        J = family.gradients(xi) @ X
        dV = np.linalg.det(J)
        G = np.linalg.solve(J, np.broadcast_to(family.gradients(xi), (len(X), 3, X.shape[1])))
        B = _strain(G)
        if modes and family.enhanced is not None:
            inner = turn @ family.enhanced(xi)[:, :modes] / dV[:, None, None]
            B = np.concatenate([B, inner], axis=2)
        K = K + (w * np.abs(dV))[:, None, None] * (B.transpose(0, 2, 1) @ C @ B)
    return _condensed(np.asarray(K), 3 * X.shape[1])


def _to_basic(A: np.ndarray) -> np.ndarray:
    """ε -> A ε Aᵀ on strains (εx εy εz γxy γyz γzx), shears twice the tensor's (m, 6, 6)."""
    T = np.empty((len(A), 6, 6))
    for row, (i, j) in enumerate(_PAIRS):
        for column, (k, h) in enumerate(_PAIRS):
            value = A[:, i, k] * A[:, j, h] + A[:, i, h] * A[:, j, k]
            T[:, row, column] = value / 2 if i == j else value
    return T


def _condensed(K: np.ndarray, n: int) -> np.ndarray:
    """K_uu - K_ua K_aa⁻¹ K_au, the first n dofs kept."""
    if K.shape[1] == n:
        return K
    return K[:, :n, :n] - K[:, :n, n:] @ np.linalg.solve(K[:, n:, n:], K[:, n:, :n])


def _shares(X: np.ndarray) -> np.ndarray:
    """∫ N_i N_j dV (m, k, k) [m³]."""
    family = _FAMILIES[X.shape[1]]
    shares: np.ndarray | float = 0.0
    for xi, w in zip(family.mass_points, family.mass_weights, strict=True):
        N = family.values(xi)
        dV = w * np.abs(np.linalg.det(family.gradients(xi) @ X))
        shares = shares + dV[:, None, None] * np.outer(N, N)
    return np.asarray(shares)


def mass(X: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Consistent M_e = ∫ ρ Nᵀ N dV (m, 3k, 3k) [kg]."""
    m, k, _ = X.shape
    scalar = rho[:, None, None] * _shares(X)
    return np.einsum("mab,ij->maibj", scalar, np.eye(3)).reshape(m, 3 * k, 3 * k)


def lumped_mass(X: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Row sums of the consistent mass: ∫ ρ N_i dV on the diagonal (m, 3k, 3k) [kg]."""
    m, k, _ = X.shape
    corner = rho[:, None] * _shares(X).sum(axis=2)
    return np.einsum("ma,ab,ij->maibj", corner, np.eye(k), np.eye(3)).reshape(m, 3 * k, 3 * k)


def volume(X: np.ndarray) -> np.ndarray:
    """V_e = ∫ dV (m,) [m³]."""
    return np.asarray(_shares(X).sum(axis=(1, 2)))
