"""Sensors that tell explanations apart, as candidates of a layout.

Two explanations predict the data y of a sensor as N(μ_i, I + F_i F_iᵀ).  Both are one model
y = μ_1 + a (μ_2 - μ_1) + F u + noise.  There a is 0 or 1, and F is the mean of both in variance.
A layout with u unknown reduces Var a by 1 + d², where d is the distance of the explanations in
units of all that is not known.  The objective is ln(1 + d²), that of one parameter of interest
(Atkinson and Cox 1974, J. R. Stat. Soc. B 36, 321-348): ``S`` of :func:`.information.value`.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from chladni.errors import ShapeError
from chladni.inference.expected_information import SETTLED
from chladni.search.next_measurement import ODDS, Outlook, with_common_candidates

from .deletion import greedy
from .exchange import exchange
from .information import Candidates, candidates, value
from .layout_rules import Rules, too_near


def separating(every: Outlook | Sequence[Outlook], odds: float = ODDS) -> Candidates:
    """The sensors of outlooks as candidates, for the criterion ``S``; a draw for each open pair.

    Parameters
    ----------
    every : of one diagnosis, or of several articles before any test
    odds : of the best explanation, from which another one is out

    Raises
    ------
    ShapeError
        If no two explanations are open.
    """
    outlooks = with_common_candidates([every] if isinstance(every, Outlook) else every)
    sensors = [o.without(("drive", "mass", "band", "weighing")) for o in outlooks]
    pairs = [
        (o, pair)
        for o in sensors
        for p in [o.rivals.probability]
        for pair in combinations(np.flatnonzero(p * odds >= p.max()).tolist(), 2)
    ]
    if not pairs:
        raise ShapeError("nothing is tied in this outlook; sensors separate two explanations")
    rows = [[_rows(o, k, *pair) for k in range(len(o.seen))] for o, pair in pairs]
    shape = np.max([r.shape for each in rows for r in each], axis=0)
    padded = np.array([[_padded(r, shape) for r in each] for each in rows])
    return candidates(padded, prior=np.ones(int(shape[1])))


def separating_layout(
    every: Sequence[Outlook], most: int, odds: float = ODDS, spacing: float = 0.0
) -> tuple[list[int], float]:
    """Positions of the fewest candidates that tell nearly all there is to tell, and their d.

    Parameters
    ----------
    every : with the same candidates, all of them sensors
    most : number of sensors
    spacing : least distance between two [m]
    """
    plain = separating(every, odds)
    c = candidates(plain.rows / np.sqrt(every[0].costs)[:, None, None], prior=plain.prior)
    due = (1 - SETTLED) * sum(o.rivals.entropy for o in every)
    rules = Rules(near=too_near(np.array([s.point_m for s in every[0].candidates]), spacing))
    for n in range(1, min(most, len(c)) + 1):
        begun = greedy(c, n, criterion="S", rules=rules)
        kept = exchange(c, begun, criterion="S", rules=rules).tolist()
        if sum(o.information(kept) for o in every) >= due:
            break
    return kept, float(np.sqrt(np.expm1(value("S", plain.fisher(np.array(kept))))))


def _rows(known: Outlook, k: int, i: int, j: int) -> np.ndarray:
    """Slopes of the data of a candidate by a and by the unknowns of both (n, 1 + k_i + k_j)."""
    seen = known.seen[k]
    half = [seen.factors[m] / np.sqrt(2) for m in (i, j)]
    return np.column_stack([seen.mean[j] - seen.mean[i], *half])


def _padded(rows: np.ndarray, shape: np.ndarray) -> np.ndarray:
    out = np.zeros(shape)
    out[: rows.shape[0], : rows.shape[1]] = rows
    return out
