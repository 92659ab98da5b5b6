"""Running sums of the reduced K and M and their slopes, to which every term of a state adds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..effects.effect import PointTerm
from .effect_dofs import with_own
from .field_factors import Fields, TermShare, mass_log, stiffness_log
from .matrix_stack import MatrixStack, add_slopes, along
from .real_modes import flexible, real_modes

MOST_GEOMETRIC = 0.99  # of the stiffness of any motion that membrane forces may take


@dataclass(eq=False)
class RunningSums:
    """K, M (m, m) and ∂K/∂x, ∂M/∂x (n_p, m, m); without slopes n_p is 0.

    ``forces`` are geometric terms, which wait for all of K.
    """

    K: np.ndarray
    M: np.ndarray
    dK: np.ndarray
    dM: np.ndarray
    forces: list[tuple[TermShare, np.ndarray]] = field(default_factory=list)

    @classmethod
    def of_fields(
        cls, K0: np.ndarray, M0: np.ndarray, stiffness: Sequence[Mapping[str, MatrixStack]],
        mass: MatrixStack, logs: Fields, slopes: Fields, n_p: int, n_own: int,
    ) -> Self:  # fmt: skip
        """Start with K_0, M_0 and all groups of shells and beams.

        Parameters
        ----------
        stiffness : stacks that grow with t, and with t³
        n_p : number of parameters, 0 without slopes
        n_own : degrees of freedom that effects add
        """
        empty = np.zeros((n_p, *K0.shape))
        out = cls(K0.copy(), M0.copy(), empty, empty.copy())
        for stacks, power in zip(stiffness, (1, 3), strict=True):
            for name, stack in stacks.items():
                log, slope = (stiffness_log(each, name, power) for each in (logs, slopes))
                _add_groups(stack, log, slope, out.K, out.dK)
        _add_groups(mass, mass_log(logs), mass_log(slopes), out.M, out.dM)
        K, M, dK, dM = (with_own(A, n_own) for A in (out.K, out.M, out.dK, out.dM))
        return cls(K, M, dK, dM)

    def add(self, share: TermShare, A: np.ndarray) -> None:
        """Add c A to its matrix, and ∂c/∂x A to its slopes."""
        if share.term.geometric:
            self.forces.append((share, A))
        elif share.term.matrix == "K":
            _add_operator(share, A, self.K, self.dK)
        else:
            _add_operator(share, A, self.M, self.dM)

    def add_points(
        self, term: PointTerm, b: np.ndarray, moved: Mapping[int, np.ndarray], at: slice
    ) -> None:
        """Add Σ c bᵀb of rows b (k, m); ``moved`` is ∂b/∂x of parameters that move them."""
        target, slope = (self.K, self.dK) if term.matrix == "K" else (self.M, self.dM)
        target += (b.T * term.coefficient) @ b
        if not len(slope):
            return
        slope[at] += np.einsum("ki,kp,kj->pij", b, term.gradient, b, optimize=True)
        for p, db in moved.items():
            half = (b.T * term.coefficient) @ db
            slope[at.start + p] += half + half.T

    def limit_geometric(self) -> None:
        """Add the membrane forces D, or s D where K + D would buckle: K + s D keeps 1 %.

        With the first buckling mode y, yᵀKy = 1 and yᵀDy = -u: s = 0.99/u, ∂u = -u yᵀ∂Ky - yᵀ∂Dy.
        """
        if not self.forces:
            return
        D, dD = np.zeros_like(self.K), np.zeros_like(self.dK)
        for share, A in self.forces:
            _add_operator(share, A, D, dD)
        lam, phi = real_modes(self.K, self.M)
        some = flexible(lam)
        V = phi[:, some] / np.sqrt(lam[some])
        w, y = np.linalg.eigh(V.T @ D @ V)
        if w[0] < -MOST_GEOMETRIC:
            u, y = -w[0], V @ y[:, :1]
            s = MOST_GEOMETRIC / u
            du = -u * along(self.dK, y)[:, 0] - along(dD, y)[:, 0]
            dD = s * dD - (s / u * du)[:, None, None] * D
            D = s * D
        self.K += D
        self.dK += dD


def _add_groups(
    stack: MatrixStack, log: np.ndarray, slope: np.ndarray, A: np.ndarray, dA: np.ndarray
) -> None:
    """Add Σ_g e^{log_g} A_g to A, and its slopes to dA where these are taken."""
    if not len(log):
        return
    w = np.exp(log)
    stack.add_to([A], w[None])
    if len(dA):
        add_slopes(stack, w[:, None] * slope, dA)


def _add_operator(share: TermShare, A: np.ndarray, target: np.ndarray, slope: np.ndarray) -> None:
    target += share.term.coefficient * A
    for k in np.flatnonzero(share.gradient) if len(slope) else ():
        slope[k] += share.gradient[k] * A
