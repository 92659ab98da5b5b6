"""Two-node beams, bars and rods (SI): axial, torsion, bending in two planes with shear.

The stiffness is a sum of squares over the six deformations of the element (natural modes). One
short formula then covers all kinds of beams, whichever terms vanish.

Sources: Argyris, Recent advances in matrix methods (1964), natural modes; Przemieniecki, Theory of
Matrix Structural Analysis (1968), ch. 5 and 11; masses as in the NASTRAN Theoretical Manual, 5.2.
"""

import numpy as np

from ..errors import ModelError, named
from ..model.assembly import Assembly
from ..model.properties import BeamSection, Isotropic
from . import tapered_beam


def stiffness_and_mass(assembly: Assembly) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(nodes (m, 2), K (m, 12, 12), M (m, 12, 12)) of all beams, dofs in the basic frame."""
    beams = assembly.beams
    if not len(beams):
        return beams.nodes, np.zeros((0, 12, 12)), np.zeros((0, 12, 12))
    sections = _sections(assembly)
    ends = assembly.points[beams.nodes] + beams.offset
    R, L = frames(ends, beams.up, beams.ids)
    K = stiffness(L, **_rigidities(sections))
    M = _mass(sections, L, beams.nonstructural, coupled=assembly.coupled_mass)
    _taper(sections, L, beams.nonstructural, K, M, coupled=assembly.coupled_mass)
    K = released(K, beams.pins.reshape(-1, 12))
    T = _to_nodes(R, beams.offset)
    return beams.nodes, T.transpose(0, 2, 1) @ K @ T, T.transpose(0, 2, 1) @ M @ T


def _taper(
    sections: list[BeamSection],
    L: np.ndarray,
    more: np.ndarray,
    K: np.ndarray,
    M: np.ndarray,
    *,
    coupled: bool,
) -> None:
    """Put K and M of tapered beams in the place of those of their end A."""
    for section in {s for s in sections if s.stations}:
        at = np.array([i for i, s in enumerate(sections) if s == section])
        e, t, kappa, w = _deformations(L[at], np.zeros((len(at), 2)))
        D = np.concatenate([e[:, None], t[:, None], kappa, w], axis=1)
        K[at] = D.transpose(0, 2, 1) @ tapered_beam.natural_stiffness(section, L[at]) @ D
        M[at] = sum(
            _moved(line, ends, L[at])
            for line, ends in tapered_beam.masses(section, L[at], more[at], coupled=coupled)
        )


def loss_factors(assembly: Assembly) -> np.ndarray:
    """Structural damping of every beam's material (m,) [-]."""
    return np.array([s.material.damping for s in _sections(assembly)], dtype=float)


def _sections(assembly: Assembly) -> list[BeamSection]:
    """The section of every beam."""
    found = []
    for k in assembly.beams.part:
        part = assembly.parts[k]
        if not isinstance(part.section, BeamSection):
            raise ModelError(f"part {part.name} ({part.id}) has beams but no beam section")
        if not isinstance(part.section.material, Isotropic):
            raise ModelError(f"part {part.name} ({part.id}): beams need an isotropic material")
        found.append(part.section)
    return found


