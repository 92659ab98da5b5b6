"""Poles chosen without the χ² criterion: by the order of a state space, or by hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import LabelError
from .out_of_band_poles import outside
from .pole_fitting import PoleData, PoleFit, PoleSystem, polish, solved
from .pole_search import (
    ROUNDING,
    STEADY,
    Solution,
    chi_of,
    own_spread,
    with_noise_left,
    with_outer_poles_if_close,
)
from .pole_search_by_parts import few_channels
from .pole_selection import Rule, uncertainty
from .subspace import subspace

NEAR_FREQUENCY = 0.02  # of a frequency given by hand: the pole that is meant
COMBINATIONS = 24  # of channels


def by_subspace(data: PoleData, rule: Rule, stated: bool, states: int) -> Solution:
    """Take all lightly damped poles of the given order; refit residues and residual terms.

    Echaniz Granado (2015), section 5.1: the order is chosen by the user, twins and all.

    Raises
    ------
    LabelError
        If the lines cannot carry that order.
    """
    most = 2 * (len(data.s) // 3)
    if not 2 <= states <= most:
        raise LabelError(f"a state space of order {states}: {len(data.s)} lines carry 2 to {most}")
    p, _ = subspace(few_channels(data, COMBINATIONS), states).modes(states)
    return _solution(data, *solved(data, p[-p.real < rule.largest * np.abs(p)]), stated)


def edited(
    data: PoleData,
    solution: Solution,
    rule: Rule,
    stated: bool,
    f_max: float,
    drop: Sequence[float],
    pick: Sequence[float],
) -> Solution:
    """Remove the poles nearest to ``drop`` and add poles started at ``pick`` [Hz].

    ``f_max`` is the frequency that scaled s. Poles outside the band are searched again. Otherwise
    one could move inside and replace a removed pole.
    """
    p = solution.fit.p[~outside(data, solution.fit.p)]
    for f in drop:
        p = np.delete(p, _nearest(p, f, f_max))
    usual = float(np.median(-p.real / np.abs(p))) if len(p) else 0.01
    begun = np.array([f / f_max * (-usual + 1j) for f in pick])
    alone = polish(data, np.concatenate([p, begun]), rule.largest, iterations=6)
    fit, slope = with_outer_poles_if_close(data, alone, rule)
    for f in pick:
        _nearest(fit.p, f, f_max)
    return _solution(data, fit, slope, stated)


def _nearest(p: np.ndarray, f: float, f_max: float) -> int:
    """Position of the pole at f [Hz].

    Raises
    ------
    LabelError
        If none is near enough.
    """
    there = f_max * np.abs(p)
    if not len(p) or np.abs(there - f).min() > NEAR_FREQUENCY * f:
        known = ", ".join(f"{x:.5g}" for x in np.sort(there)) or "none"
        raise LabelError(
            f"no pole within {100 * NEAR_FREQUENCY:g} % of {f:g} Hz; there are {known}"
        )
    return int(np.abs(there - f).argmin())


def _solution(data: PoleData, fit: PoleFit, slope: PoleSystem, stated: bool) -> Solution:
    """Add the spread, from the stated noise or from the residual."""
    chi = chi_of(data, fit)
    if stated or chi < ROUNDING:
        noise = max(1.0, chi) if stated else STEADY
        return Solution(fit, uncertainty(fit.p, slope, noise**2), chi)
    own = with_noise_left(data, data, fit)
    again, its_slope = solved(own, fit.p)
    kept = replace(again, delta_chi2=fit.delta_chi2)
    return Solution(kept, own_spread(own, again, its_slope, chi), chi)
