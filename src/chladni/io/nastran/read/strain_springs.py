"""Elements that resist a few deformations, K = Σ k g gᵀ, as springs on scalar points.

An equation makes a scalar point move by the deformation g · u, and a spring k holds it. Shear
panels, curved beams and GENEL are such elements. No card of a deck has these points.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....model.added_points import with_points
from ....model.assembly import Assembly, Equation, Masses, Scalars, concatenated

FIRST = 102_000_001  # id of the first point that no card has
_NOTHING = 1e-14  # of the largest stiffness, or of the largest factor of a deformation: rounding


@dataclass(frozen=True, eq=False)
class StrainSpring:
    """A deformation g · u of an element, and the stiffness that resists it."""

    id: int  # of the element
    nodes: Sequence[int]  # rows of points
    factors: np.ndarray  # g (n, 6) on motions in the basic frame [-, m]
    stiffness: float  # k [N/m]
    loss: float = 0.0


def squares(
    id: int, nodes: Sequence[int], E: np.ndarray, K: np.ndarray, unit: np.ndarray, loss: float = 0.0
) -> Iterator[StrainSpring]:
    """The deformations of a stiffness Eᵀ K E, one for each eigenvector of K.

    Parameters
    ----------
    E : (m, 6n)    motions that K (m, m) resists
    unit : (m,)    factors that make rotations comparable with translations
    """
    value, vectors = np.linalg.eigh(K / np.outer(unit, unit))
    for k, vector in zip(value.tolist(), vectors.T, strict=True):
        if abs(k) > _NOTHING * np.abs(value).max():
            yield StrainSpring(id, nodes, ((vector * unit) @ E).reshape(-1, 6), k, loss)


def relative(arm: np.ndarray) -> np.ndarray:
    """E (6, 12): motion of B less that of a rigid body at A, ``arm`` from A to B in basic axes."""
    x, y, z = arm
    E = np.hstack([-np.eye(6), np.eye(6)])
    E[:3, 3:6] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return E


def with_springs(
    made: Assembly, found: Sequence[StrainSpring], masses: Masses | None = None
) -> Assembly:
    """The assembly with a scalar point, an equation and a spring for each deformation; masses."""
    if masses is not None:
        made = replace(made, masses=concatenated(made.masses, masses))
    if not found:
        return made
    places = np.array([made.points[list(s.nodes)].mean(axis=0) for s in found])
    made, rows = with_points(made, places)
    first = max(FIRST, int(made.ids[rows[0] - 1]) + 1)
    scalar = np.zeros(len(made.ids), bool) if made.scalar_points is None else made.scalar_points
    scalar = np.where(np.arange(len(made.ids)) >= rows[0], True, scalar)
    axes = np.tile(np.eye(3), (len(made.ids), 1, 1)) if made.axes is None else made.axes
    equations = [_equation(axes, s, row) for s, row in zip(found, rows.tolist(), strict=True)]
    held = Scalars(
        np.array([s.id for s in found]), np.column_stack([rows, np.full(len(rows), -1)]),
        np.ones((len(rows), 2), np.int64), np.array([s.stiffness for s in found]),
        np.array([s.loss for s in found]),
    )  # fmt: skip
    return replace(
        made, ids=np.r_[made.ids[: rows[0]], first + np.arange(len(rows))], scalar_points=scalar,
        springs=concatenated(made.springs, held), rigid=(*made.rigid, *equations),
    )  # fmt: skip


def _equation(axes: np.ndarray, spring: StrainSpring, row: int) -> Equation:
    """The motion of the scalar point is g · u, u in the displacement frames."""
    nodes = list(spring.nodes)
    own = np.einsum("nij,nkj->nki", axes[nodes], spring.factors.reshape(-1, 2, 3)).reshape(-1, 6)
    at = np.argwhere(np.abs(own) > _NOTHING * np.abs(own).max())
    return Equation(
        spring.id,
        (row, *(int(nodes[k]) for k, _ in at)),
        (1, *(int(c) + 1 for _, c in at)),
        (-1.0, *(float(own[k, c]) for k, c in at)),
    )
