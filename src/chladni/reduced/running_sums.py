"""Running sums to which every term of a state adds: reduced K and M, the load of a moving base.

A unit acceleration of the base loads the relative motion by -l(x), l = Φᵀ Tᵀ M(x) R b.  Groups of
shells, added masses and operators each contribute a share of l and of its slopes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from ..dynamics.reduction import Basis
from ..effects.effect import MatrixTerm, PointTerm
from ..effects.element_groups import ElementGroups
from ..fem.assemble import Structure
from ..fem.base_motion import BaseMotion
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


@dataclass(frozen=True, eq=False)
class BaseParticipation:
    """Participation l of the nominal model, by groups of shells."""

    motion: BaseMotion
    groups: np.ndarray  # (g, r, k) Φᵀ Tᵀ M_g R b [√kg]
    rest: np.ndarray  # (r, k) share of the mass that is in no group

    def extended_to(self, built: Structure) -> Self:
        """The participation on a structure with further dofs, which the basis does not move yet."""
        return replace(self, motion=self.motion.extended_to(built))

    def extended(self, shells: ElementGroups, new: np.ndarray) -> Self:
        """The participation over a basis that also holds these vectors (n, m)."""
        more = participation(shells, Basis((new,)), self.motion)
        groups = np.concatenate([self.groups, more.groups], axis=1)
        return replace(self, groups=groups, rest=np.concatenate([self.rest, more.rest]))


def participation(shells: ElementGroups, basis: Basis, motion: BaseMotion) -> BaseParticipation:
    """Participation of each vector of a basis (n, r) in the motion of the base."""
    groups = shells.inertia_of_motion(basis, motion.whole)
    return BaseParticipation(motion, groups, basis.projected(motion.force) - groups.sum(axis=0))


class Participating:
    """Running sums l(x) (r, k) and ∂l/∂x (n_p, r, k) over the effects of a state."""

    def __init__(self, base: BaseParticipation, logs: Fields, slopes: Fields, n_own: int) -> None:
        """Start with the shells and their log fields.

        ``n_own`` degrees of freedom that effects add follow the coordinates of the basis.
        """
        self.motion, self.n_own = base.motion, n_own
        w = np.exp(mass_log(logs))
        value = base.rest + np.einsum("g,grk->rk", w, base.groups)
        self.value = np.pad(value, ((0, n_own), (0, 0)))
        slope = w[:, None] * mass_log(slopes)
        slope = np.einsum("gp,grk->prk", slope, base.groups, optimize=True)
        self.slope = np.pad(slope, ((0, 0), (0, n_own), (0, 0)))

    def add_points(
        self, term: PointTerm, b: np.ndarray, moved: dict[int, np.ndarray], at: slice
    ) -> None:
        """Add masses c at rows b (k, r); ``moved`` is ∂b/∂x of parameters that move them."""
        if term.matrix != "M":
            return
        along = self.motion.moved_with_base(term.rows if term.carrier is None else term.carrier)
        self.value = self.value + (b.T * term.coefficient) @ along
        self.slope[at] += np.einsum("ki,kp,kj->pij", b, term.gradient, along, optimize=True)
        for p, db in moved.items():
            d_along = self.motion.moved_with_base(term.moving[p])
            c = term.coefficient
            self.slope[at.start + p] += (db.T * c) @ along + (b.T * c) @ d_along

    def add_operator(self, part: MatrixTerm, basis: Basis, at: slice) -> None:
        """Add a part of the mass that scales as a whole."""
        if part.matrix != "M":
            return
        load = basis.projected(self.motion.moved_with_base(part.operator))
        l = np.pad(load, ((0, self.n_own), (0, 0)))
        self.value = self.value + part.coefficient * l
        self.slope[at] += part.gradient[:, None, None] * l

    def loads(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal load -lᵀφ of modes φ (r, r) and its gradient: (k, r), (n_p, k, r)."""
        return -self.value.T @ phi, -self.slope.swapaxes(-1, -2) @ phi
