"""Identified modes as a page: the table, the stabilisation diagram, the fit."""

from pathlib import Path

import numpy as np

from ..dynamics.frf import UNIT
from ..ema.identification import Identified, evaluate
from ..ema.level_table import level_tables
from ..io.tables.write_tables import write_poles
from ..workflows.identify import Identification, RecordingModes, firm
from .blocks import Block, PageParts, Picture, Section, Table
from .level_blocks import draw_levels, level_section
from .screening_blocks import screening_section
from .words import hertz, number

_SHOWN = 6  # channels drawn


def identification_page(folder: Path, found: Identification) -> PageParts:
    """Sections of the page; its pictures and the tables of poles are written into the folder."""
    sections, files = [screening_section(*(r.screening for r in found.recordings))], []
    for k, r in enumerate(found.recordings):
        stem = "" if len(found.recordings) == 1 else f"_{k + 1}"
        write_poles(folder / f"poles{stem}.csv", r.poles)
        files.append((f"poles{stem}.csv", f"poles of {r.recording.name}"))
        sections.append(Section(r.recording.name, [_table(r.modes), *_pictures(folder, stem, r)]))
        files.append((f"stabilisation{stem}.png", "stabilisation diagram"))
        files.append((f"fit{stem}.png", "the recording and the identified model"))
    for k, study in enumerate(found.levels):
        tables = level_tables(study)
        drawn = draw_levels(folder, tables, "" if len(found.levels) == 1 else f"_{k + 1}")
        sections.insert(k, level_section(tables, drawn))
        files += [(path.name, "a mode over levels") for path in drawn.values()]
    lead = "; ".join(_sentence(r) for r in found.recordings)
    return PageParts(lead, sections, found.notes, files)


def _table(modal: Identified) -> Table:
    sure = firm(modal)
    columns = (modal.frequency, modal.frequency_sd, 100 * modal.damping, 100 * modal.damping_sd)
    rows = [
        (str(k + 1), hertz(f), number(sf, 2), number(z, 3), number(sz, 2))
        for k, (f, sf, z, sz) in enumerate(zip(*(c[sure] for c in columns), strict=True))
    ]
    heads = ("mode", "Hz", "± Hz", "damping [%]", "± %")
    caption = f"Residual over noise: {number(modal.chi, 3)} (1: only noise is left)."
    if weak := int((~sure).sum()):
        caption += f" {weak} more poles shape the curve but are too uncertain to be called modes."
    return Table(heads, rows, caption=caption)


def _pictures(folder: Path, stem: str, r: RecordingModes) -> list[Block]:
    from ..view import plots

    frf, modal = r.recording.frf, r.modes
    assert frf is not None
    inside = (modal.band[0] <= frf.frequency) & (frf.frequency <= modal.band[1])
    f = frf.frequency[inside]
    H, fitted = frf.values[inside], evaluate(r.whole, 2j * np.pi * f)
    size = np.sqrt((np.abs(H) ** 2).mean(axis=(1, 2)))
    sweep = modal.diagram
    poles = [
        (
            int(n),
            np.abs(sweep.poles[at := sweep.order == n]) / (2 * np.pi),
            _stable(modal, sweep.poles[at]),
        )
        for n in sweep.orders
    ]
    diagram, grid = folder / f"stabilisation{stem}.png", folder / f"fit{stem}.png"
    plots.stabilisation(diagram, poles, modal.frequency[firm(modal)], (f, size))
    channels = {
        f"{o} from {i}": {"test": (f, H[:, a, b]), "identified": (f, fitted[:, a, b])}
        for b, i in enumerate(frf.inputs)
        for a, o in enumerate(frf.outputs)
    }
    chosen = dict(list(channels.items())[:_SHOWN])
    plots.frf_grid(grid, chosen, UNIT.get(frf.quantity, ""), columns=min(2, len(chosen)))
    return [Picture(diagram, "Poles of every order; lines: what was kept."), Picture(grid)]


def _stable(modal: Identified, poles: np.ndarray) -> np.ndarray:
    """Within half a bandwidth of a pole that was kept."""
    gap = np.abs(np.abs(poles)[:, None] - np.abs(modal.poles))
    return np.asarray((gap < np.abs(modal.poles.real)).any(axis=1))


def _sentence(r: RecordingModes) -> str:
    f, (low, high) = r.poles.frequency, r.whole.band
    span = f" from {number(f[0])} to {number(f[-1])} Hz" if len(f) else ""
    name = r.recording.name
    said = f"{name}: {len(f)} modes{span} in the band {number(low)} to {number(high)} Hz"
    return said + (f" ({r.screening.sentence})" if r.screening.findings else "")
