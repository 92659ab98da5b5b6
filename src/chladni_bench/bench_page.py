"""A virtual test as a page: the test setup, the schedule, a time signal, FRFs, overloads."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import UNIT
from chladni.report import live_pages as live
from chladni.report import live_panels
from chladni.report.blocks import Block, Facts, PageParts, Picture, Section, Table
from chladni.report.live_pages import Page
from chladni.report.words import number

from .bench_recording import BenchRecording
from .bench_workflow import BenchResult, level_unit

_SHOWN = 2  # responses drawn over time


def bench_page(folder: Path, found: BenchResult) -> PageParts:
    """Sections of the page; its pictures are written into the folder."""
    from . import bench_plots

    files: list[tuple[str, str]] = []
    first, page = found.recordings[0], Page()
    blocks: list[Block] = [Facts(_facts(found)), _table(found)]
    if found.schedule and first.transient is not None and first.force is not None:
        path = folder / "schedule.png"
        lines = np.array([(x.frequency, x.delay, x.measure) for x in found.schedule])
        f, delay, measure = lines.T
        drive = _drive(found)
        bench_plots.sine_schedule(path, f, delay, measure, first.force, first.transient, drive)
        still = Picture(path, "The schedule: force and transient of every line of article "
                              f"{first.article}, all sweeps (largest transient of any channel, "
                              "antiresonances included).")  # fmt: skip
        data = live_panels.schedule(f, delay, measure, first.force, first.transient, drive)
        blocks.append(live.panels(page, path.stem, data, still))
        files.append((path.name, "the schedule of the stepped sine"))
    if first.sample is not None:
        path, t, signals = folder / "time.png", *_signals(first, _drive(found))
        title = f"Article {first.article}, {first.test.excitation}"
        bench_plots.time_histories(path, t, signals, title)
        still = Picture(path, "One block of time data from the front end.")
        blocks.append(live.panels(page, path.stem, live_panels.over_time(t, signals), still))
        files.append(("time.png", "one block of time data"))
    k = _typical(first)
    path = folder / "frf.png"
    frf = first.frf
    coherence = np.ones(len(frf.frequency)) if frf.coherence is None else frf.coherence[:, k, 0]
    name = f"{frf.outputs[k]} from {frf.inputs[0]}, article {first.article}"
    bench_plots.frf_over_coherence(
        path, frf.frequency, frf.values[:, k, 0], first.truth[:, k], coherence, name,
        UNIT.get(frf.quantity, ""),
    )  # fmt: skip
    still = Picture(path, "An estimated FRF, and the FRF of ideal sensors and an ideal front end "
                          "at the same places.")  # fmt: skip
    ideal = replace(frf, values=first.truth[:, :, None], coherence=None, variance=None)
    blocks.append(live.responses(page, path.stem, {"recorded": frf, "ideal": ideal}, [still]))
    files.append((path.name, "an FRF and its coherence"))
    sections = [Section("The test", blocks)]
    return PageParts(lead(found), sections, found.notes, files, page.drawings)


def in_words(found: BenchResult) -> PageParts:
    """The page without its pictures."""
    blocks: list[Block] = [Facts(_facts(found)), _table(found)]
    return PageParts(lead(found), [Section("The test", blocks)], found.notes)


def bench_json(found: BenchResult) -> dict[str, Any]:
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
