"""Masses and springs at points."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from ..model.ground_springs import with_springs as with_springs
from ..model.point_masses import with_masses as with_masses
from .effect import Effect, Parameter, PointTerm, Weight

NOTHING = -30.0  # ln of a strength over its median that is as good as zero


@dataclass(frozen=True, eq=False)
class AtPoints(Effect):
    """Σ_k c s_k b_kᵀ b_k at fixed rows b: one strength c = scale · e^x, in shares s.

    Attributes
    ----------
    rows : (k, n)
    shares : (m,)   k/m rows one after another have one share; 1 by default
    """

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    shares: np.ndarray = field(default_factory=lambda: np.ones(1))

    matrix: ClassVar[Literal["K", "M"]] = "K"

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """The strength on every row."""
        each = np.repeat(self.shares, self.rows.shape[0] // len(self.shares))
        c = self.parameters[0].value(x[0]) * each
        return (PointTerm(self.matrix, self.rows, c, c[:, None]),)


@dataclass(frozen=True, eq=False)
class SpringEffect(AtPoints):
    """Springs to ground: one row at each of ``grids``, along each of ``directions`` (k, 3)."""

    directions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a spring to ground at each grid: CELAS2, or CBUSH in an oblique direction."""
        k = self.parameters[0].value(x[0])
        return with_springs(assembly, self.grids, self.directions, k)


@dataclass(frozen=True, eq=False)
class MassEffect(AtPoints):
    """Masses at grids: the rows are all three translations of each."""

    matrix = "M"

    def each(self, x: np.ndarray) -> np.ndarray:
        """Mass at every grid (n,) [kg]."""
        return self.parameters[0].value(x[0]) * np.broadcast_to(self.shares, len(self.grids))

    def weight(self, x: np.ndarray) -> Weight:
        """Total mass."""
        total = float(self.each(x).sum())
        return Weight(total, np.array([total]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CONM2 at each grid."""
        return with_masses(assembly, self.grids, self.each(x))


def strength(name: str, unit: str, scale: float, sd: float, starts: tuple[float, ...]) -> Parameter:
    """A log-normal strength with median ``scale``."""
    return Parameter(name, unit, 0.0, sd, scale, step=1.0, starts=starts, nominal=NOTHING)
