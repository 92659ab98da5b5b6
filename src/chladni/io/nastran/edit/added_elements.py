"""Cards of grids, ties, masses, springs and bushes that were added to a deck."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.added_points import next_id
from ....model.assembly import Assembly, Average, RigidBody
from ....units import Units
from .free_ids import FreeIds
from .tie_changes import rbe2

AXIS = 1e-9  # deviation of a unit vector from an axis of the basic frame that is none


def added_cards(before: Assembly, after: Assembly, units: Units, free: FreeIds) -> list[list]:
    """All of them; elements are numbered from the first id that is free.

    Raises
    ------
    ModelError
        If a mass was added that no CONM2 here holds.
    """
    return [
        *_grids(before, after, units, free),
        *_ties(before, after),
        *_masses(before, after, units),
        *_springs(before, after, units),
        *_bushes(before, after, units, free),
    ]


def _grids(before: Assembly, after: Assembly, units: Units, free: FreeIds) -> Iterator[list]:
    """GRID of every point that was added, what holds it in PS, its own frame in CD."""
    for row in range(len(before.points), len(after.points)):
        held = sorted(int(c) for r, c in after.supports if r == row)
        place, cid = after.points[row] / units.length, 0
        if after.axes is not None and not _basic(after.axes[row]):
            cid = next(free.systems)
            yield _system(cid, after.axes[row])
        holds = "".join(map(str, held)) or None
        yield ["GRID", int(after.ids[row]), 0, *place.tolist(), cid, holds]


def _basic(frame: np.ndarray) -> bool:
    return np.allclose(frame, np.eye(3), rtol=0, atol=AXIS)


def _system(cid: int, frame: np.ndarray) -> list:
    """CORD2R at the origin, its axes the rows of a frame."""
    x, _, z = frame
    return ["CORD2R", cid, 0, 0.0, 0.0, 0.0, *z.tolist(), *x.tolist()]


def _ties(before: Assembly, after: Assembly) -> Iterator[list]:
    """RBE2 of every rigid body that was added, RBE3 of every mean.

    A mean's weights are equal and of translations, a body holds the same of all its points.
    """
    for mean in after.rigid[len(before.rigid) :]:
        if isinstance(mean, RigidBody):
            yield rbe2(after, mean)
            continue
        alike = isinstance(mean, Average) and len({(c, w) for _, c, w in mean.terms}) == 1
        if not isinstance(mean, Average) or not alike or mean.moved:
            raise ModelError(f"rigid element {mean.id} was added; only plain RBE2 and RBE3 are")
        wanted, on = ("".join(map(str, c)) for c in (mean.components, mean.terms[0][1]))
        grids = [int(after.ids[row]) for row, _, _ in mean.terms]
        reference = int(after.ids[mean.reference])
        yield ["RBE3", mean.id, None, reference, wanted, mean.terms[0][2], on, *grids]


def _masses(before: Assembly, after: Assembly, units: Units) -> Iterator[list]:
    """CONM2 of every mass that was added, offset where it sits beside its grid."""
    first = next_id(after)
    for k in range(len(before.masses), len(after.masses)):
        M = after.masses.matrix[k]
        m = M[0, 0]
        arm = np.array([M[1, 5], M[2, 3], M[0, 4]]) / m
        x, y, z = arm
        T = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        if not np.allclose(M, m * T.T @ T, rtol=1e-9, atol=1e-9 * m):
            raise ModelError("a mass with inertia was added; CONM2 here has none")
        card = ["CONM2", first + k, int(after.ids[after.masses.node[k]]), 0, m / units.inertia]
        yield [*card, *(a / units.length for a in arm)] if np.abs(arm).max() > 1e-9 else card


def _springs(before: Assembly, after: Assembly, units: Units) -> Iterator[list]:
    """CELAS2 of every spring that was added."""
    s, n = after.springs, len(before.springs)
    first = next_id(after) + len(after.masses)
    work, scalar = units.force * units.length, after.scalar_points
    for k in range(n, len(s)):
        card, value = ["CELAS2", first + k], float(s.value[k]) / work
        ends = [(int(r), int(c)) for r, c in zip(s.nodes[k], s.component[k], strict=True) if r >= 0]
        moves = [c <= 3 or (scalar is not None and scalar[r]) for r, c in ends]
        value *= units.length ** sum(m * 2 / len(ends) for m in moves)
        yield [*card, value, *(word for r, c in ends for word in (int(after.ids[r]), c))]


def _bushes(before: Assembly, after: Assembly, units: Units, free: FreeIds) -> Iterator[list]:
    """CBUSH that was added, with its PBUSH and, where it lies askew, the CORD2R of its frame."""
    b = after.bushes
    first = next_id(after) + len(after.masses) + len(after.springs)
    unit, turning = units.force / units.length, units.force * units.length
    for k in range(len(before.bushes), len(b)):
        if np.any(b.viscous[k]) or np.any(b.loss[k]):
            raise ModelError("a bush that dissipates was added; CBUSH here is a spring")
        cid, pid = 0, next(free.properties)
        if not _basic(b.frame[k]):
            cid = next(free.systems)
            yield _system(cid, b.frame[k])
        along, about = b.stiffness[k, :3] / unit, b.stiffness[k, 3:] / turning
        yield ["PBUSH", pid, "K", *along.tolist(), *(about.tolist() if about.any() else ())]
        ends = [int(after.ids[row]) if row >= 0 else None for row in b.nodes[k]]
        place = (b.place[k] / units.length).tolist()
        yield ["CBUSH", first + k, pid, *ends, None, None, None, cid, None, 0, *place]
