"""Whitening of residuals whose errors lie along known columns.

With the covariance I + V Vᵀ the columns of one output are taken out first, then the columns that
all outputs share.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class Whitening:
    """C^-½ of C = I + V Vᵀ."""

    own: sp.csc_array  # (n, k) columns that live on one output each, orthonormal
    own_less: np.ndarray  # (k,) 1 - 1/√(1 + s)
    common: np.ndarray  # (n, m), orthonormal
    common_less: np.ndarray  # (m,)

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """Residuals or columns of slopes (n, ...)."""
        return _less(self.common, self.common_less, _less(self.own, self.own_less, r))


def whitening(output: np.ndarray, own: np.ndarray, common: np.ndarray) -> Whitening:
    """Whitening of errors along columns over the spread of each sample.

    Parameters
    ----------
    output : (n,)       of each row
    own : (n, k)        errors of one output each
    common : (n, m)     errors that all outputs share
    """
    blocks, less = [sp.csc_array((len(own), 0))], [np.zeros(0)]
    for k in np.unique(output):
        at = np.flatnonzero(output == k)
        U, share = _orthonormal(own[at])
        rows, columns = np.repeat(at, U.shape[1]), np.tile(np.arange(U.shape[1]), len(at))
        blocks.append(sp.coo_array((U.ravel(), (rows, columns)), shape=(len(own), U.shape[1])))
        less.append(share)
    U, own_less = sp.csc_array(sp.hstack(blocks)), np.concatenate(less)
    return Whitening(U, own_less, *_orthonormal(_less(U, own_less, common)))


def _less(U: np.ndarray | sp.csc_array, less: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Remove from r its share along each column."""
    along = U.T @ r
    return r - U @ (less[:, None] * along if along.ndim > 1 else less * along)


def _orthonormal(V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U (n, k) of V Vᵀ = U diag(s) Uᵀ, and 1 - 1/√(1 + s)."""
    s, Q = np.linalg.eigh(V.T @ V)
    kept = s > 1e-9 * max(float(s.max(initial=0.0)), 1e-9)
    return V @ (Q[:, kept] / np.sqrt(s[kept])), 1 - 1 / np.sqrt(1 + s[kept])
