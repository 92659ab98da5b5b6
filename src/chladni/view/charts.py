"""Charts of a vibration test: responses, matrices, bars, lines over frequency.

Test is black, the model before orange and dashed, the model after blue: distinct in grey and to any
eye (Okabe and Ito, 2008).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .chart import Chart, ChartAxis, Mark, Matrix, Note, Panel, Series

Curves = Mapping[str, tuple[np.ndarray, np.ndarray]]  # name: frequency [Hz] (n,), complex H (n,)
Bands = Sequence[tuple[float, float]]
FREQUENCY = ChartAxis("frequency [Hz]")
_STYLES: dict[str, dict[str, Any]] = {
    "test": {"tint": "ink", "width": 1.9},
    "recorded": {"tint": "ink", "width": 1.9},
    "before": {"tint": "before", "dash": "dash"},
    "after": {"tint": "after"},
    "identified": {"tint": "after"},
    "model": {"tint": "after"},
    "ideal": {"tint": "after", "width": 1.0},
}
_DEGREES = {float(v): str(v) for v in (-180, -90, 0, 90, 180)}
_ODDS = (0, 2, 10, 30, 100, 300, 1000, 3000, 10_000)
_WIDEST = 9.0  # inches of a row of bars: a page would shrink a wider one until it is unreadable
_MOST_LABELS = 40  # most bars with a number; above that every second or third bar has one
_HIGHEST = 12.0  # inches of a matrix


def responses(
    channels: Mapping[str, Curves],
    quantity: str = "|H|",
    grey: Bands = (),
    coherence: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None,
    marked: Mapping[str, int] | None = None,
) -> Chart:
    """Log magnitude above phase of each channel, and its coherence if it has one.

    Parameters
    ----------
    quantity : with its unit
    grey : bands that were not fitted [Hz]
    marked : word on a button: position of its channel
    """

    def panels(name: str) -> list[Panel | None]:
        curves = channels[name]
        level = [Series(n, f, np.abs(H), **style(n)) for n, (f, H) in curves.items()]
        phase = [Series(n, f, broken(np.degrees(np.angle(H))), **style(n))
                 for n, (f, H) in curves.items()]  # fmt: skip
        degrees = ChartAxis("phase [°]", limits=(-190, 190), ticks=_DEGREES)
        out: list[Panel | None] = [
            Panel(level, FREQUENCY, ChartAxis(quantity, log=True), grey=grey, share=3),
            Panel(phase, FREQUENCY, degrees, grey=grey, share=1.3),
        ]
        if coherence:
            f, gamma = coherence[name]
            line = [Series("coherence", f, gamma, tint="neutral")]
            out.append(Panel(line, FREQUENCY, ChartAxis("coherence", limits=(0, 1.05)), share=1.1))
        return out

    views = {name: panels(name) for name in channels}
    return Chart(views, one_x=True, size=(8.2, 4.6 + 1.2 * bool(coherence)), height=34,
                 choice="channel", marked=marked or {})  # fmt: skip


def style(name: str) -> dict[str, Any]:
    """Tint and line of a known curve; of another one none, so that it gets the next colour."""
    return _STYLES.get(name, {})


def broken(phase: np.ndarray) -> np.ndarray:
    """Phase [degree] with gaps where it wraps, so that no vertical lines are drawn."""
    shown = np.round(np.array(phase, dtype=float))
    shown[1:][np.abs(np.diff(phase)) > 270] = np.nan
    return shown


def mac(
    test: np.ndarray,
    found: Mapping[str, tuple[np.ndarray, np.ndarray, Sequence[tuple[int, int]]]],
    rows: str = "test",
    opens: str = "",
) -> Chart:
    """MAC (test, model) of each deck, side by side; framed: pairs (row, column).

    Parameters
    ----------
    opens : drawing of the modes that a click on a square opens
    test : (r,) frequencies of the rows [Hz]
    found : name: MAC (r, c), frequencies of the columns (c,) [Hz], pairs
    """

    def panel(name: str) -> Panel:
        value, model, pairs = found[name]
        tips = [[f"{rows} {f:.2f} Hz\n{name} {g:.2f} Hz\nMAC {value[i, j]:.3f}"
                 for j, g in enumerate(model)] for i, f in enumerate(test)]  # fmt: skip
        names, heads = ([f"{f:.1f}" for f in side] for side in (test, model))
        digits = 0 if len(model) <= _MOST_LABELS // 2 else None
        squares = Matrix(100 * value, names, heads, (0.0, 100.0), "MAC [%]", digits=digits, least=5,
                         tips=tips, frames=pairs,
                         opens=(opens, rows, name) if opens else None)  # fmt: skip
        title = f"{name} [Hz]" if name in ("test", "model") else f"deck {name} [Hz]"
        return Panel((), _places(heads, title), _places(names, f"{rows} [Hz]", True),
                     matrix=squares)  # fmt: skip

    side = min(0.42 * max(len(test), *(len(g) for _, g, _ in found.values())) + 1.9, _HIGHEST)
    panels = [panel(name) for name in found]
    size = len(panels) * (side + 0.6), side
    return Chart.of(*panels, columns=len(panels), height=32, size=size)


def _places(labels: Sequence[str], title: str, down: bool = False) -> ChartAxis:
    """An axis of names at 0, 1, 2 ..."""
    step = 1 + len(labels) // _MOST_LABELS
    limits = (-0.5, len(labels) - 0.5)
    ticks = {float(k): labels[k] for k in range(0, len(labels), step)}
    return ChartAxis(title, ticks=ticks, down=down, limits=limits[::-1] if down else limits)


def matrix(squares: Matrix, **more: Any) -> Chart:
    """Squares with their names."""
    size = (1.0 * len(squares.columns) + 2.6, 0.32 * len(squares.rows) + 1.5)
    axes = _places(squares.columns, ""), _places(squares.rows, "", True)
    return Chart.of(Panel((), *axes, matrix=squares), size=size,
                    height=9 + 1.5 * len(squares.rows), **more)  # fmt: skip


def ladder(test: np.ndarray, sides: Mapping[str, np.ndarray], opens: str = "") -> Chart:
    """Deviation f_model / f_test - 1 of each mode in per cent.

    Parameters
    ----------
    test : (r,) [Hz]
    sides : name: frequencies of the partners (r,) [Hz]; not-a-number without one
    opens : drawing that a click on a bar opens at its mode
    """
    at = np.arange(len(test), dtype=float)
    bars = []
    for name, model in sides.items():
        off = 100 * (np.asarray(model, dtype=float) / test - 1)
        said = ["no partner" if not np.isfinite(v) else f"{v:+.3g} %" for v in off]
        tips = [f"test {f:.2f} Hz\n{name} {s}" for f, s in zip(test, said, strict=True)]
        bars.append(Series(name, at, off, "bars", style(name).get("tint", "before"), tips=tips,
                           opens=opens))  # fmt: skip
    axis = _places([f"{f:.4g}" for f in test], "frequency of the test [Hz]")
    width = min(max(5.0, 0.55 * len(test) + 1.6), _WIDEST)
    panel = Panel(bars, axis, ChartAxis("model - test [%]"), marks=(Mark(0.0, "x", "ink"),))
    return Chart.of(panel, size=(width, 3.4))


def steps(
    sides: Mapping[str, Mapping[str, float]], floors: Mapping[str, float] | None = None,
    of: str = "noise",
) -> Chart:  # fmt: skip
    """Deviation Q from the nominal model, step by step, on each side of the data.

    ``floors`` are the least Q of each side, ``of`` their name. A Q of zero is drawn at the lower
    edge of the logarithmic axis.
    """
    names = list(dict.fromkeys(n for q in sides.values() for n in q))
    tints = dict(zip(sides, ("neutral", "before"), strict=False))
    every = [v for q in (*sides.values(), floors or {}) for v in q.values() if v > 0]
    low, high = min(every, default=1.0) / 2, 3 * max(every, default=1.0)
    points, notes, level = [], [], [np.nansum([*q.values()]) for q in sides.values()]
    for k, (side, q) in enumerate(sides.items()):
        known = [(j, q[n]) for j, n in enumerate(names) if n in q and np.isfinite(q[n])]
        at, value = np.array(known, dtype=float).reshape(-1, 2).T
        at, drawn = at + 0.12 * (2 * k - len(sides) + 1), np.maximum(value, low)
        first = value[0] if len(value) else 0.0
        said = [f"{v:.4g}" + (f" ({round(100 * (v / first - 1)):+d} %)" if j and first else "")
                for j, v in enumerate(value)]  # fmt: skip
        points.append(Series(side, at, drawn, "both", tints[side], size=7, tips=said))
        lift = 1 if level[k] == max(level) else -1  # the lower side has its words below
        notes += [Note(x, y, text, lift) for x, y, text in zip(at, drawn, said, strict=True)]
    lines = [Mark(v, "x", tints[side], "dash", f"{of}, {side}")
             for side, v in (floors or {}).items() if v > 0 and side in sides]  # fmt: skip
    axis = ChartAxis("Q", log=True, limits=(low, high))
    panel = Panel(points, _places(names, ""), axis, marks=lines, notes=notes)
    return Chart.of(panel, size=(max(4.6, 1.9 * len(names)), 3.2))


def odds(rows: Sequence[tuple[str, float, str]]) -> Chart:
    """2 ln Bayes factor of the best explanation against each.

    Parameters
    ----------
    rows : (name, log evidence, why it is not named; "named" of the named one)
    """
    best = max(value for _, value, _ in rows)
    order = sorted(rows, key=lambda row: -row[1])
    against = np.array([2 * (best - value) for _, value, _ in order])
    at, one = np.arange(len(order), dtype=float), np.ones(len(order))
    tips = [f"{n}, 2 ln B {a:.1f}\n{why}" for (n, _, why), a in zip(order, against, strict=True)]
    said = [f"{a:.{1 if a < 10 else 0}f}" for a in against]
    named = np.array([why == "named" for *_, why in order])
    bars = [
        Series("", (against + 1.04)[some], at[some], "bars", tint, base=one[some], lying=True,
               tips=_some(tips, some), labels=_some(said, some))
        for some, tint in ((named, "found"), (~named, "steel")) if some.any()
    ]  # fmt: skip
    ticks = {v + 1.0: str(v) for v in _ODDS}
    right = 1.6 * float(against.max() + 1.04)
    x = ChartAxis("2 ln Bayes factor", log=True, limits=(1.0, right), ticks=ticks)
    panel = Panel(bars, x, _places([n for n, *_ in order], "", True))
    rows_high = 0.3 * len(order) + 1.2
    return Chart.of(panel, size=(7.6, rows_high), height=6 + 1.7 * len(order))


def _some(words: Sequence[str], kept: np.ndarray) -> list[str]:
    return [w for w, k in zip(words, kept, strict=True) if k]


def fit_test(rows: Mapping[str, tuple[float, float, float, float]]) -> Chart:
    """Statistics of the residual, (value, median, low, high), as multiples of their median.

    A value of zero is drawn at the left edge of the logarithmic axis.
    """
    value, median, low, high = np.array(list(rows.values()), dtype=float).T
    value, low, high = value / median, low / median, high / median
    every = np.concatenate([value, low, high])
    edge = 0.8 * float(every[every > 0].min(initial=0.5))
    drawn, at = np.maximum(value, edge), np.arange(len(rows), dtype=float)
    said = [f"{name}: {v:.3g} times the median; 99 % of draws {a:.3g} to {b:.3g}"
            for name, v, a, b in zip(rows, value, low, high, strict=True)]  # fmt: skip
    odd = value > high
    series = [
        Series("99 % of draws", np.maximum(high, edge), at, "bars", "steel", lying=True,
               base=np.maximum(low, edge)),
        Series("median", np.ones(len(at)), at, "points", "soft", symbol="tick", size=11),
        *(Series(name, drawn[some], at[some], "points", tint, size=7, tips=_some(said, some))
          for name, tint, some in (("explained", "after", ~odd), ("not explained", "before", odd))
          if some.any()),
    ]  # fmt: skip
    right = 1.3 * float(np.maximum(every, 1.0).max())
    x = ChartAxis(
        "relative to the median of draws from the model", log=True, limits=(edge / 1.1, right)
    )
    panel = Panel(series, x, _places(list(rows), "", True))
    return Chart.of(panel, size=(7.6, 0.42 * len(rows) + 1.5), height=7 + 2.2 * len(rows))


def over(x: ChartAxis, *panels: tuple[ChartAxis, Sequence[Series]], **more: Any) -> Chart:
    """Panels one below the other over one axis."""
    made = [Panel(series, x, axis) for axis, series in panels]
    return Chart.of(*made, one_x=True, size=(8.2, 1.0 + 2.0 * len(made)),
                    height=8 + 11 * len(made), **more)  # fmt: skip


def section(
    walls: Sequence[tuple[str, np.ndarray]], solids: np.ndarray, axes: Sequence[str], title: str
) -> Chart:
    """A cut to scale: walls (k, 4, 2) of each part, outlines of solids (j, 2, 2) in grey.

    The longer extent is horizontal.
    """
    every = np.concatenate([solids.reshape(-1, 2), *(w.reshape(-1, 2) for _, w in walls)])
    extent = np.ptp(every, axis=0)
    x, y = (0, 1) if extent[0] >= extent[1] else (1, 0)

    def pieces(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        parted = np.pad(corners, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan).reshape(-1, 2)
        return parted[:, x], parted[:, y]

    drawn = [Series(name, *pieces(corners), "shape") for name, corners in walls]
    if len(solids):
        drawn.append(Series("welds, adhesive, solids", *pieces(solids), tint="soft", width=0.8))
    panel = Panel(drawn, ChartAxis(axes[x]), ChartAxis(axes[y]), title, equal=True)
    height = float(np.clip(10 * extent[y] / extent[x], 1.5, 8))
    return Chart.of(panel, size=(11, height + 1), height=8 + 3 * height)
