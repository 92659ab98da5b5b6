"""Mass, centre of gravity and inertia of a structure and of each of its parts."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..model.assembly import Assembly
from . import shell
from .gather import with_rotations
from .shell_section import section_arrays


@dataclass(frozen=True, eq=False)
class MassProperties:
    """What a balance and a pendulum would say.

    Attributes
    ----------
    mass : float            [kg]
    centre : (3,)           centre of gravity in the basic frame [m]
    inertia : (3, 3)        about the centre of gravity [kg m²]
    parts : dict            mass of each part by its name [kg]
    concentrated : float    of which in point masses [kg]
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    parts: dict[str, float]
    concentrated: float


def mass_properties(assembly: Assembly) -> MassProperties:
    """Mass properties from G = Rᵀ M R, R the rigid motions of space about the origin."""
    weight = np.zeros(len(assembly.parts))
    G = np.zeros((6, 6))
    for part, nodes, M in _elements(assembly):
        R = rigid_motion(assembly.points[nodes])
        G_e = R.swapaxes(1, 2) @ M @ R
        weight += np.bincount(part, G_e[:, 0, 0], minlength=len(weight))
        G += G_e.sum(axis=0)
    lumps = _lumps(assembly)
    G += lumps
    mass = float(G[0, 0])
    centre = np.array([G[1, 5], -G[0, 5], -G[1, 3]]) / mass if mass else np.zeros(3)
    steiner = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    parts = {p.name: float(w) for p, w in zip(assembly.parts, weight, strict=True)}
    return MassProperties(mass, centre, G[3:, 3:] - steiner, parts, float(lumps[0, 0]))


def rigid_motion(points: np.ndarray) -> np.ndarray:
    """Motions ux uy uz rx ry rz of points (..., k, 3) in the six rigid motions: (..., 6k, 6)."""
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    R = np.zeros((*x.shape, 6, 6))
    R[...] = np.eye(6)
    R[..., 0, 4], R[..., 0, 5], R[..., 1, 3] = z, -y, -z
    R[..., 1, 5], R[..., 2, 3], R[..., 2, 4] = x, y, -x
    return R.reshape(*x.shape[:-1], -1, 6)


def _elements(assembly: Assembly) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(part (m,), nodes (m, k), M (m, 6k, 6k)) of every family that has a part."""
    if len(assembly.shells):
        geo = shell.geometry(assembly.points, assembly.shells)
        s = section_arrays(assembly, geo)
        M = shell.mass(geo, assembly.shells.thickness, s.rho, s.nsm, assembly.coupled_mass)
        yield assembly.shells.part, geo.nodes, M
    if any(map(len, assembly.solids)):
        from . import solid

        groups = zip(assembly.solids, solid.stiffness_and_mass(assembly), strict=True)
        for solids, (nodes, _, M) in groups:
            yield solids.part, nodes, with_rotations(M)
    if len(assembly.beams):
        from . import beam

        nodes, _, M = beam.stiffness_and_mass(assembly)
        yield assembly.beams.part, nodes, M


def _lumps(assembly: Assembly) -> np.ndarray:
    """G (6, 6) of point masses."""
    m = assembly.masses
    if not len(m):
        return np.zeros((6, 6))
    R = rigid_motion(assembly.points[m.node][:, None])
    return np.asarray((R.swapaxes(1, 2) @ m.matrix @ R).sum(axis=0))
