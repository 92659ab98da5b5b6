"""Bushes, concentrated masses, rigid links and constraints of a fresh deck."""

from collections.abc import Iterator

import numpy as np

from ....model.assembly import Assembly, Average, Equation, RigidBody, picked
from ....units import Units
from ..read.springs_and_masses import no_body, point_mass
from ..text.format import Card, Value
from .numbering import Systems


def bushes(
    assembly: Assembly, units: Units, ids: Iterator[int], properties: Iterator[int],
    systems: Systems, since: int = 0,
) -> Iterator[Card]:  # fmt: skip
    """CBUSH in a system of its own frame, one PBUSH for equal values; from a row of bushes on."""
    b = assembly.bushes
    work = np.array([units.force / units.length] * 3 + [units.force * units.length] * 3)
    known: dict[bytes, int] = {}
    for k in range(since, len(b)):
        rows = (b.stiffness[k] / work, b.viscous[k] / (work * units.time), b.loss[k])
        key = np.concatenate(rows).tobytes()
        if key not in known:
            known[key] = pid = next(properties)
            yield _pbush(pid, rows)
        ends: list[Value] = [int(assembly.ids[r]) if r >= 0 else None for r in b.nodes[k]]
        frame = systems.of_frame(b.frame[k])
        where: list[Value] = [None, 0, *(b.place[k] / units.length).tolist()]
        if np.allclose(b.place[k], _middle(assembly, b.nodes[k]), rtol=1e-12, atol=0):
            where = []
        yield ["CBUSH", next(ids), known[key], *ends, None, None, None, frame, *where]


def _middle(assembly: Assembly, nodes: np.ndarray) -> np.ndarray:
    """Place of a bush whose card gives none."""
    a, b = nodes if nodes[1] >= 0 else (nodes[0], nodes[0])
    return assembly.points[a] + 0.5 * (assembly.points[b] - assembly.points[a])


def _pbush(pid: int, rows: tuple[np.ndarray, ...]) -> Card:
    """PBUSH with the rows K, B, GE that hold anything."""
    values: list[Value] = [pid]
    for key, row in zip(("K", "B", "GE"), rows, strict=True):
        if np.any(row) or key == "K":
            values += [key, *row.tolist()]
            values += [None] if len(values) > 1 else []
    return ["PBUSH", *values]


def masses(assembly: Assembly, units: Units, ids: Iterator[int], since: int = 0) -> Iterator[Card]:
    """CONM2 where the matrix is a body's, CONM1 otherwise; from a row of masses on."""
    unit = np.array([1.0] * 3 + [units.length] * 3)
    scale = units.inertia * unit[:, None] * unit
    some = picked(assembly.masses, slice(since, None))
    for node, matrix in zip(some.node.tolist(), some.matrix, strict=True):
        M, grid = matrix / scale, int(assembly.ids[node])
        body = _body(M)
        if body is None:
            yield ["CONM1", next(ids), grid, 0, *M[np.tril_indices(6)].tolist()]
            continue
        m, x, J = body
        inertia = [J[0, 0], -J[1, 0], J[1, 1], -J[2, 0], -J[2, 1], J[2, 2]]
        values: list[Value] = [next(ids), grid, None, m]
        if np.any(x) or np.any(J):
            values += [*x.tolist(), None, *(float(v) for v in inertia)]
        yield ["CONM2", *values]


def _body(M: np.ndarray) -> tuple[float, np.ndarray, np.ndarray] | None:
    """(m, offset, inertia about the mass) of a rigid body's matrix, None where it is no such."""
    m = float(M[0, 0])
    if not m > 0:
        return None if np.any(M[:3]) or no_body(M[3:, 3:])[1] else (0.0, np.zeros(3), M[3:, 3:])
    X = M[3:, :3] / m
    x = np.array([X[2, 1], X[0, 2], X[1, 0]])
    J = M[3:, 3:] + m * (X @ X)
    J = np.where(np.abs(J) < 1e-12 * max(np.abs(M[3:, 3:]).max(), 1e-300), 0.0, J)
    if no_body(J)[1]:
        return None
    again = point_mass(np.array([m]), x[None], J[None])[0]
    return (m, x, J) if np.allclose(again, M, rtol=1e-10, atol=1e-12 * np.abs(M).max()) else None


def ties(
    assembly: Assembly, units: Units, ids: Iterator[int], more: Iterator[int], since: int = 0
) -> Iterator[Card]:
    """RBE2, RBE3, MPC (set 1); from one on. A body of several motions takes ``more`` ids."""
    for tie in assembly.rigid[since:]:
        id = next(ids)
        if isinstance(tie, Equation):
            yield ["MPC", *_equation(assembly, tie, units)]
        elif isinstance(tie, Average):
            yield ["RBE3", *_average(assembly, tie, id)]
        else:
            lead = int(assembly.ids[tie.independent])
            for k, (comps, rows) in enumerate(_groups(tie).items()):
                own = next(more) if k else id
                yield ["RBE2", own, lead, _packed(comps), *assembly.ids[rows].tolist()]


def _packed(components: tuple[int, ...]) -> int:
    return int("".join(map(str, components)))


def _groups(tie: RigidBody) -> dict[tuple[int, ...], list[int]]:
    """Dependent rows by the components that follow."""
    out: dict[tuple[int, ...], list[int]] = {}
    for row, comps in zip(tie.dependent, tie.components, strict=True):
        out.setdefault(tuple(comps), []).append(row)
    return out


def _average(assembly: Assembly, tie: Average, id: int) -> list[Value]:
    """EID - REFGRID REFC WT C G..., UM."""
    values: list[Value] = [id, None, int(assembly.ids[tie.reference]), _packed(tie.components)]
    last = None
    for row, comps, weight in tie.terms:
        if (comps, weight) != last:
            values += [float(weight), _packed(comps)]
            last = (comps, weight)
        values.append(int(assembly.ids[row]))
    if tie.moved:
        values += [None] * (-len(values) % 8) + ["UM"]
        for row, component in tie.moved:
            if len(values) % 8 == 7:
                values += [None, None]
            values += [int(assembly.ids[row]), component]
    return values


def _equation(assembly: Assembly, tie: Equation, units: Units) -> list[Value]:
    """SID G C A G C A - - G C A G C A; a rotation's factor is per unit of length."""
    spoint = assembly.scalar_points
    values: list[Value] = [1]
    for row, component, factor in zip(tie.nodes, tie.components, tie.factors, strict=True):
        if len(values) % 8 == 7:
            values += [None, None]
        turn = component > 3 and not (spoint is not None and spoint[row])
        values += [int(assembly.ids[row]), component, factor / (units.length if turn else 1.0)]
    return values
