"""Fewer lines that say the same: away from its poles a response is smooth, and lines repeat it.

Lines are summed in bins narrower than their distance to any pole. The sum is of data minus a known
fit: the curvature of the response then bends no mean of a bin.
"""

from dataclasses import replace

import numpy as np

from .pole_fitting import PoleData, PoleFit, linear

BIN = 0.1  # of the distance to the nearest pole: widest bin
WORK = 2e10  # multiplications: some ten seconds


def condensed(data: PoleData, fit: PoleFit) -> PoleData:
    """The samples by bins of lines, with all they say of poles and residues near those of ``fit``.

    ȳ = Φ(s̄) x + Σ w² (y - Φ x) / Σ w² has the weight √Σ w².
    """
    begin = line_bins(data.s, fit.p)
    s, w = summed(data.s, data.w, begin)
    rest = data.w**2 * (data.y - linear(data.s, fit.p, data.q) @ fit.x)
    rest = np.add.reduceat(rest, begin) / np.where(w > 0, w, 1.0) ** 2
    return replace(data, s=s, y=linear(s, fit.p, data.q) @ fit.x + rest, w=w)


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
