"""The base as an input of the reduced model: its load follows every change of mass.

A unit acceleration of the base loads the relative motion by -l(x), l = Φᵀ Tᵀ M(x) R b; groups of
shells, added masses and operators each bring their share, with their slopes.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..dynamics.reduction import Basis
from ..effects.effect import MatrixTerm, PointTerm
from ..effects.element_groups import ElementGroups
from ..fem.assemble import Structure
from ..fem.base_motion import BaseMotion


@dataclass(frozen=True, eq=False)
class BaseParticipation:
    """l of the nominal model, by groups of shells.

    Attributes
    ----------
    motion : BaseMotion
    groups : (g, r, k)    Φᵀ Tᵀ M_g R b [√kg]
    rest : (r, k)         of all that is in no group
    """

    motion: BaseMotion
    groups: np.ndarray
    rest: np.ndarray

    def over(self, built: Structure) -> Self:
        """The same of a structure with more dofs, which no vector of the basis moves yet."""
        return replace(self, motion=self.motion.over(built))

    def extended(self, shells: ElementGroups, new: np.ndarray) -> Self:
        """The same over a basis that also holds these vectors (n, m)."""
        more = participation(shells, Basis((new,)), self.motion)
        groups = np.concatenate([self.groups, more.groups], axis=1)
        return replace(self, groups=groups, rest=np.concatenate([self.rest, more.rest]))


def participation(shells: ElementGroups, basis: Basis, motion: BaseMotion) -> BaseParticipation:
    """What the base does to each vector of a basis (n, r)."""
    groups = shells.carried(basis, motion.whole)
    return BaseParticipation(motion, groups, basis.projected(motion.force) - groups.sum(axis=0))


class Participating:
    """l(x) and ∂l/∂x (n_p, r, k) while the effects of a state are gone through."""

    def __init__(
        self, base: BaseParticipation, weight: np.ndarray, slopes: np.ndarray, n_own: int
    ) -> None:
        """Of the shells: factors on the mass of each group (g,) and their gradients (g, n_p).

        ``n_own`` degrees of freedom that effects bring stand below those of the basis.
        """
        self.motion, self.n_own = base.motion, n_own
        value = base.rest + np.einsum("g,grk->rk", weight, base.groups)
        self.value = np.pad(value, ((0, n_own), (0, 0)))
        slope = np.einsum("gp,grk->prk", slopes, base.groups, optimize=True)
        self.slope = np.pad(slope, ((0, 0), (0, n_own), (0, 0)))

    def add_points(
        self, term: PointTerm, b: np.ndarray, moved: dict[int, np.ndarray], at: slice
    ) -> None:
        """Masses c at rows b (k, r) of the basis, ``moved`` = ∂b/∂x of what moves them."""
        if term.matrix != "M":
            return
        along = self.motion.carried(term.rows if term.carrier is None else term.carrier)
        self.value = self.value + (b.T * term.coefficient) @ along
        self.slope[at] += np.einsum("ki,kp,kj->pij", b, term.gradient, along, optimize=True)
        for p, db in moved.items():
            d_along = self.motion.carried(term.moving[p])
            c = term.coefficient
            self.slope[at.start + p] += (db.T * c) @ along + (b.T * c) @ d_along

    def add_operator(self, part: MatrixTerm, basis: Basis, at: slice) -> None:
        """A part of the mass that scales as a whole."""
        if part.matrix != "M":
            return
        load = basis.projected(self.motion.carried(part.operator))
        l = np.pad(load, ((0, self.n_own), (0, 0)))
        self.value = self.value + part.coefficient * l
        self.slope[at] += part.gradient[:, None, None] * l

    def loads(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """-lᵀφ on modes (r, r) and its gradient: (k, r), (n_p, k, r)."""
        return -self.value.T @ phi, -self.slope.swapaxes(-1, -2) @ phi
