"""One joint with another stiffness than in the deck, and all others of its family with it."""

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from .effect import Effect, MatrixTerm, Parameter
from .joints import Connection, with_factor_on, with_family
from .model_families import JointFamilies, shared_factor

NONE_ELSE = 1e-9  # of a family's stiffness: with less of it elsewhere, the joint is all of it


def _nothing() -> sp.csr_array:
    return sp.csr_array((0, 0))


@dataclass(frozen=True, eq=False)
class JointStiffness(Effect):
    """K + (f - 1) K_j + (g - 1) Σ_{i≠j} K_i: the joint times f(x_0), others of its family times g.

    The last parameter is ln g, where there are others. It takes the place of the factor that a
    family shares. Hence no joint loses more than it has, and K stays positive. With ``own_loads``
    the basis contains (P⁻¹ A)ᵏ φ, which spans the mode change for any stiffness of the joint.

    Attributes
    ----------
    joint : what it is in the deck
    family : name of its family, "" for a joint of none
    operator, others : contribution to K of the joint, and of all others of its family
    """

    joint: Connection | None = None
    family: str = ""
    operator: sp.csr_array = field(default_factory=_nothing)
    others: sp.csr_array = field(default_factory=_nothing)

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
        others = _nothing()
        if family in families:
            K, sd = families[family]
            left = sp.csr_array(K - own)
            if abs(left).max() > NONE_ELSE * abs(K).max():
                others, unknown = left, (*unknown, shared_factor(shared, family, sd))
        x, y, z = joint.point.tolist()
        return cls(
            unknown, text, joint.parts, joint.grids, point=(x, y, z), trials_factor=tried,
            replaces=(family,) if family in families else (), joint=joint, family=family,
            operator=own, others=others, **more,
        )  # fmt: skip

    def factor(self, x: np.ndarray) -> tuple[float, float]:
        """Factor f on the joint, and its slope by the first parameter."""
        p = self.parameters[0]
        return p.value(x[0]) / p.scale, p.slope(x[0]) / p.scale

    def loss(self, x: np.ndarray) -> float | None:
        """Loss factor of the joint, or None if it is that of the deck."""
        return None

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The terms of the joint and of the others."""
        f, slope = self.factor(x)
        own = MatrixTerm("K", self.operator, f - 1, slope * np.eye(len(x))[0])
        return (own, *self.of_others(x))

    @property
    def has_others(self) -> bool:
        """True if the last parameter is the factor of the others."""
        return self.others.nnz > 0

    def of_others(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The term of the others, if there are any."""
        if not self.has_others:
            return ()
        p = self.parameters[-1]
        slope = p.slope(x[-1]) * np.eye(len(x))[-1]
        return (MatrixTerm("K", self.others, p.value(x[-1]) - 1, slope),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the joint; the basis already represents all of its family together."""
        return sp.csr_array((self.operator @ shapes).T)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the joint as fitted, and the others as fitted with it."""
        assert self.joint is not None
        g = self.factor_of_others(x)
        made = with_family(assembly, self.family, g)
        return with_factor_on(made, self.joint, self.factor(x)[0] / g, self.loss(x))

    def factor_of_others(self, x: np.ndarray) -> float:
        """Factor g on all others."""
        return self.parameters[-1].value(x[-1]) if self.has_others else 1.0


@dataclass(frozen=True, eq=False)
class Fastener(JointStiffness):
    """A joint of few elements: the basis contains all relative motions that load it.

    The basis is loaded again by inertia, because a joint that is gone may free a mode of its own.
    """

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows b with K_j = bᵀ b."""
        assert self.joint is not None
        return self.joint.rows
