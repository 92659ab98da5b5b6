"""A chart as data and layout of Plotly (plain JSON), which the script of a page hands to it.

Colours that begin with @ are those of the page's style, so that they follow light and dark. Names
from decks and recordings are escaped here: Plotly reads tags in its texts.
"""

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np

from .chart import TINTS, Chart, ChartAxis, Column, Mark, Matrix, Panel, Series

Spec = dict[str, Any]
_MODES = {"line": "lines", "points": "markers", "both": "lines+markers", "area": "lines",
          "shape": "lines"}  # fmt: skip
_SYMBOLS = {"circle": "circle", "cross": "x-thin-open", "up": "triangle-up", "dot": "circle",
            "down": "triangle-down", "diamond": "diamond-open", "tick": "line-ns-open"}  # fmt: skip
_COLOURS = {"Viridis": ("Viridis", False), "RdBu": ("RdBu", True), "Magma": ("Magma", True)}
_LINE = 62  # characters of a line under the pointer
_DECADES = 1e-3  # step of a logarithm on a page


def page(chart: Chart) -> Spec:
    """Data, layout, what changes in a narrow window, and the choices of a reader."""
    looks, first = chart.looks(), _figure(chart.panels, chart, chart.looks())
    made: Spec = {**first, "height": chart.height or _height(chart)}
    if len(chart.views) > 1 or chart.choice:
        options = [{"text": name, **_changes(panels, chart, looks, first)}
                   for name, panels in chart.views.items()]  # fmt: skip
        made["choices"] = [{"label": chart.choice, "options": options, "steps": True,
                            "marked": dict(chart.marked)}]  # fmt: skip
    if chart.table:
        made["choices"] = _axes_of(chart.table, chart)
    if chart.tints_of:
        made["brush"] = [{"text": name, "tints": list(bins), "ends": list(ends)}
                         for name, (bins, ends) in chart.tints_of.items()]  # fmt: skip
        made["layout"] |= {"dragmode": "select", "selections": [], "hovermode": "closest"}
        for axis in ("xaxis", "yaxis"):  # a drag draws a box and moves nothing
            made["layout"][axis] |= {"fixedrange": True}
    return made | ({"pick": chart.pick} if chart.pick else {})


def short(values: np.ndarray, digits: int = 5) -> list[float | None]:
    """Digits of every value (n,), None where it is not finite."""
    every = np.asarray(values, dtype=float)
    return [float(f"{v:.{digits}g}") if np.isfinite(v) else None for v in every]


