"""Shell elements as matrices: K = ∫ t εᵀQ_m ε + t³/12 κᵀQ_b κ + γᵀS γ + s (ω - rz)² dA.

Every matrix here is (m, 24, 24) in the basic frame, nodal order ux uy uz rx ry rz; a triangle's
fourth node has empty rows. It is (m, 48, 48) where some of the shells have nodes on their edges
(:mod:`.curved_shell`). ε, κ, γ, ω depend on geometry only. The incompatible bubbles of the
quadrilateral also depend on the *shape* of the membrane material. Hence the stiffness is **linear**
in Q_m, Q_b, Q_c, S and s for a constant ``reference``:

    stiffness(geo, t, Qm=a*Q1 + b*Q2) = a*stiffness(geo, t, Qm=Q1) + b*stiffness(geo, t, Qm=Q2)

With ``reference`` = the nominal Q_m, the nominal stiffness is exactly QM6. An operator of another Q
is then the exact derivative of the condensed element (see :mod:`.shell_membrane`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from . import curved_shell, triangle
from .shell_drilling import corner_twist, damped
from .shell_geometry import ShellGeometry as ShellGeometry
from .shell_geometry import geometry as geometry
from .shell_geometry import to_element
from .shell_membrane import N as QUAD_N
from .shell_membrane import jacobians
from .shell_membrane import membrane as _quad_membrane
from .shell_plate import plate as _quad_plate

CHUNK = 256  # elements a pass, chosen to fit the cache
LEAST = 1e-9  # share of the trace of Q: small to a stiffness, large to rounding
POISSON_03 = np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])  # isotropic, nu = 0.3
MEMBRANE, BENDING, SHEAR, DRILL = slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 9)
Rows = np.ndarray | slice


@dataclass(frozen=True, eq=False)
class Strains:
    """Generalised strains (ε κ γ ω-rz) of m shells of one shape at g points, from nodal motions."""

    # (m, g, 9, 24) ε [-], κ [1/m], γ [-], ω - rz [-] (see damped) in the element frame
    B: np.ndarray
    weight: np.ndarray  # (m, g) dA [m²]
    N: np.ndarray  # (g, 4) shape functions, for values given at corners


def strains(geo: ShellGeometry, reference: np.ndarray | None = None) -> Strains:
    """Strain operators of shells that are all triangles or all quadrilaterals.

    Parameters
    ----------
    geo : ShellGeometry
    reference : (m, 3, 3) or (3, 3)
        Membrane stiffness in the material frame, any scale, for which the bubbles are condensed.
    """
    if geo.curved.any():
        return Strains(*curved_shell.strains(geo))
    if geo.triangle.any():
        epsilon, omega = triangle.membrane(geo.corners)
        kappa, gamma = triangle.plate(geo.corners)
        weight, N = _quadrature(geo)
    else:
        sheet = POISSON_03 if reference is None else np.asarray(reference)
        (weight, inverse), N = jacobians(geo.corners), QUAD_N
        regular = turned(_regular(sheet), geo.turn)
        epsilon, omega = _quad_membrane(geo.corners, weight, inverse, regular)
        kappa, gamma = _quad_plate(geo.corners, inverse)
    B = np.zeros((len(geo), len(N), 9, 4, 6))  # nodal motions in the element frame
    B[:, :, MEMBRANE, :, :2] = epsilon.reshape(len(geo), -1, 3, 4, 2)
    B[:, :, BENDING, :, 3:5] = kappa.reshape(len(geo), -1, 3, 4, 2)
    B[:, :, SHEAR, :, 2:5] = gamma.reshape(len(geo), -1, 2, 4, 3)
    B[:, :, DRILL, :, :2] = omega.reshape(len(geo), -1, 1, 4, 2)
    B[:, :, 8, :, 5] = -N
    B[:, :, DRILL] = damped(B[:, :, DRILL], weight)
    B = _widened(B.reshape(len(geo), -1, 24) @ to_element(geo), geo)
    return Strains(B.reshape(len(geo), len(N), 9, -1), weight, N)


def _widened(B: np.ndarray, geo: ShellGeometry) -> np.ndarray:
    """Rows (m, r, 24) with empty columns for nodes on edges that these shells lack."""
    return np.pad(B, ((0, 0), (0, 0), (0, geo.motions - 24)))


def _regular(sheet: np.ndarray) -> np.ndarray:
    """A membrane stiffness that has an inverse, for the condensation of the bubbles.

    A sheet without stiffness in some direction (G = 0) gets ``LEAST`` of its trace there. One
    without any (a plate without membrane) is taken as isotropic, nu = 0.3.
    """
    trace = np.trace(sheet, axis1=-2, axis2=-1)[..., None, None]
    diagonal = np.diagonal(sheet, axis1=-2, axis2=-1).prod(axis=-1)
    singular = (np.linalg.det(sheet) <= LEAST * diagonal)[..., None, None]
    return np.where(trace == 0, POISSON_03, sheet + LEAST * trace * np.eye(3) * singular)


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
    S : (m, 2, 2) or (m, 2, 2, 2)
        Transverse shear stiffness in the element frame; two values are for the mean of γ over the
        element and for its variation within it [N/m].
    drill : (m,) or (m, 2)
        s, stiffness of rz relative to the membrane's spin; two values are for the field and for
        the corners (Nastran's K6ROT), see :mod:`.shell_drilling` [N/m]
    reference : (m, 3, 3) or (3, 3)
        Membrane stiffness for which the bubbles of the quadrilateral are condensed; default Qm (an
        isotropic sheet with nu = 0.3 if Qm is None).

    Returns
    -------
    (m, 24, 24)             basic frame, nodal order ux uy uz rx ry rz [N/m, N, N m]
    """

    def section(rows: Rows, part: ShellGeometry, N: np.ndarray) -> np.ndarray:
        t_g = t[rows] @ N.T
        weights = (t_g, t_g**3 / 12, -(t_g**2))
        return _section(part, weights, *_of(rows, Qm, Qb, Qc, _varying(S), _field(drill)))

    reference = Qm if reference is None else reference
    return _integrated(geo, reference, section, _excess(S), _corners(drill))


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
    change : (m, 4)         δt at the corners [m]; np.eye(4)[k] gives ∂K/∂t_k
    dS : as S               change of S for this δt, SectionArrays.shear_by_thickness [N/m]
    ddrill : as drill       change of s, SectionArrays.drill_by_thickness [N/m]
    """
    change = np.broadcast_to(change, t.shape)

    def section(rows: Rows, part: ShellGeometry, N: np.ndarray) -> np.ndarray:
        t_g, d_g = t[rows] @ N.T, change[rows] @ N.T
        weights = (d_g, t_g**2 * d_g / 4, -2 * t_g * d_g)
        return _section(part, weights, *_of(rows, Qm, Qb, Qc, _varying(dS), _field(ddrill)))

    reference = Qm if reference is None else reference
    return _integrated(geo, reference, section, _excess(dS), _corners(ddrill))


def mass(
    geo: ShellGeometry,
    t: np.ndarray,
    rho: np.ndarray,
    nsm: np.ndarray | None = None,
    coupled: bool = True,
) -> np.ndarray:
    """M_e = ∫ (ρt + nsm) N Nᵀ ⊗ 1 + ρt³/12 N Nᵀ ⊗ (1 - n nᵀ) dA; linear in rho and nsm.

    The lumped mass (coupled=False) is Nastran's default: each node has the translational mass
    ∫ (ρt + nsm) N dA and no inertia.

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
    M = np.zeros((len(geo), geo.motions, geo.motions))
    for rows in _chunks(geo):
        part = geo[rows]
        weight, N = _quadrature(part)
        t_g = t[rows] @ N.T
        areal = (rho[rows, None] * t_g + nsm[rows, None]) * weight
        rotary = rho[rows, None] * t_g**3 / 12 * weight if coupled else np.zeros_like(areal)
        M[rows] = _mass(part, N, areal, rotary, coupled)
    return M


