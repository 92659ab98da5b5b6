"""Poles outside the band: they represent outer modes, so that these do not distort inner ones.

Within the band, a mode outside it is a smooth curve. The residual terms L / s² and U represent its
first order. With many spectral lines the rest exceeds the noise and would distort the inner poles.
Therefore outer poles are added, as many as reduce χ² by their cost. They are not modes.
"""

import numpy as np

from .pole_fitting import PoleData, PoleFit, PoleSystem, polish, solve
from .pole_selection import Rule

ABOVE, BELOW = (1.06, 1.2, 1.45), (1.1, 1.5, 4.0)  # times, or under, an end of the band: begun
STEPS = 8  # of polishing once one is taken out


def outside(data: PoleData, p: np.ndarray) -> np.ndarray:
    """True for poles before the first or after the last line (r,)."""
    f, size = np.abs(data.s), np.abs(p)
    return np.asarray((size < f.min()) | (size > f.max()))


def with_outer_poles(data: PoleData, p: np.ndarray, rule: Rule) -> tuple[PoleFit, PoleSystem]:
    """Polish all poles and keep the outer ones that reduce χ² by their cost.

    Outer poles of ``p`` nearer to the band than the first of ``ABOVE`` and ``BELOW`` are kept.
    Farther ones served only a part of the band and are replaced by new starting values.
    """
    f, size = np.abs(data.s), np.abs(p)
    inner = p[~outside(data, p)]
    edge = p[outside(data, p) & (size < ABOVE[0] * f.max()) & (size > f.min() / BELOW[0])]
    zeta = float(np.median(-inner.real / np.abs(inner))) if len(inner) else 0.01
    rungs = np.concatenate([f.max() * np.array(ABOVE), f.min() / np.array(BELOW)])
    fit, _ = solve(data, np.concatenate([inner, edge, rungs * (-zeta + 1j)]))
    while (k := _idle(data, fit, len(inner), rule)) is not None:
        fit, _ = solve(data, np.delete(fit.p, k))
    fit, slope = polish(data, fit.p, rule.largest, tol=0.05)
    while (k := _idle(data, fit, len(inner), rule)) is not None:
        fit, slope = polish(data, np.delete(fit.p, k), rule.largest, STEPS, 0.05)
    return fit, slope


def _idle(data: PoleData, fit: PoleFit, inner: int, rule: Rule) -> int | None:
    """Return the outer pole (from ``inner`` on) of least gain, if below its cost or in the band.

    A pole that moved inside is not a mode, because modes were searched band by band.
    """
    gain = np.where(outside(data, fit.p), fit.delta_chi2, 0.0)[inner:]
    if not len(gain) or gain.min() >= rule.after(data, fit).price:
        return None
    return inner + int(gain.argmin())
