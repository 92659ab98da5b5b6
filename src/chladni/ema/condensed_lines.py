"""Fewer lines that say the same: away from its poles a response is smooth, and lines repeat it.

Where poles are known, lines are summed in bins narrower than their distance to any pole. The sum
is of data minus a known fit: the curvature of the response then bends no mean of a bin. Where none
is known, neighbours are summed as long as no channel bends over them by more than its noise.
"""

from dataclasses import replace

import numpy as np

from .pole_fitting import PoleData, PoleFit, linear

GROUP = 4  # neighbours that must lie on a straight course before two of them are summed
DOUBT = 2.0  # standard deviations of χ² that their scatter may exceed noise
WHITE = 2.0  # times its level, in sums of two: noise keeps it, a course grows by seven or more
GAIN = 0.95  # of the lines that a round must leave at most, or it was the last
BIN = 0.1  # of the distance to the nearest pole: widest bin
WORK = 1e9  # multiplications: half a second


def condensed(data: PoleData, fit: PoleFit) -> PoleData:
    """The samples by bins of lines, with all they say of poles and residues near those of ``fit``.

    ȳ = Φ(s̄) x + Σ w² (y - Φ x) / Σ w² has the weight √Σ w².
    """
    begin = line_bins(data.s, fit.p)
    s, w = summed(data.s, data.w, begin)
    rest = data.w**2 * (data.y - linear(data.s, fit.p, data.q) @ fit.x)
    rest = np.add.reduceat(rest, begin) / np.where(w > 0, w, 1.0) ** 2
    return replace(data, s=s, y=linear(s, fit.p, data.q) @ fit.x + rest, w=w)


def oversampled(data: PoleData) -> PoleData:
    """The samples by bins of lines over which every channel is straight within its noise.

    A straight course has its mean at the mean of s. Two neighbours are summed if they lie straight
    with the two next to them, over twice the length of the sum: curvature a leaves (2 a)² in the
    scatter of four and a²/8 in the χ² of a sum. A peak too weak or too narrow for four of its lines
    shows as soon as bins are as wide as it. Poles of the sums are off by some of their standard
    deviations; :func:`condensed` about them is not.
    """
    noise = None
    while len(data.s) >= GROUP:
        scatter, freedom = _scatter(data)
        if noise is None:
            noise = _noise_of_lines(data)
            pairs = _averaged(data, np.arange(0, len(data.s), 2))
            if _noise_of_lines(pairs) > WHITE * noise:
                break  # it is no noise but the course of lines that are too few
        straight = scatter <= noise * (freedom + DOUBT * np.sqrt(2 * freedom))
        first = np.ones(len(data.s), bool)
        first[: straight.size * GROUP].reshape(-1, GROUP)[:, 1::2] = ~straight[:, None]
        if first.sum() > GAIN * len(first):
            break
        data = _averaged(data, np.flatnonzero(first))
    return data


def _scatter(data: PoleData) -> tuple[np.ndarray, np.ndarray]:
    """χ² of groups of lines about the straight course of each channel, its degrees of freedom.

    It is infinite where a sample of a channel counts and another does not.
    """
    n = len(data.s) // GROUP * GROUP
    x = np.abs(data.s[:n]).reshape(-1, GROUP, 1)
    y, w = (z[:n].reshape(len(x), GROUP, -1) for z in (data.y, data.w))
    used, square = w.min(axis=1) > 0, w**2
    total = np.maximum(square.sum(axis=1, keepdims=True), 1e-300)
    x = x - (square * x).sum(axis=1, keepdims=True) / total
    y = y - (square * y).sum(axis=1, keepdims=True) / total
    slope = (square * x * y).sum(axis=1) / np.maximum((square * x**2).sum(axis=1), 1e-300)
    scatter = (square * np.abs(y - slope[:, None] * x) ** 2).sum(axis=(1, 2))
    torn = (used != (w.max(axis=1) > 0)).any(axis=1)
    return np.where(torn, np.inf, scatter), 2 * (GROUP - 2) * used.sum(axis=1)


def _noise_of_lines(data: PoleData) -> float:
    """χ² of what is left of four neighbours beyond a parabola, over its mean for the noise stated.

    Half of all groups lie below. A course that lines resolve has hardly a cubic part.
    """
    n = len(data.s) // GROUP * GROUP
    y, w = (z[:n].reshape(n // GROUP, GROUP, -1) for z in (data.y, data.w))
    used = w.min(axis=1) > 0
    cubic = np.array([1.0, -3.0, 3.0, -1.0])[:, None]
    variance = ((cubic / np.where(w > 0, w, 1.0)) ** 2).sum(axis=1)
    power = np.where(used, np.abs((cubic * y).sum(axis=1)) ** 2 / variance, 0.0)
    return float(np.median(power.sum(axis=1) / np.maximum(2 * used.sum(axis=1), 1)))


def _averaged(data: PoleData, begin: np.ndarray) -> PoleData:
    """Means of bins at their mean s, all channels with the common weight of the lines."""
    share = data.common**2
    count = np.diff([*begin, len(share)])
    share = share / np.repeat(np.add.reduceat(share, begin), count)
    used = data.w > 0
    v = np.where(used, share[:, None] / np.where(used, data.w, 1.0), 0.0) ** 2
    v = np.add.reduceat(v, begin)
    s, y = (np.add.reduceat(z, begin) for z in (share * data.s, share[:, None] * data.y))
    return replace(data, s=s, y=y, w=np.where(v > 0, 1 / np.sqrt(np.where(v > 0, v, 1.0)), 0.0))


def affordable(s: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lines (n,) and weights (n, n_c) for products of all columns: bins where ``WORK`` is short."""
    cost = 2 * w.size * (4 * len(p) + 2) ** 2
    return (s, w) if cost < WORK else summed(s, w, line_bins(s, p))


def summed(s: np.ndarray, w: np.ndarray, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean s (n,) and weight √Σ w² (n, n_c) of the bins that begin at these lines."""
    count = np.diff([*begin, len(s)])
    return np.add.reduceat(s, begin) / count, np.sqrt(np.add.reduceat(w**2, begin))


def line_bins(s: np.ndarray, p: np.ndarray) -> np.ndarray:
    """First line of every bin, none wider than ``BIN`` of its distance to a pole (n,).

    The ends of the band count as poles: there poles may be sought that are not among ``p``.
    """
    zeta = float(np.median(-p.real / np.abs(p))) if len(p) else 0.01
    ends = np.abs(s[[0, -1]]) * (-zeta + 1j)
    near = np.abs(s[:, None] - np.concatenate([p, ends])).min(axis=1)
    after = np.searchsorted(np.abs(s), np.abs(s) + BIN * near)
    begin, k = [0], 0
    while (k := max(k + 1, int(after[k]))) < len(s):
        begin.append(k)
    return np.array(begin)
