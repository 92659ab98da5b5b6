"""Constraints turned into one transformation u = T q: rigid bodies, weighted means, equations.

Every constraint makes some dofs linear in others, u_m = G u. Chains of dependent dofs are followed
to the end, so that q contains independent dofs only.

Source: MSC Nastran Linear Static Analysis User's Guide, R-type elements and multipoint constraints.
"""

from collections.abc import Callable
from itertools import chain

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from .. import dofs as labels
from ..errors import ModelError
from ..model.assembly import Assembly, Average, Equation, RigidBody
from .average import average_rows, lever
from .constraint import Rows
from .spring import direction


def transformation(assembly: Assembly) -> tuple[sp.csr_array, np.ndarray]:
    """T (6n, n_q) and q: u = T q, u in the basic frame, q in the displacement frames.

    Returns
    -------
    T : (6n, n_q) sparse
    independent : (n_q,) int, increasing
        6 * row + component - 1 of each kept dof; dependent dofs, and all but the first of scalar
        points, are left out.

    Raises
    ------
    ModelError
        If a dof depends twice, or on itself, or is also held by a support; the message names grid,
        component and elements.
    """
    n = 6 * len(assembly.ids)
    rows = dependencies(assembly)
    _refuse_held(assembly, rows)
    G = _followed(assembly, rows, n)
    kept = np.ones(n, dtype=bool)
    kept[rows.dof] = False
    if assembly.scalar_points is not None:
        kept &= ~np.repeat(assembly.scalar_points, 6) | (np.arange(n) % 6 == 0)
    independent = np.flatnonzero(kept)
    T = G + sp.diags_array(kept.astype(float))
    return sp.csr_array(_to_basic(assembly) @ T.tocsc()[:, independent]), independent


def _to_basic(assembly: Assembly) -> sp.csr_array:
    """Block diagonal R (6n, 6n): u_basic = R u, u in the displacement frames."""
    n = len(assembly.ids)
    if assembly.axes is None:
        return sp.eye_array(6 * n, format="csr")
    blocks = np.repeat(assembly.axes.transpose(0, 2, 1), 2, axis=0)
    index = np.arange(2 * n)
    return sp.bsr_array((blocks, index, np.arange(2 * n + 1)), shape=(6 * n, 6 * n)).tocsr()


def dependencies(assembly: Assembly) -> Rows:
    """u_m = G u as defined by the elements, before chains are followed.

    Raises
    ------
    ModelError
        If a dof depends twice.
    """
    kinds: list[tuple[type, Callable[[Assembly, np.ndarray], Rows]]] = [
        (RigidBody, _rigid_rows),
        (Average, average_rows),
        (Equation, _equation_rows),
    ]
    found = []
    for kind, rows_of in kinds:
        at = np.array([k for k, e in enumerate(assembly.rigid) if isinstance(e, kind)], dtype=int)
        found.append(rows_of(assembly, at))
    rows = Rows.joined(found)
    _refuse_double(assembly, rows)
    return rows


def _rigid_rows(assembly: Assembly, at: np.ndarray) -> Rows:
    """u_d = u_i + θ_i × r and θ_d = θ_i, each component along the axes of its point."""
    bodies = [(k, assembly.rigid[k]) for k in at]
    flat = [
        (k, body.independent, node, component)
        for k, body in bodies
        if isinstance(body, RigidBody)
        for node, components in zip(body.dependent, body.components, strict=True)
        for component in components
    ]
    owner, independent, node, component = np.array(flat, dtype=np.int64).reshape(-1, 4).T
    arm = assembly.points[node] - assembly.points[independent]
    S = lever(direction(assembly, node, component), arm)  # along the basic axes of the independent
    if assembly.axes is not None:
        S = np.einsum("mij,mkj->mki", assembly.axes[independent], S.reshape(-1, 2, 3))
    m = len(flat)
    on = 6 * independent[:, None] + np.arange(6)
    row = np.repeat(np.arange(m), 6)
    return Rows(6 * node + component - 1, owner, row, on.ravel(), S.reshape(-1))


