"""Weighted means (RBE3): the reference point moves as the best rigid motion of the others.

x = argmin Σ w_k (u_k - S_k x)² = A⁻¹ Σ S_kᵀ w_k u_k with A = Σ S_kᵀ w_k S_k. S_k x is the motion of
dof k in a rigid motion x of the reference point. Forces and moments at the reference are thus
distributed over the other points. Weights of rotations are multiplied by the squared mean distance
of the points from the reference, as in NX and MSC Nastran.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.assembly import Assembly, Average
from .constraint import Rows
from .spring import direction


@dataclass(frozen=True, eq=False)
class _Terms:
    """All connected dofs of all RBE3: element, row of points, component, weight (t,)."""

    element: np.ndarray
    node: np.ndarray
    component: np.ndarray
    weight: np.ndarray


def average_rows(assembly: Assembly, at: np.ndarray) -> Rows:
    """The dependencies of the RBE3 at these positions of ``Assembly.rigid``."""
    means = [e for e in (assembly.rigid[k] for k in at) if isinstance(e, Average)]
    if not means:
        return Rows.none()
    terms = _terms(means)
    x = motion(assembly, means, terms)  # (t, 6) along the axes of the reference
    wanted = np.zeros((len(means), 6), dtype=bool)
    for k, mean in enumerate(means):
        wanted[k, np.array(mean.components) - 1] = True
    number = np.cumsum(wanted.ravel()).reshape(wanted.shape) - 1
    t, c = np.nonzero(wanted[terms.element])
    element, component = np.nonzero(wanted)
    reference = np.array([m.reference for m in means])
    rows = Rows(
        6 * reference[element] + component,
        at[element],
        number[terms.element[t], c],
        6 * terms.node[t] + terms.component[t] - 1,
        x[t, c],
    )
    moved = {int(k): mean for k, mean in zip(at, means, strict=True) if mean.moved}
    return _moved(rows, moved) if moved else rows


def _terms(means: list[Average]) -> _Terms:
    flat = [
        (k, node, component)
        for k, mean in enumerate(means)
        for node, components, _ in mean.terms
        for component in components
    ]
    weight = [w for mean in means for _, components, w in mean.terms for _ in components]
    element, node, component = np.array(flat, dtype=np.int64).reshape(-1, 3).T
    return _Terms(element, node, component, np.array(weight, dtype=float))


def lever(along: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """S (m, 6): d · (u + θ × r) = (d, r × d) · (u, θ) for translations, d · θ for rotations.

    Parameters
    ----------
    along : (m, 6)   unit vectors of the dofs, translation and rotation halves
    arm : (m, 3)     r from the moving point to the dof's [m]
    """
    S = along.copy()
    S[:, 3:] += np.cross(arm, along[:, :3])
    return S


def motion(assembly: Assembly, means: list[Average], terms: _Terms) -> np.ndarray:
    """A⁻¹ S_kᵀ w_k (t, 6): motion of the reference, in its own axes, per unit of each dof."""
    reference = np.array([m.reference for m in means])
    arm = assembly.points[terms.node] - assembly.points[reference[terms.element]]
    L = _lengths(terms, arm, len(means))
    S = lever(direction(assembly, terms.node, terms.component), arm)
    w = terms.weight * np.where(terms.component > 3, L[terms.element] ** 2, 1.0)
    S[:, 3:] /= L[terms.element, None]  # so that A is of one unit
    A = np.zeros((len(means), 6, 6))
    np.add.at(A, terms.element, w[:, None, None] * S[:, :, None] * S[:, None, :])
    axes = np.eye(3)[None] if assembly.axes is None else assembly.axes[reference]
    axes = np.broadcast_to(axes, (len(means), 3, 3))
    inverse = _inverse(A, means, axes)
    x = w[:, None] * np.einsum("tij,tj->ti", inverse[terms.element], S)
    x[:, 3:] /= L[terms.element, None]
    turned = np.einsum("tij,tkj->tki", axes[terms.element], x.reshape(-1, 2, 3))
    return turned.reshape(-1, 6)


def _lengths(terms: _Terms, arm: np.ndarray, n: int) -> np.ndarray:
    """Mean distance of the distinct points from the reference (n,), 1 where it is zero [m]."""
    _, first = np.unique(np.stack([terms.element, terms.node]), axis=1, return_index=True)
    distance = np.linalg.norm(arm[first], axis=1)
    count = np.bincount(terms.element[first], minlength=n)
    total = np.bincount(terms.element[first], distance, minlength=n)
    L = total / np.maximum(count, 1)
    return np.where(L > 1e-12, L, 1.0)


def _inverse(A: np.ndarray, means: list[Average], axes: np.ndarray) -> np.ndarray:
    """A⁻¹, or A⁺ if the points do not determine a motion that the reference does not use.

    Raises
    ------
    ModelError
        If the points do not determine a component of the reference (three points in a line).
    """
    inverse = np.linalg.pinv(A, rcond=1e-10, hermitian=True)
    open_ = np.abs(inverse @ A - np.eye(6)).reshape(-1, 2, 3, 6).max(axis=(2, 3)) > 1e-6
    for k in np.flatnonzero(open_.any(axis=1)):
        turn = np.kron(np.eye(2), axes[k])
        gap = np.abs(turn @ (inverse[k] @ A[k] - np.eye(6))).max(axis=1)
        if lost := [c for c in means[k].components if gap[c - 1] > 1e-6]:
            raise ModelError(
                f"RBE3 {means[k].id}: its {len(means[k].terms)} points do not determine components"
                f" {lost} of the reference; add points out of line, or rotations 456"
            )
    return inverse


def _moved(rows: Rows, moved: dict[int, Average]) -> Rows:
    """Solve the dependencies for other dofs (Nastran's UM set)."""
    plain = ~np.isin(rows.owner, list(moved))
    entry = plain[rows.row]
    number = np.cumsum(plain) - 1
    parts = [
        Rows(
            rows.dof[plain],
            rows.owner[plain],
            number[rows.row[entry]],
            rows.on[entry],
            rows.factor[entry],
        )
    ]
    return Rows.joined(parts + [_exchanged(rows, k, mean) for k, mean in moved.items()])


def _exchanged(rows: Rows, owner: int, mean: Average) -> Rows:
    """Solve [1, -G] u = 0 of one RBE3 for its UM dofs."""
    mine = np.flatnonzero(rows.owner == owner)
    entry = np.isin(rows.row, mine)
    all_dofs, at = np.unique(np.concatenate([rows.dof[mine], rows.on[entry]]), return_inverse=True)
    A = np.zeros((len(mine), len(all_dofs)))
    A[np.arange(len(mine)), at[: len(mine)]] = 1
    np.subtract.at(A, (rows.row[entry] - mine[0], at[len(mine) :]), rows.factor[entry])
    dof = np.array([6 * node + component - 1 for node, component in mean.moved])
    m = np.isin(all_dofs, dof)
    if len(dof) != len(mine) or m.sum() != len(dof):
        raise ModelError(
            f"RBE3 {mean.id}: UM names {len(dof)} dofs, {m.sum()} of them in the element; "
            f"the reference has {len(mine)} components"
        )
    if np.linalg.matrix_rank(A[:, m]) < len(dof):
        raise ModelError(f"RBE3 {mean.id} cannot be solved for its UM dofs")
    G = -np.linalg.solve(A[:, m], A[:, ~m])
    row, column = np.nonzero(G)
    return Rows(all_dofs[m], np.full(len(dof), owner), row, all_dofs[~m][column], G[row, column])
