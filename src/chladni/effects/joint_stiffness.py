"""One joint with another stiffness than in the deck, and all others of its family with it."""

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from .effect import Effect, MatrixTerm, Parameter, Within
from .joints import Connection, with_factor_on, with_family
from .model_families import JointFamilies, JointFamily, shared_factor, within_joints

NONE_ELSE = 1e-9  # of a family's stiffness: with less of it elsewhere, the joint is all of it


def _nothing() -> sp.csr_array:
    return sp.csr_array((0, 0))


@dataclass(frozen=True, eq=False)
class JointStiffness(Effect):
    """K + (g - 1) Σ_i K_i + (f/g - 1) g K_j: the joint times f(x_0), others of its family times g.

    The last parameter is ln g, where there are others. It takes the place of the factor that a
    family shares. The joint is within its family, so each factor multiplies what the other left
    (:class:`.effect.Within`), also where two effects act on one family. With ``own_loads``
    the basis contains (P⁻¹ A)ᵏ φ, which spans the mode change for any stiffness of the joint.

    Attributes
    ----------
    joint : what it is in the deck
    family : name of its family, "" for a joint of none
    operator : contribution to K of the joint
    whole : its family with other members, or None
    """

    joint: Connection | None = None
    family: str = ""
    operator: sp.csr_array = field(default_factory=_nothing)
    whole: JointFamily | None = None

    @classmethod
    def of(
        cls, joint: Connection, unknown: tuple[Parameter, ...], text: str, tried: int, family: str,
        families: JointFamilies, shared: str, own: sp.csr_array | None = None, **more: Any,
    ) -> Self:  # fmt: skip
        """The effect on one joint, or one run of joints, of as many as were tried.

        Parameters
        ----------
        families : of :func:`.model_families.joint_families`
        shared : name of the parameter of the others
        own : contribution of the joint to K; bᵀ b of its rows by default
        """
        own = sp.csr_array(joint.rows.T @ joint.rows) if own is None else own
        whole = None
        if known := families.get(family):
            if abs(known.operator - own).max() > NONE_ELSE * abs(known.operator).max():
                whole, unknown = known, (*unknown, shared_factor(shared, family, known.sd))
        x, y, z = joint.point.tolist()
        return cls(
            unknown, text, joint.parts, joint.grids, point=(x, y, z), trials_factor=tried,
            replaces=(family,) if family in families else (), joint=joint, family=family,
            operator=own, whole=whole, **more,
        )  # fmt: skip

    def factor(self, x: np.ndarray) -> tuple[float, float]:
        """Factor f on the joint, and its slope by the first parameter."""
        p = self.parameters[0]
        return p.value(x[0]) / p.scale, p.slope(x[0]) / p.scale

    def loss(self, x: np.ndarray) -> float | None:
        """Loss factor of the joint, or None if it is that of the deck."""
        return None

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The terms of the family and of the joint."""
        (f, slope), (g, dg) = self.factor(x), self.shared(x)
        gradient = slope / g * np.eye(len(x))[0] - f / g**2 * dg
        own = MatrixTerm("K", self.operator, f / g - 1, gradient, within=self.within)
        return (own, *self.of_family(x))

    @property
    def within(self) -> Within:
        """The elements of the joint."""
        return within_joints(() if self.joint is None else self.joint.ids)

    def shared(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Factor g on the family and its gradient (n_p,); 1 where the joint is all of it."""
        if self.whole is None:
            return 1.0, np.zeros(len(x))
        p = self.parameters[-1]
        return p.value(x[-1]), p.slope(x[-1]) * np.eye(len(x))[-1]

    def of_family(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The term of the family, if it has other members."""
        if self.whole is None:
            return ()
        g, dg = self.shared(x)
        return (MatrixTerm("K", self.whole.operator, g - 1, dg, within=self.whole.within),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the joint; the basis already represents all of its family together."""
        return sp.csr_array((self.operator @ shapes).T)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the joint as fitted, and the others as fitted with it."""
        assert self.joint is not None
        g, _ = self.shared(x)
        made = with_family(assembly, self.family, g)
        return with_factor_on(made, self.joint, self.factor(x)[0] / g, self.loss(x))


@dataclass(frozen=True, eq=False)
class Fastener(JointStiffness):
    """A joint of few elements: the basis contains all relative motions that load it.

    The basis is loaded again by inertia, because a joint that is gone may free a mode of its own.
    """

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows b with K_j = bᵀ b."""
        assert self.joint is not None
        return self.joint.rows
