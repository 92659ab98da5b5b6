"""Modes over levels of excitation: tables and pictures of a page."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..ema.finding import TINY
from ..ema.level_study import CALM
from ..ema.level_table import LevelRow, LevelTable
from ..view.chart import Chart, ChartAxis, Series
from ..view.charts import over
from .blocks import Block, Drawing, Items, Section, Table
from .words import interval, number

SHOWN = 6  # modes that are drawn
_WHAT = (
    "Measured values and three models. 'element': the first of the elements below, fitted to all "
    "levels. 'predicted': an element chosen and fitted without these levels. 'linear': the mean "
    "of the fitted levels. The amplitude is the displacement of the output at which the mode was "
    "seen."
)
_EVERY = (
    "Every mode at every level, with the 95 % interval from the recording's noise; runs repeat to "
    "0.05 % in frequency and 5 % in damping. The amplitude is the displacement of the output at "
    "which the mode was seen; –: not found at that level."
)
_ELEMENTS = (
    "Best first. Runs of one level are assumed to repeat to 0.05 % in frequency and 5 % in "
    "damping. p below 0.01: the element does not explain the levels."
)


def level_section(tables: Sequence[LevelTable], drawn: Mapping[int, Block]) -> Section:
    """Tabulate all modes, all modes at every level, then each moving mode; none without levels.

    Parameters
    ----------
    drawn : drawings by the position of the mode
    """
    if not tables:
        return Section("Levels", [])
    blocks: list[Block] = [_summary(tables), _every_level(tables)]
    for k, t in enumerate(tables):
        if t.signature in CALM:
            continue
        blocks += [Items([t.sentence + "."])] if t.sentence else []
        blocks += [_levels(t)]
        blocks += [drawn[k]] if k in drawn else []
        blocks += [_elements(t)] if t.elements else []
    return Section("Levels", blocks)


def _summary(tables: Sequence[LevelTable]) -> Table:
    rows = [
        (
            str(k),
            number(t.rows[0].frequency_hz, 5),
            number(t.rows[-1].frequency_hz, 5),
            number(100 * t.rows[0].damping, 3),
            number(100 * t.rows[-1].damping, 3),
            str(len(t.rows)),
            _p(t.p_frequency),
            _p(t.p_damping),
            t.signature,
        )
        for k, t in enumerate(tables, 1)
    ]
    heads = ("mode", "Hz, lowest level", "highest", "damping [%], lowest", "highest ", "levels",
             "p of one frequency", "p of one damping", "signature")  # fmt: skip
    caption = "p: probability of such differences if the mode has one frequency and one damping."
    return Table(heads, rows, ("signature",), f"Modes over levels; {caption}")


def _every_level(tables: Sequence[LevelTable]) -> Table:
    """Tabulate measured modes by level; a level without the mode has a row of dashes."""
    levels = sorted({r.level for t in tables for r in t.rows})
    rows = []
    for k, t in enumerate(tables, 1):
        held = {r.level: r for r in t.rows}
        for level in levels:
            r = held.get(level)
            rows.append((str(k), number(level), *(_measured(r) if r else ("–",) * 5)))
    heads = ("mode", "level", "amplitude [mm]", "Hz", "Hz, 95 %", "damping [%]", "damping, 95 %")
    return Table(heads, rows, caption=_EVERY)


def _measured(r: LevelRow) -> tuple[str, ...]:
    f = f"{number(r.frequency_low_hz, 6)} to {number(r.frequency_high_hz, 6)}"
    z = f"{number(_percent(r.damping_low), 3)} to {number(_percent(r.damping_high), 3)}"
    a = number(1e3 * r.amplitude_m, 3)
    return a, number(r.frequency_hz, 6), f, number(100 * r.damping, 3), z


def _levels(t: LevelTable) -> Table:
    rows = [
        (
            number(r.level),
            number(1e3 * r.amplitude_m, 3),
            f"{number(r.frequency_hz, 6)} ± {number(r.frequency_sd_hz, 2)}",
            number(r.fitted_hz, 6),
            number(r.foretold_hz, 6),
            number(t.mean_hz if r.foretold_hz else None, 6),
            f"{number(100 * r.damping, 3)} ± {number(100 * r.damping_sd, 2)}",
            number(_percent(r.fitted_damping), 3),
            number(_percent(r.foretold_damping), 3),
            number(_percent(t.mean_damping if r.foretold_hz else None), 3),
        )
        for r in t.rows
    ]
    heads = ("level", "amplitude [mm]", "Hz", "element", "predicted", "linear",
             "damping [%]", "element ", "predicted ", "linear ")  # fmt: skip
    return Table(heads, rows, caption=f"{t.output}. {_WHAT}")


def _elements(t: LevelTable) -> Table:
    rows = [
        (
            e.name,
            number(e.chi2, 3),
            str(e.data),
            number(e.bic, 3),
            _p(e.p),
            "; ".join(f"{n.name} {interval(n.value, n.low, n.high, n.unit)}" for n in e.numbers),
        )
        for e in t.elements
    ]
    heads = ("element", "χ²", "data", "BIC", "p", "numbers (95 %)")
    return Table(heads, rows, ("element", "numbers (95 %)"), _ELEMENTS)


def _p(p: float | None) -> str:
    return number(p, 2) if p is None or p >= TINY else f"< {TINY:g}"


def _percent(x: float | None) -> float | None:
    return None if x is None else 100 * x


def moving(tables: Sequence[LevelTable]) -> list[int]:
    """Positions of the modes that are drawn: the first that depend on the level."""
    return [k for k, t in enumerate(tables) if t.signature not in CALM][:SHOWN]


def over_levels(t: LevelTable) -> Chart:
    """Frequency and damping of one mode over its amplitude: measured, fitted, predicted, linear."""
    rows = [(r.amplitude_m, r.frequency_hz, r.frequency_sd_hz, r.foretold_hz,
             r.damping, r.damping_sd, r.foretold_damping) for r in t.rows]  # fmt: skip
    a, *values = np.array(rows, dtype=float).T
    fitted = np.array(t.curve, dtype=float).reshape(-1, 3).T
    element = t.elements[0].name if t.elements else "the element"

    def side(measured: Sequence[np.ndarray], line: np.ndarray, mean: float | None) -> list[Series]:
        value, sd, foretold = measured
        ends = value - 2 * sd, value + 2 * sd
        series = [Series("measured", 1e3 * a, value, "points", "ink", ends=ends)]
        if len(line):
            name = f"{element}, fitted to all"
            series.append(Series(name, 1e3 * fitted[0], line, tint="after"))
        if np.isfinite(foretold).any():
            series.append(
                Series("predicted from the others", 1e3 * a, foretold, "points", "after",
                       symbol="diamond", size=8)
            )  # fmt: skip
        if mean:
            level = 1e3 * a[[0, -1]], np.full(2, mean)
            series.append(Series("one linear model", *level, tint="before", dash="dash"))
        return series

    mean = None if t.mean_damping is None else 100 * t.mean_damping
    return over(
        ChartAxis("amplitude [mm]", log=True),
        (ChartAxis("natural frequency [Hz]"), side(values[:3], fitted[1], t.mean_hz)),
        (ChartAxis("damping [% of critical]", zero=True),
         side([100 * v for v in values[3:]], 100 * fitted[2], mean)),
    )  # fmt: skip


def level_drawings(tables: Sequence[LevelTable], stem: str = "") -> dict[int, Drawing]:
    """Modes that depend on the level over it, by the position of the mode."""
    return {
        k: Drawing(f"levels{stem}_{k + 1}", over_levels(tables[k]), what="a mode over levels",
                   place="levels")
        for k in moving(tables)
    }  # fmt: skip
