"""Improving a layout by exchange: a sensor leaves, another joins, as long as it helps.

Fedorov (1972), Theory of Optimal Experiments; Mitchell (1974), Technometrics 16(2), 203-210.
"""

from collections.abc import Iterator

import numpy as np

from .deletion import deletion, faint
from .information import Candidates, Criterion, candidates, changed, positions_of, value
from .layout_rules import Rules, keyed

BETTER = 1e-9  # least improvement that counts, so that the search ends


def exchange(
    phi: np.ndarray | Candidates,
    layout: np.ndarray,
    *,
    criterion: Criterion = "D",
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
    max_swaps: int = 1000,
) -> np.ndarray:
    """A layout (increasing positions) that no exchange of one sensor improves.

    Each round makes the best of all swaps.

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
    kept = np.sort(positions_of(layout, len(c)))
    checked = (rules or Rules()).checked(len(c), len(kept))
    checked.obeyed(kept)
    for _ in range(max_swaps):
        swap = _best_swap(c, kept, checked, criterion)
        if swap is None:
            break
        kept = np.sort(np.r_[np.setdiff1d(kept, swap[0]), swap[1]])
    return kept


def best_layout(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    starts: int = 0,
    seed: int = 0,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Effective independence, then exchange: positions (increasing) of ``n_sensors``.

    With ``starts``, exchange begins as often from a random layout too, and the layout of the
    highest log det is the result.
    """
    c = candidates(phi, noise, prior)
    first = deletion(c, n_sensors, rules=rules).ranked
    checked, rng = (rules or Rules()).checked(len(c), n_sensors), np.random.default_rng(seed)
    drawn = (keyed(rng.random(len(c)), n_sensors, checked) for _ in range(starts))
    begun = [first, *(k for k in drawn if len(k) == n_sensors)]
    ended = [exchange(c, kept, rules=rules) for kept in begun]
    return max(ended, key=lambda kept: value("D", c.fisher(kept)))


Swap = tuple[np.ndarray, np.ndarray]  # who leaves, who joins


def _regular(c: Candidates, kept: np.ndarray) -> np.ndarray:
    """F of the kept, with a faint prior where it would be singular."""
    F = c.fisher(kept)
    return F if np.isfinite(value("D", F)) and len(kept) >= c.fewest else F + faint(c)


def _best_swap(c: Candidates, kept: np.ndarray, rules: Rules, criterion: Criterion) -> Swap | None:
    """The best swap of one sensor, if it is better than none."""
    F = _regular(c, kept)
    now, best, swap = value(criterion, F), BETTER, None
    for k, others, gains in _swaps(c, F, kept, rules, criterion):
        gain = gains - now
        if gain.max() > best + BETTER:
            j = int(np.argmax(gain >= gain.max() - BETTER))
            best, swap = float(gain[j]), (kept[[k]], others[[j]])
    return swap


def _swaps(
    c: Candidates, F: np.ndarray, kept: np.ndarray, rules: Rules, criterion: Criterion
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """(k, others, criterion of each after it joined) for every k-th sensor that may leave."""
    G = c.leaving(kept)
    mask = np.zeros(len(c), bool)
    mask[kept] = True
    together = criterion == "D" and c.noise is None and c.rows.shape[2] == 1
    every = value("D", F) + _log_ratio(F, G[:, :, 0], c.rows[:, :, 0]) if together else None
    for k in np.flatnonzero(~rules.fixed[kept]):
        others = np.flatnonzero(_joinable(rules, mask, kept[k]))
        if len(others) == 0:
            continue
        if every is not None:
            yield int(k), others, every[k, others]
        else:
            rest = np.delete(kept, k)
            yield int(k), others, _swapped(c, F, rest, others, G[:, k], criterion)


def _log_ratio(F: np.ndarray, leave: np.ndarray, join: np.ndarray) -> np.ndarray:
    """ln((1 - d_i)(1 + d_j) + d_ij²), d = G F⁻¹ Gᵀ, mean over draws (m, n).

    Fedorov (1972): log det F changes so where row i (d, m, p) leaves and row j (d, n, p) joins.
    """
    left = np.linalg.solve(F, leave.mT).mT
    d_i = (left * leave).sum(axis=-1)
    d_j = (np.linalg.solve(F, join.mT).mT * join).sum(axis=-1)
    ratio = (1 - d_i)[:, :, None] * (1 + d_j)[:, None] + (left @ join.mT) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(ratio > 0, np.log(ratio), -np.inf).mean(axis=0)


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
        return value("D", F) + _log_ratio(F, leaving, join[:, :, 0])[0]
    U = np.concatenate([np.broadcast_to(leaving[:, None], (d, m, k, p)), join], axis=2)
    return changed(criterion, F, U, np.r_[-np.ones(k), np.ones(k)])
