"""Pictures of a virtual test: the schedule, a stretch of time, responses over their coherence."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from chladni.view.paper import AFTER, BEFORE, LEGEND, TEST, TITLE, save


def sine_schedule(
    path: Path | str,
    frequency: np.ndarray,
    delay: np.ndarray,
    measure: np.ndarray,
    force: np.ndarray,
    transient: np.ndarray,
    drive: str = "force [N]",
) -> Path:
    """Plot cycles of delay and measurement, drive and remaining transient by line (n,)."""
    figure = Figure(figsize=(8.2, 6.0), layout="constrained")
    top, middle, low = figure.subplots(3, 1, sharex=True)
    top.step(frequency, delay, where="post", color=TEST, lw=1.3, label="waited")
    top.step(frequency, measure, where="post", color=AFTER, lw=1.3, label="measured")
    top.set(ylabel="cycles", yscale="log")
    top.legend(ncols=2, **LEGEND)
    middle.plot(frequency, force.T, color=AFTER, lw=0.8)
    middle.set(ylabel=drive, yscale="log")
    low.plot(frequency, 100 * np.maximum(transient, 1e-12), ".", ms=2, color=BEFORE)
    low.set(ylabel="transient left [%]", yscale="log", xscale="log", xlabel="frequency [Hz]")
    minutes = ((delay + measure) / frequency).sum() / 60
    text = f"Stepped sine: {len(frequency)} lines, {minutes:.3g} minutes a sweep"
    top.set_title(text, loc="left", **TITLE)
    for ax in (top, middle, low):
        ax.grid(which="both", lw=0.3, alpha=0.5)
    return save(figure, path)


def time_histories(
    path: Path | str, t: np.ndarray, signals: Mapping[str, np.ndarray], title: str = ""
) -> Path:
    """Plot signals (n,) by name, one below the other, over time (n,) [s]."""
    figure = Figure(figsize=(8.2, 1.6 + 1.3 * len(signals)), layout="constrained")
    axes = np.ravel(figure.subplots(len(signals), 1, sharex=True))
    for ax, (name, x) in zip(axes, signals.items(), strict=True):
        ax.plot(t, x, color=TEST, lw=0.5)
        ax.set_ylabel(name, fontsize=8)
        ax.grid(lw=0.3, alpha=0.5)
    axes[0].set_title(title, loc="left", **TITLE)
    axes[-1].set_xlabel("time [s]")
    return save(figure, path)


def frf_over_coherence(
    path: Path | str,
    frequency: np.ndarray,
    measured: np.ndarray,
    ideal: np.ndarray,
    coherence: np.ndarray,
    title: str = "",
    unit: str = "",
) -> Path:
    """Plot |H| as measured and with an ideal front end, above the coherence (n,)."""
    figure = Figure(figsize=(8.2, 4.6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.1))
    upper.plot(frequency, np.abs(measured), color=TEST, lw=1.6, alpha=0.8, label="recorded")
    upper.plot(frequency, np.abs(ideal), color=AFTER, lw=0.8, label="ideal front end")
    upper.set(yscale="log", ylabel=f"|H| [{unit}]" if unit else "|H|")
    upper.legend(ncols=2, **LEGEND)
    upper.set_title(title, loc="left", **TITLE)
    lower.plot(frequency, coherence, color=TEST, lw=0.9)
    lower.set(ylabel="coherence", ylim=(0, 1.03), xlabel="frequency [Hz]")
    for ax in (upper, lower):
        ax.grid(which="both", lw=0.3, alpha=0.5)
    return save(figure, path)
