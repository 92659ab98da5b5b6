"""A chart as PNG, SVG or PDF, by matplotlib without global state."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis as TickedAxis
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatter, LogLocator, NullFormatter

from .chart import TINTS, Chart, ChartAxis, Dash, Matrix, Panel, Series
from .paper import LEGEND, TITLE, save

_DASHES: dict[Dash, Any] = {"solid": "-", "dash": (0, (4, 2)), "dot": (0, (1, 1.5))}
_MARKS = {"circle": "o", "cross": "x", "up": "^", "down": "v", "diamond": "D", "tick": "|",
          "dot": "."}  # fmt: skip
_CMAPS = {"Viridis": "viridis", "RdBu": "RdBu", "Magma": "magma_r"}
_TILE = (8.2, 2.6)  # inches of a panel whose chart says no size
_NAMED_ROWS = 12  # names in the legend above which it is left out


def png(chart: Chart, path: Path | str) -> Path:
    """Draw the first view; the suffix of the path may be that of another format."""
    return save(figure(chart), path)


def figure(chart: Chart) -> Figure:
    """The first view of a chart."""
    rows = -(-len(chart.panels) // chart.columns)
    wide, high = chart.size or (_TILE[0], _TILE[1] * rows + 0.4)
    made = Figure(figsize=(wide, high), layout="constrained")
    shares = [p.share if p else 1.0 for p in chart.panels[:: chart.columns]]
    axes = made.subplots(
        rows, chart.columns, squeeze=False, height_ratios=shares,
        sharex="col" if chart.one_x else False,
    ).ravel()  # fmt: skip
    looks, small = chart.looks(), chart.columns > 1
    for k, ax in enumerate(axes):
        panel = chart.panels[k] if k < len(chart.panels) else None
        if panel is None:
            ax.set_visible(False)
        else:
            _panel(ax, panel, looks, small)
            if chart.one_x and k + chart.columns < len(chart.panels):
                ax.set_xlabel("")
    _legend(made, axes)
    return made


def _legend(made: Figure, axes: Any) -> None:
    """Every name once, above the panels; none where there is one."""
    named: dict[str, Any] = {}
    for ax in made.axes:
        named |= {n: h for h, n in zip(*ax.get_legend_handles_labels(), strict=True)}
    if 1 < len(named) <= _NAMED_ROWS:
        columns = min(len(named), 5 if made.get_size_inches()[0] > 7 else 3)
        text = LEGEND | {"loc": "outside upper right", "ncols": columns}
        made.legend(named.values(), named.keys(), **text)


def _panel(ax: Axes, panel: Panel, looks: Any, small: bool) -> None:
    if panel.matrix is not None:
        _matrix(ax, panel.matrix)
    behind = None if panel.right is None else ax.twinx()
    if behind is not None and panel.right is not None:
        _axis(behind, "y", panel.right, small)
        ax.set_zorder(behind.get_zorder() + 1)
        ax.patch.set_visible(False)
    bars = [s for s in panel.series if s.kind == "bars" and s.base is None]
    for s in panel.series:
        _series(behind if s.right and behind is not None else ax, s, looks, bars)
    for mark in panel.marks:
        line = ax.axvline if mark.along == "y" else ax.axhline
        known = mark.name in ax.get_legend_handles_labels()[1]
        line(mark.at, color=TINTS.get(mark.tint, mark.tint), lw=0.8, ls=_DASHES[mark.dash],
             zorder=1, label=None if known or not mark.name else mark.name)  # fmt: skip
    for low, high in panel.grey:
        ax.axvspan(low, high, color="#555555", alpha=0.14, lw=0, zorder=0)
    for note in panel.notes:
        style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7}
        ax.annotate(note.text, (note.x, note.y), (0, 7 * note.lift), textcoords="offset points",
                    **style)  # fmt: skip
    _axis(ax, "x", panel.x, small)
    _axis(ax, "y", panel.y, small)
    if panel.equal:
        ax.set_aspect("equal", adjustable="datalim")
    if panel.matrix is None:
        ax.grid(lw=0.3, alpha=0.5)
    ax.set_axisbelow(True)
    size = {"fontsize": 8.5} if small else TITLE
    ax.set_title(panel.title, loc="left", **size)  # type: ignore[arg-type]


def _axis(ax: Axes, side: Literal["x", "y"], axis: ChartAxis, small: bool) -> None:
    ticked: TickedAxis = getattr(ax, f"{side}axis")
    ticked.set_label_text(axis.title, fontsize=8 if small else 9)
    if axis.log:
        getattr(ax, f"set_{side}scale")("log")
        _decades(ticked)
    if axis.limits is not None:
        getattr(ax, f"set_{side}lim")(*axis.limits)
    elif axis.zero:
        getattr(ax, f"set_{side}lim")(**{"bottom" if side == "y" else "left": 0.0})
    if axis.ticks is not None:
        words = axis.ticks.values()
        turned = side == "x" and len(words) * max(map(len, words), default=0) > 50
        ticked.set_major_locator(FixedLocator(list(axis.ticks)))
        ticked.set_ticklabels(
            list(axis.ticks.values()), fontsize=8, rotation=45 if turned else 0,
            ha="right" if turned or side == "y" else "center",
        )  # fmt: skip
        ticked.set_minor_formatter(NullFormatter())
    elif small and not axis.log:
        ax.locator_params(axis=side, nbins=4)
    if axis.down:
        ticked.set_inverted(True)
    ticked.set_tick_params(labelsize=7 if small else 8)
    if axis.bare:
        ticked.set_tick_params(which="both", length=0, labelbottom=False, labelleft=False)


def _decades(ticked: TickedAxis) -> None:
    """Ticks at 1, 2 and 5 where there are few decades."""
    low, high = ticked.get_data_interval()
    if 0 < low and high < 30 * low:
        ticked.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ticked.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.3g}"))
        ticked.set_minor_formatter(NullFormatter())
    elif low > 0:
        ticked.set_minor_formatter(LogFormatter(labelOnlyBase=True))


def _series(ax: Axes, s: Series, looks: Any, bars: list[Series]) -> None:
    tint, dash = looks.get(s.name, ("ink", "solid"))
    colour, dash = s.tint or tint, s.dash or dash
    look: dict[str, Any] = {"color": TINTS.get(colour, colour), "alpha": s.opacity}
    look["label"] = s.name or None
    if s.kind == "bars":
        _bars(ax, s, look, bars)
    elif s.kind == "area":
        base = np.zeros(len(s.x)) if s.base is None else s.base
        ax.fill_between(s.x, base, s.y, lw=0, **look)
    elif s.kind == "shape":
        ax.add_collection(PolyCollection(_pieces(s), linewidths=0.6, facecolors=look["color"],
                                         alpha=s.opacity, label=s.name or None))  # fmt: skip
        ax.autoscale_view()
    elif s.values is not None:
        ax.scatter(s.x, s.y, c=s.values, s=s.size**2, cmap="viridis", label=s.name or None)
    else:
        mark: dict[str, Any] = (
            {} if s.kind == "line" else {"marker": _MARKS[s.symbol], "ms": s.size}
        )
        open_: dict[str, Any] = {"mfc": "none"} if s.symbol == "diamond" else {}
        line = _DASHES[dash] if s.kind != "points" else "none"
        ax.plot(s.x, s.y, lw=s.width, ls=line, **mark, **open_, **look)
    if s.ends is not None:
        _intervals(ax, s, look["color"])


def _bars(ax: Axes, s: Series, look: dict[str, Any], bars: list[Series]) -> None:
    """Bars side by side where several series start at zero."""
    wide = 0.8 / max(len(bars), 1) if s.base is None else 0.6
    k = next((k for k, one in enumerate(bars) if one is s), 0)
    shift = (k - (len(bars) - 1) / 2) * wide if s.base is None else 0.0
    base = np.zeros(len(s.x)) if s.base is None else s.base
    if s.lying:
        ax.barh(s.y + shift, s.x - base, wide, left=base, **look)
    else:
        ax.bar(s.x + shift, s.y - base, wide, bottom=base, **look)
    at: dict[str, Any] = (
        {"ha": "left", "va": "center"} if s.lying else {"ha": "center", "va": "bottom"}
    )
    for x, y, text in zip(s.x, s.y, s.labels, strict=False):
        ax.annotate(f" {text} ", (x, y), fontsize=8, **at)


def _intervals(ax: Axes, s: Series, colour: str) -> None:
    assert s.ends is not None
    value = s.x if s.lying else s.y
    off = np.abs(np.stack([value - s.ends[0], s.ends[1] - value]))
    way = {"xerr": off} if s.lying else {"yerr": off}
    ax.errorbar(s.x, s.y, **way, fmt="none", ecolor=colour, elinewidth=1, capsize=2.5)


def _pieces(s: Series) -> list[np.ndarray]:
    """Polygons that are parted by a gap."""
    points = np.column_stack([s.x, s.y])
    cut = np.flatnonzero(~np.isfinite(points).all(axis=1))
    return [p[np.isfinite(p).all(axis=1)] for p in np.split(points, cut) if len(p) > 1]


def _matrix(ax: Axes, m: Matrix) -> None:
    low, high = m.limits
    cmap = _CMAPS[m.colours]
    shown = ax.imshow(m.values, cmap=cmap, vmin=low, vmax=high, aspect="auto")
    for (i, j), value in np.ndenumerate(m.values):
        if m.digits is not None and np.isfinite(value) and abs(value) >= m.least:
            r, g, b, _ = shown.cmap(shown.norm(value))
            ax.text(j, i, f"{round(value, m.digits) + 0.0:.{m.digits}f}", ha="center", va="center",
                    fontsize=7, color="white" if r + g + b < 1.5 else "#333333")  # fmt: skip
    for i, j in m.frames:
        square = Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, ec=TINTS["before"], lw=1.8)
        ax.add_patch(square)
    ax.figure.colorbar(shown, ax=ax, shrink=0.8, label=m.title)
