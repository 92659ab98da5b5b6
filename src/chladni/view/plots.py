"""Curves and matrices of a vibration test, as matplotlib figures without global state.

Each function writes one picture (PNG, SVG or PDF by the suffix) and returns its path. Test is
black, the model before orange and dashed, the model after blue: distinct in grey and to any eye.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from ..errors import ShapeError
from .paper import AFTER, BEFORE, LEGEND, TEST, TITLE, save

Curves = Mapping[str, tuple[np.ndarray, np.ndarray]]  # name: frequency [Hz] (n,), complex H (n,)
Bands = Sequence[tuple[float, float]]
_STYLES: dict[str, dict[str, Any]] = {
    "test": {"color": TEST, "lw": 2.3, "alpha": 0.8, "zorder": 3},
    "before": {"color": BEFORE, "lw": 1.2, "ls": (0, (4, 2)), "zorder": 2},
    "after": {"color": AFTER, "lw": 1.1, "zorder": 4},
    "identified": {"color": AFTER, "lw": 1.1, "zorder": 4},
    "model": {"color": AFTER, "lw": 1.3, "zorder": 4},
}
_WIDEST = 9.0  # inches of a row of bars: a page would shrink a wider one until it is unreadable
_MOST_LABELS = 40  # most bars with a number; above that every second or third bar has one
_MORE = ("#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")


def frf(
    path: Path | str,
    curves: Curves,
    title: str = "",
    unit: str = "",
    fitted: Bands = (),
    excluded: Bands = (),
) -> Path:
    """Plot log magnitude above phase of one channel; "test", "before", "after" have fixed colours.

    ``fitted`` bands are shaded blue, ``excluded`` ones grey [Hz].
    """
    figure = Figure(figsize=(8.2, 4.6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.1))
    _curves(upper, lower, curves)
    for ax in (upper, lower):
        _bands(ax, fitted, AFTER, 0.06)
        _bands(ax, excluded, "#555555", 0.16)
        ax.grid(which="both", lw=0.3, alpha=0.5)
    upper.set(yscale="log", ylabel=f"|H| [{unit}]" if unit else "|H|")
    lower.set(xlabel="frequency [Hz]", ylabel="phase [deg]", ylim=(-185, 185))
    lower.set_yticks([-180, -90, 0, 90, 180])
    upper.set_title(title, loc="left", **TITLE)
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}  # a peak may stand in any corner
    upper.legend(ncols=min(3, len(curves)), **above, **LEGEND)
    return save(figure, path)


def frf_grid(
    path: Path | str,
    channels: Mapping[str, Curves],
    unit: str = "",
    fitted: Bands = (),
    excluded: Bands = (),
    columns: int = 2,
) -> Path:
    """Plot magnitudes of many channels, one small picture each."""
    columns = min(columns, len(channels))
    rows = -(-len(channels) // columns)
    figure = Figure(figsize=(4.6 * columns, 2.2 * rows + 0.5), layout="constrained")
    axes = np.ravel(figure.subplots(rows, columns, sharex=True, squeeze=False))
    for ax, (name, curves) in zip(axes, channels.items(), strict=False):
        _curves(ax, None, curves)
        _bands(ax, fitted, AFTER, 0.06)
        _bands(ax, excluded, "#555555", 0.16)
        ax.set_yscale("log")
        ax.set_title(name, fontsize=9, loc="left")
        ax.tick_params(labelsize=7)
        ax.grid(lw=0.3, alpha=0.5)
    for ax in axes[len(channels) :]:
        ax.set_visible(False)
    for ax in axes[len(channels) - columns : len(channels)]:
        ax.tick_params(labelbottom=True)
    names = axes[0].get_legend_handles_labels()
    figure.legend(*names, loc="outside upper right", ncols=3, **LEGEND)
    figure.supxlabel("frequency [Hz]", fontsize=9)
    figure.supylabel(f"|H| [{unit}]" if unit else "|H|", fontsize=9)
    return save(figure, path)


def frequency_ladder(
    path: Path | str, test: np.ndarray, before: np.ndarray, after: np.ndarray | None = None
) -> Path:
    """Plot the deviation (f_model / f_test - 1) of each paired mode in per cent, as bars.

    Parameters
    ----------
    test, before, after : (r,)   paired frequencies [Hz]; not-a-number where there is no partner
    """
    test = np.asarray(test, dtype=float)
    width = min(max(5.0, 0.55 * len(test) + 1.6), _WIDEST)
    figure = Figure(figsize=(width, 3.4), layout="constrained")
    ax, at = figure.subplots(), np.arange(len(test))
    series = [("before" if after is not None else "model", before, BEFORE)]
    series += [("after", after, AFTER)] if after is not None else []
    wide = 0.8 / len(series)
    for k, (name, model, colour) in enumerate(series):
        offset = (k - (len(series) - 1) / 2) * wide
        ax.bar(
            at + offset, 100 * (np.asarray(model, float) / test - 1), wide, color=colour, label=name
        )
    ax.axhline(0, color=TEST, lw=0.9)
    labelled = at[:: 1 + len(test) // _MOST_LABELS]
    ax.set_xticks(labelled, [f"{f:.4g}" for f in test[labelled]], rotation=60, fontsize=8)
    ax.set(xlabel="frequency of the test [Hz]", ylabel="model - test [%]")
    ax.grid(axis="y", lw=0.3, alpha=0.6)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, **LEGEND)
    return save(figure, path)


def mac_matrix(
    path: Path | str, mac: np.ndarray, rows: Sequence[str], columns: Sequence[str], title: str = "",
    pairs: Sequence[tuple[int, int]] = (),
) -> Path:  # fmt: skip
    """Plot MAC (r, c) in [0, 1] as shaded squares with values; pairs (row, column) are framed."""
    if mac.shape != (len(rows), len(columns)):
        raise ShapeError(f"MAC is {mac.shape}, the labels say {(len(rows), len(columns))}")
    size = 0.42 * max(len(rows), len(columns)) + 1.9
    figure = Figure(figsize=(size + 0.6, size), layout="constrained")
    ax = figure.subplots()
    shown = ax.imshow(100 * mac, cmap="Blues", vmin=0, vmax=100, aspect="equal")
    for (i, j), value in np.ndenumerate(mac):
        if value >= 0.05:
            colour = "white" if value > 0.6 else "#333333"
            ax.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=7, color=colour)
    for i, j in pairs:
        ax.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, ec=BEFORE, lw=1.8))
    ax.set_xticks(range(len(columns)), columns, rotation=60, fontsize=8)
    ax.set_yticks(range(len(rows)), rows, fontsize=8)
    ax.set_title(title, loc="left", **TITLE)
    figure.colorbar(shown, ax=ax, shrink=0.7, label="MAC [%]")
    return save(figure, path)


def evidence_bars(path: Path | str, evidence: Mapping[str, float], best: str | None = None) -> Path:
    """Plot log evidence of every hypothesis relative to the best one; the longest bar is worst."""
    ranked = sorted(evidence.items(), key=lambda item: -item[1])
    names = [name for name, _ in ranked]
    below = np.array([ranked[0][1] - value for _, value in ranked])
    figure = Figure(figsize=(7.6, 0.3 * len(names) + 1.2), layout="constrained")
    ax = figure.subplots()
    winner = best or names[0]
    colours = [AFTER if name == winner else "#aab4bf" for name in names]
    ax.barh(names, below, color=colours, height=0.66)
    for k, value in enumerate(below):
        ax.annotate(f" {-value:.4g}" if value else " best", (value, k), va="center", fontsize=8)
    ax.set_xscale("symlog", linthresh=5)
    ax.invert_yaxis()
    ax.set_xlabel("log evidence below the best (a longer bar is less likely)")
    ax.set_xlim(0, max(10.0, 4 * float(below.max())))
    ax.spines[["top", "right"]].set_visible(False)
    return save(figure, path)


def fit_test(path: Path | str, rows: Mapping[str, tuple[float, float, float, float]]) -> Path:
    """Plot statistics of the residual, (value, median, low, high), as multiples of their median.

    A value of zero is drawn at the left edge of the logarithmic axis.
    """
    figure = Figure(figsize=(7.6, 0.42 * len(rows) + 1.1), layout="constrained")
    ax = figure.subplots()
    over = np.array([(value, low, high) for value, _, low, high in rows.values()])
    over = over / np.array([[median] for _, median, *_ in rows.values()])
    edge = 0.8 * float(over[over > 0].min(initial=0.5))
    for k, (value, low, high) in enumerate(np.maximum(over, edge)):
        ax.barh(k, high - low, left=low, color="#aab4bf", height=0.5)
        ax.plot(1.0, k, "|", color="#555555", ms=12)
        ax.plot(value, k, "o", color=AFTER if value <= high else BEFORE, ms=7, clip_on=False)
    ax.set(xscale="log", xlabel="relative to the median of draws from the model [-]")
    ax.set_xlim(left=edge)
    ax.set_yticks(range(len(rows)), list(rows))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.invert_yaxis()
    ax.spines[["top", "right"]].set_visible(False)
    return save(figure, path)


def waterfall(
    path: Path | str, steps: Mapping[str, float], floor: float | None = None,
    of: str = "noise floor",
) -> Path:  # fmt: skip
    """Plot the deviation Q from the nominal model, step by step, with a ``floor`` and its name."""
    figure = Figure(figsize=(max(4.6, 1.5 * len(steps)), 3.2), layout="constrained")
    known = {name: value for name, value in steps.items() if np.isfinite(value)}
    ax, names, Q = figure.subplots(), list(known), np.array(list(known.values()), dtype=float)
    colours = [BEFORE, *["#aab4bf"] * max(0, len(Q) - 2), AFTER][: len(Q)]
    ax.bar(names, Q, color=colours, width=0.62)
    for k in range(1, len(Q)):
        ax.plot([k - 1.31, k + 0.31], [Q[k - 1]] * 2, color="#888888", lw=0.7, ls=":")
    for k, value in enumerate(Q):
        gain = f"\n{100 * (value / Q[0] - 1):+.0f} %" if k and Q[0] else ""
        ax.annotate(f"{value:.4g}{gain}", (k, value), ha="center", va="bottom", fontsize=8)
    if floor is not None and np.isfinite(floor):
        ax.axhline(floor, color=TEST, lw=0.9, ls="--")
        ax.annotate(of, (len(Q) - 0.5, floor), ha="right", va="bottom", fontsize=8)
    ax.set(ylabel="Q", ylim=(0, 1.22 * float(Q.max(initial=0.0)) or 1.0))
    ax.spines[["top", "right"]].set_visible(False)
    return save(figure, path)


def _curves(upper: Axes, lower: Axes | None, curves: Curves) -> None:
    for k, (name, (frequency, H)) in enumerate(curves.items()):
        style = _style(name, k)
        upper.plot(frequency, np.abs(H), label=name, **style)
        if lower is not None:
            lower.plot(frequency, _broken(np.degrees(np.angle(H))), **style)


def _style(name: str, k: int) -> dict[str, Any]:
    """Style of a known name, else the k-th colour; later curves are thinner and hide no other."""
    return _STYLES.get(name) or {"color": _MORE[k % len(_MORE)], "lw": max(0.8, 2.2 - 0.6 * k)}


def _broken(phase: np.ndarray) -> np.ndarray:
    """Phase with gaps where it wraps, so that no vertical lines are drawn."""
    shown = np.array(phase, dtype=float)
    shown[1:][np.abs(np.diff(phase)) > 270] = np.nan
    return shown


def _bands(ax: Axes, bands: Bands, colour: str, alpha: float) -> None:
    for low, high in bands:
        ax.axvspan(low, high, color=colour, alpha=alpha, lw=0, zorder=0)
