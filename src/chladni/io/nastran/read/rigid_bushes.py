"""Components of bushes that are RIGID, as equations between their ends."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import scipy.linalg as sl

from ....model.assembly import Assembly, Bushes, Equation, RigidBody
from .rigid_elements import Tie
from .springs_and_masses import skew


def tied(made: Assembly) -> Assembly:
    """The assembly with equations in the place of infinite stiffness.

    The relative motion δ = E q at the bush is zero in these components. Dofs of B follow, one for
    each of them, or dofs of A where B is the ground or follows something already.
    """
    stiff = np.isinf(made.bushes.stiffness)
    if not stiff.any():
        return made
    follow = _following(made.rigid)
    found = []
    for i in np.flatnonzero(stiff.any(axis=1)).tolist():
        a, b = made.bushes.nodes[i].tolist()
        end = 0 if b < 0 or (b in follow and a not in follow) else 1
        found += list(_equations(made, i, stiff[i], end))
        follow.add((a, b)[end])
    stiffness = np.where(stiff, 0.0, made.bushes.stiffness)
    bushes = replace(made.bushes, stiffness=stiffness)
    return replace(made, bushes=bushes, rigid=(*made.rigid, *found))


def _following(rigid: Iterable[Tie]) -> set[int]:
    """Rows of points of which some dof follows others."""
    found: set[int] = set()
    for tie in rigid:
        if isinstance(tie, RigidBody):
            found.update(tie.dependent)
        elif isinstance(tie, Equation):
            found.add(tie.nodes[0])
        else:
            found.update([row for row, _ in tie.moved] or [tie.reference])
    return found


def _equations(made: Assembly, i: int, stiff: np.ndarray, end: int) -> Iterator[Equation]:
    """q_d + P⁻¹ E_r q_r = 0 with P = E_d, d the columns of an end that pivoted QR takes first."""
    bushes: Bushes = made.bushes
    nodes = bushes.nodes[i]
    E = np.zeros((6, 2, 6))
    for k in np.flatnonzero(nodes >= 0).tolist():
        row, R = nodes[k], bushes.frame[i]
        axes = np.eye(3) if made.axes is None else made.axes[row]
        arm = skew((bushes.place[i] - made.points[row])[None])[0]
        block = np.block([[R, -R @ arm], [np.zeros((3, 3)), R]])
        E[:, k] = (2 * k - 1) * block @ np.kron(np.eye(2), axes.T)
    E = E[stiff]
    span = np.abs(E[:, :, 3:]).max() or 1.0
    unit = np.array([1.0] * 3 + [1 / span] * 3)  # rotations as if at the end of the longest arm
    first = sl.qr(E[:, end] * unit, mode="r", pivoting=True)[1][: len(E)]
    factors = np.linalg.solve(E[:, end, first], E.reshape(len(E), 12))
    factors[np.abs(factors) < 1e-12 * max(1.0, span)] = 0.0
    own = (6 * end + first).tolist()
    for line, dof in zip(factors, own, strict=True):
        rest = [k for k in np.flatnonzero(line).tolist() if k not in own]
        terms = [dof, *rest]
        yield Equation(
            int(bushes.ids[i]),
            tuple(int(nodes[k // 6]) for k in terms),
            tuple(k % 6 + 1 for k in terms),
            tuple(float(line[k]) for k in terms),
        )