def frames(ends: np.ndarray, up: np.ndarray, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors R (m, 3, 3) as rows and lengths L (m,) [m]: x along, ``up`` in the x-y plane.

    For a zero ``up`` (rods) any normal is used.
    """
    x = ends[:, 1] - ends[:, 0]
    L = np.linalg.norm(x, axis=1)
    if np.any(L == 0):
        raise ModelError(f"beam {named(ids[L == 0], 3)} has no length")
    x = x / L[:, None]
    free = ~np.any(up, axis=1)
    up = np.where(free[:, None], np.eye(3)[np.argmin(np.abs(x), axis=1)], up)
    z = np.cross(x, up)
    size = np.linalg.norm(z, axis=1)
    if np.any(bad := size <= 1e-9 * np.linalg.norm(up, axis=1)):
        raise ModelError(f"beam {named(ids[bad], 3)} lies along its orientation vector")
    z = z / size[:, None]
    return np.stack([x, np.cross(z, x), z], axis=1), L


def _rigidities(sections: list[BeamSection]) -> dict[str, np.ndarray]:
    """EA, GJ (m,), EI (m, 2, 2), shear compliance c (m, 2) and neutral axis N (m, 2)."""
    materials = [s.material for s in sections if isinstance(s.material, Isotropic)]
    E = np.array([m.E for m in materials])
    G = np.array([m.shear_modulus for m in materials])
    A = np.array([s.area for s in sections])
    I = np.array([[[s.I1, s.I12], [s.I12, s.I2]] for s in sections])
    bends = np.array([s.kind != "rod" for s in sections])
    GAk = (G * A)[:, None] * np.array([s.shear for s in sections])
    return {
        "EA": E * A,
        "GJ": G * np.array([s.J for s in sections]),
        "EI": (E * bends)[:, None, None] * I,
        "c": np.divide(1.0, GAk, out=np.zeros_like(GAk), where=GAk > 0),
        "N": np.array([s.neutral for s in sections], dtype=float),
    }


def stiffness(
    L: np.ndarray, EA: np.ndarray, GJ: np.ndarray, EI: np.ndarray, c: np.ndarray, N: np.ndarray
) -> np.ndarray:
    """K_e = e^T EA/L e + t^T GJ/L t + κᵀ EI/L κ + wᵀ S w, S = 12/L³ EI (1 + 12/L² c EI)⁻¹.

    The squares are elongation e (of the neutral axis), twist t, the two end rotation differences κ,
    and the two deflections w. The latter are relative to the chord L (θ_a + θ_b) / 2.

    Parameters
    ----------
    L, EA, GJ : (m,)   length [m], [N], [N m²]
    EI : (m, 2, 2)     bending, planes 1 (x-y) and 2 (x-z), coupled by I12 [N m²]
    c : (m, 2)         shear compliance 1 / k G A [1/N]; 0: none
    N : (m, 2)         (y, z) of the neutral axis from the shear centre [m]
    """
    e, t, kappa, w = _deformations(L, N)
    C = 12 / L[:, None, None] ** 2 * c[:, :, None] * EI
    S = 12 / L[:, None, None] ** 3 * EI @ np.linalg.inv(np.eye(2) + C)
    K = np.einsum("m,mi,mj->mij", EA / L, e, e) + np.einsum("m,mi,mj->mij", GJ / L, t, t)
    K += np.einsum("mpq,mpi,mqj->mij", EI / L[:, None, None], kappa, kappa)
    K += np.einsum("mpq,mpi,mqj->mij", S, w, w)
    return K


def _deformations(
    L: np.ndarray, N: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows e, t (m, 12), κ, w (m, 2, 12): the natural modes in the dofs of both ends.

    Slopes are v' = θz in plane 1 and w' = -θy in plane 2.
    """
    m = len(L)
    slope = np.zeros((2, 6))
    slope[0, 5], slope[1, 4] = 1, -1
    along = np.zeros((m, 6))
    along[:, 0], along[:, 4], along[:, 5] = 1, N[:, 1], -N[:, 0]
    e = np.concatenate([-along, along], axis=1)
    t = np.tile(np.eye(12)[9] - np.eye(12)[3], (m, 1))
    kappa = np.tile(np.hstack([-slope, slope]), (m, 1, 1))
    across = np.eye(6)[1:3]
    w = np.tile(np.hstack([-across, across]), (m, 1, 1))
    w -= L[:, None, None] / 2 * np.hstack([slope, slope])
    return e, t, kappa, w


def released(K: np.ndarray, pins: np.ndarray) -> np.ndarray:
    """K_ff - K_fp K_pp⁺ K_pf, zero at released dofs p (pin flags); (m, n, n), (m, n) bool."""
    K = K.copy()
    for pattern in np.unique(pins[pins.any(axis=1)], axis=0):
        at = np.flatnonzero((pins == pattern).all(axis=1))
        p = np.flatnonzero(pattern)
        block = K[at]
        inner = np.linalg.pinv(block[:, p[:, None], p], rcond=1e-12, hermitian=True)
        block = block - block[:, :, p] @ inner @ block[:, p, :]
        block[:, p, :] = 0
        block[:, :, p] = 0
        K[at] = block
    return K


def _mass(
    sections: list[BeamSection], L: np.ndarray, more: np.ndarray, *, coupled: bool
) -> np.ndarray:
    """Element masses (m, 12, 12) in the element frame [kg].

    Parameters
    ----------
    more : (m,)   mass of the elements beyond that of their sections [kg/m]
    """
    structural = np.array([s.material.rho * s.area for s in sections]) * L
    other = (np.array([s.nonstructural for s in sections]) + more) * L
    polar = np.array([s.material.rho * (s.I1 + s.I2) * (s.kind == "beam") for s in sections]) * L
    extra = np.array([s.nonstructural_inertia for s in sections]) * L
    at = np.array([s.neutral for s in sections], dtype=float)
    other_at = np.array([s.nonstructural_at for s in sections], dtype=float)
    bends = np.array([s.kind != "rod" for s in sections])
    shape = _consistent if coupled else _lumped
    return shape(structural, at, polar, L, bends) + shape(other, other_at, extra, L, bends)


def _lumped(
    m: np.ndarray, at: np.ndarray, polar: np.ndarray, _L: np.ndarray, _bends: np.ndarray
) -> np.ndarray:
    """Half the mass and half the polar inertia at either end, at the offset ``at`` (y, z)."""
    end = _offset_mass(m / 2, at)
    end[:, 3, 3] += polar / 2
    M = np.zeros((len(m), 12, 12))
    M[:, :6, :6] = M[:, 6:, 6:] = end
    return M


def _offset_mass(m: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Point masses at (0, y, z): m Rᵀ R with R = [1, -r×] (n, 6, 6)."""
    y, z = at.T
    R = np.zeros((len(m), 3, 6))
    R[:, :, :3] = np.eye(3)
    R[:, 0, 4], R[:, 0, 5], R[:, 1, 3], R[:, 2, 3] = z, -y, -z, y
    return m[:, None, None] * (R.transpose(0, 2, 1) @ R)


def _consistent(
    m: np.ndarray, at: np.ndarray, polar: np.ndarray, L: np.ndarray, bends: np.ndarray
) -> np.ndarray:
    """Axial 5/12 and 1/12, cubic bending (lumped across a rod), linear torsion (n, 12, 12)."""
    M = np.zeros((len(m), 12, 12))
    _add(M, (0, 6), np.array([[5, 1], [1, 5]]) / 12 * m[:, None, None])
    _add(M, (3, 9), np.array([[2, 1], [1, 2]]) / 6 * polar[:, None, None])
    across = m[:, None, None] * np.where(bends[:, None, None], _cubic(L), _halves())
    _add(M, (1, 5, 7, 11), across)
    flip = np.array([1, -1, 1, -1])
    _add(M, (2, 4, 8, 10), across * np.outer(flip, flip))
    return _moved(M, np.stack([at, at], axis=1), L)


def _add(M: np.ndarray, dofs: tuple[int, ...], block: np.ndarray) -> None:
    M[:, np.array(dofs)[:, None], np.array(dofs)] += block


def _cubic(L: np.ndarray) -> np.ndarray:
    """∫ N Nᵀ dx / L of the Hermite cubics, dofs (v, v', v, v') (m, 4, 4)."""
    M = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    scale = np.stack([np.ones_like(L), L, np.ones_like(L), L], axis=1)
    return M / 420 * scale[:, :, None] * scale[:, None, :]


def _halves() -> np.ndarray:
    return np.diag([0.5, 0, 0.5, 0])


def _moved(M: np.ndarray, at: np.ndarray, L: np.ndarray) -> np.ndarray:
    """Tᵀ M T for a line at the offsets (n, 2, 2) of both ends (y, z).

    T = [1, -r×], and where the line is tilted its slopes gain v' = -z' θx, w' = y' θx.
    """
    tilt = (at[:, 1] - at[:, 0]) / L[:, None]
    T = np.tile(np.eye(12), (len(M), 1, 1))
    for k, (y, z) in zip((0, 6), at.transpose(1, 2, 0), strict=True):
        T[:, k, k + 4], T[:, k, k + 5], T[:, k + 1, k + 3], T[:, k + 2, k + 3] = z, -y, -z, y
        T[:, k + 4, k + 3], T[:, k + 5, k + 3] = -tilt.T
    return T.transpose(0, 2, 1) @ M @ T


def _to_nodes(R: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """T (m, 12, 12): element dofs at the offset ends = T · dofs of the nodes in the basic frame."""
    T = np.zeros((len(R), 12, 12))
    for end in (0, 1):
        k = 6 * end
        T[:, k : k + 3, k : k + 3] = T[:, k + 3 : k + 6, k + 3 : k + 6] = R
        T[:, k : k + 3, k + 3 : k + 6] = -R @ cross(offset[:, end])
    return T


def cross(r: np.ndarray) -> np.ndarray:
    """[r×] (m, 3, 3) with [r×] a = r × a; a rigid arm r moves by θ × r = -[r×] θ."""
    zero = np.zeros(len(r))
    x, y, z = r.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
