"""What sits at points: masses and springs at known or unknown places."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly, Masses, Scalars
from .effect import Effect, Parameter, PointTerm

NOTHING = -30.0  # ln of a strength over its median that is none


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
    """Masses: moved along every direction, weighed once per grid."""

    matrix = "M"

    def weight(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """The masses the scales would see, n · m."""
        total = len(self.grids) * self.parameters[0].value(x[0])
        return total, np.array([total])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """CONM2 at each grid."""
        m = self.parameters[0].value(x[0])
        return with_masses(assembly, self.grids, m)


def strength(name: str, unit: str, scale: float, sd: float, starts: tuple[float, ...]) -> Parameter:
    """A log-normal strength with median ``scale``."""
    return Parameter(name, unit, 0.0, sd, scale, step=1.0, starts=starts, nominal=NOTHING)


def with_masses(
    assembly: Assembly, grids: tuple[int, ...], m: float, offset: np.ndarray | None = None
) -> Assembly:
    """The assembly with a mass m [kg] at each of these grids, ``offset`` (3,) from it [m]."""
    old = assembly.masses
    first = int(old.ids.max(initial=0)) + 1
    x, y, z = np.zeros(3) if offset is None else offset
    arm = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])  # motion of the mass
    new = Masses(
        np.append(old.ids, first + np.arange(len(grids))),
        np.append(old.node, assembly.rows(list(grids))),
        np.concatenate([old.matrix, np.tile(m * arm.T @ arm, (len(grids), 1, 1))]),
    )
    return replace(assembly, masses=new)


def with_springs(
    assembly: Assembly, grids: tuple[int, ...], directions: np.ndarray, k: float
) -> Assembly:
    """Springs k to ground, k d_i² along each axis of the grid's frame (cross terms neglected)."""
    rows = assembly.rows(list(grids))
    local = directions if assembly.axes is None else np.einsum(
        "kij,kj->ki", assembly.axes[rows], directions
    )  # fmt: skip
    at, component = np.nonzero(np.abs(local) > 0.1)
    values = k * local[at, component] ** 2
    old, n = assembly.springs, len(at)
    first = int(old.ids.max(initial=0)) + 1
    ground = np.full(n, -1)
    new = Scalars(
        np.append(old.ids, first + np.arange(n)),
        np.concatenate([old.nodes, np.stack([rows[at], ground], axis=1)]),
        np.concatenate([old.component, np.stack([component + 1, component * 0 + 1], axis=1)]),
        np.append(old.value, values),
        np.append(old.damping, np.zeros(n)),
    )
    return replace(assembly, springs=new)
