"""Which model mode belongs to which test pole, where no shapes were measured.

Both lists are in order of frequency, so a pairing is a monotone path; a test pole or a model mode
may be left alone at a price.  A model mode that the sensor cannot see is cheap to leave alone.
Needleman and Wunsch (1970), J. Mol. Biol. 48, 443-453 (the alignment).
"""

import numpy as np

WIDTH = 0.05  # ln f; a pair that far apart costs 1
TEST_ALONE = 9.0


def paired(
    test: np.ndarray, model: np.ndarray, visibility: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (in test, in model) of the cheapest monotone pairing.

    Parameters
    ----------
    test, model : (n,), (m,)   increasing frequencies [Hz]
    visibility : (m,)          strength of each model mode at the sensors, 1 = strongest

    >>> paired(np.array([10.0, 30.0]), np.array([10.1, 20.0, 30.2]), np.array([1, 0.01, 1]))
    (array([0, 1]), array([0, 2]))
    """
    n, m = len(test), len(model)
    gap = np.log(model[None, :] / test[:, None]) / WIDTH
    pair = gap**2 + 0.5 * np.log(1 + 0.02 / np.maximum(visibility, 1e-6))[None, :]
    alone = 4.0 * np.clip(1 + np.log10(np.maximum(visibility, 1e-6)) / 2, 0.05, 1)
    alone = np.where(model > test[-1] * (1 + WIDTH), 0.0, alone) if n else alone
    cost = np.full((n + 1, m + 1), np.inf)
    step = np.zeros((n + 1, m + 1), dtype=int)
    cost[0] = np.concatenate([[0.0], np.cumsum(alone)])
    step[0] = 2
    for i in range(1, n + 1):
        cost[i, 0], step[i, 0] = i * TEST_ALONE, 1
        for j in range(1, m + 1):
            options = (
                cost[i - 1, j - 1] + min(pair[i - 1, j - 1], 3 * TEST_ALONE),
                cost[i - 1, j] + TEST_ALONE,
                cost[i, j - 1] + alone[j - 1],
            )
            step[i, j] = int(np.argmin(options))
            cost[i, j] = options[step[i, j]]
    return _backtrack(step, n, m)


def _backtrack(step: np.ndarray, n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    test, model = [], []
    while n > 0:
        if step[n, m] == 0:
            test.append(n - 1)
            model.append(m - 1)
            n, m = n - 1, m - 1
        elif step[n, m] == 1:
            n -= 1
        else:
            m -= 1
    return np.array(test[::-1], dtype=int), np.array(model[::-1], dtype=int)
