"""Pairing of the modes of the model with the modes of the test."""

from dataclasses import dataclass

import numpy as np

from ..arrays import OneScreen
from ..errors import ShapeError

LEAST_CHANNELS = 3  # on fewer all shapes look similar, so that modes are paired by frequency


@dataclass(frozen=True, eq=False, repr=False)
class ModePairs(OneScreen):
    """Positions of paired modes, in order of the test's frequency, and of modes without partner."""

    # model, test: (k,) int
    model: np.ndarray
    test: np.ndarray
    mac: np.ndarray  # (k,) of each pair; nan where no shapes were given
    # alone_model, alone_test: int arrays
    alone_model: np.ndarray
    alone_test: np.ndarray

    def __len__(self) -> int:
        return len(self.model)


def pair(
    f_model: np.ndarray,
    f_test: np.ndarray,
    mac: np.ndarray | None = None,
    visibility: np.ndarray | None = None,
    width: float = 0.05,
    least_mac: float = 0.5,
    farthest: float = 0.5,
) -> ModePairs:
    """One-to-one pairing of modes.

    With shapes: the assignment of largest Σ MAC - (Δ ln f / 4 width)² (Hungarian method, Kuhn
    1955). Pairs below ``least_mac`` are separated. The least MAC increases with the distance in
    frequency (0.95 at ``farthest``). Without shapes: the cheapest *monotone* path with free skips
    (Needleman and Wunsch 1970). Modes that a test could not see then do not shift the rest.

    Parameters
    ----------
    f_model, f_test : (m,), (n,)  Hz, in any order
    mac : (m, n)                  optional
    visibility : (m,)             strength of a model mode at sensors and exciters, 1 = strongest;
                                  an invisible mode is cheap to leave alone
    width : typical Δ ln f between model and test
    farthest : |Δ ln f| beyond which nothing is paired

    >>> pair(np.array([10.0, 20.0, 30.0]), np.array([10.2, 30.5])).model
    array([0, 2])
    """
    if mac is not None and mac.shape != (len(f_model), len(f_test)):
        raise ShapeError(f"MAC is {mac.shape}, frequencies say {(len(f_model), len(f_test))}")
    by_model, by_test = np.argsort(f_model, kind="stable"), np.argsort(f_test, kind="stable")
    x = np.log(np.asarray(f_test, float)[by_test])
    gap = x - np.log(np.asarray(f_model, float)[by_model])[:, None]
    if mac is None:
        seen = np.ones(len(f_model)) if visibility is None else np.asarray(visibility)
        m, n = _aligned(gap, width, seen[by_model], farthest)
    else:
        m, n = _assigned(gap, mac[np.ix_(by_model, by_test)], width, least_mac, farthest)
    m, n = by_model[m], by_test[n]
    return ModePairs(
        model=m,
        test=n,
        mac=np.full(len(m), np.nan) if mac is None else mac[m, n],
        alone_model=np.setdiff1d(np.arange(len(f_model)), m),
        alone_test=np.setdiff1d(np.arange(len(f_test)), n),
    )


def _assigned(
    gap: np.ndarray, mac: np.ndarray, width: float, least: float, farthest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Hungarian assignment; pairs of low MAC or large distance are separated."""
    from scipy.optimize import linear_sum_assignment

    due = least + max(0.95 - least, 0.0) * np.abs(gap) / farthest
    allowed = (mac >= due) & (np.abs(gap) <= farthest)
    score = np.where(allowed, 1 + mac - np.minimum((gap / (4 * width)) ** 2, 0.9), 0.0)
    m, n = linear_sum_assignment(score, maximize=True)
    kept = allowed[m, n]
    m, n = m[kept], n[kept]
    order = np.argsort(n)
    return m[order], n[order]


_ALONE_TEST = 9.0  # a test mode the model does not have: three widths twice over
_ALONE_MODEL = 2.0  # a model mode the test did not see: common


def _aligned(
    gap: np.ndarray, width: float, visibility: np.ndarray, farthest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cheapest monotone path; both sides in order of frequency.

    A common factor between model and test (a wrong modulus) costs little. The path is computed for
    several factors, and the cheapest is used.
    """
    if gap.size == 0:
        return np.zeros(0, int), np.zeros(0, int)
    shifts = width * np.arange(-4, 5)
    paths = [_path(gap - shift, width, visibility, farthest) for shift in shifts]
    costs = [
        cost + 0.5 * (shift / (2 * width)) ** 2
        for (cost, *_), shift in zip(paths, shifts, strict=True)
    ]
    _, m, n = paths[int(np.argmin(costs))]
    return m, n


def _path(
    gap: np.ndarray, width: float, visibility: np.ndarray, farthest: float
) -> tuple[float, np.ndarray, np.ndarray]:
    """(cost, model positions, test positions) of the cheapest monotone path."""
    n_m, n_t = gap.shape
    strength = np.clip(1 + np.log10(np.maximum(visibility, 1e-6)) / 2, 0.05, 1.0)
    top = gap[:, -1] < -3 * width  # above the last test mode: the band ends there
    skip_m = np.where(top, 0.0, _ALONE_MODEL * strength)
    match = np.where(
        np.abs(gap) <= farthest, (gap / width) ** 2 + 0.5 * (1 - strength[:, None]), np.inf
    )
    cost = np.full((n_m + 1, n_t + 1), np.inf)
    came = np.zeros((n_m + 1, n_t + 1), int)
    cost[0] = _ALONE_TEST * np.arange(n_t + 1)
    came[0] = 2
    for i in range(1, n_m + 1):
        cost[i, 0], came[i, 0] = cost[i - 1, 0] + skip_m[i - 1], 1
        for j in range(1, n_t + 1):
            options = (
                cost[i - 1, j - 1] + match[i - 1, j - 1],
                cost[i - 1, j] + skip_m[i - 1],
                cost[i, j - 1] + _ALONE_TEST,
            )
            came[i, j] = int(np.argmin(options))
            cost[i, j] = options[came[i, j]]
    m, n = [], []
    i, j = n_m, n_t
    while i or j:
        step = came[i, j]
        if step == 0:
            m.append(i - 1)
            n.append(j - 1)
        i, j = i - (step != 2), j - (step != 1)
    return float(cost[-1, -1]), np.array(m[::-1], int), np.array(n[::-1], int)
