"""Pictures of an identification: stabilisation diagram, mode indicators, Nyquist circles."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .paper import AFTER, BEFORE, LEGEND, TEST, save

_CLASSES = {  # letter of a pole: (mark, colour, size, meaning)
    "o": (".", "#c9c9c9", 2, "new"),
    "f": ("x", "#9aa3ad", 3, "steady frequency"),
    "d": ("^", "#e69f00", 3.5, "and damping"),
    "v": ("v", "#56b4e9", 3.5, "and shape"),
    "s": ("o", AFTER, 3.5, "all steady"),
}


def stabilisation_classes(
    path: Path | str,
    states: np.ndarray,
    frequency: np.ndarray,
    kind: np.ndarray,
    kept: np.ndarray,
    struck: np.ndarray,
    indicator: tuple[np.ndarray, np.ndarray],
    unit: str = "",
) -> Path:
    """Plot poles over model order by class, kept ones as lines, struck ones as dotted lines.

    Parameters
    ----------
    states, frequency, kind : (k,)   order, [Hz], letter of each pole: o f d v s
    kept, struck : (r,), (g,)        frequencies [Hz]
    indicator : (f, value)           drawn behind on a log scale; unit of the value
    """
    figure = Figure(figsize=(8.2, 4.6), layout="constrained")
    ax = figure.subplots()
    behind = ax.twinx()
    behind.semilogy(*indicator, color="#9aa3ad", lw=0.9)
    behind.set_ylabel(f"rms of |H| [{unit}]" if unit else "rms of |H|", fontsize=8, color="#6b7480")
    ax.set_zorder(behind.get_zorder() + 1)
    ax.patch.set_visible(False)
    low, high = indicator[0][[0, -1]]
    inside = (low <= frequency) & (frequency <= high)
    for letter, (mark, colour, size, text) in _CLASSES.items():
        at = inside & (kind == letter)
        ax.plot(frequency[at], states[at], mark, ms=size, mew=0.7, color=colour, label=text)
    for k, f in enumerate(kept):
        ax.axvline(f, color=BEFORE, lw=0.7, alpha=0.7, zorder=1, label=None if k else "kept")
    for k, f in enumerate(struck):
        ax.axvline(f, color=TEST, lw=0.9, ls=":", label=None if k else "struck out")
    ax.set(xlabel="frequency [Hz]", ylabel="states", xlim=(low, high))
    figure.legend(loc="outside upper left", ncols=7, columnspacing=1.2, handlelength=1.2, **LEGEND)
    return save(figure, path)


def mode_indicators(
    path: Path | str, frequency: np.ndarray, cmif: np.ndarray, mif: np.ndarray, kept: np.ndarray,
    unit: str = "",
) -> Path:  # fmt: skip
    """Plot singular values of H (n_f, n_in) above, the share in quadrature below (n_f,)."""
    figure = Figure(figsize=(8.2, 4.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for k in range(cmif.shape[1]):
        upper.semilogy(frequency, cmif[:, k], lw=1.0, color=(TEST, AFTER, "#009e73")[k % 3])
    lower.plot(frequency, mif, lw=1.0, color=TEST)
    for ax in (upper, lower):
        for f in kept:
            ax.axvline(f, color=BEFORE, lw=0.6, alpha=0.6, zorder=1)
        ax.grid(lw=0.3, alpha=0.5)
    upper.set(ylabel=f"CMIF [{unit}]" if unit else "CMIF", xlim=frequency[[0, -1]])
    lower.set(xlabel="frequency [Hz]", ylabel="MIF", ylim=(0, 1.02))
    return save(figure, path)


def nyquist_grid(
    path: Path | str,
    modes: Mapping[str, tuple[np.ndarray, np.ndarray]],
    columns: int = 5,
    wide: float = 1.75,
) -> Path:
    """Plot a small Nyquist picture of every mode: measured lines as dots, the model as a curve.

    Parameters
    ----------
    modes : {name: (H measured (n,), H identified (m,))}
    wide : of one of them [inches]
    """
    rows = -(-len(modes) // columns)
    figure = Figure(figsize=(wide * columns, (wide + 0.1) * rows + 0.3), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, (name, (measured, identified)) in zip(axes, modes.items(), strict=False):
        ax.plot(identified.real, identified.imag, lw=1.1, color=AFTER, label="identified")
        ax.plot(measured.real, measured.imag, "o", ms=2.2, color=TEST, label="test")
        ax.set_title(name, fontsize=7.5)
        ax.set_aspect("equal", adjustable="datalim")
        ax.tick_params(labelleft=False, labelbottom=False, length=0)
        ax.axhline(0, color="#bbbbbb", lw=0.5, zorder=1)
        ax.axvline(0, color="#bbbbbb", lw=0.5, zorder=1)
    for ax in axes[len(modes) :]:
        ax.set_visible(False)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", **LEGEND)
    figure.supxlabel("Re H", fontsize=8)
    figure.supylabel("Im H", fontsize=8)
    return save(figure, path)
