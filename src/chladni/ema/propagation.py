"""Covariance of quantities computed from each identified mode separately."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from .identification import Identified
from .modal_covariance import ModalCovariance

_STEP = 1e-5  # of a mode's residues and pole, for slopes of what is made of them
_TOGETHER = 10_000_000  # slopes held at once

Made = Callable[[Identified], np.ndarray]


def propagated(identified: Identified, made: Made) -> np.ndarray:
    """Covariance (r, k, k) of k real numbers computed from the pole and residues of each mode.

    J C Jᵀ with J by central differences. The numbers may be a shape: its free sign is kept fixed.

    Parameters
    ----------
    made : Identified -> (r, k), each mode by itself

    Raises
    ------
    ValueError
        If the identification holds no covariance.
    """
    parts = []
    for J, C in _parts(identified, made):
        own = _by_channel(J)
        through = J @ _root(C)
        local = np.einsum("rkci,rcij,rlcj->rkl", own, C.local, own, optimize=True)
        parts.append(through @ through.transpose(0, 2, 1) + local)
    return np.concatenate(parts) if parts else np.zeros((0, 0, 0))


def standard_deviations(identified: Identified, made: Made) -> np.ndarray:
    """Standard deviations (r, k): the square roots of the diagonal of :func:`propagated`."""
    parts = []
    for J, C in _parts(identified, made):
        own = _by_channel(J)
        variance = ((J @ _root(C)) ** 2).sum(axis=2)
        parts.append(variance + np.einsum("rkci,rcij,rkcj->rk", own, C.local, own, optimize=True))
    found = np.concatenate(parts) if parts else made(identified)
    return np.sqrt(np.maximum(found, 0.0))


def _parts(identified: Identified, made: Made) -> Iterator[tuple[np.ndarray, ModalCovariance]]:
    """Yield slopes and covariance for groups of modes that fit into memory."""
    if identified.covariance is None:
        raise ValueError("this identification has no covariance of its modes")
    if not identified.order:
        return
    k = made(identified).shape[1]
    step = max(1, _TOGETHER // (k * (2 + 2 * identified.lower.size)))
    for first in range(0, identified.order, step):
        one = identified.sel(slice(first, first + step))
        assert one.covariance is not None
        yield _slopes(one, made), one.covariance


def _root(C: ModalCovariance) -> np.ndarray:
    """Root of the shared covariance of pole and residues of every mode (r, 2 + 2 n_c, m)."""
    root = np.concatenate([C.pole[:, None], C.shared], axis=1)
    return root.reshape(len(root), -1, root.shape[-1])


def _by_channel(J: np.ndarray) -> np.ndarray:
    """Slopes of the residues (r, k, n_c, 2)."""
    return J[:, :, 2:].reshape(*J.shape[:2], -1, 2)


def _slopes(identified: Identified, made: Made) -> np.ndarray:
    """d made / d(Re p, Im p, Re R, Im R channel by channel) of every mode (r, k, 2 + 2 n_c)."""
    p, R, due = identified.poles, identified.residues, made(identified)

    def held(moved: Identified) -> np.ndarray:
        found = made(moved)
        return found * np.where((found * due).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)

    n_c = R[0].size
    J = np.empty((*due.shape, 2 + 2 * n_c))
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
        J[:, :, at] = (held(moved[0]) - held(moved[1])) / (2 * h[:, None])
    return J
