"""Whitening of residuals whose errors lie along known columns.

With the covariance I + V Vᵀ the columns of one output are taken out first, then the columns that
all outputs share.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp


class Stacks(Protocol):
    """Responses that stack complex columns (k, n_f, n_out, n_in) into real ones (n, k)."""

    @property
    def use(self) -> np.ndarray:
        """Lines and channels in use (n_f, n_out)."""

    @property
    def values(self) -> np.ndarray:
        """H (n_f, n_out, n_in)."""

    def stacked(self, z: np.ndarray) -> np.ndarray:
        """Real columns of complex ones, not whitened."""


@dataclass(frozen=True, eq=False)
class Whitening:
    """C^-½ of C = I + V Vᵀ.

    Attributes
    ----------
    own : (n, k) sparse, orthonormal    columns that live on one output each
    own_less : (k,)                     1 - 1/√(1 + s)
    common : (n, m) orthonormal
    common_less : (m,)
    """

    own: sp.csc_array
    own_less: np.ndarray
    common: np.ndarray
    common_less: np.ndarray

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """Residuals or columns of slopes (n, ...)."""
        return _less(self.common, self.common_less, _less(self.own, self.own_less, r))


def whitening(data: Stacks, own: np.ndarray, common: np.ndarray) -> Whitening:
    """Whitening of errors along complex columns over the spread of each sample.

    Parameters
    ----------
    own : (k, n_f, n_out, n_in)      errors of one output each
    common : (m, n_f, n_out, n_in)   errors that all outputs share
    """
    columns, less = [], []
    for at, V in _by_output(data, own):
        U, share = _orthonormal(V)
        columns.append((at, U))
        less.append(share)
    U, own_less = _sparse(columns, data), np.concatenate([np.zeros(0), *less])
    shared = data.stacked(common)
    return Whitening(U, own_less, *_orthonormal(_less(U, own_less, shared)))


def _by_output(data: Stacks, own: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows of each output in use, and the columns of its errors on them."""
    outputs = np.broadcast_to(np.arange(data.use.shape[1]), data.use.shape)[data.use]
    output = np.tile(np.repeat(outputs, data.values.shape[2]), 2)
    V = data.stacked(own)
    return [(at, V[at]) for k in np.unique(output) if len(at := np.flatnonzero(output == k))]


def _sparse(blocks: list[tuple[np.ndarray, np.ndarray]], data: Stacks) -> sp.csc_array:
    """Blocks side by side, each on its rows."""
    n = 2 * int(data.use.sum()) * data.values.shape[2]
    each = []
    for at, U in blocks:
        rows, columns = np.repeat(at, U.shape[1]), np.tile(np.arange(U.shape[1]), len(at))
        each.append(sp.coo_array((U.ravel(), (rows, columns)), shape=(n, U.shape[1])))
    return sp.csc_array(sp.hstack(each)) if each else sp.csc_array((n, 0))


def _less(U: np.ndarray | sp.csc_array, less: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Remove from r its share along each column."""
    along = U.T @ r
    return r - U @ (less[:, None] * along if along.ndim > 1 else less * along)


def _orthonormal(V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U (n, k) of V Vᵀ = U diag(s) Uᵀ, and 1 - 1/√(1 + s)."""
    s, Q = np.linalg.eigh(V.T @ V)
    kept = s > 1e-9 * max(float(s.max(initial=0.0)), 1e-9)
    return V @ (Q[:, kept] / np.sqrt(s[kept])), 1 - 1 / np.sqrt(1 + s[kept])
