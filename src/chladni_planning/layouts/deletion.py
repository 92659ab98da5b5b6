"""Layouts one sensor at a time: deletion (effective independence), addition, pivoted QR."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from chladni.errors import ShapeError

from .information import Candidates, Criterion, candidates, changed, combined, value, whitened
from .layout_rules import Rules, thinned

TIE = 1e-9  # values nearer than this are equal: mirrored places must not be decided by rounding
REFRESH = 48  # deletions after which rounding and the rows that left are swept out


@dataclass(frozen=True, eq=False)
class Deletion:
    """The course of a backward elimination.

    Attributes
    ----------
    ranked : (n_sensors,) int   kept candidates, the most informative first: the last of them is
                                the sensor to give up when one is needed elsewhere
    deleted : (n - n_sensors,)  the others in the order of deletion
    log_det : (n_steps + 1,)    log det F before and after each deletion
    """

    ranked: np.ndarray
    deleted: np.ndarray
    log_det: np.ndarray


def effective_independence(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Positions (increasing) of the ``n_sensors`` kept by Kammer's effective independence method.

    Deletes, one at a time, the candidate whose loss reduces det(ΦᵀΦ) least.

    Parameters
    ----------
    phi : (n_candidates, n_modes)
        Target mode shapes at the candidates (see :func:`candidates` for all accepted shapes).
    noise, prior : see :func:`candidates`
    rules : fixed, forbidden, near, regions

    References
    ----------
    Kammer (1991), J. Guidance, Control and Dynamics 14(2), 251-259.

    Examples
    --------
    >>> effective_independence(np.array([[1.0, 0.0], [0.9, 0.0], [0.0, 1.0]]), 2)
    array([0, 2])
    """
    return np.sort(deletion(phi, n_sensors, noise=noise, prior=prior, rules=rules).ranked)


def deletion(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
) -> Deletion:
    """Effective independence with its order of deletion; see :func:`effective_independence`.

    The kept candidates are ranked by further deletion down to the number of unknowns. The last
    ones, all indispensable, are ranked by the pivots of QR. Rules apply throughout.
    """
    c = candidates(phi, noise, prior)
    kept, rules = start(c, n_sensors, rules)
    order, log_det = _delete(c, kept, n_sensors, rules)
    left = kept.copy()
    left[order] = False
    deleted = np.r_[np.flatnonzero(~kept), order].astype(np.int64)
    return Deletion(_ranked(c, left), deleted, log_det)


def start(c: Candidates, n_sensors: int, rules: Rules | None) -> tuple[np.ndarray, Rules]:
    """Candidates (n,) bool from which deletion starts, and the rules as masks."""
    if not max(c.fewest, 1) <= n_sensors <= len(c):
        raise ShapeError(
            f"{n_sensors} sensors cannot distinguish {c.unknowns} modes among {len(c)} candidates"
        )
    checked = (rules or Rules()).checked(len(c), n_sensors)
    if checked.near is None:
        return ~checked.masks(len(c))[1], checked
    everywhere = np.arange(len(c))
    return thinned(checked, combined(_independence(whitened(c, everywhere))), n_sensors), checked


def first_min(values: np.ndarray) -> int:
    """Position of the least value; the first of those that are equal to within rounding."""
    return int(np.argmax(values <= values.min() + TIE))


def first_max(values: np.ndarray) -> int:
    """Position of the greatest value; the first of those that are equal to within rounding."""
    return int(np.argmax(values >= values.max() - TIE))


def updated(
    Q: np.ndarray, C: np.ndarray, E: np.ndarray, i: int, sign: int
) -> tuple[np.ndarray, np.ndarray]:
    """C and E after row i joins (+1) or leaves (-1) C⁻¹: C ∓ v vᵀ/(1 ± e), v = C q, e = qᵀv.

    Sherman and Morrison (1950), Ann. Math. Stat. 21, 124-127.

    Parameters
    ----------
    Q : (d, n, p)    rows
    C : (d, p, p)    inverse information
    E : (d, n)       q_jᵀ C q_j of every row
    """
    v = (C @ Q[:, i, :, None])[..., 0]
    scale = sign / np.maximum(1 + sign * E[:, i], 1e-15)
    h = (Q @ v[..., None])[..., 0]
    return (
        C - scale[:, None, None] * (v[:, :, None] * v[:, None]),
        E - scale[:, None] * h * h,
    )


def _independence(Q: np.ndarray) -> np.ndarray:
    """E (d, n) of whitened rows (d, n, k, p)."""
    if Q.shape[2] == 1:
        return np.einsum("dikp,dikp->di", Q, Q)
    return 1 - np.linalg.det(np.eye(Q.shape[2]) - Q @ Q.mT)


