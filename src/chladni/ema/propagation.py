"""Covariance of numbers that are made of each identified mode by itself."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .identification import Identified

_STEP = 1e-5  # of a mode's residues and pole, for slopes of what is made of them


def propagated(identified: Identified, made: Callable[[Identified], np.ndarray]) -> np.ndarray:
    """Covariance (r, k, k) of k real numbers that are made of each mode's own pole and residues.

    J C Jᵀ with J by central differences.

    Parameters
    ----------
    made : Identified -> (r, k), each mode by itself

    Raises
    ------
    ValueError
        If the identification holds no covariance.
    """
    C = identified.covariance
    if C is None:
        raise ValueError("this identification holds no covariance of its modes")
    J = _slopes(identified, made)
    n_c = C.local.shape[1]
    root = np.concatenate([C.pole[:, None], C.shared], axis=1)
    root = root.reshape(len(root), 2 + 2 * n_c, -1)
    through = J @ root
    own = J[:, :, 2:].reshape(*J.shape[:2], n_c, 2)
    return np.asarray(
        through @ through.transpose(0, 2, 1)
        + np.einsum("rkci,rcij,rlcj->rkl", own, C.local, own, optimize=True)
    )


def _slopes(identified: Identified, made: Callable[[Identified], np.ndarray]) -> np.ndarray:
    """d made / d(Re p, Im p, Re R, Im R channel by channel) of every mode (r, k, 2 + 2 n_c)."""
    p, R = identified.poles, identified.residues
    n_c = R[0].size if len(R) else 0
    columns = []
    for at in range(2 + 2 * n_c):
        turn = 1j if at % 2 else 1.0
        if at < 2:
            h = _STEP * np.abs(p)
            moved = [replace(identified, poles=p + sign * turn * h) for sign in (1, -1)]
        else:
            h = _STEP * np.maximum(np.abs(R).max(axis=(1, 2)), 1e-300)
            unit = np.zeros(n_c)
            unit[at // 2 - 1] = 1.0
            by = turn * h[:, None, None] * unit.reshape(R.shape[1:])
            moved = [replace(identified, residues=R + sign * by) for sign in (1, -1)]
        columns.append((made(moved[0]) - made(moved[1])) / (2 * h[:, None]))
    return np.stack(columns, axis=2)
