"""Shell elements as matrices: K = ∫ t εᵀQ_m ε + t³/12 κᵀQ_b κ + γᵀS γ + s (ω - rz)² dA.

Every matrix here is (m, 24, 24) in the basic frame, nodal order ux uy uz rx ry rz; a triangle's
fourth node has empty rows. ε, κ, γ, ω depend on geometry alone (and, through the incompatible
bubbles of the quadrilateral, on the *shape* of the membrane material), so the stiffness is
**linear** in Q_m, Q_b, Q_c, S and s as long as ``reference`` stays the same:

    stiffness(geo, t, Qm=a*Q1 + b*Q2) = a*stiffness(geo, t, Qm=Q1) + b*stiffness(geo, t, Qm=Q2)

With ``reference`` = the nominal Q_m the nominal stiffness is exactly QM6 and every operator built
from another Q is the exact derivative of the condensed element (see :mod:`.shell_membrane`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from . import triangle
from .shell_geometry import ShellGeometry as ShellGeometry
from .shell_geometry import geometry as geometry
from .shell_membrane import N as QUAD_N
from .shell_membrane import jacobians
from .shell_membrane import membrane as _quad_membrane
from .shell_plate import plate as _quad_plate

CHUNK = 1024  # elements a pass: what fits the cache
POISSON_03 = np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])  # isotropic, nu = 0.3


@dataclass(frozen=True, eq=False)
class Strains:
    """Generalised strains of m shells of one shape at their g points, from 24 nodal motions.

    Attributes
    ----------
    membrane, bending : (m, g, 3, 24)   ε [-], κ [1/m] in the element frame
    shear : (m, g, 2, 24)               γ [-]
    drill : (m, g, 1, 24)               ω - rz [-]
    weight : (m, g)                     dA [m²]
    N : (g, 4)                          shape functions, for values given at corners
    """

    membrane: np.ndarray
    bending: np.ndarray
    shear: np.ndarray
    drill: np.ndarray
    weight: np.ndarray
    N: np.ndarray


def strains(geo: ShellGeometry, reference: np.ndarray | None = None) -> Strains:
    """Strain operators of shells that are all triangles or all quadrilaterals.

    Parameters
    ----------
    geo : ShellGeometry
    reference : (m, 3, 3) or (3, 3)
        Membrane stiffness in the material frame, any scale, for which the bubbles are condensed.
    """
    reference = POISSON_03 if reference is None else reference
    if geo.triangle.any():
        epsilon, omega = triangle.membrane(geo.corners)
        kappa, gamma = triangle.plate(geo.corners)
        weight, N = np.repeat(geo.area[:, None] / 3, 3, axis=1), triangle.N
    else:
        epsilon, omega = _quad_membrane(geo.corners, turned(reference, geo.turn))
        kappa, gamma = _quad_plate(geo.corners)
        weight, N = jacobians(geo.corners)[1], QUAD_N
    return Strains(
        membrane=_from_plane(geo, epsilon),
        bending=_from_rotations(geo, kappa),
        shear=_from_plate(geo, gamma),
        drill=_from_plane(geo, omega) - _from_normal(geo, N),
        weight=weight,
        N=N,
    )


def stiffness(
    geo: ShellGeometry,
    t: np.ndarray,
    Qm: np.ndarray | None = None,
    Qb: np.ndarray | None = None,
    Qc: np.ndarray | None = None,
    S: np.ndarray | None = None,
    drill: np.ndarray | None = None,
    *,
    reference: np.ndarray | None = None,
) -> np.ndarray:
    """K_e = ∫ t εᵀQ_m ε - t² (εᵀQ_c κ + κᵀQ_c ε) + t³/12 κᵀQ_b κ + γᵀS γ + s (ω - rz)² dA.

    Linear in each of Qm, Qb, Qc, S and drill (None is zero) for a given ``reference``; polynomial
    in the corner thicknesses. S and s are not functions of t here: see
    :func:`chladni.fem.shell_section.section_arrays`.

    Parameters
    ----------
    geo : ShellGeometry of m shells
    t : (m, 4)              corner thickness [m], interpolated to the Gauss points
    Qm, Qb, Qc : (m, 3, 3) or (3, 3)
        Plane stiffness of membrane, bending (times 12 I/t³) and coupling (MID4's sign: curvature
        counted as Nastran does, ε(z) = ε - z χ) in the material frame [Pa].
    S : (m, 2, 2)           transverse shear stiffness in the element frame [N/m]
    drill : (m,)            s, stiffness against rz other than the membrane's spin [N/m]
    reference : (m, 3, 3) or (3, 3)
        Membrane stiffness for which the bubbles of the quadrilateral are condensed; Qm where not
        given (an isotropic sheet with nu = 0.3 where Qm is None).

    Returns
    -------
    (m, 24, 24)             basic frame, nodal order ux uy uz rx ry rz [N/m, N, N m]
    """
    reference = Qm if reference is None else reference
    K = np.zeros((len(geo), 24, 24))
    for rows in _chunks(geo):
        part, thick = geo[rows], t[rows]
        e = strains(part, _take(reference, rows))
        t_g = thick @ e.N.T
        terms: list[tuple[np.ndarray, np.ndarray]] = []
        _add(terms, e.membrane, _plane(Qm, rows, part), t_g * e.weight)
        _add(terms, e.bending, _plane(Qb, rows, part), t_g**3 / 12 * e.weight)
        _add(terms, e.shear, _take(S, rows), e.weight)
        _add(terms, e.drill, _scalar(drill, rows), e.weight)
        K[rows] = _quadratic(terms, len(part)) + _coupling(
            e, _plane(Qc, rows, part), -(t_g**2) * e.weight
        )
    return K


def thickness_derivative(
    geo: ShellGeometry,
    t: np.ndarray,
    change: np.ndarray,
    Qm: np.ndarray | None = None,
    Qb: np.ndarray | None = None,
    Qc: np.ndarray | None = None,
    dS: np.ndarray | None = None,
    ddrill: np.ndarray | None = None,
    *,
    reference: np.ndarray | None = None,
) -> np.ndarray:
    """dK_e = ∫ δt εᵀQ_m ε - 2t δt (εᵀQ_c κ + ...) + t²δt/4 κᵀQ_b κ + γᵀdS γ + ds (ω - rz)² dA.

    The exact derivative of :func:`stiffness` along a change of the corner thicknesses.

    Parameters
    ----------
    change : (m, 4)         δt at the corners [m]; np.eye(4)[k] broadcast gives ∂K/∂t_k
    dS : (m, 2, 2)          change of S for this δt (SectionArrays.shear_by_thickness) [N/m]
    ddrill : (m,)           change of s [N/m]
    """
    reference = Qm if reference is None else reference
    K, change = np.zeros((len(geo), 24, 24)), np.broadcast_to(change, t.shape)
    for rows in _chunks(geo):
        part = geo[rows]
        e = strains(part, _take(reference, rows))
        t_g, d_g = t[rows] @ e.N.T, change[rows] @ e.N.T
        terms: list[tuple[np.ndarray, np.ndarray]] = []
        _add(terms, e.membrane, _plane(Qm, rows, part), d_g * e.weight)
        _add(terms, e.bending, _plane(Qb, rows, part), t_g**2 * d_g / 4 * e.weight)
        _add(terms, e.shear, _take(dS, rows), e.weight)
        _add(terms, e.drill, _scalar(ddrill, rows), e.weight)
        K[rows] = _quadratic(terms, len(part)) + _coupling(
            e, _plane(Qc, rows, part), -2 * t_g * d_g * e.weight
        )
    return K


def mass(
    geo: ShellGeometry,
    t: np.ndarray,
    rho: np.ndarray,
    nsm: np.ndarray | None = None,
    coupled: bool = True,
) -> np.ndarray:
    """M_e = ∫ (ρt + nsm) N Nᵀ ⊗ 1 + ρt³/12 N Nᵀ ⊗ (1 - n nᵀ) dA; linear in rho and nsm.

    Lumped (coupled=False) it is what Nastran makes by default: each node carries the translational
    mass ∫ (ρt + nsm) N dA and no inertia.

    Parameters
    ----------
    t : (m, 4)              corner thickness [m]
    rho : (m,)              density [kg/m³]
    nsm : (m,)              non-structural mass [kg/m²]

    Returns
    -------
    (m, 24, 24)             basic frame; the mass of an offset shell sits on its mid-surface
    """
    nsm = np.zeros(len(geo)) if nsm is None else nsm
    M = np.zeros((len(geo), 24, 24))
    for rows in _chunks(geo):
        part = geo[rows]
        weight, N = _quadrature(part)
        t_g = t[rows] @ N.T
        areal = (rho[rows, None] * t_g + nsm[rows, None]) * weight
        rotary = rho[rows, None] * t_g**3 / 12 * weight if coupled else np.zeros_like(areal)
        M[rows] = _mass(part, N, areal, rotary, coupled)
    return M


def areal_mass(geo: ShellGeometry, t: np.ndarray, rho: np.ndarray, nsm: np.ndarray) -> np.ndarray:
    """m_k = ∫ (ρt + nsm) N_k dA (m, 4) [kg], the share of each corner."""
    share = np.zeros((len(geo), 4))
    for rows in _chunks(geo):
        weight, N = _quadrature(geo[rows])
        areal = rho[rows, None] * (t[rows] @ N.T) + nsm[rows, None]
        share[rows] = (areal * weight) @ N
    return share


def turned(Q: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Q in the element frame, Tᵀ Q T, from the material frame turned by ``turn`` (m, 3, 3).

    T takes engineering strains to the material axes (Jones, Mechanics of Composite Materials,
    2.6).
    """
    c, s = np.cos(turn), np.sin(turn)
    T = np.empty((len(turn), 3, 3))
    T[:, 0] = np.stack([c * c, s * s, c * s], axis=1)
    T[:, 1] = np.stack([s * s, c * c, -c * s], axis=1)
    T[:, 2] = np.stack([-2 * c * s, 2 * c * s, c * c - s * s], axis=1)
    return np.asarray(T.swapaxes(1, 2) @ Q @ T)


