"""Sensitivity of each result to each parameter, from the samples of a study.

- Logarithmic slopes d ln y / d ln p by least squares over all samples.
- Standardised regression coefficients (Saltelli et al. 2008, Global Sensitivity Analysis, 1.2.5).
- First-order and total Sobol' indices (Saltelli et al. 2010) of a ``saltelli`` design.
- Elementary effects (Morris 1991; Campolongo, Cariboni and Saltelli 2007) of a ``morris`` design.

Other designs give no Sobol' indices: at usual sizes such estimates are noise (0.18 for 0 with 80
samples). Where R² is near one, the squares of the standardised coefficients equal the indices.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .designs import LEVELS, problem

SIGNIFICANT = 1e-9  # relative range of a result below which it does not depend on anything


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """One result against all parameters (d,); nan where a measure does not apply."""

    result: str  # name of its column
    log_slope: np.ndarray  # d ln y / d ln p of the best power law y = c Π p^s
    r2: float  # share of the variance of ln y that this law explains
    standardised: np.ndarray  # regression coefficients times sd(p) / sd(y)
    # first, total: Sobol' indices; ``first_interval``, ``total_interval``: half their 95 % interval
    first: np.ndarray
    first_interval: np.ndarray
    total: np.ndarray
    total_interval: np.ndarray
    # mu_star, sigma: mean of |elementary effects| and their standard deviation, over the range
    mu_star: np.ndarray
    sigma: np.ndarray
    used: int  # number of samples used


def sensitivity(
    result: str, y: np.ndarray, X: np.ndarray, U: np.ndarray, sampler: str, block: int
) -> Sensitivity:
    """All sensitivity measures that the samples allow.

    Parameters
    ----------
    y : (n,)       nan where a sample failed
    X, U : (n, d)  values of the parameters, and their positions in the unit cube
    """
    d = X.shape[1]
    none = np.full(d, np.nan)
    held = {name: none for name in _INDICES}
    good = np.isfinite(y)
    slope, r2, standardised = none, np.nan, none
    if good.sum() > d + 1 and np.ptp(y[good]) > SIGNIFICANT * np.abs(y[good]).max():
        slope, r2 = _power_law(X[good], y[good])
        A, b = U[good] - U[good].mean(axis=0), y[good] - y[good].mean()
        standardised = np.linalg.lstsq(A, b, rcond=None)[0] * A.std(axis=0) / b.std()
        held |= _indices(y, U, good, sampler, block)
    elif good.sum() > d + 1:
        slope = standardised = np.zeros(d)
    return Sensitivity(result, slope, r2, standardised, used=int(good.sum()), **held)


_INDICES = ("first", "first_interval", "total", "total_interval", "mu_star", "sigma")


def _power_law(X: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float]:
    """Least-squares fit of ln y on ln p: slopes (d,) and R²; nan where y or p is not positive."""
    d = X.shape[1]
    if not ((y > 0).all() and (X > 0).all()):
        return np.full(d, np.nan), np.nan
    A, b = np.log(X) - np.log(X).mean(axis=0), np.log(y) - np.log(y).mean()
    moved = np.linalg.matrix_rank(A) == d
    if not moved:
        return np.full(d, np.nan), np.nan
    slope, *_ = np.linalg.lstsq(A, b, rcond=None)
    return slope, float(1 - ((b - A @ slope) ** 2).sum() / (b**2).sum())


def _indices(
    y: np.ndarray, U: np.ndarray, good: np.ndarray, sampler: str, block: int
) -> dict[str, np.ndarray]:
    """The indices a design was made for; blocks with a failed sample are left out."""
    whole = np.repeat(good.reshape(-1, block).all(axis=1), block) if block > 1 else good
    given, Y, rows = problem(U.shape[1]), y[whole], U[whole]
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # SALib's warnings: old names, too few samples
        if sampler == "saltelli" and len(Y) >= 2 * block:
            from SALib.analyze import sobol

            S = sobol.analyze(given, Y, calc_second_order=False, seed=0)
            return {
                "first": S["S1"], "first_interval": S["S1_conf"],
                "total": S["ST"], "total_interval": S["ST_conf"],
            }  # fmt: skip
        if sampler == "morris" and len(Y) >= 2 * block:
            from SALib.analyze import morris

            S = morris.analyze(given, rows, Y, num_levels=LEVELS, seed=0)
            return {"mu_star": np.asarray(S["mu_star"]), "sigma": np.asarray(S["sigma"])}
    return {}


def worth_telling(columns: Sequence[str]) -> list[str]:
    """Names of the results that are reported: all but MAC and the frequencies of peaks."""
    return [c for c in columns if not c.startswith(("mac", "peak"))]
