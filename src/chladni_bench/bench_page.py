"""A virtual test as a page: the test setup, the schedule, a time signal, FRFs, overloads."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.report import frf_charts
from chladni.report.blocks import Block, Drawing, Facts, PageParts, Section, Table, still
from chladni.report.words import number
from chladni.view.chart import Chart, ChartAxis, Series
from chladni.view.chart_page import extremes
from chladni.view.charts import over

from .bench_recording import BenchRecording
from .bench_workflow import BenchResult, level_unit

_SHOWN = 2  # responses drawn over time
_POINTS = 2000  # of a curve


def as_page(folder: Path, found: BenchResult) -> PageParts:
    """Sections of the page."""
    first = found.recordings[0]
    blocks: list[Block] = [Facts(_facts(found)), _table(found)]
    if found.schedule and first.transient is not None and first.force is not None:
        text = (
            f"The schedule: force and transient of every line of article {first.article}, all "
            "sweeps (largest transient of any channel, antiresonances included)."
        )
        chart = sine_schedule(found, first.force, first.transient)
        blocks.append(Drawing("schedule", chart, text, what="the schedule of the stepped sine"))
    if first.sample is not None:
        chart = over_time(*_signals(first, _drive(found)))
        text = "One block of time data from the front end."
        blocks.append(Drawing("time", chart, text, what="one block of time data"))
    frf = first.frf
    ideal = replace(frf, values=first.truth[:, :, None], coherence=None, variance=None)
    chart, rows = frf_charts.responses({"recorded": frf, "ideal": ideal})
    k = _typical(first)
    view = next((name for name, output, _ in rows if output == frf.outputs[k]), rows[0][0])
    blocks.append(Drawing(
        "frf", chart, "An estimated FRF, and the FRF of ideal sensors and an ideal front end at "
        "the same places.", {"frf": still(chart.at(view))}, "an FRF and its coherence",
    ))  # fmt: skip
    return PageParts(lead(found), [Section("The test", blocks)], found.notes)


def sine_schedule(found: BenchResult, force: np.ndarray, transient: np.ndarray) -> Chart:
    """Cycles waited and measured at each line; drive and transient (k, n) of every sweep."""
    f, delay, measure = np.array([(x.frequency, x.delay, x.measure) for x in found.schedule]).T

    def sweeps(what: str, values: np.ndarray, tint: str) -> list[Series]:
        rows = enumerate(np.atleast_2d(values), 1)
        return [_thinned(f"{what}, sweep {k}", f, y, tint) for k, y in rows]

    cycles = [_thinned("waited", f, delay, "ink"), _thinned("measured", f, measure, "after")]
    left = 100 * np.maximum(transient, 1e-12)
    return over(
        ChartAxis("frequency [Hz]", log=True),
        (ChartAxis("cycles", log=True), cycles),
        (ChartAxis(_drive(found), log=True), sweeps("drive", force, "after")),
        (ChartAxis("transient left [%]", log=True), sweeps("transient", left, "before")),
    )


def over_time(t: np.ndarray, signals: Mapping[str, np.ndarray]) -> Chart:
    """Signals (n,) by name and unit, one below the other, over time (n,) [s]."""
    panels = [(ChartAxis(name), [_thinned("", t, x, "ink")]) for name, x in signals.items()]
    return over(ChartAxis("time [s]"), *panels)


def _thinned(name: str, x: np.ndarray, y: np.ndarray, tint: str) -> Series:
    at = extremes(y, _POINTS)
    return Series(name, x[at], y[at], tint=tint, width=1.0)


def in_words(found: BenchResult) -> PageParts:
    """The page without its pictures."""
    blocks: list[Block] = [Facts(_facts(found)), _table(found)]
    return PageParts(lead(found), [Section("The test", blocks)], found.notes)


def as_json(found: BenchResult) -> dict[str, Any]:
    """``bench.json``: what was tested and how well; nothing of what is sealed."""
    return {
        "excitation": found.settings.excitation,
        "band_hz": found.band,
        "outputs": found.outputs.labels,
        "input": found.inputs.labels[0],
        "mass_kg": found.mass,
        "recordings": [
            {
                "article": r.article,
                f"level_{'m_s2' if found.inputs.base[0] else 'n'}": r.test.level,
                "lines": len(r.frf.frequency),
                "averages": r.averages,
                "coherence_median": None
                if r.frf.coherence is None
                else float(np.median(r.frf.coherence)),
                "overloads": r.overloads,
                "transient_largest": None if r.transient is None else float(r.transient.max()),
            }
            for r in found.recordings
        ],
        "notes": found.notes,
    }


def lead(found: BenchResult) -> str:
    """The test in one sentence."""
    s, r = found.settings, found.recordings
    low, high = found.band
    hidden, loud = len(s.hide) + len(s.local), sum(bool(x.overloads) for x in r)
    return (
        f"{len(r)} recording{'s' * (len(r) > 1)} of {s.articles} article{'s' * (s.articles > 1)} "
        f"by {s.excitation}, "
        f"{len(found.outputs.labels)} sensors, {number(low)} to {number(high)} Hz"
        + (f"; {hidden} concealed" if hidden else "")
        + (f"; {loud} of them overloaded" if loud else "")
    )


def _facts(found: BenchResult) -> list[tuple[str, str]]:
    s, first = found.settings, found.recordings[0]
    at, usual = found.outputs, found.setup.accelerometer.mass
    each = np.where(at.mass > 0, at.mass, usual) / at.channels
    return [
        ("Driven at", found.inputs.labels[0]),
        ("Sensors", f"{len(set(at.device))}, {number(1e3 * each.sum())} g in all"),
        ("Channels", str(len(at.labels))),
        ("Weighed", f"{number(found.mass, 5)} kg"),
        ("Lines", str(len(first.frf.frequency))),
        ("Articles", f"{s.articles}, " + ("the deck's own" if s.exact else "scattered")),
        *([("Vibration from the room", f"{number(s.room, 3)} m/s² rms")] if s.room else []),
    ]


def _table(found: BenchResult) -> Table:
    rows = []
    for r in found.recordings:
        gamma = None if r.frf.coherence is None else float(np.median(r.frf.coherence))
        felt = np.abs(r.truth) > 0  # what is held moves nowhere
        error = np.abs(r.frf.values[:, :, 0][felt] / r.truth[felt] - 1)
        over = ", ".join(f"{k} ({n})" for k, n in r.overloads.items()) or "none"
        rows.append((r.article, number(r.test.level, 3), number(gamma, 6),
                     number(100 * float(np.median(error)), 2), over))  # fmt: skip
    heads = (
        "article",
        f"level [{level_unit(found.inputs)}]",
        "coherence",
        "deviation from the ideal FRF [%]",
        "overloaded",
    )
    caption = "Medians over lines and channels; overloads with their blocks or lines."
    return Table(heads, rows, ("article", "overloaded"), caption)


def _typical(r: BenchRecording) -> int:
    """The channel of median level."""
    size = np.abs(r.frf.values[:, :, 0]).mean(axis=0)
    return int(np.argsort(size)[len(size) // 2])


def _drive(found: BenchResult) -> str:
    """Return the excited quantity with its unit."""
    what = "base" if found.inputs.base[0] else "force"
    return f"{what} [{level_unit(found.inputs)}]"


def _signals(r: BenchRecording, drive: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time [s] and signals (n,) of the first block: drive and some responses."""
    record = r.sample
    assert record is not None
    t = np.arange(record.force.shape[2]) / record.rate
    signals: dict[str, np.ndarray] = {drive: record.force[0, 0]}
    for k in range(min(_SHOWN, len(record.outputs))):
        signals[f"{record.outputs[k]} [m/s²]"] = record.response[0, k]
    return t, signals