def _chunks(geo: ShellGeometry) -> Iterator[np.ndarray | slice]:
    """Rows of one shape, a cache's worth at a time."""
    mixed = geo.triangle.any() and not geo.triangle.all()
    for kind in (False, True) if mixed else (None,):
        rows = np.arange(len(geo)) if kind is None else np.flatnonzero(geo.triangle == kind)
        for start in range(0, len(rows), CHUNK):
            if kind is None:
                yield slice(start, min(start + CHUNK, len(geo)))
            else:
                yield rows[start : start + CHUNK]


def _quadrature(geo: ShellGeometry) -> tuple[np.ndarray, np.ndarray]:
    """DA (m, g) and N (g, 4)."""
    if geo.triangle.any():
        return np.repeat(geo.area[:, None] / 3, 3, axis=1), triangle.N
    return jacobians(geo.corners)[1], QUAD_N


def _take(Q: np.ndarray | None, rows: np.ndarray | slice) -> np.ndarray | None:
    return Q if Q is None or Q.ndim == 2 else Q[rows]


def _plane(Q: np.ndarray | None, rows: np.ndarray | slice, geo: ShellGeometry) -> np.ndarray | None:
    Q = _take(Q, rows)
    return None if Q is None else turned(Q, geo.turn)


def _scalar(s: np.ndarray | None, rows: np.ndarray | slice) -> np.ndarray | None:
    return None if s is None else s[rows, None, None]


