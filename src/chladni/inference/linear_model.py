"""A model linearised at a state: sums of squares under errors of form of any size.

The covariance is C = I + δ² U diag(s) Uᵀ. Products with its inverse need no whitened slopes:

aᵀ C⁻¹ b = aᵀb - (Uᵀa)ᵀ diag(w) (Uᵀb),   w = δ² s / (1 + δ² s).
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from .discrepancy import Discrepancy


@dataclass(frozen=True, eq=False)
class Squares:
    """Sum of squares of residuals r with slopes J."""

    cost: float  # |r|²
    gradient: np.ndarray  # (n_p,) Jᵀr
    information: np.ndarray  # (n_p, n_p) JᵀJ

    @property
    def further(self) -> float:
        """Improvement of the cost by the best step, if residuals are linear."""
        return float(self.gradient @ np.linalg.solve(self.information, self.gradient))

    def profiled(self, n: int) -> Self:
        """Squares with the best first n parameters for any of the others."""
        A, g = self.information, self.gradient
        taken = np.linalg.solve(A[:n, :n], np.column_stack([g[:n], A[:n, n:]]))
        return replace(
            self, cost=self.cost - float(g[:n] @ taken[:, 0]),
            gradient=g[n:] - A[n:, :n] @ taken[:, 0],
            information=A[n:, n:] - A[n:, :n] @ taken[:, 1:],
        )  # fmt: skip

    def of_some(self, chosen: np.ndarray) -> Self:
        """Squares with the slopes by some parameters alone."""
        return replace(
            self, gradient=self.gradient[chosen], information=self.information[chosen][:, chosen]
        )


def cost(error: Discrepancy | None, r: np.ndarray, r0: np.ndarray) -> float:
    """|r|² of the data under an error of form, with |r0|² of the rest."""
    plain = float(r @ r + r0 @ r0)
    return plain if error is None else plain - float(error.share() @ (error.U.T @ r) ** 2)


@dataclass(frozen=True, eq=False)
class Learned:
    """Evidence over all δ, and which δ the data prefer."""

    neg2_log_evidence: float  # -2 ln evidence, δ integrated out
    delta: float  # its most probable value


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Slopes of residuals, with the products that all residuals of one state share."""

    error: Discrepancy | None  # of the data's residuals
    J: np.ndarray  # (n, n_p) slopes of the data's residuals, not whitened by C
    J0: np.ndarray  # (m, n_p) those of the priors and the weighing
    # with the first columns of J; its products are reused
    within: "LinearModel | None" = field(default=None, kw_only=True)

    @cached_property
    def _along(self) -> np.ndarray:
        """UᵀJ (k, n_p)."""
        if self.error is None:
            return np.zeros((0, self.J.shape[1]))
        if (inner := self.within) is None:
            return np.asarray(self.error.U.T @ self.J)
        return np.hstack([inner._along, self.error.U.T @ self.J[:, inner.J.shape[1] :]])

    @cached_property
    def _products(self) -> np.ndarray:
        """JᵀJ (n_p, n_p)."""
        if (inner := self.within) is None:
            return np.asarray(self.J.T @ self.J)
        old = inner.J.shape[1]
        border = self.J.T @ self.J[:, old:]
        return np.block([[inner._products, border[:old]], [border.T]])

    @cached_property
    def _information(self) -> np.ndarray:
        """JᵀJ + J0ᵀJ0 (n_p, n_p)."""
        return np.asarray(self._products + self.J0.T @ self.J0)

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

    def neg2_log_evidence(self, r: np.ndarray, r0: np.ndarray) -> float:
        """-2 ln evidence of the linear model, over all sizes of its error if it has one."""
        if self.error is not None:
            return self.learned(r, r0).neg2_log_evidence
        found = self.squares(r, r0)
        return found.cost - found.further + float(np.linalg.slogdet(found.information)[1])

    @cached_property
    def _over_sizes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At every δ of the grid: w (d, k), L⁻¹ of the information L Lᵀ, terms without r."""
        assert self.error is not None
        grid, V = self.error.prior.grid, self._along
        w = np.array([self.error.share(delta) for delta in grid])
        L = np.linalg.cholesky(self._information - np.array([(V.T * each) @ V for each in w]))
        terms = 2 * np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
        terms += self.error.prior.neg2_log(grid) - np.log1p(-w).sum(axis=1)
        return w, np.linalg.inv(L), terms

    def learned(self, r: np.ndarray, r0: np.ndarray) -> Learned:
        """Integrate δ out of the evidence."""
        assert self.error is not None
        plain, u, grid = self._plain(r, r0), self.error.U.T @ r, self.error.prior.grid
        w, inverse, terms = self._over_sizes
        gradient = plain.gradient - (w * u) @ self._along
        step = (inverse @ gradient[:, :, None])[:, :, 0]
        S = plain.cost - w @ u**2 - (step**2).sum(axis=1) + terms
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
