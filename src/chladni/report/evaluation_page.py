"""The evaluation of a test as a page: findings, FRFs, coherence, distortion, free decays."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics.frf import FRF, UNIT
from ..ema.level_table import level_tables
from ..ema.ring_down import RingDown
from ..io.tables.write_tables import write_npz
from ..io.uff.estimate_stamp import stamp
from ..io.uff.write_uff import write_uff
from ..view.chart import Chart, ChartAxis, Series
from ..view.chart_page import extremes
from ..view.charts import FREQUENCY, over
from ..workflows.evaluation import Evaluation, RecordingEvaluation
from . import frf_charts
from .blocks import Block, Drawing, PageParts, Section, Table
from .level_blocks import level_drawings, level_section
from .screening_blocks import lead_of, screening_json, screening_section
from .typed_fields import as_data
from .words import number

_SHOWN = 12  # channels drawn
_POINTS, _LEAST = 2000, 200  # of a curve; of one among many


def as_page(folder: Path, found: Evaluation) -> PageParts:
    """Sections of the page; the FRFs of time data are written into the folder."""
    sections = [screening_section(*(r.screening for r in found.recordings))]
    files: list[tuple[str, str]] = []
    share = len(found.recordings)
    for k, r in enumerate(found.recordings):
        stem = "" if len(found.recordings) == 1 else f"_{k + 1}"
        files += _written(folder, stem, r)
        sections.append(Section(r.recording.name, _blocks(stem, r, share)))
        if r.levels.nonlinear:
            tables = level_tables(r.levels)
            of = f"Free decays of {r.recording.name} by amplitude"
            drawn = level_drawings(tables, f"_decay{stem}")
            sections.append(replace(level_section(tables, drawn), title=of))
    lead = lead_of([r.screening for r in found.recordings])
    return PageParts(lead, sections, found.notes, files)


def in_words(found: Evaluation) -> PageParts:
    """The page without its pictures."""
    sections = [screening_section(*(r.screening for r in found.recordings))]
    for r in found.recordings:
        if r.recording.frf is not None:
            sections.append(Section(r.recording.name, [_table(r.recording.frf)]))
    return PageParts(lead_of([r.screening for r in found.recordings]), sections, found.notes)


def _written(folder: Path, stem: str, r: RecordingEvaluation) -> list[tuple[str, str]]:
    """The FRFs of time data as a universal file in text and in binary, and as arrays."""
    if r.estimate is None or r.recording.frf is None:
        return []
    frf = r.estimate.frf
    line = stamp(r.estimate.averages, r.estimate.added_damping)
    names = (f"frf{stem}.uff", f"frf{stem}_58b.uff", f"frf{stem}.npz")
    write_uff(folder / names[0], frf, r.recording.nodes, title=line)
    write_uff(folder / names[1], frf, r.recording.nodes, title=line, binary=True)
    write_npz(folder / names[2], frf)
    what = ("FRFs and coherence for a case (58)", "the same in binary (58b)", "with the variance")
    return list(zip(names, what, strict=True))


def _blocks(stem: str, r: RecordingEvaluation, share: int) -> list[Block]:
    """Draw FRFs, coherence, distortion and free decays; the page shows ``share`` recordings."""
    frf = r.recording.frf
    assert frf is not None
    channels = [(i, j) for j in range(len(frf.inputs)) for i in range(len(frf.outputs))][:_SHOWN]
    chart, _ = frf_charts.responses({"test": frf}, share=share)
    grid = {f"frf_grid{stem}": frf_charts.overview(chart)}
    caption = frf_charts.CAPTION
    blocks: list[Block] = [_table(frf), Drawing(f"frf_grid{stem}", chart, caption, grid, "FRFs")]
    if frf.coherence is not None:
        alone = len(frf.inputs) == 1
        lines = {
            frf.outputs[i] if alone else f"{frf.outputs[i]} from {frf.inputs[j]}":
            frf.coherence[:, i, j] for i, j in channels
        }  # fmt: skip
        axis, text = ChartAxis("coherence [-]", limits=(0.0, 1.02)), "Low: noise or leakage."
        drawn = over_frequency(frf.frequency, lines, axis, share)
        blocks.append(Drawing(f"coherence{stem}", drawn, text, what="coherence"))
    distortion = r.estimate.distortion if r.estimate is not None else None
    if distortion is not None:
        each = {o: 100 * distortion[:, i] for i, o in enumerate(frf.outputs[:_SHOWN])}
        axis = ChartAxis("harmonics 2 to 5 [%]", zero=True)
        drawn = over_frequency(frf.frequency, each, axis, share)
        text = "Harmonics of the responses over their fundamental."
        blocks.append(Drawing(f"distortion{stem}", drawn, text, what="harmonic distortion"))
    if r.decays:
        text = "Frequency and damping against amplitude."
        drawn = over_amplitude(r.decays)
        blocks += [_decays(r.decays), Drawing(f"decays{stem}", drawn, text, what="free decays")]
    return blocks


def over_frequency(
    f: np.ndarray, lines: Mapping[str, np.ndarray], axis: ChartAxis, share: int = 1
) -> Chart:
    """Real functions of frequency (n,) [Hz] by channel; ``share`` such drawings are on the page."""
    most = max(_LEAST, _POINTS // share)
    series = []
    for name, y in lines.items():
        at = extremes(np.nan_to_num(y), most)
        series.append(Series(name, f[at], y[at], width=1.0))
    return over(FREQUENCY, (axis, series))


def over_amplitude(decays: Sequence[RingDown]) -> Chart:
    """Frequency relative to the faintest, and damping, against the amplitude of free decays."""
    both = [(f"{number(d.frequency)} Hz, {d.output}", d) for d in decays]
    f = [Series(n, d.amplitude, 100 * (d.frequency_at / d.frequency_at[-1] - 1), "both")
         for n, d in both]  # fmt: skip
    z = [Series(n, d.amplitude, 100 * d.damping_at, "both") for n, d in both]
    x = ChartAxis("amplitude of the response [SI]", log=True)
    return over(
        x, (ChartAxis("frequency, relative [%]"), f), (ChartAxis("damping [%]", zero=True), z)
    )


def _table(frf: FRF) -> Table:
    """Level, coherence and spread of every channel."""
    rows = []
    for j, drive in enumerate(frf.inputs):
        for i, output in enumerate(frf.outputs):
            H = frf.values[:, i, j]
            size = np.abs(H)
            coherence = None if frf.coherence is None else float(np.median(frf.coherence[:, i, j]))
            sd = None
            if frf.variance is not None:
                noise = np.sqrt(frf.variance[:, i, j])
                sd = 100 * float(np.median(noise / np.maximum(size, 1e-300)))
            peak = frf.frequency[size.argmax()]
            cells = (number(size.max()), number(peak), number(coherence, 3), number(sd, 2))
            rows.append((output, drive, *cells))
    unit = UNIT.get(frf.quantity, "-")
    heads = ("output", "input", f"largest [{unit}]", "at [Hz]", "coherence", "± %")
    f = frf.frequency
    caption = (
        f"{len(f)} lines from {number(float(f[0]))} to {number(float(f[-1]))} Hz; medians over "
        "them of the coherence and of the standard deviation."
    )
    return Table(heads, rows, ("output", "input"), caption)


def _decays(decays: tuple[RingDown, ...]) -> Table:
    rows = [
        (
            d.output,
            number(d.frequency, 5),
            number(100 * d.damping, 3),
            f"{number(100 * d.damping_at[0], 3)} to {number(100 * d.damping_at[-1], 3)}",
            f"{number(d.frequency_at[0], 5)} to {number(d.frequency_at[-1], 5)}",
        )
        for d in decays
    ]
    heads = ("output", "Hz", "damping [%]", "damping, loud to faint [%]", "Hz, loud to faint")
    return Table(heads, rows, ("output",), "Free decays, each followed until it reaches its noise.")


def as_json(result: Evaluation) -> dict[str, Any]:
    """The result for ``test.json``."""
    return {"recordings": [_evaluated(r) for r in result.recordings]}


def _evaluated(r: RecordingEvaluation) -> dict[str, Any]:
    e, frf = r.estimate, r.recording.frf
    assert frf is not None
    found: dict[str, Any] = {
        "name": r.recording.name,
        "quantity": frf.quantity,
        "outputs": frf.outputs,
        "inputs": frf.inputs,
        "band_hz": frf.frequency[[0, -1]],
        "screening": screening_json(r.screening),
        "free_decays": [dict(vars(d)) for d in r.decays],
        "levels": as_data(level_tables(r.levels)),
    }
    if e is not None:
        found |= {
            "excitation": e.excitation,
            "method": e.method,
            "averages": e.averages,
            "added_damping_1_s": e.added_damping,
            "how": e.notes,
        }
    return found
