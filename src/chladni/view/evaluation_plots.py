"""Pictures of evaluations: coherence, distortion, damping against amplitude, power."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .paper import AFTER, BEFORE, LEGEND, TEST, TITLE, save

_COLOURS = (TEST, AFTER, BEFORE, "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")
_STYLES = ("-", (0, (4, 2)), (0, (1, 1)))


def lines_over_frequency(
    path: Path | str,
    frequency: np.ndarray,
    lines: Mapping[str, np.ndarray],
    what: str,
    limits: tuple[float, float] | None = None,
) -> Path:
    """Plot real functions of frequency (n,) [Hz] by channel, in one picture."""
    figure = Figure(figsize=(8.2, 3.2), layout="constrained")
    ax = figure.subplots()
    for k, (name, values) in enumerate(lines.items()):
        style = _STYLES[k // len(_COLOURS) % len(_STYLES)]
        ax.plot(frequency, values, lw=0.9, ls=style, color=_COLOURS[k % len(_COLOURS)], label=name)
    ax.set(xlabel="frequency [Hz]", ylabel=what)
    ax.set_ylim(*(limits or (0.0, None)))
    ax.grid(lw=0.3, alpha=0.5)
    figure.legend(loc="outside upper left", ncols=4, **LEGEND)
    return save(figure, path)


def amplitude_dependence(
    path: Path | str, modes: Mapping[str, tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> Path:
    """Plot frequency relative to the lowest level, and damping, against amplitude.

    Parameters
    ----------
    modes : {name: (amplitude, frequency [Hz], damping of critical)}, each (k,)
    """
    figure = Figure(figsize=(8.2, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for k, (name, (amplitude, f, zeta)) in enumerate(modes.items()):
        look = {"color": _COLOURS[k % len(_COLOURS)], "marker": "o", "ms": 3, "lw": 1.0}
        left.plot(amplitude, 100 * (f / f[-1] - 1), label=name, **look)
        right.plot(amplitude, 100 * zeta, **look)
    for ax, what in ((left, "frequency relative to the faintest [%]"), (right, "damping [%]")):
        ax.set(xscale="log", xlabel="amplitude of the response [SI]", ylabel=what)
        ax.grid(which="both", lw=0.3, alpha=0.5)
    right.set_ylim(bottom=0.0)
    figure.legend(loc="outside upper left", ncols=3, **LEGEND)
    return save(figure, path)


def shares_over_size(
    path: Path | str,
    curves: Mapping[str, tuple[Sequence[float], Sequence[float], Sequence[tuple[float, float]]]],
) -> Path:
    """Draw shares of named effects over their size: {label: (size, share, interval)}."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    ax = figure.subplots()
    for (label, (size, share, ends)), colour in zip(curves.items(), cycle(_COLOURS)):
        low, high = np.array(ends).T
        off = np.array([share - low, high - share])
        ax.errorbar(size, share, off, marker="o", capsize=3, color=colour, label=label, ls=":")
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("size of the effect, times scatter and mesh (0: no effect, false alarms)")
    ax.set_ylabel("share named")
    ax.set_title("Power of the diagnosis", loc="left", **TITLE)
    ax.legend(**LEGEND)
    return save(figure, path)
