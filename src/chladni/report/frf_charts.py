"""Responses as charts: their lines thinned without losing a peak, the channels that matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.frf import UNIT
from ..ema.correlation import deviation
from ..view import charts
from ..view.chart_page import extremes
from .blocks import Still, still
from .words import number

if TYPE_CHECKING:
    from ..dynamics.frf import FRF
    from ..view.chart import Chart

_VALUES = 1_200_000  # complex numbers on a page: about 5 MB
_LINES = 300  # at least, of every channel
_GRID = 8  # channels in the overview
Row = tuple[str, str, float]  # name of a view, its output, Q of the last curve
CAPTION = "Drag to zoom, double-click to see all, click a name to hide its curve."
OF_CURVES = (
    "Q of curves: of the channel, over all lines, with the damping as drawn; scores have one "
    "damping for all."
)


def typical(chart: Chart, rows: Sequence[Row], outputs: Sequence[str] = ()) -> Still:
    """The channel with the median deviation, of all or of some outputs."""
    some = sorted((off, name) for name, output, off in rows if not outputs or output in outputs)
    return still(chart.at(some[len(some) // 2][1]))


def overview(chart: Chart, most: int = _GRID) -> Still:
    """Small pictures of channels spread evenly over the list."""
    names = list(chart.views)
    some = np.unique(np.linspace(0, len(names) - 1, most).astype(int))
    return still(chart.grid([names[k] for k in some]))


def responses(
    curves: Mapping[str, FRF],
    fitted: charts.Bands = (),
    excluded: charts.Bands = (),
    held_out: Sequence[str] = (),
    share: int = 1,
    unit: str | None = None,
) -> tuple[Chart, list[Row]]:
    """A view for every channel of curves on the same lines, first the test; and its rows.

    Parameters
    ----------
    held_out : outputs that were not fitted
    share : number of such drawings on the page
    unit : of the responses; None: that of motion over force
    """
    test, *others = curves.values()
    channels = [(i, j) for j in range(len(test.inputs)) for i in range(len(test.outputs))]
    per_channel = _VALUES // len(curves) // share
    lines = thinned(test, max(_LINES, per_channel // len(channels)))
    off = {n: _off(c, test) for n, c in curves.items() if c is not test}
    last = list(off.values())[-1] if off else np.abs(test.values).max(axis=0)
    room = max(1, per_channel // len(lines))
    if len(channels) > room:  # the worst ones are looked for, of one curve the largest
        order = sorted(channels, key=lambda c: -last[c])
        channels = sorted(order[:room], key=lambda c: c[::-1])
    f, held = test.frequency[lines], set(held_out)
    names = {}
    for i, j in channels:
        each = ", ".join(f"{name} {number(v[i, j], 3)}" for name, v in off.items())
        q = f", Q of curves: {each}" if each else ""
        out = " (held out)" if test.outputs[i] in held else ""
        names[i, j] = f"{test.outputs[i]} from {test.inputs[j]}{out}{q}"
    shown = {names[c]: {n: (f, r.values[lines, *c]) for n, r in curves.items()} for c in channels}
    gamma = None
    if test.coherence is not None:
        gamma = {names[c]: (f, np.round(test.coherence[lines, *c], 3)) for c in channels}
    worst = {"worst": int(np.argmax([last[c] for c in channels]))} if others else {}
    unit = UNIT.get(test.quantity, "") if unit is None else unit
    quantity = f"{test.quantity} [{unit}]" if unit else str(test.quantity)
    grey = _unfitted(test.frequency, fitted, excluded)
    made = charts.responses(shown, quantity, grey, gamma, worst)
    return made, [(names[c], test.outputs[c[0]], float(last[c])) for c in channels]


def _unfitted(
    frequency: np.ndarray, fitted: charts.Bands, excluded: charts.Bands
) -> list[tuple[float, float]]:
    """The bands that are not fitted, within the lines [Hz]."""
    low, high = float(frequency[0]), float(frequency[-1])
    inside = [(max(a, low), min(b, high)) for a, b in fitted]
    ends = [low, *(e for band in inside for e in band), high] if inside else []
    free = [(a, b) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]
    return free + [(max(a, low), min(b, high)) for a, b in excluded]


def thinned(frf: FRF, most: int) -> np.ndarray:
    """Positions of at most ``most`` lines: of every block the highest and the lowest."""
    return extremes(np.log(np.maximum((np.abs(frf.values) ** 2).sum(axis=(1, 2)), 1e-300)), most)


def _off(curve: FRF, test: FRF) -> np.ndarray:
    """Q of every channel (n_out, n_in); 0 where a response is exactly zero, as at a support."""
    out = np.zeros(test.values.shape[1:])
    alive = np.flatnonzero((test.values * curve.values).all(axis=(0, 2)))
    if len(alive):
        names = [test.outputs[k] for k in alive]
        with np.errstate(invalid="ignore"):
            q = np.abs(deviation(curve.sel(names), test.sel(names))) ** 2
            out[alive] = np.nan_to_num(np.nanmean(q, axis=0))
    return out
