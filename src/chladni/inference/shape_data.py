"""Measured mode shapes as data: each against its partner, up to a factor.

An error of the model's form mixes modes, and gives ln f a spread s. To first order
(Soize 2000, :mod:`.discrepancy`) the coefficient of mode j in mode i has the variance
s² (λ_i λ_j + λ_i²) / (λ_i - λ_j)². The measured shape has the covariance

C = D + Σ_j s² (λ_i λ_j + λ_i²) / (λ_i - λ_j)² φ_j φ_jᵀ / |φ_i|²,

D of the sensors. Close modes mix freely: among these only the subspace is compared. The factor of
the shape has no prior, so neither scale nor sign counts.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from ..reduced.reduced_model import State

APART = 1e-12  # of λ_i²: least (λ_i - λ_j)²
UNIT = 1e-300  # least norm of a shape


@dataclass(frozen=True, eq=False)
class ShapeData:
    """Measured shapes at the sensors."""

    values: np.ndarray  # (n, n_out) real, of unit norm
    variance: np.ndarray  # (n, n_out) of each entry, without errors of the model's form: D

    def mac(self, phi: np.ndarray) -> np.ndarray:
        """MAC of each shape with a column of φ (n_out, n) at its place (n,)."""
        power = np.maximum((phi**2).sum(axis=0), UNIT)
        return np.asarray((self.values * phi.T).sum(axis=1) ** 2 / power)

    def spurious(self) -> np.ndarray:
        """-2 ln density of a shape of no mode over that of a pair, without its misfit (n,).

        A shape of no mode has any direction.
        """
        n = self.values.shape[1]
        noise = (1 - 1 / n) * np.log(self.variance).sum(axis=1)
        return (n - 1) * (1 - np.log(n)) - noise

    def costs(
        self, phi: np.ndarray, lam: np.ndarray, scale: float, test: np.ndarray, model: np.ndarray
    ) -> np.ndarray:
        """-2 ln density of the shapes of some pairs, their factors integrated out (k,).

        Parameters
        ----------
        phi, lam : (n_out, m), (m,)   modes that may mix, at the sensors, and their λ
        test, model : (k,)            positions of the pairs
        """
        weighted, norm = self.values / self.variance, np.linalg.norm(phi, axis=0)
        gram = np.einsum("oi,to,oj->tij", phi, 1 / self.variance, phi, optimize=True)
        p = (norm**2 / scale**2)[:, None] / np.maximum(mixing(lam), UNIT)
        np.fill_diagonal(p, 0.0)  # the factor is free
        L = np.linalg.cholesky(gram[test] + p[model][:, :, None] * np.eye(len(lam)))
        z = np.linalg.solve(L, (weighted @ phi)[test][:, :, None])[:, :, 0]
        np.fill_diagonal(p, 1.0)
        wide = 2 * np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
        wide -= np.log(p).sum(axis=1)[model] + np.log(gram[test, model, model])
        left = (weighted * self.values).sum(axis=1)[test] - (z**2).sum(axis=1)
        return np.asarray(left + wide)

    def scaled(
        self, phi: np.ndarray, lam: np.ndarray, scale: float, test: np.ndarray, model: np.ndarray,
        slopes: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, float]:  # fmt: skip
        """Whitened misfit of some pairs (k, n_out), its slopes (n_p, k, n_out), ln det C/D.

        The sum of squares and the last value is that of :meth:`costs`. ``slopes`` (n_p, n_out, k)
        are ∂φ of the partners at the sensors. The covariance counts as constant in the slopes: what
        its change does has mean zero.
        """
        shape = len(test), self.values.shape[1]
        out, J, wide, c = np.zeros(shape), np.zeros((len(slopes), *shape)), 0.0, mixing(lam)
        for k, (t, i) in enumerate(zip(test, model, strict=True)):
            size, D = max(float(np.linalg.norm(phi[:, i])), UNIT), self.variance[t]
            B = phi * (scale * np.sqrt(c[i]) / size)
            L = np.linalg.cholesky(np.diag(D) + B @ B.T)
            columns = np.column_stack([self.values[t], phi[:, i] / size, slopes[:, :, k].T / size])
            white = sl.solve_triangular(L, columns, lower=True)
            z, y, dy = white[:, 0], white[:, 1], white[:, 2:]
            yy = max(float(y @ y), UNIT)
            q = float(y @ z) / yy
            out[k] = r = z - q * y
            J[:, k] = (-q * dy - np.outer(y, (r @ dy - q * (y @ dy)) / yy)).T
            alone = max(float((phi[:, i] ** 2 / D).sum()) / size**2, UNIT)
            wide += float(2 * np.log(np.diag(L)).sum() - np.log(D).sum() + np.log(yy / alone))
        return out, J, wide


def mixing(lam: np.ndarray) -> np.ndarray:
    """(λ_i λ_j + λ_i²) / (λ_i - λ_j)² (m, m), zero on the diagonal: how mode j comes into mode i.

    >>> mixing(np.array([1.0, 4.0])).round(3)
    array([[0.   , 0.556],
           [2.222, 0.   ]])
    """
    lam = np.maximum(lam, 0.0)
    own, gap = lam[:, None], lam[:, None] - lam
    c = own * (lam + own) / np.maximum(gap**2, APART * np.maximum(own**2, UNIT))
    np.fill_diagonal(c, 0.0)
    return np.asarray(c)


def shape_slopes(state: State, at: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """∂φ/∂x of some modes where they are measured, but for their norm (n_p, n_out, k).

    ∂φ_i = Σ_j φ_j φ_jᵀ(∂K - λ_i ∂M)φ_i / (λ_i - λ_j), exact in the basis (Fox and Kapoor 1968,
    AIAA J. 6, 2426-2429). All modes of the state are ``at`` (n_out, m) there.
    """
    assert state.dK is not None
    assert state.dM is not None
    v, own = state.vectors, state.lam[modes]
    moved = state.dK.times(v[:, modes]) - own * state.dM.times(v[:, modes])
    gap, least = own - state.lam[:, None], np.sqrt(APART) * np.maximum(own, UNIT)
    gap = np.where(np.abs(gap) < least, np.copysign(least, gap), gap)
    gap[modes, np.arange(len(modes))] = np.inf
    out = at @ ((v.T @ moved) / gap)
    for p, changed in state.dmoved.items():
        out[p] += changed[: len(at), modes]
    return np.asarray(out)
