"""Improving a layout by exchange: one or two sensors leave, as many join, as long as it helps.

Fedorov (1972), Theory of Optimal Experiments; Mitchell (1974), Technometrics 16(2), 203-210.
"""

from itertools import combinations

import numpy as np

from chladni.errors import ShapeError

from .deletion import deletion, faint
from .information import Candidates, Criterion, candidates, changed, positions_of, value
from .layout_rules import Rules

BETTER = 1e-9  # least improvement that counts, so that the search ends


def exchange(
    phi: np.ndarray | Candidates,
    layout: np.ndarray,
    *,
    criterion: Criterion = "D",
    pairs: bool = False,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
    max_swaps: int = 1000,
) -> np.ndarray:
    """A layout (increasing positions) that no single exchange improves; with ``pairs`` no double.

    Each round makes the best of all swaps. Double exchange is for the D criterion and one reading a
    candidate.  It starts where single exchange stops and skips every pair that cannot win by its
    bound det ≤ Π (1 + E_j), so it is exact.

    Parameters
    ----------
    phi, noise, prior : see :func:`candidates`
    layout : positions or mask of the sensors to start from
    rules : fixed, forbidden, near, regions

    Examples
    --------
    >>> exchange(np.array([[1.0, 0.0], [0.9, 0.0], [0.0, 1.0]]), [0, 1])
    array([0, 2])
    """
    c = candidates(phi, noise, prior)
    if pairs and (criterion != "D" or c.rows.shape[2] > 1):
        raise ShapeError("double exchange needs the D criterion and one reading a candidate")
    kept = np.sort(positions_of(layout, len(c)))
    checked = (rules or Rules()).checked(len(c), len(kept))
    checked.obeyed(kept)
    for _ in range(max_swaps):
        swap = _best_single(c, kept, checked, criterion)
        if swap is None and pairs:
            swap = _best_double(c, kept, checked)
        if swap is None:
            break
        kept = np.sort(np.r_[np.setdiff1d(kept, swap[0]), swap[1]])
    return kept