def extremes(values: np.ndarray, most: int) -> np.ndarray:
    """Positions of at most ``most`` values (n,): of every block the highest and the lowest."""
    if len(values) <= most:
        return np.arange(len(values))
    ends = np.linspace(0, len(values), most // 2 + 1).astype(int)
    blocks = list(pairwise(ends))
    picked = [a + int(pick(values[a:b])) for a, b in blocks for pick in (np.argmin, np.argmax)]
    return np.unique(picked)


def _height(chart: Chart) -> float:
    rows = -(-len(chart.panels) // chart.columns)
    return 8 + (11 if rows > 1 else 18) * rows


def _figure(panels: Sequence[Panel | None], chart: Chart, looks: Any) -> Spec:
    data: list[Spec] = []
    layout: Spec = {"shapes": [], "annotations": []}
    named: set[str] = set()
    places = _places(panels, chart, chart.columns)
    for k, panel in enumerate(panels):
        if panel is not None:
            x, y = _axes(k, panels, chart)
            _add_panel(data, layout, panel, (x, y), looks, named)
            for axis, domain in zip((x, y), places[k], strict=True):
                layout[_key(axis)]["domain"] = domain
    lines = all(s.kind in ("line", "area") for p in panels if p for s in p.series)
    stacked = chart.one_x and chart.columns == 1 and lines
    layout |= {
        "hovermode": "x unified" if stacked or (lines and len(panels) == 1) else "closest",
        "hoversubplots": "axis",
        "barmode": "group",
        "showlegend": len(named) > 1,
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
    }
    if layout["showlegend"] and any(p.title for p in panels[: chart.columns] if p):
        layout["legend"] |= {"yref": "container", "y": 1, "yanchor": "top"}  # above the titles
        layout["margin"] = {"l": 60, "r": 42, "t": 48, "b": 45}
    return {"data": data, "layout": layout, "narrow": _narrow(panels, chart)}


def _key(axis: str) -> str:
    """Name of an axis in the layout.

    >>> _key("x"), _key("y3")
    ('xaxis', 'yaxis3')
    """
    return f"{axis[0]}axis{axis[1:]}"


def _axes(k: int, panels: Sequence[Panel | None], chart: Chart) -> tuple[str, str]:
    """Axes of a panel; panels on one axis x have that of the last one."""
    number = "" if k == 0 else str(k + 1)
    return ("x" if chart.one_x and chart.columns == 1 else f"x{number}"), f"y{number}"


def _places(
    panels: Sequence[Panel | None], chart: Chart, columns: int
) -> list[tuple[list[float], list[float]]]:
    """Shares of width and height of every panel."""
    rows = -(-len(panels) // columns)
    tall = [p.share if p else 1.0 for p in panels[::columns]]
    tall = tall if len(tall) == rows and columns == chart.columns else [1.0] * rows
    ends = 1 - np.concatenate([[0.0], np.cumsum(tall) / np.sum(tall)])
    between = 0.05 if chart.one_x or rows == 1 else min(0.2, 0.5 / rows)
    out = []
    for k in range(len(panels)):
        i, j = divmod(k, columns)
        top, low = float(ends[i]), float(ends[i + 1])
        gap = between * (top - low) if chart.one_x else between * (top - low) * 2.2
        side = 0.0 if columns == 1 else 0.1 / columns
        left, right = side * (j > 0), side * (j < columns - 1)
        wide = [j / columns + left, (j + 1) / columns - right]
        low = low + (gap if i < rows - 1 else 0.0)
        out.append(([round(v, 4) for v in wide], [round(max(low, 0.0), 4), round(top, 4)]))
    return out


def _narrow(panels: Sequence[Panel | None], chart: Chart) -> Spec:
    """Changes of layout and height for a telephone: fewer panels in a row."""
    if chart.columns == 1 or None in panels:
        return {}
    columns = chart.columns // 2 if chart.columns > 2 else 1
    places, layout = _places(panels, chart, columns), {}
    for k in range(len(panels)):
        for axis, domain in zip(_axes(k, panels, chart), places[k], strict=True):
            layout[_key(axis)] = {"domain": domain}
    rows = [-(-len(panels) // n) for n in (columns, chart.columns)]
    return {"layout": layout, "height": (chart.height or _height(chart)) * rows[0] / rows[1]}


def _add_panel(
    data: list[Spec], layout: Spec, panel: Panel, axes: tuple[str, str], looks: Any, named: set[str]
) -> None:
    x, y = axes
    of_x, of_y = _axis(panel.x), _axis(panel.y)
    if panel.matrix is not None:
        data.append({**_heatmap(panel.matrix), "xaxis": x, "yaxis": y, "showscale": not named})
        of_x |= {"showgrid": False, "zeroline": False}
        of_y |= {"showgrid": False, "zeroline": False}
        named.add("")
    for s in panel.series:
        show = bool(s.name) and s.name not in named
        named |= {s.name} - {""}
        axis = f"{y}0" if s.right else y
        data.extend({**t, "xaxis": x, "yaxis": axis} for t in _traces(s, looks, show, panel))
    for mark in panel.marks:
        layout["shapes"].append(_line(mark, x, y))
    layout["shapes"] += [_band(low, high, x, y) for low, high in panel.grey]
    if panel.matrix is not None:
        layout["shapes"] += [_frame(i, j, x, y) for i, j in panel.matrix.frames]
    note = {"showarrow": False, "font": {"size": 10, "color": "@soft"}}
    for n in panel.notes:
        high = float(np.log10(n.y)) if panel.y.log else n.y  # Plotly's annotations are in decades
        words = escape(n.text, False)
        place = {"x": n.x, "y": high, "xref": x, "yref": y, "yshift": 12 * n.lift}
        layout["annotations"].append({**note, **place, "text": words})
    if panel.title:
        layout["annotations"].append(_title(panel.title, x, y))
    if panel.equal:
        of_y |= {"scaleanchor": x}
    layout[_key(x)] = {**layout.get(_key(x), {}), **of_x, "anchor": y}
    layout[_key(y)] = {**of_y, "anchor": x}
    if panel.right is not None:
        layout[_key(f"{y}0")] = {**_axis(panel.right), "overlaying": y, "side": "right",
                                 "showgrid": False, "showticklabels": False}  # fmt: skip


def _title(text: str, x: str, y: str) -> Spec:
    return {"text": escape(text, False), "xref": f"{x} domain", "yref": f"{y} domain", "x": 0,
            "y": 1, "yanchor": "bottom", "xanchor": "left", "showarrow": False,
            "font": {"size": 12}}  # fmt: skip


def _axis(axis: ChartAxis) -> Spec:
    made: Spec = {"title": {"text": escape(axis.title, False), "font": {"size": 11}}}
    if axis.log:
        made |= {"type": "log", "exponentformat": "power"}
    else:
        made |= {"rangemode": "tozero" if axis.zero else "normal"}
    if axis.limits is not None:
        made["range"] = list(np.log10(axis.limits)) if axis.log else list(axis.limits)
    if axis.ticks is not None:
        made |= {"tickvals": list(axis.ticks), "tickfont": {"size": 10},
                 "ticktext": [escape(t, False) for t in axis.ticks.values()]}  # fmt: skip
    if axis.down:
        made["autorange"] = "reversed"
    return made | ({"showticklabels": False, "showgrid": False} if axis.bare else {})


def _tint(tint: str) -> str:
    return f"@{tint}" if tint in TINTS else tint


def _numbers(values: np.ndarray, axis: ChartAxis, fine: bool = False) -> Any:
    """Values of an axis; on a logarithmic one whole thousandths of a decade, short when packed."""
    if not axis.log:
        return short(values, 7 if fine or axis.title.startswith("frequency") else 5)
    every = np.asarray(values, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = np.rint(np.log10(every) / _DECADES)
    return {"log": [int(v) if np.isfinite(v) else None for v in whole], "step": _DECADES}


def _traces(s: Series, looks: Any, show: bool, panel: Panel) -> list[Spec]:
    tint, dash = looks.get(s.name, ("ink", "solid"))
    colour, dash = _tint(s.tint or tint), s.dash or dash
    name = escape(s.name, False)
    of_y, fine = panel.right if s.right and panel.right else panel.y, s.kind == "shape"
    made: Spec = {
        "x": _numbers(s.x, panel.x, fine), "y": _numbers(s.y, of_y, fine), "name": name,
        "legendgroup": name, "showlegend": show, "opacity": s.opacity,
    }  # fmt: skip
    made |= _bar(s, colour, panel) if s.kind == "bars" else _scatter(s, colour, dash)
    if s.opens:
        made["meta"] = {"opens": s.opens}
    if s.sample is not None:
        made["customdata"] = [None if v < 0 else int(v) for v in s.sample]
    made |= _under_pointer(s, name)
    if s.ends is not None:
        value = s.x if s.lying else s.y
        off = {"type": "data", "array": short(s.ends[1] - value), "thickness": 1,
               "arrayminus": short(value - s.ends[0]), "color": colour}  # fmt: skip
        made["error_x" if s.lying else "error_y"] = off
    if s.kind == "area":
        base = np.zeros(len(s.x)) if s.base is None else s.base
        edge = {**made, "y": _numbers(base, of_y), "showlegend": False, "hoverinfo": "skip"}
        made |= {"fill": "tonexty", "fillcolor": colour, "opacity": 1.0}
        none = {"width": 0}
        return [{**edge, "line": none}, {**made, "line": none, "opacity": s.opacity}]
    return [made]


def _under_pointer(s: Series, name: str) -> Spec:
    if s.tips:
        return {"text" if s.kind != "bars" else "hovertext": [wrapped(t) for t in s.tips],
                "hoverinfo": "text"}  # fmt: skip
    if s.kind == "shape" or s.right:
        return {"hoverinfo": "skip"}
    if s.kind == "line":
        return {"hovertemplate": f"{name} %{{y:.4g}}<extra></extra>"}
    return {"hovertemplate": f"{name}<br>%{{x:.5g}}: %{{y:.5g}}<extra></extra>"}


def wrapped(text: str) -> str:
    """Words under the pointer: escaped, in lines of a readable length."""
    lines, line = [], ""
    for word in (w for part in text.split("\n") for w in (*part.split(" "), "\n")):
        if word == "\n" or len(line) + len(word) > _LINE:
            lines.append(escape(line.strip(), False))
            line = ""
        line += "" if word == "\n" else f" {word}"
    return "<br>".join(lines)


def _scatter(s: Series, colour: str, dash: str) -> Spec:
    made: Spec = {"type": "scatter", "mode": _MODES[s.kind]}
    made["line"] = {"color": colour, "width": s.width, "dash": dash}
    marker: Spec = {"color": colour, "size": s.size + 1, "symbol": _SYMBOLS[s.symbol]}
    if s.values is not None:
        bar = {"thickness": 10, "title": {"side": "right", "text": ""}}
        marker |= {"color": short(s.values), "colorscale": "Viridis", "showscale": True,
                   "colorbar": bar}  # fmt: skip
    made["marker"] = marker
    if s.kind == "shape":
        made |= {"fill": "toself", "fillcolor": colour}
    return made


def _bar(s: Series, colour: str, panel: Panel) -> Spec:
    made: Spec = {"type": "bar", "orientation": "h" if s.lying else "v"}
    made["marker"] = {"color": colour}
    if s.labels:
        made |= {"text": list(s.labels), "textposition": "outside", "cliponaxis": False}
    if s.base is not None:
        side, log = ("x", panel.x.log) if s.lying else ("y", panel.y.log)
        value = s.x if s.lying else s.y
        made |= {"base": short(s.base), side: short(value - s.base), "width": 0.6}
        if log:  # Plotly adds a bar to its base as numbers
            made["offsetgroup"] = s.name
    return made


def _line(mark: Mark, x: str, y: str) -> Spec:
    own, other = ("x", "y") if mark.along == "y" else ("y", "x")
    axis, across = (x, y) if own == "x" else (y, x)
    look = {"color": _tint(mark.tint), "width": 1, "dash": mark.dash}
    return {"type": "line", f"{own}0": mark.at, f"{own}1": mark.at, f"{own}ref": axis,
            f"{other}0": 0, f"{other}1": 1, f"{other}ref": f"{across} domain", "layer": "below",
            "line": look}  # fmt: skip


def _band(low: float, high: float, x: str, y: str) -> Spec:
    return {"type": "rect", "xref": x, "yref": f"{y} domain", "x0": low, "x1": high, "y0": 0,
            "y1": 1, "line": {"width": 0}, "fillcolor": "@soft", "opacity": 0.12,
            "layer": "below"}  # fmt: skip


def _frame(i: int, j: int, x: str, y: str) -> Spec:
    return {"type": "rect", "xref": x, "yref": y, "x0": j - 0.5, "x1": j + 0.5, "y0": i - 0.5,
            "y1": i + 0.5, "line": {"color": "#ff5a36", "width": 2}}  # fmt: skip


def _heatmap(m: Matrix) -> Spec:
    scale, reverse = _COLOURS[m.colours]
    made: Spec = {
        "type": "heatmap", "z": [short(row) for row in m.values], "zmin": m.limits[0],
        "zmax": m.limits[1], "colorscale": scale, "reversescale": reverse,
        "colorbar": {"thickness": 10, "title": {"text": escape(m.title, False), "side": "right"}},
        "hoverinfo": "text",
        "hovertext": [[escape(t, False).replace("\n", "<br>") for t in row] for row in m.tips],
    }  # fmt: skip
    if m.opens is not None:
        made["meta"] = {"opens": m.opens[0], "sides": m.opens[1:]}
    if m.digits is not None:
        shown = np.isfinite(m.values) & (np.abs(m.values) >= m.least)
        made["texttemplate"] = "%{text}"
        made["text"] = [
            [f"{v + 0.0:.{m.digits}f}" if s else "" for v, s in zip(*row, strict=True)]
            for row in zip(np.round(m.values, m.digits), shown, strict=True)
        ]
    return made


def _changes(panels: Sequence[Panel | None], chart: Chart, looks: Any, first: Spec) -> Spec:
    """The parts of a view's traces that differ from those of the first one."""
    made = _figure(panels, chart, looks)
    data = [{k: v for k, v in trace.items() if v != old.get(k)}
            for trace, old in zip(made["data"], first["data"], strict=True)]  # fmt: skip
    same = {"shapes", "annotations"}
    layout = {k: v for k, v in made["layout"].items() if k in same and v != first["layout"][k]}
    ticks = {k: v for k, v in made["layout"].items() if "axis" in k and v != first["layout"][k]}
    return {"data": data, "layout": layout | ticks}


def _axes_of(table: Sequence[Column], chart: Chart) -> list[Spec]:
    """Choices of the columns over and along which the points lie, and of their colour."""
    (panel,) = chart.panels
    assert panel is not None
    shown = {"x": panel.x.title, "y": panel.y.title}
    made = []
    for label, side in (("over", "x"), ("result", "y")):
        options = []
        for c in table:
            axis = ChartAxis(c.name, c.log)
            mark = Mark(c.nominal, "y" if side == "x" else "x", "before", "dash")
            line = [_line(mark, "x", "y")]
            options.append({
                "text": c.name,
                "data": [{side: _numbers(c.values, axis)}],
                "layout": {_key(side): _axis(axis) | {"type": "log" if c.log else "linear"}},
                "shapes": line if np.isfinite(c.nominal) else [],
            })  # fmt: skip
        made.append({"label": label, "options": options,
                     "chosen": [c.name for c in table].index(shown[side])})  # fmt: skip
    tints: list[Spec] = [{"text": "none", "data": [{}]}]
    for c in table:
        bar = {"thickness": 10, "title": {"text": escape(c.name, False), "side": "right"}}
        marker = {"color": short(c.values), "colorscale": "Viridis", "showscale": True}
        tints.append({"text": c.name, "data": [{"marker": {**marker, "colorbar": bar}}]})
    return [*made, {"label": "colour", "options": tints}]
