"""A model linearised at a state: sums of squares under errors of form of any size.

The covariance is C = I + δ² U diag(s) Uᵀ. Products with its inverse need no whitened slopes:

aᵀ C⁻¹ b = aᵀb - (Uᵀa)ᵀ diag(w) (Uᵀb),   w = δ² s / (1 + δ² s).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import scipy.linalg as sl

from .discrepancy import Discrepancy


@dataclass(frozen=True, eq=False)
class Squares:
    """Sum of squares of residuals r with slopes J.

    Attributes
    ----------
    cost : float                   |r|²
    gradient : (n_p,)              Jᵀr
    information : (n_p, n_p)       JᵀJ
    """

    cost: float
    gradient: np.ndarray
    information: np.ndarray

    @classmethod
    def of(cls, r: np.ndarray, J: np.ndarray) -> Self:
        """Squares of residuals (n,) and slopes (n, n_p); J without columns where none are known."""
        gradient = J.T @ r if J.shape[1] else np.zeros(0)
        return cls(float(r @ r), gradient, J.T @ J)

    @property
    def further(self) -> float:
        """Improvement of the cost by the best step, if residuals are linear."""
        return float(self.gradient @ np.linalg.solve(self.information, self.gradient))

    def of_some(self, chosen: np.ndarray) -> Self:
        """Squares with the slopes by some parameters alone."""
        return replace(
            self, gradient=self.gradient[chosen], information=self.information[chosen][:, chosen]
        )


@dataclass(frozen=True, eq=False)
class Learned:
    """Evidence over all δ, and which δ the data prefer.

    Attributes
    ----------
    neg2_log_evidence : float  -2 ln evidence, δ integrated out
    delta : float            its most probable value
    """

    neg2_log_evidence: float
    delta: float


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Slopes of residuals, with the products that all residuals of one state share.

    Attributes
    ----------
    error : Discrepancy or None     of the data's residuals
    J : (n, n_p)                    slopes of the data's residuals, not whitened by C
    J0 : (m, n_p)                   those of the priors and the weighing
    """

    error: Discrepancy | None
    J: np.ndarray
    J0: np.ndarray

    @cached_property
    def _along(self) -> np.ndarray:
        """UᵀJ (k, n_p)."""
        return np.zeros((0, self.J.shape[1])) if self.error is None else self.error.U.T @ self.J

    @cached_property
    def _information(self) -> np.ndarray:
        """JᵀJ + J0ᵀJ0 (n_p, n_p)."""
        return np.asarray(self.J.T @ self.J + self.J0.T @ self.J0)

    def _plain(self, r: np.ndarray, r0: np.ndarray) -> Squares:
        """Squares without an error of form."""
        gradient = self.J.T @ r + self.J0.T @ r0
        return Squares(float(r @ r + r0 @ r0), gradient, self._information)

    def _less(self, plain: Squares, u: np.ndarray, w: np.ndarray) -> Squares:
        """Squares less the shares w (k,) along the columns of U; u = Uᵀr (k,)."""
        V = self._along
        return Squares(
            plain.cost - float(w @ u**2),
            plain.gradient - V.T @ (w * u),
            plain.information - (V.T * w) @ V,
        )

    def squares(self, r: np.ndarray, r0: np.ndarray, delta: float | None = None) -> Squares:
        """Squares of the data's residuals (n,) under C⁻¹, and of the rest (m,).

        ``delta`` is that of the error where it is not given.
        """
        plain = self._plain(r, r0)
        if self.error is None:
            return plain
        return self._less(plain, self.error.U.T @ r, self.error.share(delta))

    def learned(self, r: np.ndarray, r0: np.ndarray) -> Learned:
        """Integrate δ out of the evidence."""
        assert self.error is not None
        plain, u, prior = self._plain(r, r0), self.error.U.T @ r, self.error.prior
        grid = prior.grid
        S = np.empty(len(grid))
        for k, delta in enumerate(grid):
            w = self.error.share(delta)
            under = self._less(plain, u, w)
            L = np.linalg.cholesky(under.information)
            step = sl.solve_triangular(L, under.gradient, lower=True)
            cost = under.cost - float(step @ step)
            S[k] = cost + 2 * np.log(np.diag(L)).sum() - np.log1p(-w).sum() + prior.neg2_log(delta)
        width = np.log(grid[1] / grid[0])
        best = int(np.argmin(S))
        total = S[best] - 2 * np.log(np.exp(-(S - S[best]) / 2).sum() * width)
        return Learned(float(total), _peak(grid, S, best))

    def refitted(self, r: np.ndarray, r0: np.ndarray, delta: float) -> np.ndarray:
        """Residual (n,) whitened by C, after the parameters are fitted to r and r0."""
        assert self.error is not None
        found = self.squares(r, r0, delta)
        left = r - self.J @ np.linalg.solve(found.information, found.gradient)
        return self.error.with_delta(delta).whitened(left)


def _peak(grid: np.ndarray, S: np.ndarray, best: int) -> float:
    """Where the parabola through the best three values has its foot."""
    if not 0 < best < len(S) - 1:
        return float(grid[best])
    a, b, c = S[best - 1 : best + 2]
    shift = 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
    return float(grid[best] * (grid[1] / grid[0]) ** np.clip(shift, -1, 1))
