"""Poles of recordings of hundreds of channels or many thousand lines: band by band.

A pole is determined by the lines near it, so a band of some hundred lines has few unknowns. In it
thirty combinations of whitened channels carry nearly all information of a hundred (Juang and Suzuki
1988, ASME J. Vib. Acoust. 110, 88-95: compression by principal components). They select the poles.
All channels then polish them, each with its own noise. The residues of all poles are solved
together. The poles outside the band are too, because they affect every part of it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from ..parallel import in_parallel
from ..progress import Progress, counted, silent, within
from .condensed_lines import condensed
from .out_of_band_poles import outside, with_outer_poles
from .pole_fitting import PoleData, PoleFit, basis, polish, solve, stacked
from .pole_search import (
    ROUNDING,
    STEADY,
    Solution,
    Spread,
    chi_of,
    selected,
    with_noise_left,
)
from .pole_selection import Rule, extended, paid, uncertainty, with_neighbours

CHANNELS, LINES = 48, 2000  # up to here all are fitted at once; beyond, outer modes become visible
PER_BAND = 1200  # lines of a band: some ten modes of a structure, a hundred lines each
MARGIN = 0.15  # of its lines that a band looks to either side
COMBINATIONS = 32
POLISH = 3  # steps on all channels: they begin within the noise of the answer
PASSES = 2  # each subtracts the modes of other bands, more accurate than before
SEARCH = 0.8  # of the time goes into choosing the poles
TRIES = 4  # poles sought in what all channels leave


def is_large(data: PoleData) -> bool:
    """Return True if channels or lines are so many that one fit of all takes minutes."""
    return data.y.shape[1] > CHANNELS or len(data.s) > LINES


@dataclass(frozen=True, eq=False)
class BandPoles:
    """Poles of one band, and the samples (margins too, own weights) they were fitted to.

    ``poles`` (r,) are those from ``begin`` to ``end`` of |s|.
    """

    rows: slice
    w: np.ndarray
    begin: float
    end: float
    poles: np.ndarray


def searched_by_parts(
    data: PoleData,
    rule: Rule,
    stated: bool,
    orders: tuple[int, ...],
    tries: int,
    progress: Progress = silent,
) -> Solution:
    """Search poles as :func:`.pole_search.searched`, but select them band by band."""
    bands = core_bands(data)
    size = f"{data.y.shape[1]} channels x {len(data.s)} lines"
    step = counted(within(progress, 0.0, SEARCH), f"identifying {size}: band", len(bands))
    parts = []
    for part in in_parallel(lambda band: _part(data, *band, rule, stated, orders, tries), bands):
        parts.append(part)
        step(len(parts))
    progress(f"identifying {size}: all bands together", SEARCH)
    lines, whole, whole_spread = _with_outer(data, _once(parts), rule, stated)
    out_of_band = outside(data, whole.p)
    of_part = [
        np.flatnonzero(~out_of_band & (one.begin <= np.abs(whole.p)) & (np.abs(whole.p) < one.end))
        for one in parts
    ]
    fit, delta_chi2, spread = solve(data, whole.p)[0], whole.delta_chi2, np.array(whole_spread)
    for k in range(PASSES):
        progress(f"identifying {size}: every band again", 0.9 + 0.1 * k / PASSES)
        others, _ = solve(lines, fit.p)
        p, rise, sd = fit.p.copy(), delta_chi2.copy(), spread.copy()
        for part, own in zip(parts, of_part, strict=True):
            p[own], rise[own], sd[:, own] = _polished(data, others, part, own, rule, stated)
        closer, _ = solve(data, p)
        if closer.chi2 > fit.chi2:
            break
        fit, delta_chi2, spread = closer, rise, sd
    return Solution(replace(fit, delta_chi2=delta_chi2), (spread[0], spread[1]), chi_of(data, fit))


def _with_outer(
    data: PoleData, parts: list[BandPoles], rule: Rule, stated: bool
) -> tuple[PoleData, PoleFit, Spread]:
    """Polish the poles of all bands and outside them together, on condensed lines and few channels.

    A pole that was significant in its band only is removed: there it stood for outer modes.
    The first result is the condensed lines of all channels.
    """
    p = np.concatenate([one.poles for one in parts])
    fit, _ = solve(data, p)
    lines = condensed(data, fit)
    few = few_channels(lines)
    if not stated and chi_of(data, fit) > ROUNDING:
        few = few_channels(condensed(with_noise_left(data, data, fit), fit))
    rule = replace(rule, channels=few.y.shape[1])
    fit, _ = with_outer_poles(few, p, rule)
    fit, slope = paid(few, fit.p, rule)
    return lines, fit, uncertainty(fit.p, slope, max(1.0, chi_of(few, fit)) ** 2)


def core_bands(data: PoleData) -> list[tuple[int, int]]:
    """Divide the lines into bands [low, high) of similar size, cut at the weakest response."""
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
) -> BandPoles:
    """Find the poles of one band without those of its inner margins."""
    n, margin = len(data.s), max(6, int(MARGIN * (high - low)))
    rows = slice(max(0, low - margin), min(n, high + margin))
    whole = replace(data, s=data.s[rows], y=data.y[rows], w=data.w[rows])
    few = few_channels(whole)
    its = replace(rule, channels=few.y.shape[1], lines=len(few.s))
    fit, _ = selected(few, orders, its, tries)
    rule = replace(rule, lines=len(whole.s))
    fit, slope = polish(whole, fit.p, rule.largest, POLISH, rule.noise)
    if not stated and chi_of(whole, fit) > ROUNDING:
        whole = with_noise_left(whole, whole, fit)
        fit, slope = polish(whole, fit.p, rule.largest, POLISH, rule.noise)
    fit, slope = extended(whole, fit, slope, rule, TRIES)
    if high == n or low == 0:
        fit, _ = with_neighbours(whole, fit, slope, rule, low == 0, far=True)
    f = np.abs(data.s)
    begin = 0.0 if low == 0 else f[low]
    end = np.inf if high == n else f[high]
    slack = np.abs(fit.p.real)  # at the cut two bands may find one pole, each on the other's side
    core = (begin - slack <= np.abs(fit.p)) & (np.abs(fit.p) < end + slack)
    return BandPoles(rows, whole.w, begin, end, fit.p[core])


def _once(parts: list[BandPoles]) -> list[BandPoles]:
    """Remove duplicates: if two neighbouring bands share a pole, the second band keeps it."""
    kept = []
    for part, after in zip(parts, [*parts[1:], None], strict=True):
        p = part.poles
        alone = np.ones(len(p), bool)
        if after is not None and len(after.poles):
            gap = np.abs(p[:, None] - after.poles)
            alone = (gap > 0.5 * np.abs(p.real[:, None] + after.poles.real)).all(axis=1)
        kept.append(replace(part, poles=p[alone]))
    return kept


def _polished(
    data: PoleData, fit: PoleFit, part: BandPoles, own: np.ndarray, rule: Rule, stated: bool
) -> tuple[np.ndarray, np.ndarray, Spread]:
    """Poles, rise of χ² and spread of one band, after subtraction of the other bands' modes."""
    rest = np.delete(np.arange(len(fit.p)), own)
    whole = PoleData(data.s[part.rows], data.y[part.rows], data.w[part.rows], data.q)
    x = fit.x[:-2].reshape(len(fit.p), 2, -1)[rest].reshape(2 * len(rest), -1)
    band = assumed = replace(whole, y=whole.y - basis(whole.s, fit.p[rest], data.q) @ x)
    if not stated:  # noise goes with all that rings, not with the band's own part of it
        fitted = replace(band, w=part.w)
        own_noise = with_noise_left(whole, fitted, solve(fitted, fit.p[own])[0])
        band = replace(band, w=own_noise.w)
    best, slope = polish(band, fit.p[own], rule.largest, POLISH, 0.05)
    noise = max(1.0, left := chi_of(band, best)) ** 2
    chi = 1.0 if stated else max(chi_of(assumed, solve(assumed, best.p)[0]), ROUNDING)
    if chi < STEADY:
        noise = (left * STEADY / chi) ** 2
    return best.p, best.delta_chi2, uncertainty(best.p, slope, noise)