def _delete(
    c: Candidates, kept: np.ndarray, n_sensors: int, rules: Rules
) -> tuple[np.ndarray, np.ndarray]:
    """Order of deletion from the kept (a mask) down to ``n_sensors``, and log det along it."""
    free, kept, order = rules.free, kept.copy(), []
    log_det = [value("D", c.fisher(np.flatnonzero(kept)))]
    course = _Course(c, np.flatnonzero(kept))
    for left in range(int(kept.sum()), n_sensors, -1):
        E = combined(course.E)
        may = course.live if free else rules.deletable(kept, n_sensors)[course.at]
        if not may.any():
            raise ShapeError(f"the rules leave {left} sensors, but {n_sensors} were requested")
        i = first_min(np.where(may, E, np.inf))
        order.append(course.at[i])
        kept[order[-1]] = False
        log_det.append(log_det[-1] + float(np.log1p(-min(E[i], 1 - 1e-15))))
        course.delete(i)
    return np.array(order, dtype=np.int64), np.array(log_det)


class _Course:
    """Independence E (d, len(at)) of the candidates at hand along a deletion.

    Independent single readings use rank-one updates in whitened rows, which are recomputed from
    time to time.  The rows are orthonormal at the start, so F stays near I.  All other cases are
    computed each time.
    """

    def __init__(self, c: Candidates, at: np.ndarray) -> None:
        self.c, self.at, self.live = c, at, np.ones(len(at), bool)
        self.simple = c.noise is None and c.rows.shape[2] == 1
        Q = whitened(c, at)
        self.E, self.Q = _independence(Q), Q[:, :, 0]
        self.prior = np.eye(c.unknowns) - self.Q.mT @ self.Q if c.prior.any() else 0.0
        self.C, self.age = np.broadcast_to(np.eye(c.unknowns), (len(Q), *c.prior.shape)), 0

    def delete(self, i: int) -> None:
        """Delete candidate i of the remaining ones."""
        self.live[i], self.age = False, self.age + 1
        if self.simple and self.age < REFRESH and self.E[:, i].max() < 0.99:
            self.C, self.E = updated(self.Q, self.C, self.E, i, -1)
            return
        self.at = self.at[self.live]
        if not self.simple:
            self.E = _independence(whitened(self.c, self.at))
        else:
            self.Q = self.Q[:, self.live]
            self.C = np.linalg.inv(self.prior + self.Q.mT @ self.Q)
            self.E, self.age = np.einsum("dip,dip->di", self.Q @ self.C, self.Q), 0
        self.live = np.ones(len(self.at), bool)


def _ranked(c: Candidates, left: np.ndarray) -> np.ndarray:
    """The layout with the most informative first, by deletion down to indispensable sensors."""
    free = Rules().checked(len(c), 0)
    order, _ = _delete(c, left, min(max(c.fewest, 1), int(left.sum())), free)
    last = left.copy()
    last[order] = False
    return np.r_[qr_ranking(c.rows[0][last], np.flatnonzero(last)), order[::-1]].astype(np.int64)


def qr_ranking(phi: np.ndarray, positions: np.ndarray | None = None) -> np.ndarray:
    """Candidates in the order of the pivots of QR of Φᵀ: each the farthest from those before it.

    Manohar et al. (2018), IEEE Control Systems 38(3), 63-86. Beyond the number of modes the order
    carries no more information than the remaining norms.
    """
    rows = phi.reshape(len(phi), -1, phi.shape[-1])
    if rows.shape[1] > 1:
        order = np.argsort(-np.linalg.norm(rows, axis=(1, 2)), kind="stable")
    else:
        order = qr(rows[:, 0].T, mode="r", pivoting=True)[1]
    return order if positions is None else positions[order]


def greedy(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    criterion: Criterion = "D",
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Forward selection of the most informative candidate: positions in the order chosen.

    While the information is singular, a faint prior and the D criterion decide, because A and E do
    not distinguish singular layouts. The choice is then that of pivoted QR with modes scaled to
    equal energy.
    """
    c = candidates(phi, noise, prior)
    kept, checked = start(c, n_sensors, rules)
    found = _add(c, np.ones(len(c), bool), n_sensors, checked, criterion)
    if found is None:  # ran into a corner: choose among places that all fit together
        found = _add(c, kept, n_sensors, checked, criterion)
    if found is None:
        raise ShapeError(f"{n_sensors} sensors were requested, but the rules have no room for them")
    return found


def _add(
    c: Candidates, among: np.ndarray, n_sensors: int, rules: Rules, criterion: Criterion
) -> np.ndarray | None:
    """Forward selection among some candidates; None where the rules leave no next one."""
    kept, order = np.zeros(len(c), bool), np.zeros(0, dtype=np.int64)
    ridge = faint(c)
    while len(order) < n_sensors:
        others = np.flatnonzero(rules.addable(kept, n_sensors) & among)
        if len(others) == 0:
            return None
        by = criterion if len(order) >= c.fewest else "D"
        U = c.joining(order, others)
        score = changed(by, c.fisher(order) + ridge, U, np.ones(U.shape[2]))
        order = np.r_[order, others[first_max(score)]]
        kept[order[-1]] = True
    return order


def faint(c: Candidates) -> np.ndarray:
    """A prior (p, p) so weak that it only breaks singularity: 1e-8 of the mean information."""
    if c.informed:
        return np.zeros((c.unknowns, c.unknowns))
    size = np.einsum("dikp,dikp->p", c.rows, c.rows) / len(c.rows) / len(c)
    return np.diag(1e-8 * np.maximum(size, 1e-12 * size.max()))