def best_layout(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    pairs: bool = False,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Effective independence, then exchange: positions (increasing) of ``n_sensors``."""
    c = candidates(phi, noise, prior)
    first = deletion(c, n_sensors, rules=rules).ranked
    return exchange(c, first, pairs=pairs, rules=rules)


Swap = tuple[np.ndarray, np.ndarray]  # who leaves, who joins


def _regular(c: Candidates, kept: np.ndarray) -> np.ndarray:
    """F of the kept, with a faint prior where it would be singular."""
    F = c.fisher(kept)
    return F if np.isfinite(value("D", F)) and len(kept) >= c.fewest else F + faint(c)


def _best_single(
    c: Candidates, kept: np.ndarray, rules: Rules, criterion: Criterion
) -> Swap | None:
    """The best swap of one sensor, if it is better than none."""
    F = _regular(c, kept)
    now, best, swap = value(criterion, F), BETTER, None
    G = c.leaving(kept)
    mask = np.zeros(len(c), bool)
    mask[kept] = True
    for k in np.flatnonzero(~rules.fixed[kept]):
        others = np.flatnonzero(_joinable(rules, mask, kept[k]))
        if len(others) == 0:
            continue
        gain = _swapped(c, F, np.delete(kept, k), others, G[:, k], criterion) - now
        if gain.max() > best + BETTER:
            j = int(np.argmax(gain >= gain.max() - BETTER))
            best, swap = float(gain[j]), (kept[[k]], others[[j]])
    return swap


def _joinable(rules: Rules, mask: np.ndarray, i: int) -> np.ndarray:
    """Mask of candidates that may take the place of sensor i (n,) bool."""
    rest = mask.copy()
    rest[i] = False
    may = rules.addable(rest, int(mask.sum()))
    may[i] = False
    return may


def _swapped(
    c: Candidates,
    F: np.ndarray,
    rest: np.ndarray,
    others: np.ndarray,
    leaving: np.ndarray,
    criterion: Criterion,
) -> np.ndarray:
    """Criterion (n_others,) after one sensor left and each of the others joined in turn."""
    join = c.joining(rest, others)
    d, m, k, p = join.shape
    if criterion == "D" and k == 1:
        C = np.linalg.inv(F)
        Cg = C @ leaving.mT  # (d, p, 1)
        d_i = (leaving @ Cg)[:, 0]  # (d, 1)
        d_ij, d_j = (
            (join[:, :, 0] @ Cg)[..., 0],
            np.einsum("dmkp,dmkp->dm", join @ C[:, None], join),
        )
        ratio = (1 - d_i) * (1 + d_j) + d_ij**2  # Fedorov's determinant ratio
        with np.errstate(divide="ignore", invalid="ignore"):
            log_ratio = np.where(ratio > 0, np.log(ratio), -np.inf).mean(axis=0)
        return value("D", F) + log_ratio
    U = np.concatenate([np.broadcast_to(leaving[:, None], (d, m, k, p)), join], axis=2)
    return changed(criterion, F, U, np.r_[-np.ones(k), np.ones(k)])


def _best_double(c: Candidates, kept: np.ndarray, rules: Rules) -> Swap | None:
    """The best swap of two sensors, if it is better than none."""
    now, best, swap = value("D", _regular(c, kept)), BETTER, None
    for pair in combinations(range(len(kept)), 2):
        out, rest = kept[list(pair)], np.delete(kept, pair)
        if rules.fixed[out].any():
            continue
        found = _best_pair(c, rest, rules, out, now + best)
        if found is not None:
            best, swap = found[0] - now, (out, found[1])
    return swap


def _best_pair(
    c: Candidates, rest: np.ndarray, rules: Rules, out: np.ndarray, to_beat: float
) -> tuple[float, np.ndarray] | None:
    """The best two candidates to complete a layout, if they beat a value of log det."""
    others = _pair_candidates(rules, rest, out, len(c))
    F = _regular(c, rest)
    C, base = np.linalg.inv(F), value("D", F)
    R, gamma = _given(c, rest, others)
    alone = np.log1p(np.einsum("dip,dpq,diq->di", R, C, R, optimize=True) / np.diag(gamma))
    bound = alone.mean(axis=0)
    if c.noise is None:  # joint gain ≤ sum of single gains; correlated noise knows no such bound
        good = bound + bound.max(initial=-np.inf) + base > to_beat
        others, R, gamma = others[good], R[:, good], gamma[np.ix_(good, good)]
    if len(others) < 2:
        return None
    E = R @ C @ R.mT
    gain = _pair_gain(gamma, E)
    gain[~rules.pairs(rest, others)] = -np.inf
    a, b = divmod(int(gain.argmax()), len(others))
    if base + gain[a, b] <= to_beat + BETTER:
        return None
    exact = value("D", c.fisher(np.sort(np.r_[rest, others[[a, b]]])))
    return (exact, others[[a, b]]) if exact > to_beat + BETTER else None


def _pair_candidates(rules: Rules, rest: np.ndarray, out: np.ndarray, n: int) -> np.ndarray:
    """Candidates that may be one of two that join the rest."""
    may = ~rules.forbidden
    may[rest] = may[out] = False
    if rules.near is not None:
        may &= ~rules.near[rest].any(axis=0)
    return np.flatnonzero(may)


def _given(c: Candidates, rest: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Readings of the others (d, m, p) and their noise (m, m), given the rest."""
    if c.noise is None:
        return c.rows[:, others, 0], np.eye(len(others))
    return c.innovations(rest, others)


def _pair_gain(gamma: np.ndarray, E: np.ndarray) -> np.ndarray:
    """log det(Γ_JJ + E_JJ) - log det Γ_JJ of every pair J, mean over draws (m, m)."""

    def det(A: np.ndarray) -> np.ndarray:
        diagonal = np.diagonal(A, axis1=-2, axis2=-1)
        return diagonal[..., :, None] * diagonal[..., None, :] - A**2

    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.log(det(gamma + E)) - np.log(det(gamma))
    gain[:, np.arange(len(gamma)), np.arange(len(gamma))] = -np.inf
    return gain.mean(axis=0)
