"""Mechanisms: strain-free motions other than rigid motions of the whole structure."""

import numpy as np
from scipy.linalg import orth

from .assemble import Structure, frames, idle_motions
from .energy import rigid_motions

_NOT_RIGID = 0.05  # sine of the angle to the rigid motions of the whole; rounding is far below
_FOLLOWS = 1e-3  # weight of a scalar point, so that the grid tied to it is reported instead


def loose_grids(structure: Structure, phi: np.ndarray) -> tuple[int, ...]:
    """The grid that moves most in each mechanism, P = 1 - R R⁺ of modes without strain.

    The singular values of P orth(Tφ) are the sines of the angles between the modes and the six
    rigid motions R (Björck and Golub 1973). Each nonzero one is a mechanism. Rotations are scaled
    by half the structure's size, so that a bar spinning about its axis is a mechanism too. Dofs
    without stiffness (the rotations of a grid of solids) move in no mode, hence not in R either.

    Parameters
    ----------
    phi : (n_free, r)   modes of zero frequency

    Returns
    -------
    ids of grids, one for each mechanism; () if the whole structure moves as one
    """
    if not phi.shape[1]:
        return ()
    made = structure.assembly
    size = float(np.linalg.norm(np.ptp(made.points, axis=0))) or 1.0
    scale = np.tile([1.0] * 3 + [size / 2] * 3, (len(made.ids), 1))
    if made.scalar_points is not None:
        scale[made.scalar_points] *= _FOLLOWS
    scale = scale.reshape(-1, 1)
    u, R = (orth(scale * A) for A in (structure.T @ phi, _modelled_rigid_motions(structure)))
    directions, sine, _ = np.linalg.svd(u - R @ (R.T @ u), full_matrices=False)
    moved = np.linalg.norm(directions[:, sine > _NOT_RIGID].reshape(len(made.ids), 6, -1), axis=1)
    return tuple(int(made.ids[k]) for k in np.argmax(moved, axis=0))


def _modelled_rigid_motions(structure: Structure) -> np.ndarray:
    """Six rigid motions (6n, 6) less the share of dofs that were left out as without stiffness."""
    made = structure.assembly
    R = rigid_motions(made)
    T, at = idle_motions(structure)
    return R - T @ (frames(made).T @ R)[at]
