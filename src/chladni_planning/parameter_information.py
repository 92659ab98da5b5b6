"""Information of a test on parameters: a linearised calibration with held-out data."""

from dataclasses import dataclass

import numpy as np

from chladni.errors import ShapeError

from .layouts.information import positions_of


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residuals r(θ) = r_0 + J θ over the noise, θ in prior standard deviations, nominal 0.

    Attributes
    ----------
    residual, jacobian : (m,), (m, p)             of the fitted data
    held_residual, held_jacobian : (h,), (h, p)   of held-out data
    """

    residual: np.ndarray
    jacobian: np.ndarray
    held_residual: np.ndarray
    held_jacobian: np.ndarray

    def __post_init__(self) -> None:
        for r, J in (
            (self.residual, self.jacobian),
            (self.held_residual, self.held_jacobian),
        ):
            if J.shape != (len(r), self.jacobian.shape[1]):
                raise ShapeError(f"a Jacobian is {J.shape} for {len(r)} residuals")

    def __len__(self) -> int:
        return self.jacobian.shape[1]

    def fitted(self, freed: np.ndarray) -> np.ndarray:
        """Minimiser θ (p,) of |r_0 + J θ|² + |θ|² over the freed parameters, others 0."""
        free = positions_of(freed, len(self))
        theta, J = np.zeros(len(self)), self.jacobian[:, free]
        theta[free] = -np.linalg.solve(J.T @ J + np.eye(len(free)), J.T @ self.residual)
        return theta

    def posterior(self, freed: np.ndarray) -> np.ndarray:
        """Posterior over prior standard deviation √diag(JᵀJ + I)⁻¹ of the freed parameters."""
        J = self.jacobian[:, positions_of(freed, len(self))]
        return np.sqrt(np.diag(np.linalg.inv(J.T @ J + np.eye(J.shape[1]))))

    def held_out(self, theta: np.ndarray) -> float:
        """Mean square Q of the held-out residuals."""
        return float(np.mean((self.held_residual + self.held_jacobian @ theta) ** 2))

    def improvement(self, freed: np.ndarray) -> float:
        """log10 Q_nominal / Q_fitted of the held-out data [decades]; negative where over-fitted."""
        before, after = self.held_out(np.zeros(len(self))), self.held_out(self.fitted(freed))
        return float(np.log10(before / after))

    def unlearned(self, freed: np.ndarray) -> float:
        """Σ s_k²: effective number of freed parameters the data leave unknown, in [0, n_freed]."""
        return float((self.posterior(freed) ** 2).sum())