def _add(
    terms: list[tuple[np.ndarray, np.ndarray]],
    B: np.ndarray,
    D: np.ndarray | None,
    weight: np.ndarray,
) -> None:
    """Append B and w D B, rows of all points one under another."""
    if D is not None:
        m, g, k, _ = B.shape
        stress = (D[:, None] * weight[:, :, None, None]) @ B
        terms.append((B.reshape(m, g * k, 24), stress.reshape(m, g * k, 24)))


def _quadratic(terms: list[tuple[np.ndarray, np.ndarray]], m: int) -> np.ndarray:
    """Σ Bᵀ w D B (m, 24, 24)."""
    if not terms:
        return np.zeros((m, 24, 24))
    B, DB = (np.concatenate(rows, axis=1) for rows in zip(*terms, strict=True))
    return np.asarray(B.swapaxes(1, 2) @ DB)


def _coupling(e: Strains, D: np.ndarray | None, weight: np.ndarray) -> np.ndarray:
    """Σ w (εᵀ D κ + κᵀ D ε)."""
    terms: list[tuple[np.ndarray, np.ndarray]] = []
    _add(terms, e.bending, D, weight)
    if not terms:
        return np.zeros(1)
    m, rows, _ = terms[0][0].shape
    half = e.membrane.reshape(m, rows, 24).swapaxes(1, 2) @ terms[0][1]
    return np.asarray(half + half.swapaxes(1, 2))


