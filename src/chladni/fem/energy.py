"""Mass properties of a structure, and the strain and kinetic energy of its parts in a motion."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly, Beams, Bushes, Masses, Rotors, Scalars, Shells, picked
from . import shell
from .assemble import PIECE, Structure, over_all_motions
from .shell_section import section_arrays


def rigid_motions(assembly: Assembly) -> np.ndarray:
    """Six rigid motions of all points about the origin, u = d + θ x r: (6 n, 6), basic frame.

    Scalar points have no place; their rows are zero.
    """
    n, r = len(assembly.points), assembly.points
    R = np.zeros((n, 6, 6))
    R[:, :3, :3] = R[:, 3:, 3:] = np.eye(3)
    R[:, :3, 3:] = np.cross(np.eye(3)[None], r[:, None]).swapaxes(1, 2)
    if assembly.scalar_points is not None:
        R[assembly.scalar_points] = 0
    return R.reshape(6 * n, 6)


def mass_properties(assembly: Assembly) -> tuple[float, np.ndarray]:
    """Mass m [kg] and centre of gravity c (3,) [m] from Rᵀ M R, supports included.

    The coupling of translation and rotation is m [e_j x c]; a massless structure has c = nan.
    """
    M = over_all_motions(assembly)[0]
    R = rigid_motions(assembly)
    total = R.T @ (M @ R)
    m = float(np.trace(total[:3, :3]) / 3)
    if m <= 0:
        return 0.0, np.full(3, np.nan)
    return m, np.array([total[1, 5], total[2, 3], total[0, 4]]) / m


def part_energies(structure: Structure, phi: np.ndarray) -> np.ndarray:
    """Share φᵀ K_p φ / φᵀ K φ of each part in the strain energy of each motion.

    Parameters
    ----------
    phi : (n_free, r)   motions over the free dofs

    Returns
    -------
    (parts, r); the rest to 1 is in springs and bushes; nan where φᵀ K φ is zero
    """
    return _shares(structure, phi, 2, structure.system.K)


def _shares(structure: Structure, phi: np.ndarray, which: int, whole: sp.csr_array) -> np.ndarray:
    """φᵀ A_p φ / φᵀ A φ, A the M (0) or K (2) of every part."""
    u = np.asarray(structure.T @ phi)
    total = np.einsum("nr,nr->r", phi, whole @ phi)
    share = np.zeros((len(structure.assembly.parts), phi.shape[1]))
    for k in range(len(share)):
        A = over_all_motions(only(structure.assembly, k))[which]
        share[k] = np.einsum("nr,nr->r", u, A @ u)
    return np.divide(share, total, out=np.full_like(share, np.nan), where=total > 0)


def bare(assembly: Assembly) -> Assembly:
    """The points only, without elements, masses and constraints."""
    none = Scalars()
    return replace(
        assembly, shells=Shells(), beams=Beams(), solids=(), springs=none, dampers=none,
        scalar_masses=none, bushes=Bushes(), masses=Masses(), rotors=Rotors(), rigid=(),
    )  # fmt: skip


def only(assembly: Assembly, part: int) -> Assembly:
    """The elements of one part only, over the same points, without constraints."""
    beams, shells = assembly.beams, assembly.shells
    return replace(
        bare(assembly),
        shells=picked(shells, shells.part == part) if len(shells) else Shells(),
        beams=picked(beams, beams.part == part) if len(beams) else Beams(),
        solids=tuple(picked(s, s.part == part) for s in assembly.solids if np.any(s.part == part)),
    )


def shell_energies(structure: Structure, phi: np.ndarray) -> np.ndarray:
    """Strain energy ½ uᵀ K_e u of every shell in each motion: (shells, r) [J]."""
    a = structure.assembly
    u = np.asarray(structure.T @ phi).reshape(len(a.points), 6, -1)
    geo = shell.geometry(a.points, a.shells)
    sections = section_arrays(a, geo)
    energy = np.empty((len(geo), phi.shape[1]))
    for start in range(0, len(geo), PIECE):
        rows = slice(start, start + PIECE)
        K = shell.stiffness(geo[rows], a.shells.thickness[rows], **sections[rows].stiffness)
        u_e = u[geo.nodes[rows]].reshape(len(K), -1, phi.shape[1])
        energy[rows] = 0.5 * np.einsum("eir,eij,ejr->er", u_e, K, u_e, optimize=True)
    return energy