def mass_by_thickness(
    geo: ShellGeometry, t: np.ndarray, change: np.ndarray, rho: np.ndarray, coupled: bool = True
) -> np.ndarray:
    """dM_e = ∫ ρδt N Nᵀ ⊗ 1 + ρt²δt/4 N Nᵀ ⊗ (1 - n nᵀ) dA for a change δt (m, 4) of t."""
    M, change = np.zeros((len(geo), geo.motions, geo.motions)), np.broadcast_to(change, t.shape)
    for rows in _chunks(geo):
        part = geo[rows]
        weight, N = _quadrature(part)
        areal = rho[rows, None] * (change[rows] @ N.T) * weight
        rotary = areal * (t[rows] @ N.T) ** 2 / 4 * coupled
        M[rows] = _mass(part, N, areal, rotary, coupled)
    return M


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
    return T.swapaxes(1, 2) @ Q @ T


def _chunks(geo: ShellGeometry) -> Iterator[Rows]:
    """Rows of one shape, in pieces that fit the cache."""
    kinds = geo.triangle + 2 * geo.curved
    found = np.unique(kinds)
    for kind in found:
        rows = np.flatnonzero(kinds == kind)
        for start in range(0, len(rows), CHUNK):
            if len(found) == 1:
                yield slice(start, min(start + CHUNK, len(geo)))
            else:
                yield rows[start : start + CHUNK]


