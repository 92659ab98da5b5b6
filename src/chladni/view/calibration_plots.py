"""Pictures of a calibration: profiles of the likelihood, the posterior by pairs, response bands."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .paper import AFTER, BEFORE, LEGEND, TEST, save

MOST = 8  # parameters in a picture of pairs
_ANGLE = np.linspace(0, 2 * np.pi, 90)
_SIGNIFICANT = 3.84  # χ² of one degree of freedom at 95 %


def likelihood_profiles(
    path: Path | str, profiles: Sequence[tuple[str, Sequence[float], Sequence[float]]]
) -> Path:
    """Plot the profile of each parameter over the parabola of its covariance.

    Parameters
    ----------
    profiles : (name, -2 ln likelihood above the best, parabola), at -2, -1, 1, 2 sd
    """
    columns = min(4, len(profiles))
    rows = -(-len(profiles) // columns)
    figure = Figure(figsize=(2.5 * columns, 2.3 * rows), layout="constrained")
    axes = np.ravel(figure.subplots(rows, columns, squeeze=False))
    for ax, (name, found, parabola) in zip(axes, profiles, strict=False):
        at, zero = [-2, -1, 0, 1, 2], lambda v: [*v[:2], 0.0, *v[2:]]
        ax.plot(at, zero(list(parabola)), color=BEFORE, ls=(0, (4, 2)), lw=1.2, label="interval")
        ax.plot(at, zero(list(found)), color=AFTER, marker="o", ms=3.5, lw=1.4, label="profile")
        ax.axhline(_SIGNIFICANT, color="#999999", lw=0.6)
        ax.set_title(name, fontsize=8, loc="left")
        ax.set_ylim(min(-1.0, *found), max(6.0, 1.1 * max(v for v in found if np.isfinite(v))))
        ax.set_xticks(at)
        ax.tick_params(labelsize=7)
    for ax in axes[len(profiles) :]:
        ax.set_visible(False)
    axes[0].legend(**LEGEND)
    figure.supxlabel("standard deviations from the best", fontsize=9)
    figure.supylabel("-2 ln profile likelihood", fontsize=9)
    return save(figure, path)


def corner(
    path: Path | str, names: Sequence[str], covariance: np.ndarray, draws: np.ndarray | None = None
) -> Path:
    """Plot the posterior of every pair of parameters in per cent.

    Ellipses of the Gaussian hold 39 % and 86 %; points and bars are draws, if there are any.

    Parameters
    ----------
    covariance : (p, p)   of ln value
    draws : (n, p)   of ln value from the mean of the Gaussian
    """
    names, C = list(names[:MOST]), 1e4 * np.asarray(covariance)[:MOST, :MOST]
    x = np.zeros((0, len(names))) if draws is None else 100 * np.asarray(draws)[:, :MOST]
    p = len(names)
    side = max(1.25 * p, 2.6)
    figure = Figure(figsize=(side + 0.8, side), layout="constrained")
    axes = figure.subplots(p, p, squeeze=False)
    for i in range(p):
        for j in range(p):
            ax = axes[i, j]
            if j > i:
                ax.set_visible(False)
                continue
            _pair(ax, C, x, i, j)
            ax.tick_params(labelsize=6, labelbottom=i == p - 1, labelleft=j == 0 and i > 0)
            if i == p - 1:
                ax.set_xlabel(names[j], fontsize=7, rotation=20, ha="right")
            if j == 0 and i:
                ax.set_ylabel(names[i], fontsize=7, rotation=70, ha="right")
    return save(figure, path)


def _pair(ax: Axes, C: np.ndarray, x: np.ndarray, i: int, j: int) -> None:
    """One density on the diagonal, else two ellipses; the draws with them."""
    if i == j:
        z = np.linspace(-3, 3, 61)
        ax.plot(z * np.sqrt(C[i, i]), np.exp(-(z**2) / 2), color=AFTER, lw=1.2)
        if len(x):
            count, edges = np.histogram(x[:, i], 20)
            share = count / len(x) / np.diff(edges) * np.sqrt(2 * np.pi * C[i, i])
            ax.stairs(share, edges, color=BEFORE, lw=1.0)
        ax.set_yticks([])
        return
    at = np.ix_((j, i), (j, i))
    root = np.linalg.cholesky(C[at] + 1e-12 * np.trace(C[at]) * np.eye(2))
    for k, strength in ((1, 0.35), (2, 0.15)):
        ellipse = k * root @ np.stack([np.cos(_ANGLE), np.sin(_ANGLE)])
        ax.fill(*ellipse, color=AFTER, alpha=strength, lw=0)
    ax.plot(x[:, j], x[:, i], ".", color=BEFORE, ms=1.2)
    for axis, n in ((ax.set_xlim, j), (ax.set_ylim, i)):
        reach = 3 * np.sqrt(C[n, n])
        axis(min(-reach, *x[:, n], 0.0), max(reach, *x[:, n], 0.0))


def unit_places(
    path: Path | str,
    rows: Sequence[tuple[str, float, Sequence[float], Sequence[float]]],
    articles: Sequence[str],
) -> Path:
    """Plot each article's deviation from the mean of all in per cent, over the spread of units.

    Parameters
    ----------
    rows : (name, spread τ, deviations of the articles, half of their 95 % intervals), ln value
    """
    figure = Figure(figsize=(7.2, 0.5 * len(rows) + 1.2), layout="constrained")
    ax = figure.subplots()
    at = np.arange(len(rows))[::-1]
    tau, *places = (100 * np.array([row[n] for row in rows]) for n in (1, 2, 3))
    ax.barh(at, 2 * tau, left=-tau, height=0.7, color=AFTER, alpha=0.25, label="± spread of units")
    for k, name in enumerate(articles):
        shift = 0.5 * (k / max(len(articles) - 1, 1) - 0.5)
        away, reach = (each[:, k] for each in places)
        ax.errorbar(away, at - shift, xerr=reach, fmt="o", ms=3.5, lw=1, capsize=2, label=name)
    ax.set_yticks(at, [row[0] for row in rows])
    ax.axvline(0, color="#999999", lw=0.6)
    ax.set_xlabel("deviation from the mean of all units [%]", fontsize=9)
    figure.legend(loc="outside upper right", ncols=4, **LEGEND)
    return save(figure, path)


def response_bands(
    path: Path | str,
    bands: Sequence[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]],
    unit: str = "",
) -> Path:
    """Plot 90 % bands of predicted magnitudes and the measured ones, one channel above another.

    Parameters
    ----------
    bands : (title, frequency [Hz], measured, low, high)
    """
    figure = Figure(figsize=(8.2, 1.9 * len(bands) + 0.4), layout="constrained")
    axes = np.ravel(figure.subplots(len(bands), 1, sharex=True, squeeze=False))
    for ax, (title, f, measured, low, high) in zip(axes, bands, strict=True):
        ax.fill_between(f, low, high, color=AFTER, alpha=0.35, lw=0, label="90 % of the posterior")
        ax.plot(f, measured, color=TEST, lw=1.3, label="test")
        ax.set_yscale("log")
        ax.set_title(title, fontsize=9, loc="left")
        ax.grid(lw=0.3, alpha=0.5)
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2, **LEGEND
    )
    figure.supxlabel("frequency [Hz]", fontsize=9)
    figure.supylabel(f"|H| [{unit}]" if unit else "|H|", fontsize=9)
    return save(figure, path)
