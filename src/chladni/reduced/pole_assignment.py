"""Pairing of model modes with test poles.

Without shapes both lists are in order of frequency, so an assignment is a monotone path. With
shapes any mode may be the partner of any pole. A pole or a mode may stay unpaired at a price.  The
model is a mixture. A pole is a mode of the structure, ln f = ln f_m + ε with ε ~ N(0, σ²). Or it is
spurious, and its ln f lies anywhere in the range.  Prices are -2 ln of
these probabilities.  The price of a missed mode depends on its visibility.
Needleman and Wunsch (1970), J. Mol. Biol. 48, 443-453 (the alignment).
"""

import numpy as np

SPURIOUS = 0.4  # share of a recording's poles that may come from the rig, the room or noise
FAINTEST = 0.02  # of the highest peak; weaker poles are taken as spurious
CERTAIN = 5.0  # largest odds from the height of a peak alone, for a mode or a spurious pole
SPURIOUS_LISTED = 0.05  # share of spurious poles where the user lists modes
RANGE = 3.0  # ln f over which a spurious pole may lie anywhere: 20 to 400 Hz
MISSED = 5.0  # -2 ln p of missing a mode as visible as the strongest
HARDLY = 0.3  # -2 ln p of missing a mode that is hardly visible
FORBIDDEN = 1e9  # price of a pair that cannot be
SEEN = 1.5  # decades of visibility over which the price falls from MISSED to HARDLY


def price_spurious(share: np.ndarray | float) -> np.ndarray:
    """Price of an unpaired pole, -2 ln(p/(1-p)) + 2 ln L - ln 2π, where a pair costs δ²/σ² + ln σ².

    >>> bool(price_spurious(0.05) > price_spurious(0.4) > 0)
    True
    """
    odds = np.asarray(share) / (1 - np.asarray(share))
    return np.asarray(-2 * np.log(odds) + 2 * np.log(RANGE) - np.log(2 * np.pi))


def share_spurious(strength: np.ndarray) -> np.ndarray:
    """Probability of each pole of a recording to be spurious, by its height over the highest (n,).

    Resonances of the rig or the room have low peaks, and the highest peaks are the structure's.
    The density of log heights is linear over the decades from ``FAINTEST`` to 1.  It falls to zero
    for spurious poles and rises from zero for modes.

    >>> low, high = share_spurious(np.array([0.03, 1.0]))
    >>> bool(low > SPURIOUS > high)
    True
    """
    u = np.clip(1 - np.log10(strength) / np.log10(FAINTEST), 0, 1)
    odds = np.clip((1 - u) / np.maximum(u, 1e-9), 1 / CERTAIN, CERTAIN) * SPURIOUS / (1 - SPURIOUS)
    return np.asarray(odds / (1 + odds))


def price_missed(visibility: np.ndarray) -> np.ndarray:
    """Price of unpaired modes, by visibility relative to the strongest (m,)."""
    share = np.clip(1 + np.log10(np.maximum(visibility, 1e-9)) / SEEN, 0, 1)
    return HARDLY + MISSED * share


def paired(
    test: np.ndarray, model: np.ndarray, sd: np.ndarray, alone: np.ndarray, missed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions (in test, in model) of the cheapest monotone pairing; price of unpaired modes.

    Σ_pairs (ln f_m/f_t)²/σ² + Σ (alone of unpaired poles) + Σ (missed of unpaired modes)

    Parameters
    ----------
    test, model : (n,), (m,)   increasing frequencies [Hz]
    sd : (n,)                  standard deviation of ln f of a pair
    alone, missed : (n,), (m,) prices

    >>> test, model = np.array([10.0, 30.0]), np.array([10.1, 20.0, 30.2])
    >>> paired(test, model, np.full(2, 0.01), np.full(2, 16.0), np.array([9.0, 1.0, 9.0]))
    (array([0, 1]), array([0, 2]), 1.0)
    """
    n, m = len(test), len(model)
    pair = (np.log(model[None, :] / test[:, None]) / sd[:, None]) ** 2
    skip = np.concatenate([[0.0], np.cumsum(missed)])
    cost = skip
    matched = np.zeros((n + 1, m + 1), bool)  # the last pole, if any, is paired with the last mode
    skipped = np.zeros((n + 1, m + 1), bool)  # the last mode is unpaired
    skipped[0, 1:] = True
    joined = np.full(m + 1, np.inf)
    for i in range(n):
        joined[1:] = cost[:-1] + pair[i]
        left = cost + alone[i]
        matched[i + 1] = joined < left
        ahead = np.minimum(left, joined) - skip
        least = np.minimum.accumulate(ahead)
        skipped[i + 1], cost = least < ahead, least + skip
    at_test, at_model = _backtrack(matched, skipped)
    unpaired = np.ones(m, bool)
    unpaired[at_model] = False
    return at_test, at_model, float(missed[unpaired].sum())


def assigned(
    cost: np.ndarray, alone: np.ndarray, missed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions of the cheapest pairing in any order; price of unpaired modes.

    Kuhn (1955), Naval Research Logistics Quarterly 2, 83-97.

    Parameters
    ----------
    cost : (n, m)              of each pair
    alone, missed : (n,), (m,) prices of what stays unpaired

    >>> assigned(np.array([[9.0, 1.0], [2.0, 50.0]]), np.full(2, 20.0), np.array([3.0, 3.0]))
    (array([0, 1]), array([1, 0]), 0.0)
    """
    from scipy.optimize import linear_sum_assignment

    unpaired = np.where(np.eye(len(alone), dtype=bool), alone, FORBIDDEN)
    test, at = linear_sum_assignment(np.hstack([cost - missed, unpaired]))
    kept = at < len(missed)
    test, model = test[kept], at[kept]
    return test, model, float(np.delete(missed, model).sum())  # never below 0


def _backtrack(matched: np.ndarray, skipped: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    n, m = np.array(matched.shape) - 1
    test, model = [], []
    while n > 0:
        if skipped[n, m]:
            m -= 1
            continue
        if matched[n, m]:
            test.append(n - 1)
            model.append(m - 1)
            m -= 1
        n -= 1
    return np.array(test[::-1], dtype=int), np.array(model[::-1], dtype=int)