def _quadrature(geo: ShellGeometry) -> tuple[np.ndarray, np.ndarray]:
    """dA (m, g) and N (g, 4)."""
    if geo.curved.any():
        return curved_shell.quadrature(geo)
    if geo.triangle.any():
        return np.repeat(geo.area[:, None] / 3, 3, axis=1), triangle.N
    return jacobians(geo.corners)[0], QUAD_N


def _integrated(
    geo: ShellGeometry,
    reference: np.ndarray | None,
    section: Callable[[Rows, ShellGeometry, np.ndarray], np.ndarray],
    excess: np.ndarray | None,
    corners: np.ndarray | None,
) -> np.ndarray:
    """∫ Bᵀ C B dA + A γ̄ᵀ dS γ̄ + s |J| Σ bᵀ b, C (m, g, 9, 9) from section(rows, geometry, N).

    Here dS is the excess of shear stiffness and s the drilling stiffness of the corners.
    """
    n = geo.motions
    K = np.zeros((len(geo), n, n))
    for rows in _chunks(geo):
        part = geo[rows]
        e = strains(part, *_of(rows, reference))
        C = section(rows, part, e.N) * e.weight[:, :, None, None]
        m = len(part)
        K[rows] = e.B.reshape(m, -1, n).swapaxes(1, 2) @ (C @ e.B).reshape(m, -1, n)
        if excess is not None:
            share = e.weight / part.area[:, None]
            mean = (share[:, :, None, None] * e.B[:, :, SHEAR]).sum(axis=1)
            stress = excess[rows] * part.area[:, None, None] @ mean
            K[rows] += mean.swapaxes(1, 2) @ stress
        if corners is not None:
            curved = part.curved.any()
            b = curved_shell.corner_twist(part) if curved else _widened(corner_twist(part), part)
            K[rows] += b.swapaxes(1, 2) @ (corners[rows, None, None] * b)
    return K


def _varying(S: np.ndarray | None) -> np.ndarray | None:
    """Shear stiffness of γ at every point, before the excess of the mean is added."""
    return S if S is None or S.ndim == 3 else S[:, 1]


def _excess(S: np.ndarray | None) -> np.ndarray | None:
    """Excess of shear stiffness for the mean of γ, usually negative (m, 2, 2)."""
    return None if S is None or S.ndim == 3 else S[:, 0] - S[:, 1]


