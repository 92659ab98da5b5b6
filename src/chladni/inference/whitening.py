"""Whitening of residuals whose errors lie along known columns, in the space of the data.

An identified response has few parameters: its samples vary only in the span of the columns of its
poles and of the linear unknowns of its channels. Residuals are projected on that span.
With the covariance I + V Vᵀ and V in the span, the columns of one output are taken out first, then
the columns that all outputs share.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

KNOWN = 1e-6  # of the largest singular value: directions below it are rounding


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
class Span:
    """Orthonormal columns of what an identification can say.

    Attributes
    ----------
    own : (n, k) sparse      columns on one output each
    common : (n, m)          columns of the poles beyond them
    log_det : float          ln of the volume of an orthonormal basis of the span, over the spreads
    """

    own: sp.csc_array
    common: np.ndarray
    log_det: float = 0.0

    def projected(self, r: np.ndarray) -> np.ndarray:
        """Part of residuals or of columns of slopes (n, ...) within the span."""
        return self.columns(self.coordinates(r))

    def coordinates(self, r: np.ndarray) -> np.ndarray:
        """Components of residuals or of columns of slopes along the span (k + m, ...)."""
        return np.concatenate([self.own.T @ r, self.common.T @ r])

    def columns(self, c: np.ndarray) -> np.ndarray:
        """Residuals or columns of slopes (n, ...) with these components."""
        k = self.own.shape[1]
        return np.asarray(self.own @ c[:k] + self.common @ c[k:])

    @property
    def leverage(self) -> np.ndarray:
        """Share of each sample within the span (n,); the sum is its dimension."""
        return np.asarray(self.own.power(2).sum(axis=1)) + (self.common**2).sum(axis=1)


@dataclass(frozen=True, eq=False)
class Whitening:
    """C^-½ of C = I + V Vᵀ on a span, or on all samples without one.

    Attributes
    ----------
    own : (n, k) sparse, orthonormal    columns that live on one output each
    own_less : (k,)                     1 - 1/√(1 + s)
    common : (n, m) orthonormal
    common_less : (m,)
    span : Span or None
    """

    own: sp.csc_array
    own_less: np.ndarray
    common: np.ndarray
    common_less: np.ndarray
    span: Span | None = None

    @property
    def log_det(self) -> float:
        """Ln det C of data in units that do not depend on the spread of each sample."""
        less = np.concatenate([self.own_less, self.common_less])
        volume = 0.0 if self.span is None else self.span.log_det
        return float(-2 * np.log1p(-less).sum() - 2 * volume)

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """Residuals or columns of slopes (n, ...)."""
        if self.span is not None:
            r = self.span.projected(r)
        return _less(self.common, self.common_less, _less(self.own, self.own_less, r))

    def transposed(self, z: np.ndarray) -> np.ndarray:
        """Apply the transpose of the whitening, so that C⁻¹ r is that of C^-½ r (n, ...)."""
        z = _less(self.own, self.own_less, _less(self.common, self.common_less, z))
        return z if self.span is None else self.span.projected(z)


def by_input(own: np.ndarray) -> np.ndarray:
    """Columns (k, ..., n_in) of every channel as columns (n_in k, ..., n_in) of every input."""
    return np.concatenate([own * each for each in np.eye(own.shape[-1])])


def spanned(data: Stacks, own: np.ndarray, common: np.ndarray, sd: np.ndarray) -> Span:
    """Span of complex columns over the spread of each sample.

    Parameters
    ----------
    own : (k, n_f, n_out, n_in)      of one output each
    common : (m, n_f, n_out, n_in)   of all outputs
    sd : (n_f, n_out, n_in)
    """
    spread = np.tile(sd[data.use].ravel(), 2)
    basis, within, log_det = [], [], 0.0
    for at, V in _by_output(data, own):
        basis.append((at, _basis(V)))
        Q, size = _orthogonal(basis[-1][1] / spread[at, None])
        within.append((at, Q))
        log_det += size
    of_outputs, scaled = _sparse(basis, data), _sparse(within, data)
    rest = _basis(_beyond(of_outputs, data.stacked(common))) / spread[:, None]
    Q, size = _orthogonal(rest - scaled @ (scaled.T @ rest))
    return Span(scaled, Q, log_det + size)


def whitening(
    data: Stacks, own: np.ndarray, common: np.ndarray, span: Span | None = None
) -> Whitening:
    """Whitening of errors along complex columns over the spread of each sample.

    Parameters
    ----------
    own : (k, n_f, n_out, n_in)      errors of one output each
    common : (m, n_f, n_out, n_in)   errors that all outputs share
    """
    columns, less = [], []
    for at, V in _by_output(data, own):
        if span is not None:
            V = (span.own @ (span.own.T @ _on_rows(at, V, data)))[at]
        U, share = _orthonormal(V)
        columns.append((at, U))
        less.append(share)
    U, own_less = _sparse(columns, data), np.concatenate([np.zeros(0), *less])
    shared = data.stacked(common)
    shared = shared if span is None else span.projected(shared)
    return Whitening(U, own_less, *_orthonormal(_less(U, own_less, shared)), span)


def _by_output(data: Stacks, own: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows of each output in use, and the columns of its errors on them."""
    outputs = np.broadcast_to(np.arange(data.use.shape[1]), data.use.shape)[data.use]
    output = np.tile(np.repeat(outputs, data.values.shape[2]), 2)
    V = data.stacked(own)
    return [(at, V[at]) for k in np.unique(output) if len(at := np.flatnonzero(output == k))]


def _on_rows(at: np.ndarray, V: np.ndarray, data: Stacks) -> np.ndarray:
    """A block on some rows of all (n, k)."""
    out = np.zeros((2 * int(data.use.sum()) * data.values.shape[2], V.shape[1]))
    out[at] = V
    return out


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


def _beyond(U: sp.csc_array, V: np.ndarray) -> np.ndarray:
    """Columns of V less their share along orthonormal U; those with only rounding left are out."""
    left = V - U @ (U.T @ V)
    length, before = (np.sqrt((A**2).sum(axis=0)) for A in (left, V))
    return np.asarray(left[:, length > KNOWN * before])


def _basis(V: np.ndarray) -> np.ndarray:
    """Orthonormal basis of columns of any length."""
    length = np.sqrt((V**2).sum(axis=0))
    U, s, _ = np.linalg.svd(V / np.maximum(length, 1e-300), full_matrices=False)
    return U[:, s > KNOWN * s.max(initial=0.0)]


def _orthogonal(V: np.ndarray) -> tuple[np.ndarray, float]:
    """Orthonormal basis of independent columns, and ln of the volume that they span."""
    Q, R = np.linalg.qr(V)
    return Q, float(np.log(np.abs(np.diag(R))).sum())


def _orthonormal(V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U (n, k) of V Vᵀ = U diag(s) Uᵀ, and 1 - 1/√(1 + s)."""
    s, Q = np.linalg.eigh(V.T @ V)
    kept = s > 1e-9 * max(float(s.max(initial=0.0)), 1e-9)
    return V @ (Q[:, kept] / np.sqrt(s[kept])), 1 - 1 / np.sqrt(1 + s[kept])
