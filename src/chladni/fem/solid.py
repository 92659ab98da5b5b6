"""Solids: hexahedron, wedge, tetrahedron and pyramid, with and without nodes on edges (SI).

Element dofs are translations in the basic frame, ordered node by node. Either handedness of the
node order is accepted: the volume is |det J|.

Sources: Zienkiewicz, Taylor, The Finite Element Method 1 (shape functions); Simo, Rifai, Int. J.
Num. Meth. Eng. 29 (1990) 1595-1638 (enhanced assumed strain); Andelfinger, Ramm, Int. J. Num. Meth.
Eng. 36 (1993) 1311-1337 (its 21 strains of the hexahedron); Taylor, Beresford, Wilson, Int. J. Num.
Meth. Eng. 10 (1976) 1211-1219 (incompatible modes, which are the first nine).
"""

from collections.abc import Callable

import numpy as np

from ..errors import ModelError, named
from ..geometry.solid_shapes import CORNERS, FAMILIES, ShapeFamily, jacobians, with_middles
from ..model.assembly import Assembly, Solids
from ..model.properties import AnisotropicSolid, Isotropic, SolidSection

LEAST = 1e-9  # share of the trace of C: small to a stiffness, large to rounding
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # of strain components


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


def loss_factors(assembly: Assembly) -> list[np.ndarray]:
    """Structural damping of every solid's material, one (m,) a group [-]."""
    out = []
    for solids in assembly.solids:
        sections, which = _sections(assembly, solids)
        out.append(np.array([s.material.damping for s in sections])[which])
    return out


def _sections(assembly: Assembly, solids: Solids) -> tuple[list[SolidSection], np.ndarray]:
    """The sections in use, and the index of each element's section."""
    used, which = np.unique(solids.part, return_inverse=True)
    found = []
    for part in (assembly.parts[k] for k in used):
        if not isinstance(part.section, SolidSection):
            raise ModelError(f"part {part.name} ({part.id}) has solids but no solid section")
        found.append(part.section)
    return found, which


def elasticity(material: object) -> np.ndarray:
    """C (6, 6) of σ = C ε, ε = (εx εy εz γxy γyz γzx), λ = E nu / (1+nu)(1-2nu) [Pa].

    An anisotropic solid has its own.
    """
    if isinstance(material, AnisotropicSolid):
        return material.C
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


def elasticity_derivative(material: Isotropic, name: str) -> np.ndarray:
    """dC/dE or dC/dnu (6, 6); an independent G stays constant."""
    E, nu = material.E, material.nu
    below, own = (1 + nu) * (1 - 2 * nu), material.G is not None
    if name == "E":
        lam, twice, G = nu / below, 1 / (1 + nu), 1 / (2 * (1 + nu))
    elif name == "nu":
        lam, twice = E * (1 + 2 * nu**2) / below**2, -E / (1 + nu) ** 2
        G = twice / 2
    else:
        raise ModelError(f"no modulus {name!r} of a solid; there are E and nu")
    dC = np.zeros((6, 6))
    dC[:3, :3] = lam + twice * np.eye(3)
    dC[3:, 3:] = 0.0 if own else G * np.eye(3)
    return dC


