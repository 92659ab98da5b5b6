"""Masses and springs at points."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from ..model.ground_springs import with_springs as with_springs
from ..model.point_masses import with_masses as with_masses
from .effect import Effect, Parameter, PointTerm

NOTHING = -30.0  # ln of a strength over its median that is as good as zero


def _empty() -> sp.csr_array:
    return sp.csr_array((0, 0))


@dataclass(frozen=True, eq=False)
class AtPoints(Effect):
    """Σ_k c b_kᵀ b_k at fixed rows, one strength for all, c = scale · e^x."""

    rows: sp.csr_array = field(default_factory=_empty)  # (k, n_free)
    directions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    matrix = "K"

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One strength on every row."""
        c = np.full(self.rows.shape[0], self.parameters[0].value(x[0]))
        return (PointTerm("M" if self.matrix == "M" else "K", self.rows, c, c[:, None]),)


@dataclass(frozen=True, eq=False)
class MassEffect(AtPoints):
    """Masses: they act in every direction and count once per grid in the weight."""

    matrix = "M"

    def weight(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Total mass n · m."""
        total = len(self.grids) * self.parameters[0].value(x[0])
        return total, np.array([total])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CONM2 at each grid."""
        m = self.parameters[0].value(x[0])
        return with_masses(assembly, self.grids, m)


def strength(name: str, unit: str, scale: float, sd: float, starts: tuple[float, ...]) -> Parameter:
    """A log-normal strength with median ``scale``."""
    return Parameter(name, unit, 0.0, sd, scale, step=1.0, starts=starts, nominal=NOTHING)
