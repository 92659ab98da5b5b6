"""A reduced model at one value of its parameters: modes, and all that acts on them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from ..dynamics.modal_sum import modal_sum
from .frequency_dependent_stiffness import Dissipated
from .gyroscopic import Spin
from .matrix_slopes import MatrixSlopes


@dataclass(frozen=True, eq=False)
class State:
    """The reduced model at one x."""

    lam: np.ndarray  # (m,) ω² [rad²/s²]; m = r plus the degrees of freedom that effects add
    phi: np.ndarray  # (r, m) eigenvectors in the basis
    own: np.ndarray  # (m - r, m) eigenvectors at the degrees of freedom of effects
    # dK, dM: ∂K, ∂M over the basis and dofs of effects; None where not requested
    dK: MatrixSlopes | None
    dM: MatrixSlopes | None
    # weight, dweight: weighed mass [kg] and its gradient (n_p,)
    weight: float
    dweight: np.ndarray
    # offset, doffset: log10 factor of the channels (n_out,), (n_out, n_p), or None
    offset: np.ndarray | None
    doffset: np.ndarray | None
    # drive, ddrive: load of a moving base on each mode (k, r), (n_p, k, r), or None
    drive: np.ndarray | None = None
    ddrive: np.ndarray | None = None
    # moved, dmoved: change of the modes where they are measured, outputs and inputs (p, m), or
    # None, and its derivatives by position of the parameter
    moved: np.ndarray | None = None
    dmoved: Mapping[int, np.ndarray] = field(default_factory=dict)
    dissipated: Dissipated | None = None  # dissipation of effects in the modes, or None
    spin: Spin | None = None  # spinning parts, or None; λ and φ are those at rest

    def between(
        self, s: np.ndarray, d: np.ndarray, left: np.ndarray, right: np.ndarray
    ) -> np.ndarray:
        """Receptances (n_f, n_l, n_r) of places over the modes (., m), d = 1 / (λ + s²) (n_f, m).

        They are those at places left to forces at places right, spinning parts included.
        """
        H = modal_sum(left, d, right)
        return H if self.spin is None else H + self.spin.seen(s, d, left, right)

    @property
    def vectors(self) -> np.ndarray:
        """Eigenvectors at all degrees of freedom, those of effects last (m, m)."""
        return np.concatenate([self.phi, self.own])

    def without_slopes(self) -> Self:
        """The state without ∂K and ∂M, which hold the matrices that they are made of."""
        lost = self.dissipated
        return replace(
            self, dK=None, dM=None, dissipated=None if lost is None else lost.held,
            spin=None if self.spin is None else replace(self.spin, slopes={}),
        )  # fmt: skip

    def of_last(self, k: int) -> Self:
        """The state with its slopes by the last k parameters alone."""
        assert self.dK is not None
        assert self.dM is not None
        first, lost = self.dK.count - k, self.dissipated
        return replace(
            self, dK=self.dK.of_last(k), dM=self.dM.of_last(k), dweight=self.dweight[first:],
            doffset=None if self.doffset is None else self.doffset[:, first:],
            ddrive=None if self.ddrive is None else self.ddrive[first:],
            dmoved={p - first: moved for p, moved in self.dmoved.items() if p >= first},
            dissipated=None if lost is None else lost.of_last(k),
            spin=None if self.spin is None else self.spin.of_last(first),
        )  # fmt: skip