def _check(X: np.ndarray, solids: Solids, assembly: Assembly) -> None:
    """Raise if an element has no volume or is turned inside out."""
    dV = jacobians(X)
    bad = (np.abs(dV).max(axis=1) == 0) | (dV.min(axis=1) <= 0) & (dV.max(axis=1) >= 0)
    if np.any(bad):
        raise ModelError(
            f"solid {named(solids.ids[bad], 3)} has no volume or turns inside out; "
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
    modes : (m,) or int  internal strains of a hexahedron: 21, 9 (incompatible modes) or 0 (plain);
                         any value but 0 gives a wedge three, and tied shear, and elements with
                         mid-side nodes reduced shear

    Notes
    -----
    The internal strains vary along the element's axes at its centre and are scaled by
    det J₀ / det J. Constant stress then does no work on them, so that the patch test is passed.
    They prevent locking of a brick in bending and of nearly incompressible material. On a box, 21
    reproduce NX Nastran's hexahedron to its printed digits; plain is its ISOP=FULL. Where C has no
    stiffness in some direction (G = 0), they follow as if it had ``LEAST`` of its trace.
    Hexahedra and wedges with mid-side nodes have no internal strains. Their energy of shear is
    integrated by 2 x 2 x 2 and 3 x 2 points, the rest by 3 x 3 x 3 and 7 x 3 (reduced shear, PSOLID
    of the MSC Nastran Quick Reference Guide); plain integrates all by the latter. Tetrahedra have 5
    points, with which MSC Nastran's displacements of two curved ones come out to the printed
    digits. Pyramids have the Gauss points of their collapsed hexahedron.
    """
    modes = np.broadcast_to(np.asarray(modes), len(X))
    K = np.empty((len(X), 3 * X.shape[1], 3 * X.shape[1]))
    scale = np.trace(C, axis1=1, axis2=2)
    singular = np.linalg.eigvalsh(C)[:, 0] <= LEAST * scale
    if np.any(singular):
        least = np.where(scale > 0, LEAST * scale, 1.0)[:, None, None] * np.eye(6)
        regular = (C + least)[singular]
        K[singular] = stiffness_derivative(X[singular], regular, C[singular], modes[singular])
    for n in np.unique(modes[~singular]):
        at = (modes == n) & ~singular
        K[at] = _condensed(_whole(X[at], C[at], int(n)), 3 * X.shape[1])
    return K


def stiffness_derivative(
    X: np.ndarray, C: np.ndarray, dC: np.ndarray, modes: np.ndarray | int = 21
) -> np.ndarray:
    """dK_e = ∫ (B + A G)ᵀ dC (B + A G) dV, G = -K_aa⁻¹ K_au of C: exact, by stationarity.

    Parameters
    ----------
    C, dC : (m, 6, 6)    elasticity and its change [Pa]
    """
    modes, n = np.broadcast_to(np.asarray(modes), len(X)), 3 * X.shape[1]
    out = np.empty((len(X), n, n))
    for kind in np.unique(modes):
        at = modes == kind
        K, dK = (_whole(X[at], A[at], int(kind)) for A in (C, dC))
        follow = np.linalg.solve(K[:, n:, n:], -K[:, n:, :n])
        carry = np.concatenate([np.broadcast_to(np.eye(n), (len(K), n, n)), follow], axis=1)
        out[at] = carry.swapaxes(1, 2) @ dK @ carry
    return out


def _whole(X: np.ndarray, C: np.ndarray, modes: int) -> np.ndarray:
    """Σ w |det J| Bᵀ C B over displacements and the first ``modes`` internal strains."""
    family, n = FAMILIES[X.shape[1]], 3 * X.shape[1]
    X, straight = with_middles(X)
    J0 = family.gradients(family.centre) @ X
    turn = _to_basic(np.linalg.inv(J0)) * np.linalg.det(J0)[:, None, None]
    tie = _tied(X) if modes and X.shape[1] == 6 else None
    rules = [(family.rule, C)]
    if modes and family.shear_rule is not None:
        shear = _shear_part(J0, C)
        rules = [(family.rule, C - shear), (family.shear_rule, shear)]
    K: np.ndarray | float = 0.0
    for rule, A in rules:
        for k, (xi, w) in enumerate(zip(*rule, strict=True)):
            B, dV = _compatible(family, X, xi)
            if tie is not None:
                B = tie(B, k % 3)
            if modes and family.enhanced is not None:
                inner = turn @ family.enhanced(xi)[:, :modes] / dV[:, None, None]
                B = np.concatenate([B, inner], axis=2)
            K = K + (w * np.abs(dV))[:, None, None] * (B.transpose(0, 2, 1) @ A @ B)
    if straight is not None:
        T = np.einsum("mab,ij->maibj", straight, np.eye(3)).reshape(-1, n, n)
        K = T.transpose(0, 2, 1) @ K @ T
    return np.asarray(K)


def _shear_part(J0: np.ndarray, C: np.ndarray) -> np.ndarray:
    """C (m, 6, 6) of the shears alone, in the axes nearest to the element's (J0 = S R)."""
    left, _, right = np.linalg.svd(J0)
    local = _to_basic(left @ right)
    back = np.linalg.inv(local)
    own = back.transpose(0, 2, 1) @ C @ back
    own[:, :3] = own[:, :, :3] = 0
    return local.transpose(0, 2, 1) @ own @ local


def _compatible(
    family: ShapeFamily, X: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """B (m, 6, 3k) and det J (m,) at a point."""
    J = family.gradients(xi) @ X
    G = np.linalg.solve(J, np.broadcast_to(family.gradients(xi), (len(X), 3, X.shape[1])))
    return _strain(G), np.linalg.det(J)


def _tied(X: np.ndarray) -> Callable[[np.ndarray, int], np.ndarray]:
    """B of a wedge with its transverse shear tied at the middles of its three walls.

    Only the shear along the edge t_k of a wall is used, e_k = t_k · γ, at the middle of the wall.
    At edge k γ is e_k t_k + (c · n_k) n_k. The constant c fits the three best, weighted by length:
    Σ l_k t_k (t_k · c - e_k) = 0. The rule was identified from NX Nastran's CPENTA, which it
    reproduces to the printed digits on a right prism.
    """
    R, t, n, length = _walls(X)
    middle = [np.array([a, b, 0.0]) for a, b, _ in FAMILIES[6].rule[0][:3]]
    local = _to_basic(R)
    e = []
    for k in range(3):
        shear = (local @ _compatible(FAMILIES[6], X, middle[k])[0])[:, [5, 4]]  # γzx, γyz
        e.append(np.einsum("mi,mij->mj", t[:, k], shear))
    rows = np.stack(e, axis=1)  # (m, 3, 18)
    fit = np.einsum("mk,mki,mkj->mij", length, t, t)
    c = np.linalg.solve(fit, np.einsum("mk,mki,mkj->mij", length, t, rows))
    back = _to_basic(R.transpose(0, 2, 1))

    def tie(B: np.ndarray, k: int) -> np.ndarray:
        across = np.einsum("mi,mij->mj", n[:, k], c)
        gamma = t[:, k, :, None] * rows[:, k, None] + n[:, k, :, None] * across[:, None]
        inside = local @ B
        inside[:, [5, 4]] = gamma
        return back @ inside

    return tie


def _walls(X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Frame of the mid-triangle (z its normal), its edges' directions, normals and lengths."""
    P = (X[:, :3] + X[:, 3:]) / 2
    edges = np.roll(P, -1, axis=1) - P
    length = np.linalg.norm(edges, axis=2)
    x = edges[:, 0] / length[:, :1]
    z = np.cross(edges[:, 0], edges[:, 1])
    z /= np.linalg.norm(z, axis=1)[:, None]
    R = np.stack([x, np.cross(z, x), z], axis=1)
    t = np.einsum("mij,mkj->mki", R[:, :2], edges) / length[:, :, None]
    n = np.stack([-t[..., 1], t[..., 0]], axis=-1)
    return R, t, n, length


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
    family, (X, straight) = FAMILIES[X.shape[1]], with_middles(X)
    shares: np.ndarray | float = 0.0
    for xi, w in zip(*family.mass_rule, strict=True):
        N = family.values(xi)
        dV = w * np.abs(np.linalg.det(family.gradients(xi) @ X))
        shares = shares + dV[:, None, None] * np.outer(N, N)
    if straight is not None:
        shares = straight.transpose(0, 2, 1) @ shares @ straight
    return np.asarray(shares)


def mass(X: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Consistent M_e = ∫ ρ Nᵀ N dV (m, 3k, 3k) [kg]."""
    m, k, _ = X.shape
    scalar = rho[:, None, None] * _shares(X)
    return np.einsum("mab,ij->maibj", scalar, np.eye(3)).reshape(m, 3 * k, 3 * k)


def lumped_mass(X: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Row sums of the consistent mass, ∫ ρ N_i dV on the diagonal (m, 3k, 3k) [kg].

    With mid-side nodes row sums are negative at corners. There the diagonal of the consistent mass
    is scaled to ρ V (Hinton, Rock, Zienkiewicz, Earthquake Eng. Struct. Dyn. 4 (1976) 245-249).
    """
    m, k, _ = X.shape
    shares = _shares(X)
    node = shares.sum(axis=2)
    if k > CORNERS[k]:
        total, node = node.sum(axis=1), np.einsum("maa->ma", shares)
        node = node * (total / node.sum(axis=1))[:, None]
    node = rho[:, None] * node
    return np.einsum("ma,ab,ij->maibj", node, np.eye(k), np.eye(3)).reshape(m, 3 * k, 3 * k)


def volume(X: np.ndarray) -> np.ndarray:
    """V_e = ∫ dV (m,) [m³]."""
    return _shares(X).sum(axis=(1, 2))
