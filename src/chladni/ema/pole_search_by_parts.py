"""Poles of recordings of hundreds of channels or many thousand lines: band by band.

A pole is known from the lines about it, so a band of some hundred lines holds few unknowns; in it
thirty combinations of whitened channels carry nearly all that a hundred do (Juang and Suzuki 1988,
ASME J. Vib. Acoust. 110, 88-95: compression by principal components). They choose the poles; every
channel then polishes them with its own noise. Residues of all poles are solved for at once.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from .pole_fitting import PoleData, basis, polish, solve, stacked
from .pole_search import ROUNDING, STEADY, Solution, chi_of, selected, with_noise_left
from .pole_selection import Rule, extended, uncertainty, with_neighbours

CHANNELS, LINES = 48, 3000  # up to here all are fitted at once
PER_BAND = 1200  # lines of a band: some ten modes of a structure, a hundred lines each
MARGIN = 0.15  # of its lines that a band looks to either side
COMBINATIONS = 32
POLISH = 3  # steps on all channels: they begin within the noise of the answer
PASSES = 2  # each takes off what rings in other bands, better known than before
TRIES = 4  # poles sought in what all channels leave


def is_large(data: PoleData) -> bool:
    """So many channels or lines that fitting all at once takes minutes."""
    return data.y.shape[1] > CHANNELS or len(data.s) > LINES


@dataclass(frozen=True, eq=False)
class BandPoles:
    """Poles of one band, and the samples (margins too, own weights) they were fitted to.

    ``poles`` (r,) are those of the band itself, ``x`` (2 r, n_c) their residues as real pairs.
    """

    rows: slice
    w: np.ndarray
    poles: np.ndarray
    x: np.ndarray


def searched_by_parts(
    data: PoleData, rule: Rule, stated: bool, orders: tuple[int, ...], tries: int
) -> Solution:
    """As :func:`.pole_search.searched`, of poles that are chosen band by band."""
    parts = [_part(data, low, high, rule, stated, orders, tries) for low, high in core_bands(data)]
    parts = _once(parts)
    for _ in range(PASSES):
        done = [_polished(data, parts, k, rule, stated) for k in range(len(parts))]
        p, delta_chi2, sd_f, sd_z = (np.concatenate(all_of) for all_of in zip(*done, strict=True))
        fit, _ = solve(data, p)
        ends = np.cumsum([2 * len(one[0]) for one in done])
        x = np.split(fit.x[:-2], ends[:-1])
        parts = [
            replace(part, poles=one[0], x=own)
            for part, one, own in zip(parts, done, x, strict=True)
        ]
    return Solution(replace(fit, delta_chi2=delta_chi2), (sd_f, sd_z), chi_of(data, fit))


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
) -> BandPoles:
    """Poles of one band, those of its margins left out again; at the ends all are kept."""
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
    return BandPoles(rows, whole.w, fit.p[core], fit.x[:-2][np.repeat(core, 2)])


def _once(parts: list[BandPoles]) -> list[BandPoles]:
    """Of two neighbours' poles that are one, that of the first is left out."""
    kept = []
    for part, after in zip(parts, [*parts[1:], None], strict=True):
        p = part.poles
        alone = np.ones(len(p), bool)
        if after is not None and len(after.poles):
            gap = np.abs(p[:, None] - after.poles)
            alone = (gap > 0.5 * np.abs(p.real[:, None] + after.poles.real)).all(axis=1)
        kept.append(replace(part, poles=p[alone], x=part.x[np.repeat(alone, 2)]))
    return kept


def _polished(
    data: PoleData, parts: list[BandPoles], k: int, rule: Rule, stated: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Poles, rise of χ² and spread of one band once what rings in all others is taken off."""
    part, rest = parts[k], [one for j, one in enumerate(parts) if j != k]
    s, y = data.s[part.rows], data.y[part.rows]
    for other in rest:
        y = y - basis(s, other.poles, data.q) @ other.x
    own = assumed = PoleData(s, y, data.w[part.rows], data.q)
    if not stated:
        own = replace(own, w=part.w)
        own = with_noise_left(own, own, solve(own, part.poles)[0])
    fit, slope = polish(own, part.poles, rule.largest, POLISH, 0.05)
    noise = chi_of(own, fit) ** 2
    if stated:
        noise = max(1.0, noise)
    else:
        chi = max(chi_of(assumed, solve(assumed, fit.p)[0]), ROUNDING)
        noise *= max(1.0, STEADY / chi) ** 2
    order = np.argsort(np.abs(fit.p))
    sd_f, sd_z = uncertainty(fit.p, slope, noise)
    return fit.p[order], fit.delta_chi2[order], sd_f[order], sd_z[order]
