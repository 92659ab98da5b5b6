"""Which model mode belongs to which test pole, where no shapes were measured.

Both lists are in order of frequency, so a pairing is a monotone path; a test pole or a model mode
may be left alone at a price.  The prices are -2 ln of probabilities: that a resonance of the test
is none of the structure's, that a mode the sensors see well was missed.
Needleman and Wunsch (1970), J. Mol. Biol. 48, 443-453 (the alignment).
"""

import numpy as np

STRANGER = 20.0  # -2 ln p of a strong pole that belongs to the rig, the room, the noise
FAINT = 6.0  # the same of one that hardly stands out
STRONG = -0.5  # log10 of the relative peak height from which a pole counts as strong
MISSED = 12.0  # -2 ln p of overlooking a mode that shows as strongly as the strongest
SEEN = 1.5  # decades of visibility over which that price falls to one


def price_alone(strength: np.ndarray) -> np.ndarray:
    """Price of leaving test poles alone, by peak height relative to the highest (n,)."""
    share = np.clip(1 - STRONG + np.log10(np.maximum(strength, 1e-9)), 0, 1)
    return FAINT + (STRANGER - FAINT) * share


def price_missed(visibility: np.ndarray) -> np.ndarray:
    """Price of leaving model modes alone, by visibility relative to the strongest (m,)."""
    share = np.clip(1 + np.log10(np.maximum(visibility, 1e-9)) / SEEN, 0, 1)
    return 1 + (MISSED - 1) * share


def paired(
    test: np.ndarray, model: np.ndarray, sd: np.ndarray, alone: np.ndarray, missed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions (in test, in model) of the cheapest monotone pairing, and the modes' share of it.

    Σ_pairs (ln f_m/f_t)²/σ² + Σ (alone of lonely poles) + Σ (missed of lonely modes)

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
    cost = np.full((n + 1, m + 1), np.inf)
    step = np.zeros((n + 1, m + 1), dtype=int)
    cost[0], step[0] = np.concatenate([[0.0], np.cumsum(missed)]), 2
    for i in range(1, n + 1):
        cost[i, 0], step[i, 0] = cost[i - 1, 0] + alone[i - 1], 1
        for j in range(1, m + 1):
            options = (
                cost[i - 1, j - 1] + pair[i - 1, j - 1],
                cost[i - 1, j] + alone[i - 1],
                cost[i, j - 1] + missed[j - 1],
            )
            step[i, j] = min(range(3), key=options.__getitem__)
            cost[i, j] = options[step[i, j]]
    at_test, at_model = _backtrack(step, n, m)
    lonely = np.ones(m, bool)
    lonely[at_model] = False
    return at_test, at_model, float(missed[lonely].sum())


def _backtrack(step: np.ndarray, n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    test, model = [], []
    while n > 0:
        if step[n, m] == 0:
            test.append(n - 1)
            model.append(m - 1)
        n, m = n - (step[n, m] != 2), m - (step[n, m] != 1)
    return np.array(test[::-1], dtype=int), np.array(model[::-1], dtype=int)
