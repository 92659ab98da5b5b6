"""Charts of a parameter study: slopes, indices, parallel coordinates, results over parameters."""

from collections.abc import Mapping, Sequence

import numpy as np

from chladni.report.words import number
from chladni.view.chart import Chart, ChartAxis, Column, Mark, Matrix, Note, Panel, Series
from chladni.view.charts import FREQUENCY, matrix

Measures = Mapping[str, tuple[np.ndarray, np.ndarray | None]]  # values, half of the interval
MOST = 1000  # samples: a line and words for each
_VIRIDIS = ("#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58",
            "#b5de2b", "#fde725")  # fmt: skip


def slopes(values: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> Chart:
    """Signed values (r, c) as squares with their numbers, blue above zero, red below."""
    most = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    tips = [[f"{row} over {column}: {v:.3g}" for column, v in zip(columns, line, strict=True)]
            for row, line in zip(rows, values, strict=True)]  # fmt: skip
    return matrix(Matrix(values, rows, columns, (-most, most), colours="RdBu", digits=2, tips=tips))


def indices(results: Mapping[str, Measures], parameters: Sequence[str], axis: str) -> Chart:
    """Measures (d,) of each result with half of their intervals, as bars."""
    at = np.arange(len(parameters), dtype=float)
    ticks = {float(k): name for k, name in enumerate(parameters)}

    def panel(measures: Measures) -> Panel:
        bars = []
        for k, (name, (value, half)) in enumerate(measures.items()):
            tint, spread = ("neutral", "before")[k % 2], [""] * len(value)
            if half is not None:
                spread = [f" ± {h:.3g}" for h in half]
            tips = [f"{p}\n{name} {v:.4g}{s}" for p, v, s in
                    zip(parameters, value, spread, strict=True)]  # fmt: skip
            ends = None if half is None else (value - half, value + half)
            bars.append(Series(name, value, at, "bars", tint, lying=True, tips=tips, ends=ends))
        return Panel(bars, ChartAxis(axis), ChartAxis(ticks=ticks, down=True))

    views = {result: [panel(measures)] for result, measures in results.items()}
    many = len(next(iter(results.values())))
    return Chart(views, height=8 + 1.6 * len(parameters) * many, choice="result",
                 size=(7.0, 1.2 + 0.35 * len(parameters) * many))  # fmt: skip


def samples(columns: Sequence[Column]) -> list[str]:
    """Words on each of the first samples."""
    count = min(MOST, len(columns[0].values))
    return [
        "\n".join([f"sample {n}", *(f"{c.name}: {number(float(c.values[n]))}" for c in columns)])
        for n in range(count)
    ]


def parallel(axes: Sequence[Column], said: Sequence[str], by: int) -> Chart:
    """Every sample as a line across the axes, each from its least value (below) to its largest.

    Parameters
    ----------
    said : words on each sample
    by : axis that gives the colour at first
    """
    whole = np.stack([np.asarray(c.values, float) for c in axes], axis=1)[:MOST]
    kept = np.flatnonzero(np.isfinite(whole).all(axis=1))
    each = zip(axes, whole[kept].T, strict=True)
    run = np.stack([np.log(v) if c.log else v for c, v in each], axis=1)
    low, high = run.min(axis=0), run.max(axis=0)
    place = np.where(high > low, (run - low) / np.where(high > low, high - low, 1.0), 0.5)
    tints = np.rint((len(_VIRIDIS) - 1) * place).astype(int)
    across, one = np.arange(len(axes) + 1.0), np.full(1, np.nan)
    across[-1] = np.nan
    opacity = float(np.clip(40 / max(len(kept), 1), 0.15, 0.9))

    def lines(some: np.ndarray, tint: str) -> Series:
        y = np.hstack([place[some], np.full((len(some), 1), np.nan)])
        number_of = np.hstack([np.repeat(kept[some, None], len(axes), axis=1),
                               np.full((len(some), 1), -1)])  # fmt: skip
        tips = [said[n] if n >= 0 else "" for n in number_of.ravel()]
        return Series("", np.tile(across, len(some)), y.ravel(), "both", tint, width=1.0, size=2.5,
                      opacity=opacity, tips=tips, sample=number_of.ravel())  # fmt: skip

    none = np.zeros(0, int)
    ends = [(float(whole[kept, k].min()), float(whole[kept, k].max())) for k in range(len(axes))]
    scale = Series("", np.array([0.0, 0.0]), np.array([np.nan, np.nan]), "points",
                   values=np.array(ends[by]))  # fmt: skip
    series = [
        lines(none, "line"),
        *(lines(np.flatnonzero(tints[:, by] == k), tint) for k, tint in enumerate(_VIRIDIS)),
        scale,
        Series("", one, one, "both", "found", width=3.0),
    ]
    notes = [Note(float(k), y, f"{v:.4g}") for k, both in enumerate(ends)
             for y, v in zip((-0.06, 1.06), both, strict=True)]  # fmt: skip
    names = {float(k): c.name for k, c in enumerate(axes)}
    panel = Panel(
        series, ChartAxis(ticks=names, limits=(-0.4, len(axes) - 0.6)),
        ChartAxis(limits=(-0.11, 1.11),
        bare=True), marks=[Mark(float(k)) for k in range(len(axes))],
        notes=notes,
    )  # fmt: skip
    order = [by, *(k for k in range(len(axes)) if k != by)]
    shades = {axes[k].name: (tints[:, k].tolist(), ends[k]) for k in order}
    return Chart.of(panel, size=(1.5 * len(axes) + 1.5, 4.2), height=28, tints_of=shades)


def cloud(table: Sequence[Column], said: Sequence[str], x: int, y: int) -> Chart:
    """One column over another; a reader may put any of them on the axes."""
    shown = [Column(c.name, c.values[:MOST], c.log, c.nominal) for c in table]
    panel = over(shown[x], shown[y])
    (points,) = panel.series
    series = Series("", points.x, points.y, "points", "neutral", size=5, opacity=0.75, tips=said)
    return Chart.of(Panel([series], panel.x, panel.y), table=shown, size=(7.0, 4.5))


def results_over_parameters(parameters: Sequence[Column], results: Sequence[Column]) -> Chart:
    """Every result (row) over every parameter (column); lines show the deck's own values."""
    panels = [over(x, y) for y in results for x in parameters]
    size = (2.5 * len(parameters) + 0.8, 1.9 * len(results) + 0.6)
    return Chart.of(*panels, columns=len(parameters), size=size)


def over(x: Column, y: Column) -> Panel:
    """One column over another, with the deck's own values."""
    marks = [Mark(c.nominal, along, "before", "dash")  # type: ignore[arg-type]
             for c, along in ((x, "y"), (y, "x")) if np.isfinite(c.nominal)]  # fmt: skip
    points = Series("", np.asarray(x.values, float), np.asarray(y.values, float), "points", "after",
                    size=3, opacity=0.6)  # fmt: skip
    return Panel([points], ChartAxis(x.name, x.log), ChartAxis(y.name, y.log), marks=marks)


def spread(f: np.ndarray, H: np.ndarray, names: Sequence[str], axis: str) -> Chart:
    """Magnitudes H (n, lines, c) of samples over frequency [Hz], with their median, by channel."""
    x = np.tile(np.append(f, np.nan), len(H))

    def panel(values: np.ndarray) -> Panel:
        every = np.hstack([values, np.full((len(values), 1), np.nan)]).ravel()
        lines = Series("samples", x, every, tint="soft", width=0.8, opacity=0.5)
        middle = Series("median", f, np.median(values, axis=0), tint="after", width=1.8)
        return Panel([lines, middle], FREQUENCY, ChartAxis(axis, log=True))

    views = {name: [panel(H[:, :, k])] for k, name in enumerate(names)}
    return Chart(views, size=(8.2, 4.2), height=28, choice="channel")