def _equation_rows(assembly: Assembly, at: np.ndarray) -> Rows:
    """q_0 = -Σ a_k q_k / a_0."""
    equations = [e for e in (assembly.rigid[k] for k in at) if isinstance(e, Equation)]
    lengths = np.array([len(e.nodes) for e in equations], dtype=int)
    first = np.cumsum(lengths) - lengths
    dof = 6 * _flat([e.nodes for e in equations], int) + _flat(
        [e.components for e in equations], int
    )
    factor = _flat([e.factors for e in equations], float)
    if np.any(factor[first] == 0):
        bad = equations[int(np.argmax(factor[first] == 0))]
        raise ModelError(f"MPC {bad.id} has factor 0 at its dependent dof, the first")
    row = np.repeat(np.arange(len(at)), lengths)
    rest = np.ones(len(dof), dtype=bool)
    rest[first] = False
    value = -factor / np.repeat(factor[first], lengths)
    return Rows(dof[first] - 1, at, row[rest], dof[rest] - 1, value[rest])


def _flat(lists: list[tuple], kind: type) -> np.ndarray:
    return np.array(list(chain.from_iterable(lists)), dtype=kind)


def _refuse_double(assembly: Assembly, rows: Rows) -> None:
    """Raise if a dof is dependent in two places."""
    order = np.argsort(rows.dof, kind="stable")
    again = np.flatnonzero(np.diff(rows.dof[order]) == 0)
    if len(again):
        pair = order[again[0] : again[0] + 2]
        one, other = (_name(assembly, rows.owner[k]) for k in pair)
        raise ModelError(
            f"{_label(assembly, rows.dof[pair[0]])} depends twice: through {one} and {other}; "
            f"{len(again)} such dofs in all"
        )


def _refuse_held(assembly: Assembly, rows: Rows) -> None:
    """Raise if a dependent dof has a support: one of the two would be ignored."""
    held = 6 * assembly.supports[:, 0] + assembly.supports[:, 1] - 1
    both = np.flatnonzero(np.isin(rows.dof, held))
    if len(both):
        raise ModelError(
            f"{_label(assembly, rows.dof[both[0]])} is held by a support and depends on others "
            f"through {_name(assembly, rows.owner[both[0]])}; hold the points it depends on "
            f"instead ({len(both)} such dofs)"
        )


def _followed(assembly: Assembly, rows: Rows, n: int) -> sp.csr_array:
    """(1 - G_mm)⁻¹ G_mi = (1 + G_mm)(1 + G_mm²)(1 + G_mm⁴)... G_mi, finite for finite chains."""
    G = sp.csr_array((rows.factor, (rows.dof[rows.row], rows.on)), shape=(n, n))
    G.eliminate_zeros()
    dependent = np.zeros(n)
    dependent[rows.dof] = 1
    G_mm = sp.csr_array(G @ sp.diags_array(dependent))
    G_mm.eliminate_zeros()
    if G_mm.nnz:
        _refuse_cycles(assembly, rows, G_mm)
        G = sp.csr_array(G @ sp.diags_array(1 - dependent))
    while G_mm.nnz:
        G = G + G_mm @ G
        G_mm = sp.csr_array(G_mm @ G_mm)
        G_mm.eliminate_zeros()
    return G


def _refuse_cycles(assembly: Assembly, rows: Rows, G_mm: sp.csr_array) -> None:
    """Raise if a dof depends on itself, in any number of steps."""
    count, group = connected_components(G_mm, connection="strong")
    in_cycle = np.bincount(group, minlength=count)[group] > 1
    in_cycle |= G_mm.diagonal() != 0
    if np.any(in_cycle):
        first = int(np.flatnonzero(in_cycle)[0])
        ring = in_cycle & (group == group[first])
        owners = np.unique(rows.owner[ring[rows.dof]])[:6]
        names = ", ".join(_name(assembly, k) for k in owners)
        raise ModelError(f"{_label(assembly, first)} depends on itself through {names}")


def _label(assembly: Assembly, dof: int) -> str:
    return f"dof {labels.label(int(assembly.ids[dof // 6]), int(dof % 6) + 1)}"


def _name(assembly: Assembly, k: int) -> str:
    element = assembly.rigid[k]
    kind = {RigidBody: "rigid element", Average: "RBE3", Equation: "MPC"}[type(element)]
    return f"{kind} {element.id}"
