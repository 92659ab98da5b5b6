"""The evaluation of a test as a page: findings, FRFs, coherence, distortion, free decays."""

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
from ..workflows.evaluation import Evaluation, RecordingEvaluation
from . import live_pages as live
from . import live_panels
from .blocks import Block, PageParts, Picture, Section, Table
from .level_blocks import draw_levels, level_section
from .live_pages import Page
from .screening_blocks import lead_of, screening_json, screening_section
from .typed_fields import as_data
from .words import number

_SHOWN = 12  # channels drawn


def evaluation_page(folder: Path, found: Evaluation) -> PageParts:
    """Sections of the page; pictures and, of time data, the FRFs are written into the folder."""
    sections = [screening_section(*(r.screening for r in found.recordings))]
    files: list[tuple[str, str]] = []
    page, share = Page(), len(found.recordings)
    for k, r in enumerate(found.recordings):
        stem = "" if len(found.recordings) == 1 else f"_{k + 1}"
        files += _written(folder, stem, r)
        blocks, drawn = _blocks(page, folder, stem, r, share)
        sections.append(Section(r.recording.name, blocks))
        files += drawn
        if r.levels.nonlinear:
            tables = level_tables(r.levels)
            pictures = draw_levels(folder, tables, f"_decay{stem}")
            of = f"Free decays of {r.recording.name} by amplitude"
            drawings = live.levels(page, tables, pictures)
            sections.append(replace(level_section(tables, drawings), title=of))
            files += [(path.name, "a mode over its amplitudes") for path in pictures.values()]
    lead = lead_of([r.screening for r in found.recordings])
    return PageParts(lead, sections, found.notes, files, page.drawings)


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


def _blocks(
    page: Page, folder: Path, stem: str, r: RecordingEvaluation, share: int
) -> tuple[list[Block], list[tuple[str, str]]]:
    from ..view import evaluation_plots, plots

    frf = r.recording.frf
    assert frf is not None
    channels = [(i, j) for j in range(len(frf.inputs)) for i in range(len(frf.outputs))][:_SHOWN]
    named = {f"{frf.outputs[i]} from {frf.inputs[j]}": (i, j) for i, j in channels}
    blocks: list[Block] = [_table(frf)]
    files = []
    grid = folder / f"frf_grid{stem}.png"
    curves = {n: {"test": (frf.frequency, frf.values[:, i, j])} for n, (i, j) in named.items()}
    plots.frf_grid(grid, curves, UNIT.get(frf.quantity, ""), columns=min(2, len(curves)))
    blocks.append(
        live.responses(page, grid.stem, {"test": frf}, [Picture(grid, "FRFs.")], share=share)
    )
    files.append((grid.name, "FRFs"))
    if frf.coherence is not None:
        path = folder / f"coherence{stem}.png"
        alone = len(frf.inputs) == 1
        lines = {
            frf.outputs[i] if alone else name: frf.coherence[:, i, j]
            for name, (i, j) in named.items()
        }
        evaluation_plots.lines_over_frequency(
            path, frf.frequency, lines, "coherence [-]", (0.0, 1.02)
        )
        still = Picture(path, "Coherence: low values show noise or leakage.")
        data = live_panels.over_frequency(frf.frequency, lines, "coherence [-]", (0.0, 1.02), share)
        blocks.append(live.panels(page, path.stem, data, still))
        files.append((path.name, "coherence"))
    distortion = r.estimate.distortion if r.estimate is not None else None
    if distortion is not None:
        path = folder / f"distortion{stem}.png"
        each = {o: 100 * distortion[:, i] for i, o in enumerate(frf.outputs[:_SHOWN])}
        evaluation_plots.lines_over_frequency(path, frf.frequency, each, "harmonics 2 to 5 [%]")
        still = Picture(path, "Harmonics of the responses over their fundamental.")
        data = live_panels.over_frequency(frf.frequency, each, "harmonics 2 to 5 [%]", share=share)
        blocks.append(live.panels(page, path.stem, data, still))
        files.append((path.name, "harmonic distortion"))
    if r.decays:
        path = folder / f"decays{stem}.png"
        each_decay = {
            f"{number(d.frequency)} Hz, {d.output}": (d.amplitude, d.frequency_at, d.damping_at)
            for d in r.decays
        }
        evaluation_plots.amplitude_dependence(path, each_decay)
        still = Picture(path, "Frequency and damping against amplitude.")
        data = live_panels.decays(each_decay)
        blocks += [_decays(r.decays), live.panels(page, path.stem, data, still)]
        files.append((path.name, "free decays"))
    return blocks, files


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


def evaluation_json(result: Evaluation) -> dict[str, Any]:
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
