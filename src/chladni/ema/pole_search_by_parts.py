"""Poles of recordings of hundreds of channels or many thousand lines: band by band.

A pole is determined by the lines near it, so a band of some hundred lines has few unknowns. In it
thirty combinations of whitened channels carry nearly all information of a hundred (Juang and Suzuki
1988, ASME J. Vib. Acoust. 110, 88-95: compression by principal components). They select the poles.
All channels then polish them, each with its own noise. The residues of all poles are solved
together. The poles outside the band are too, because they affect every part of it. Lines that say
the same as their neighbours are summed beforehand; all lines serve the last polish.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from ..parallel import in_parallel
from ..progress import Progress, counted, silent, within
from .condensed_lines import condensed, oversampled
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
PER_BAND_SUMMED = 250  # where lines that repeat others are summed: some hundred for each mode
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
    """Poles (r,) of one band, from ``begin`` to ``end`` of |s|."""

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
    few = oversampled(data) if len(data.s) > LINES else data
    bands = core_bands(few, PER_BAND if few is data else PER_BAND_SUMMED)
    size = f"{data.y.shape[1]} channels x {len(data.s)} lines"
    step = counted(within(progress, 0.0, SEARCH), f"identifying {size}: band", len(bands))
    parts = []
    for part in in_parallel(lambda band: _part(few, *band, rule, stated, orders, tries), bands):
        parts.append(part)
        step(len(parts))
    progress(f"identifying {size}: all bands together", SEARCH)
    lines, whole, whole_spread = _with_outer(data, few, _once(parts), rule, stated)
    inside = ~outside(data, whole.p)
    fit, delta_chi2, spread = solve(lines, whole.p)[0], whole.delta_chi2, np.array(whole_spread)
    for k in range(PASSES):
        progress(f"identifying {size}: every band again", 0.9 + 0.1 * k / PASSES)
        p, rise, sd = fit.p.copy(), delta_chi2.copy(), spread.copy()
        for rows, begin, end in map(lambda band: _looked_at(data, *band), core_bands(data)):
            own = np.flatnonzero(inside & (begin <= np.abs(whole.p)) & (np.abs(whole.p) < end))
            if len(own):
                p[own], rise[own], sd[:, own] = _polished(data, fit, rows, own, rule, stated)
        closer, _ = solve(lines, p)
        if closer.chi2 > fit.chi2 + 2 * len(p):  # off by a standard deviation each
            break
        fit, delta_chi2, spread = closer, rise, sd
    fit, _ = solve(data, fit.p)
    return Solution(replace(fit, delta_chi2=delta_chi2), (spread[0], spread[1]), chi_of(data, fit))


def _with_outer(
    data: PoleData, few: PoleData, parts: list[BandPoles], rule: Rule, stated: bool
) -> tuple[PoleData, PoleFit, Spread]:
    """Polish the poles of all bands and outside them together, on condensed lines and few channels.

    A pole that was significant in its band only is removed: there it stood for outer modes.
    The first result is the condensed lines of all channels.
    """
    p = np.concatenate([one.poles for one in parts])
    fit, _ = solve(few, p)
    lines = condensed(data, fit)
    own = lines
    if not stated and chi_of(few, fit) > ROUNDING:
        fit, _ = solve(data, p)
        own = condensed(with_noise_left(data, data, fit), fit)
    few = few_channels(own)
    rule = replace(rule, channels=few.y.shape[1])
    fit, _ = with_outer_poles(few, p, rule)
    fit, slope = paid(few, fit.p, rule)
    return lines, fit, uncertainty(fit.p, slope, max(1.0, chi_of(few, fit)) ** 2)


def core_bands(data: PoleData, lines: int | None = None) -> list[tuple[int, int]]:
    """Divide the lines into bands [low, high) of similar size, cut at the weakest response."""
    n = len(data.s)
    count = max(1, round(n / (lines or PER_BAND)))
    scale = np.maximum(np.sqrt((np.abs(data.y) ** 2).mean(axis=0)), 1e-300)
    power = (np.abs(data.y / scale) ** 2).mean(axis=1)
    reach = n // (5 * count)
    cuts = [0]
    for k in range(1, count):
        near = slice(k * n // count - reach, k * n // count + reach + 1)
        cuts.append(near.start + int(power[near].argmin()))
    return list(zip(cuts, [*cuts[1:], n], strict=True))


def few_channels(data: PoleData, most: int = COMBINATIONS, above_noise: bool = False) -> PoleData:
    """The strongest real combinations of the whitened channels, with the noise of each line.

    ``above_noise``: only those whose sum of squares is more than that of noise alone.
    """
    used = data.w > 0
    alive = used.any(axis=0)
    if alive.sum() <= most and not above_noise:
        return data
    used, w = used[:, alive], data.w[:, alive]
    y = np.where(used, data.y[:, alive], 0)
    h = np.sqrt((w**2).sum(axis=0) / used.sum(axis=0))
    g = np.sqrt((w**2 / h**2).mean(axis=1, keepdims=True))
    Z = stacked(g * h * y)
    n = Z.shape[1]
    square, V = eigh(Z.T @ Z, subset_by_index=(max(n - most, 0), n - 1))
    power = (np.abs(h * y) ** 2).mean(axis=0)  # a sample that does not count is not known at all
    variance = np.where(used, 2 * h**2 / np.where(used, w, 1.0) ** 2, power)
    if above_noise:
        V = V[:, _stands_out(square, (g**2 * variance).sum(axis=0) @ V**2, n / len(Z))]
    return PoleData(data.s, (h * y) @ V, np.sqrt(2 / (variance @ V**2)), data.q)


def _stands_out(square: np.ndarray, noise: np.ndarray, ratio: float) -> np.ndarray:
    """Select eigenvalues beyond the largest of noise alone, the last one always (n,) bool.

    Eigenvalues of noise lie within (1 ± √(columns / rows))² of its power (Marchenko and Pastur
    1967, Math. USSR Sbornik 1, 457). The smallest show a noise that is less than assumed.
    """
    edge = min(np.sqrt(ratio), 0.9)
    level = min(1.0, float((square / noise).min()) / (1 - edge) ** 2)
    out = square > level * (1 + edge) ** 2 * noise
    out[-1] = True
    return np.asarray(out)


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
    n = len(data.s)
    rows, begin, end = _looked_at(data, low, high)
    whole = replace(data, s=data.s[rows], y=data.y[rows], w=data.w[rows])
    few = few_channels(whole, above_noise=True)
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
    slack = np.abs(fit.p.real)  # at the cut two bands may find one pole, each on the other's side
    core = (begin - slack <= np.abs(fit.p)) & (np.abs(fit.p) < end + slack)
    return BandPoles(begin, end, fit.p[core])


def _looked_at(data: PoleData, low: int, high: int) -> tuple[slice, float, float]:
    """Lines of a band [low, high) with its margins, and the range of |s| of its poles."""
    n, margin, f = len(data.s), max(6, int(MARGIN * (high - low))), np.abs(data.s)
    rows = slice(max(0, low - margin), min(n, high + margin))
    return rows, 0.0 if low == 0 else f[low], np.inf if high == n else f[high]


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
    data: PoleData, fit: PoleFit, rows: slice, own: np.ndarray, rule: Rule, stated: bool
) -> tuple[np.ndarray, np.ndarray, Spread]:
    """Poles, rise of χ² and spread of one band, after subtraction of the other bands' modes."""
    rest = np.delete(np.arange(len(fit.p)), own)
    whole = PoleData(data.s[rows], data.y[rows], data.w[rows], data.q)
    x = fit.x[:-2].reshape(len(fit.p), 2, -1)[rest].reshape(2 * len(rest), -1)
    band = assumed = replace(whole, y=whole.y - basis(whole.s, fit.p[rest], data.q) @ x)
    if not stated:  # noise goes with all that rings, not with the band's own part of it
        own_noise = with_noise_left(whole, band, solve(band, fit.p[own])[0])
        band = replace(band, w=own_noise.w)
    best, slope = polish(band, fit.p[own], rule.largest, POLISH, 0.05)
    noise = max(1.0, left := chi_of(band, best)) ** 2
    chi = 1.0 if stated else max(chi_of(assumed, solve(assumed, best.p)[0]), ROUNDING)
    if chi < STEADY:
        noise = (left * STEADY / chi) ** 2
    return best.p, best.delta_chi2, uncertainty(best.p, slope, noise)