def _field(drill: np.ndarray | None) -> np.ndarray | None:
    """Drilling stiffness of the field ω - rz."""
    return drill if drill is None or drill.ndim == 1 else drill[:, 0]


def _corners(drill: np.ndarray | None) -> np.ndarray | None:
    """Drilling stiffness of the corners (m,), or None if it is zero."""
    return None if drill is None or drill.ndim == 1 or not drill[:, 1].any() else drill[:, 1]


def _section(
    geo: ShellGeometry,
    weights: tuple[np.ndarray, np.ndarray, np.ndarray],
    Qm: np.ndarray | None,
    Qb: np.ndarray | None,
    Qc: np.ndarray | None,
    S: np.ndarray | None,
    drill: np.ndarray | None,
) -> np.ndarray:
    """C (m, g, 9, 9) of stress resultants over generalised strains, element frame."""
    w_m, w_b, w_c = (w[:, :, None, None] for w in weights)
    C = np.zeros((*weights[0].shape, 9, 9))
    if Qm is not None:
        C[:, :, MEMBRANE, MEMBRANE] = w_m * turned(Qm, geo.turn)[:, None]
    if Qb is not None:
        C[:, :, BENDING, BENDING] = w_b * turned(Qb, geo.turn)[:, None]
    if Qc is not None and Qc.any():
        C[:, :, MEMBRANE, BENDING] = w_c * turned(Qc, geo.turn)[:, None]
        C[:, :, BENDING, MEMBRANE] = C[:, :, MEMBRANE, BENDING].swapaxes(2, 3)
    if S is not None:
        C[:, :, SHEAR, SHEAR] = S[:, None]
    if drill is not None:
        C[:, :, 8, 8] = drill[:, None]
    return C


def _of(rows: Rows, *arrays: np.ndarray | None) -> Iterator[np.ndarray | None]:
    """Select rows of arrays given for each element; one (3, 3) applies to all elements."""
    for a in arrays:
        yield a if a is None or a.shape == (3, 3) else a[rows]


def _mass(
    geo: ShellGeometry, N: np.ndarray, areal: np.ndarray, rotary: np.ndarray, coupled: bool
) -> np.ndarray:
    """Nodal mass and inertia with the rigid link of an offset, but not of warp."""
    if geo.curved.any():
        return curved_shell.mass(geo, areal, rotary, coupled)
    NN = N[:, :, None] * (N[:, None, :] if coupled else np.eye(4))
    m_ij, j_ij = ((w @ NN.reshape(-1, 16)).reshape(-1, 4, 4) for w in (areal, rotary))
    n = geo.frames[:, 2]
    plane = np.eye(3) - n[:, :, None] * n[:, None, :]
    M = np.zeros((len(geo), 4, 6, 4, 6))
    for k in range(3):
        M[:, :, k, :, k] = m_ij
    M[:, :, 3:, :, 3:] = j_ij[:, :, None, :, None] * plane[:, None, :, None, :]
    if geo.offset.any():
        _carry_offset(M, m_ij, geo.offset, n)
    more = geo.motions - 24
    return np.pad(M.reshape(len(geo), 24, 24), ((0, 0), (0, more), (0, more)))


def _carry_offset(M: np.ndarray, m_ij: np.ndarray, offset: np.ndarray, n: np.ndarray) -> None:
    """u = u_node + r x (offset n) = u_node + C r: adds m C to (u, r) and m CᵀC to (r, r)."""
    d = offset[:, None] * n
    C = np.zeros((len(n), 3, 3))
    C[:, 0, 1], C[:, 1, 2], C[:, 2, 0] = d[:, 2], d[:, 0], d[:, 1]
    C -= C.swapaxes(1, 2)
    M[:, :, :3, :, 3:] += np.einsum("mij,mkl->mikjl", m_ij, C)
    M[:, :, 3:, :, :3] += np.einsum("mij,mlk->mikjl", m_ij, C)
    M[:, :, 3:, :, 3:] += np.einsum("mij,mpk,mpl->mikjl", m_ij, C, C)
