"""From weighted samples to the poles they support, with their spread."""

from dataclasses import dataclass, replace

import numpy as np

from .out_of_band_poles import with_outer_poles
from .pole_fitting import PoleData, PoleFit, PoleSystem, noise_left, polish, solve
from .pole_selection import (
    ORDERS,
    Rule,
    extended,
    merge_duplicate_poles,
    paid,
    settled,
    start,
    swept,
    uncertainty,
    with_neighbours,
)
from .response_variance import left_variance

UNSETTLED = 2.0  # times the noise: more that is left has another cause
OTHERS = (5, 8, 12, 18, 26, 36, 48)  # orders that are tried then
ROUNDS = 4  # of weights from what is left
QUIET = 0.3  # times the noise assumed: so little is left that poles below it may be seen
ROUNDING = 1e-6  # times the noise assumed: nothing is left
STEADY = 0.05  # of the spread at the noise assumed: no FRF repeats itself to less than 0.05 %

Spread = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Solution:
    """Poles and residues, as they were scaled."""

    fit: PoleFit
    spread: Spread  # (r,), (r,) standard deviations of |p| and of ζ
    chi: float  # rms of the residual over the noise stated or assumed


def searched(
    data: PoleData, rule: Rule, stated: bool, orders: tuple[int, ...] = ORDERS, tries: int = 12
) -> Solution:
    """Search the significant poles; ``stated``: the recording states its noise."""
    fit, slope = selected(data, orders, rule, tries)
    if chi_of(data, fit) > UNSETTLED and orders == ORDERS:
        other = selected(data, OTHERS, rule, tries)
        fit, slope = min((fit, slope), other, key=lambda one: one[0].chi2)
    if not stated and len(fit.p):
        return reweighted(data, fit, slope, rule, tries)
    chi = chi_of(data, fit)
    return Solution(fit, uncertainty(fit.p, slope, max(1.0, chi**2)), chi)


def selected(
    data: PoleData, orders: tuple[int, ...], rule: Rule, tries: int
) -> tuple[PoleFit, PoleSystem]:
    """Sweep over orders, then polish the significant poles, inside and outside the band."""
    sweep = swept(data, orders, rule.largest)
    fit, slope = settled(data, start(data, sweep, rule), rule)
    fit, slope = extended(data, fit, slope, rule, tries)
    fit, slope = with_neighbours(data, fit, slope, rule)
    fit, _ = merge_duplicate_poles(data, fit, slope, rule)
    alone = paid(data, fit.p, rule)
    found = with_outer_poles_if_close(data, alone, rule)
    return alone if found is alone else paid(data, found[0].p, rule)


def with_outer_poles_if_close(
    data: PoleData, alone: tuple[PoleFit, PoleSystem], rule: Rule
) -> tuple[PoleFit, PoleSystem]:
    """Add poles outside the band if the residual is then close to the noise.

    All inner poles are kept. A large residual shows a cause other than outer modes. The outer poles
    would then hide a leaning peak, or replace a pole removed by hand.
    """
    found = with_outer_poles(data, alone[0].p, rule)
    if chi_of(data, found[0]) > UNSETTLED:
        return alone
    return min(alone, found, key=lambda one: one[0].chi2 + rule.price * len(one[0].p))


def reweighted(data: PoleData, fit: PoleFit, slope: PoleSystem, rule: Rule, tries: int) -> Solution:
    """Repeat the fit with the noise of its residual, if the recording states none.

    A wrong noise reduces the accuracy and rarely loses poles. If the residual is far below the
    assumed noise, modes that this noise would hide are searched again.
    """
    own, chi = data, chi_of(data, fit)
    for _ in range(ROUNDS):
        if chi < ROUNDING:
            fit, slope = polish(data, fit.p, rule.largest, tol=0.0)
            return Solution(fit, uncertainty(fit.p, slope, STEADY**2), chi)
        own = with_noise_left(data, own, fit)
        fit, slope = polish(own, fit.p, rule.largest, tol=0.05)
        count = len(fit.p)
        if chi < QUIET:
            fit, slope = merge_duplicate_poles(own, *extended(own, fit, slope, rule, tries), rule)
        plain, _ = solve(data, fit.p)
        chi = chi_of(data, plain)
        if len(fit.p) == count:
            break
    fit = fit if chi < QUIET else replace(fit, delta_chi2=plain.delta_chi2)
    return Solution(fit, own_spread(own, fit, slope, chi), chi)


def with_noise_left(data: PoleData, fitted: PoleData, fit: PoleFit) -> PoleData:
    """Weight the samples by the residual of a fit; ``fitted`` contains the weights of that fit."""
    used = fitted.w > 0
    rest = np.where(used, fit.e / np.where(used, fitted.w, 1.0), 0)
    return replace(data, w=weights(left_variance(rest, data.y - rest, used), used))


def own_spread(own: PoleData, fit: PoleFit, slope: PoleSystem, chi: float) -> Spread:
    """Spread by the residual noise, at least that of ``STEADY`` times the assumed noise."""
    noise = chi_of(own, fit) * max(1.0, STEADY / chi)
    return uncertainty(fit.p, slope, noise**2)


def weights(variance: np.ndarray, used: np.ndarray) -> np.ndarray:
    """√2 / σ, zero where a sample does not count."""
    used = used & (variance > 0)
    return np.where(used, np.sqrt(2 / np.where(used, variance, 1.0)), 0.0)


def chi_of(data: PoleData, fit: PoleFit) -> float:
    """Rms of the whitened residual over its degrees of freedom."""
    return float(np.sqrt(noise_left(data, fit)))
