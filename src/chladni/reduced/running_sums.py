"""Running sums of the reduced K and M and their slopes, to which every term of a state adds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..effects.effect import PointTerm
from .effect_dofs import with_own
from .field_factors import Fields, TermShare, mass_log, stiffness_log
from .matrix_slopes import MatrixSlopes
from .matrix_stack import MatrixStack
from .real_modes import flexible, real_modes

MOST_GEOMETRIC = 0.99  # of the stiffness of any motion that membrane forces may take


@dataclass(eq=False)
class RunningSums:
    """K, M (m, m) and ∂K/∂x, ∂M/∂x.

    ``forces`` are geometric terms, which wait for all of K.
    """

    K: np.ndarray
    M: np.ndarray
    dK: MatrixSlopes
    dM: MatrixSlopes
    forces: list[tuple[TermShare, np.ndarray]] = field(default_factory=list)

    @classmethod
    def of_fields(
        cls, K: np.ndarray, M: np.ndarray, stiffness: Sequence[Mapping[str, MatrixStack]],
        mass: MatrixStack, logs: Fields, slopes: Fields, n_own: int,
    ) -> Self:  # fmt: skip
        """Start with K, M of these fields, and their slopes of all groups of shells and beams.

        The first stacks of stiffness grow with t and the second with t³; effects add ``n_own``
        degrees of freedom.
        """
        dK, dM = (MatrixSlopes(slopes["t"].shape[1]) for _ in "KM")
        for stacks, power in zip(stiffness, (1, 3), strict=True):
            for name, stack in stacks.items():
                w = np.exp(stiffness_log(logs, name, power))
                dK.add_groups(stack, w[:, None] * stiffness_log(slopes, name, power))
        dM.add_groups(mass, np.exp(mass_log(logs))[:, None] * mass_log(slopes))
        return cls(with_own(K, n_own), with_own(M, n_own), dK, dM)

    def add(self, share: TermShare, A: np.ndarray) -> None:
        """Add c A to its matrix, and ∂c/∂x A to its slopes."""
        if share.term.geometric:
            self.forces.append((share, A))
            return
        target, slope = (self.K, self.dK) if share.term.matrix == "K" else (self.M, self.dM)
        target += share.term.coefficient * A
        slope.add_operator(A, share.gradient)

    def add_points(
        self, term: PointTerm, b: np.ndarray, moved: Mapping[int, np.ndarray], at: slice
    ) -> None:
        """Add Σ c bᵀb of rows b (k, m); ``moved`` is ∂b/∂x of parameters that move them."""
        target, slope = (self.K, self.dK) if term.matrix == "K" else (self.M, self.dM)
        target += (b.T * term.coefficient) @ b
        slope.add_points(b, term.gradient, at, moved, term.coefficient)

    def limit_geometric(self) -> None:
        """Add the membrane forces D, or s D where K + D would buckle: K + s D keeps 1 %.

        With the first buckling mode y, yᵀKy = 1 and yᵀDy = -u: s = 0.99/u, ∂u = -u yᵀ∂Ky - yᵀ∂Dy.
        """
        if not self.forces:
            return
        D, dD, s = np.zeros_like(self.K), MatrixSlopes(self.dK.count), 1.0
        for share, A in self.forces:
            D += share.term.coefficient * A
            dD.add_operator(A, share.gradient)
        lam, phi = real_modes(self.K, self.M)
        some = flexible(lam)
        V = phi[:, some] / np.sqrt(lam[some])
        w, y = np.linalg.eigh(V.T @ D @ V)
        if w[0] < -MOST_GEOMETRIC:
            u, y = -w[0], V @ y[:, :1]
            s = MOST_GEOMETRIC / u
            du = -u * self.dK.along(y)[:, 0] - dD.along(y)[:, 0]
            self.dK.add_operator(D, -s / u * du)
        self.K += s * D
        self.dK.add_scaled(dD, s)
