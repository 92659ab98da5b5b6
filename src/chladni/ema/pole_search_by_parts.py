"""Poles of recordings of hundreds of channels or many thousand lines: band by band.

A pole is known from the lines about it, so a band of some hundred lines holds few unknowns; in it
thirty combinations of whitened channels carry nearly all that a hundred do (Juang and Suzuki 1988,
ASME J. Vib. Acoust. 110, 88-95: compression by principal components). They choose the poles; every
channel then polishes them with its own noise. Residues of all poles are solved for at once.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from .pole_fitting import PoleData, polish, solve, stacked
from .pole_search import ROUNDING, Solution, chi_of, own_spread, selected, with_noise_left
from .pole_selection import Rule, Sweep, extended, uncertainty

CHANNELS, LINES = 48, 3000  # up to here all are fitted at once
PER_BAND = 1200  # lines of a band: some ten modes of a structure, a hundred lines each
MARGIN = 0.15  # of its lines that a band looks to either side
COMBINATIONS = 32
POLISH = 4  # steps on all channels: they begin within the noise of the answer
TRIES = 4  # poles sought in what all channels leave


def is_large(data: PoleData) -> bool:
    """So many channels or lines that fitting all at once takes minutes."""
    return data.y.shape[1] > CHANNELS or len(data.s) > LINES


def searched_by_parts(
    data: PoleData, rule: Rule, stated: bool, orders: tuple[int, ...], tries: int
) -> Solution:
    """As :func:`.pole_search.searched`, of poles that are chosen band by band."""
    parts = [_part(data, low, high, rule, stated, orders, tries) for low, high in core_bands(data)]
    p, delta_chi2, sd_f, sd_z = (
        np.concatenate(all_of)
        for all_of in zip(
            *((one.fit.p, one.fit.delta_chi2, *one.spread) for one in parts), strict=True
        )
    )
    of = np.concatenate([np.full(len(one.fit.p), k) for k, one in enumerate(parts)])
    kept = _once(p, delta_chi2, of)
    fit, _ = solve(data, p[kept])
    chi = chi_of(data, fit)
    fit = replace(fit, delta_chi2=delta_chi2[kept])
    return Solution(fit, (sd_f[kept], sd_z[kept]), chi, _joined([one.sweep for one in parts]))


def core_bands(data: PoleData) -> list[tuple[int, int]]:
    """Lines [low, high) of bands of about the same number, cut where least resonates."""
    n = len(data.s)
    count = max(1, round(n / PER_BAND))
    scale = np.maximum(np.sqrt((np.abs(data.y) ** 2).mean(axis=0)), 1e-300)
    power = (np.abs(data.y / scale) ** 2).mean(axis=1)
    reach = n // (5 * count)
    cuts = [0]
    for k in range(1, count):
        near = slice(k * n // count - reach, k * n // count + reach + 1)
        cuts.append(near.start + int(power[near].argmin()))
    return list(zip(cuts, [*cuts[1:], n], strict=True))


def few_channels(data: PoleData, most: int = COMBINATIONS) -> PoleData:
    """The strongest real combinations of the whitened channels, with the noise of each line."""
    used = data.w > 0
    alive = used.any(axis=0)
    if alive.sum() <= most:
        return data
    used, w = used[:, alive], data.w[:, alive]
    y = np.where(used, data.y[:, alive], 0)
    h = np.sqrt((w**2).sum(axis=0) / used.sum(axis=0))
    g = np.sqrt((w**2 / h**2).mean(axis=1, keepdims=True))
    Z = stacked(g * h * y)
    _, V = eigh(Z.T @ Z, subset_by_index=(Z.shape[1] - most, Z.shape[1] - 1))
    power = (np.abs(h * y) ** 2).mean(axis=0)  # a sample that does not count is not known at all
    variance = np.where(used, 2 * h**2 / np.where(used, w, 1.0) ** 2, power)
    return PoleData(data.s, (h * y) @ V, np.sqrt(2 / (variance @ V**2)), data.q)


def _part(
    data: PoleData,
    low: int,
    high: int,
    rule: Rule,
    stated: bool,
    orders: tuple[int, ...],
    tries: int,
) -> Solution:
    """Poles of one band, those of its margins left out again; at the ends all are kept."""
    n, margin = len(data.s), max(6, int(MARGIN * (high - low)))
    at = slice(max(0, low - margin), min(n, high + margin))
    whole = replace(data, s=data.s[at], y=data.y[at], w=data.w[at])
    few = few_channels(whole)
    its = replace(rule, channels=few.y.shape[1], lines=len(few.s))
    fit, _, sweep = selected(few, orders, its, tries)
    rule = replace(rule, lines=len(whole.s))
    fit, slope = polish(whole, fit.p, rule.largest, POLISH, rule.noise)
    chi = chi_of(whole, fit)
    own = whole if stated or chi < ROUNDING else with_noise_left(whole, whole, fit)
    if own is not whole:
        fit, slope = polish(own, fit.p, rule.largest, POLISH, rule.noise)
    fit, slope = extended(own, fit, slope, rule, TRIES)
    if stated:
        spread = uncertainty(fit.p, slope, max(1.0, chi_of(own, fit) ** 2))
    else:
        spread = own_spread(own, fit, slope, max(chi, ROUNDING))
    f = np.abs(data.s)
    begin = 0.0 if low == 0 else f[low]
    end = np.inf if high == n else f[high]
    slack = np.abs(fit.p.real)  # at the cut two bands may find one pole, each on the other's side
    core = (begin - slack <= np.abs(fit.p)) & (np.abs(fit.p) < end + slack)
    fit = replace(fit, p=fit.p[core], delta_chi2=fit.delta_chi2[core])
    return Solution(fit, (spread[0][core], spread[1][core]), chi, sweep)


def _once(p: np.ndarray, delta_chi2: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Positions by rising |p|; of two bands' poles that are one, the one that brings more."""
    half = np.abs(p.real)
    same = np.abs(p[:, None] - p) < 0.5 * (half[:, None] + half)
    weaker = same & (of[:, None] != of) & (delta_chi2[:, None] < delta_chi2)
    order = np.argsort(np.abs(p))
    return np.asarray(order[~weaker.any(axis=1)[order]])


def _joined(sweeps: list[Sweep]) -> Sweep:
    """One diagram of all bands; of an order that several tried, the largest misfit."""
    orders = np.unique(np.concatenate([s.orders for s in sweeps]))
    chi = [max(float(s.chi[s.orders == n].max(initial=0.0)) for s in sweeps) for n in orders]
    order, poles, delta_chi2 = (
        np.concatenate([getattr(s, name) for s in sweeps])
        for name in ("order", "poles", "delta_chi2")
    )
    return Sweep(order, poles, delta_chi2, np.array(chi), orders)