def _from_plane(geo: ShellGeometry, B: np.ndarray) -> np.ndarray:
    """In-plane u1 v1 u2 ... of the mid-surface to 24 nodal motions, u = e·u + link (n x ...)·r."""
    m, g, k, _ = B.shape
    e1, e2 = geo.frames[:, 0, None, None, None], geo.frames[:, 1, None, None, None]
    u, v = B[..., 0::2, None], B[..., 1::2, None]
    out = np.empty((m, g, k, 4, 6))
    out[..., :3] = u * e1 + v * e2
    out[..., 3:] = (u * e2 - v * e1) * geo.link[:, None, None, :, None]
    return out.reshape(m, g, k, 24)


def _from_rotations(geo: ShellGeometry, B: np.ndarray) -> np.ndarray:
    """rx1 ry1 rx2 ... in the element frame to 24 nodal motions."""
    m, g, k, _ = B.shape
    e1, e2 = geo.frames[:, 0, None, None, None], geo.frames[:, 1, None, None, None]
    out = np.zeros((m, g, k, 4, 6))
    out[..., 3:] = B[..., 0::2, None] * e1 + B[..., 1::2, None] * e2
    return out.reshape(m, g, k, 24)


def _from_plate(geo: ShellGeometry, B: np.ndarray) -> np.ndarray:
    """w1 rx1 ry1 w2 ... in the element frame to 24 nodal motions."""
    m, g, k, _ = B.shape
    e1, e2, n = (geo.frames[:, i, None, None, None] for i in range(3))
    out = np.empty((m, g, k, 4, 6))
    out[..., :3] = B[..., 0::3, None] * n
    out[..., 3:] = B[..., 1::3, None] * e1 + B[..., 2::3, None] * e2
    return out.reshape(m, g, k, 24)


def _from_normal(geo: ShellGeometry, N: np.ndarray) -> np.ndarray:
    """Rz = Σ N n·r (m, g, 1, 24)."""
    m, g = len(geo), len(N)
    out = np.zeros((m, g, 1, 4, 6))
    out[..., 3:] = N[:, None, :, None] * geo.frames[:, 2, None, None, None]
    return out.reshape(m, g, 1, 24)


def _mass(
    geo: ShellGeometry, N: np.ndarray, areal: np.ndarray, rotary: np.ndarray, coupled: bool
) -> np.ndarray:
    """Nodal mass and inertia through the link of an offset (never of warp): (m, 24, 24)."""
    NN = np.einsum("gi,gj->gij", N, N)
    if not coupled:
        NN = np.eye(4) * N[:, :, None]
    m_ij, j_ij = np.einsum("mg,gij->mij", areal, NN), np.einsum("mg,gij->mij", rotary, NN)
    n = geo.frames[:, 2]
    plane = np.eye(3) - n[:, :, None] * n[:, None, :]
    M = np.zeros((len(geo), 4, 6, 4, 6))
    M[:, :, :3, :, :3] = np.einsum("mij,kl->mikjl", m_ij, np.eye(3))
    M[:, :, 3:, :, 3:] = np.einsum("mij,mkl->mikjl", j_ij, plane)
    if geo.offset.any():
        _carry_offset(M, m_ij, geo.offset, n)
    return M.reshape(len(geo), 24, 24)


def _carry_offset(M: np.ndarray, m_ij: np.ndarray, offset: np.ndarray, n: np.ndarray) -> None:
    """U = u_node + r x (offset n) = u_node + C r: adds m C to (u, r) and m CᵀC to (r, r)."""
    d = offset[:, None] * n
    C = np.zeros((len(n), 3, 3))
    C[:, 0, 1], C[:, 1, 2], C[:, 2, 0] = d[:, 2], d[:, 0], d[:, 1]
    C -= C.swapaxes(1, 2)
    M[:, :, :3, :, 3:] += np.einsum("mij,mkl->mikjl", m_ij, C)
    M[:, :, 3:, :, :3] += np.einsum("mij,mlk->mikjl", m_ij, C)
    M[:, :, 3:, :, 3:] += np.einsum("mij,mpk,mpl->mikjl", m_ij, C, C)
