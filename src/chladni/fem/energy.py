"""Mass properties of a structure, and the strain and kinetic energy of its parts in a motion."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import cell_areas
from ..model.assembly import Assembly, Beams, Bushes, Masses, Rotors, Scalars, Shells, picked
from . import shell
from .assemble import PIECE, Structure, mass_over_all_motions
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
    M = mass_over_all_motions(assembly)
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
    a, energy = structure.assembly, element_energies(structure, phi)
    part = np.concatenate([a.shells.part, *(group.part for group in a.solids), a.beams.part])
    share = np.zeros((len(a.parts), phi.shape[1]))
    np.add.at(share, part, 2 * energy)
    return _shares(share, phi, structure.system.K)


def kinetic_energies(structure: Structure, phi: np.ndarray) -> np.ndarray:
    """Share φᵀ M_p φ / φᵀ M φ of each part in the kinetic energy of each motion (parts, r).

    The rest to 1 is in point masses.
    """
    u, made = np.asarray(structure.T @ phi), structure.assembly
    every = (mass_over_all_motions(only(made, k)) for k in range(len(made.parts)))
    share = np.array([np.einsum("nr,nr->r", u, M @ u) for M in every])
    return _shares(share.reshape(len(made.parts), phi.shape[1]), phi, structure.system.M)


def effective_masses(structure: Structure, phi: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Effective modal mass (φᵀ M R)² / φᵀ M φ for the six rigid motions of the base (6, r).

    Over all modes the rows add up to the mass and inertia that move (Craig and Kurdila 2006,
    Fundamentals of Structural Dynamics, section 18.2). Three translations [kg], three rotations
    [kg m²].

    Parameters
    ----------
    phi : (n_free, r)   modes over the free dofs
    about : (3,)        point of the rotations [m]
    """
    made = structure.assembly
    R = rigid_motions(replace(made, points=made.points - about))
    load = np.asarray(structure.T.T @ (mass_over_all_motions(made) @ R))
    mass = np.einsum("nr,nr->r", phi, structure.system.M @ phi)
    return np.asarray((load.T @ phi) ** 2 / mass)


def _shares(each: np.ndarray, phi: np.ndarray, whole: sp.csr_array) -> np.ndarray:
    """φᵀ A_p φ of every part (parts, r) over φᵀ A φ."""
    total = np.einsum("nr,nr->r", phi, whole @ phi)
    return np.divide(each, total, out=np.full_like(each, np.nan), where=total > 0)


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


def element_energies(structure: Structure, phi: np.ndarray) -> np.ndarray:
    """Strain energy ½ uᵀ K_e u (n, r) [J] of all shells, then all solids, then all beams."""
    from . import beam, solid

    a = structure.assembly
    u = np.asarray(structure.T @ phi).reshape(len(a.points), 6, -1)
    found = [np.zeros((len(a.shells), phi.shape[1]))]
    for which in (a.shells.curved, ~a.shells.curved):
        if which.any():
            some = replace(structure, assembly=replace(a, shells=picked(a.shells, which)))
            found[0][which] = shell_energies(some, phi)
    for nodes, K, _ in solid.stiffness_and_mass(a):
        u_e = u[nodes, :3].reshape(len(K), -1, phi.shape[1])
        found.append(0.5 * np.einsum("eir,eij,ejr->er", u_e, K, u_e, optimize=True))
    nodes, K, _ = beam.stiffness_and_mass(a)
    u_e = u[nodes].reshape(len(K), 12, phi.shape[1])
    return np.concatenate([*found, 0.5 * np.einsum("eir,eij,ejr->er", u_e, K, u_e)])


def element_volumes(assembly: Assembly) -> np.ndarray:
    """Volumes (n,) [m³] of all shells, then all solids, then all beams."""
    from . import solid

    a, x = assembly, assembly.points
    found = [cell_areas(x, a.shells.nodes) * a.thickness()]
    found += [solid.volume(x[group.nodes]) for group in a.solids]
    area = [getattr(a.parts[p].section, "area", 0.0) for p in a.beams.part.tolist()]
    ends = x[a.beams.nodes] + a.beams.offset
    return np.concatenate([*found, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) * area])


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
