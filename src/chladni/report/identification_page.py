"""Identified modes as a page: the table, the stabilisation diagram, indicators, shapes, the fit."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics.frf import UNIT
from ..ema.correlation import auto_mac
from ..ema.finding import of_all
from ..ema.identification import evaluate
from ..ema.level_table import level_tables
from ..ema.mode_indicators import cmif, mif
from ..ema.shapes import driven_shapes, shape_spread, shapes
from ..io.tables.write_modal import write_shape_table, write_state_space
from ..io.tables.write_tables import write_levels, write_poles
from ..workflows.identify import Identification, RecordingModes
from . import live_pages as live
from .blocks import Block, PageParts, Picture, Section, Table
from .level_blocks import draw_levels, level_section
from .live_pages import Page
from .screening_blocks import SEVERAL, screening_json, screening_section
from .typed_fields import as_data
from .words import hertz, number

_SHOWN = 6  # channels drawn
_CIRCLES = 30  # modes drawn
_MATRIX = 40  # modes of an AutoMAC that can still be read
_FILES = {
    "stabilisation": "stabilisation diagram",
    "indicators": "mode indicators",
    "fit": "the recording and the identified model",
    "circles": "Nyquist circles of the modes",
    "automac": "AutoMAC of the modes",
}
_AROUND = 4.0  # half bandwidths of a circle


def identification_page(folder: Path, found: Identification) -> PageParts:
    """Sections of the page; its pictures and tables are written into the folder."""
    sections, files = [screening_section(*(r.screening for r in found.recordings))], []
    page, share = Page(), len(found.recordings)
    for k, r in enumerate(found.recordings):
        stem, name = "" if len(found.recordings) == 1 else f"_{k + 1}", r.recording.name
        write_poles(folder / f"poles{stem}.csv", r.poles)
        files.append((f"poles{stem}.csv", f"poles of {name}"))
        pictures = _pictures(folder, stem, r)
        sections.append(Section(name, [_table(r), *_live(page, stem, r, pictures, share)]))
        files += _modal_files(folder, stem, r)
        files += [(p.path.name, _FILES[p.path.stem.removesuffix(stem)]) for p in pictures]
    for k, study in enumerate(found.levels):
        tables = level_tables(study)
        stem = "" if len(found.levels) == 1 else f"_{k + 1}"
        write_levels(folder / f"levels{stem}.csv", tables)
        files.append((f"levels{stem}.csv", "every mode at every level, with its intervals"))
        drawn = draw_levels(folder, tables, stem)
        sections.insert(k, level_section(tables, live.levels(page, tables, drawn)))
        files += [(path.name, "a mode over levels") for path in drawn.values()]
    return PageParts(_lead(found.recordings), sections, found.notes, files, page.drawings)


def in_words(found: Identification) -> PageParts:
    """The page without its pictures."""
    sections = [Section(r.recording.name, [_table(r)]) for r in found.recordings]
    return PageParts(f"{_lead(found.recordings)}.", sections, found.notes)


def _modal_files(folder: Path, stem: str, r: RecordingModes) -> list[tuple[str, str]]:
    """Shapes as a table, the state space for other programs."""
    sure, name = r.modes.sel(r.firm), r.recording.name
    if not sure.order:
        return []
    write_shape_table(folder / f"shapes{stem}.csv", sure)
    files = [(f"shapes{stem}.csv", f"shapes of {name}, real and imaginary part")]
    if r.whole.quantity != "transmissibility":
        write_state_space(folder / f"state_space{stem}.npz", r.whole)
        write_state_space(folder / f"state_space{stem}.mat", r.whole)
        what = f"A, B, C, D of {name}, the band's residual terms as a low and a high pole"
        files += [(f"state_space{stem}.{kind}", what) for kind in ("npz", "mat")]
    return files


def _table(r: RecordingModes) -> Table:
    m = r.modes.sel(r.firm)
    phase, seen = shapes(m).collinearity, r.diagram.seen(m)
    spread = 100 * shape_spread(m)
    columns = (
        m.frequency, m.frequency_sd, 100 * m.damping, 100 * m.damping_sd, phase, spread, seen,
    )  # fmt: skip
    rows = [
        (
            str(k + 1),
            hertz(f),
            number(sf, 2),
            f"{z:#.3g}",
            number(sz, 2),
            f"{c:.3f}",
            number(v, 2),
            f"{100 * s:.0f}",
        )
        for k, (f, sf, z, sz, c, v, s) in enumerate(zip(*columns, strict=True))
    ]
    heads = ("mode", "Hz", "± Hz", "damping [%]", "± %", "MPC", "shape ± %", "orders [%]")
    caption = (
        f"Residual over noise: {number(r.modes.chi, 3)} (1: only noise remains). MPC: 1 where all "
        "channels move in phase. Shape: its standard deviation from noise, relative to its norm. "
        "Orders: share of the higher orders of the stabilisation diagram, from another method, "
        "that have the pole."
    )
    struck, weak = r.modes.frequency[r.struck], int((~r.firm & ~r.struck).sum())
    if weak:
        caption += (
            f" {weak} further poles contribute to the curve but are too uncertain to count as "
            "modes."
        )
    if len(struck):
        said = ", ".join(number(f, 4) for f in struck)
        caption += f" Rejected, because they have no peak and no other order has them: {said} Hz."
    return Table(heads, rows, caption=caption)


def _pictures(folder: Path, stem: str, r: RecordingModes) -> list[Picture]:
    from ..view import modal_plots, plots

    frf, modal = r.recording.frf, r.modes
    assert frf is not None
    inside = (modal.band[0] <= frf.frequency) & (frf.frequency <= modal.band[1])
    f = frf.frequency[inside]
    unit = UNIT.get(frf.quantity, "")
    H, fitted = frf.values[inside], evaluate(r.whole, 2j * np.pi * f)
    size = np.sqrt((np.abs(H) ** 2).mean(axis=(1, 2)))
    path = {name: folder / f"{name}{stem}.png" for name in _FILES}
    d, kept = r.diagram, modal.frequency[r.firm]
    modal_plots.stabilisation_classes(
        path["stabilisation"],
        d.states, d.frequency, d.kind, kept, modal.frequency[r.struck], (f, size), unit,
    )  # fmt: skip
    modal_plots.mode_indicators(
        path["indicators"], f, cmif(frf)[inside], mif(frf)[inside], kept, unit
    )
    channels = {
        f"{o} from {i}": {"test": (f, H[:, a, b]), "identified": (f, fitted[:, a, b])}
        for b, i in enumerate(frf.inputs)
        for a, o in enumerate(frf.outputs)
    }
    chosen = dict(list(channels.items())[:_SHOWN])
    plots.frf_grid(path["fit"], chosen, unit, columns=min(2, len(chosen)))
    blocks = [
        Picture(path["stabilisation"], "Poles of every order; lines: the poles kept."),
        Picture(path["indicators"], "Singular values of the responses; share in quadrature."),
        Picture(path["fit"]),
    ]
    if len(kept):
        modal_plots.nyquist_grid(path["circles"], _circles(r))
        blocks.append(Picture(path["circles"], "Each mode at the channel where it is clearest."))
    if 1 < len(kept) <= _MATRIX and len(frf.outputs) > 1:
        labels = [hertz(x) for x in kept]
        psi = driven_shapes(modal.sel(r.firm))
        plots.mac_matrix(path["automac"], auto_mac(psi), labels, labels, "AutoMAC of the test [Hz]")
        blocks.append(
            Picture(path["automac"], "Off the diagonal: modes that are similar at these sensors.")
        )
    return blocks


def _live(
    page: Page, stem: str, r: RecordingModes, pictures: Sequence[Picture], share: int
) -> list[Block]:
    """The pictures, some of them drawn by the page, which shows ``share`` recordings."""
    frf = r.recording.frf
    assert frf is not None
    low, high = r.modes.band
    test = frf.sel(band=(float(low), float(high)))
    curves = {
        "test": test,
        "identified": replace(test, values=evaluate(r.whole, 2j * np.pi * test.frequency)),
    }
    shapes = driven_shapes(r.modes.sel(r.firm))
    kept = r.modes.frequency[r.firm]

    def block(picture: Picture) -> Block:
        kind, still = picture.path.stem.removesuffix(stem), [picture]
        if kind == "stabilisation":
            return live.poles(page, kind + stem, r, still)
        if kind == "fit":
            return live.responses(page, kind + stem, curves, still, share=share)
        if kind == "automac":
            return live.likeness(page, kind + stem, auto_mac(shapes), kept, kept, "test", [], still)
        return picture

    return [block(picture) for picture in pictures]


def _circles(r: RecordingModes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Measured lines and the model about each mode, where its residue is largest."""
    frf, m = r.recording.frf, r.modes.sel(r.firm)
    assert frf is not None
    found = {}
    for k in range(min(m.order, _CIRCLES)):
        i, j = np.unravel_index(np.abs(m.residues[k]).argmax(), m.residues[k].shape)
        reach = _AROUND * m.damping[k] * m.frequency[k]
        near = np.abs(frf.frequency - m.frequency[k]) < reach
        fine = np.linspace(max(m.frequency[k] - reach, 1e-3), m.frequency[k] + reach, 200)
        model = evaluate(r.whole, 2j * np.pi * fine)[:, i, j]
        name = f"{hertz(m.frequency[k])} Hz, {frf.outputs[i]}"
        found[name] = (frf.values[near, i, j], model)
    return found


def _lead(recordings: Sequence[RecordingModes]) -> str:
    """Describe one recording in full, or several by number of modes and which to inspect."""
    if len(recordings) <= SEVERAL:
        return "; ".join(_sentence(r) for r in recordings)
    counts = sorted({len(r.poles.frequency) for r in recordings})
    span = _span(np.sort(np.concatenate([r.poles.frequency for r in recordings])))
    many = " to ".join(str(n) for n in dict.fromkeys((counts[0], counts[-1])))
    said = f"{len(recordings)} recordings of {many} {'mode' if many == '1' else 'modes'} each{span}"
    bad = of_all([r.screening for r in recordings])
    return "; ".join(filter(None, (said, bad)))


def _sentence(r: RecordingModes) -> str:
    f, (low, high) = r.poles.frequency, r.whole.band
    modes = f"{len(f)} {'mode' if len(f) == 1 else 'modes'}{_span(f)}"
    said = f"{r.recording.name}: {modes} in the band {number(low)} to {number(high)} Hz"
    return said + (f" ({r.screening.sentence})" if r.screening.findings else "")


def _span(f: np.ndarray) -> str:
    """Locate rising frequencies in words; "" if there are none."""
    if len(f) < 2:
        return "".join(f" at {number(one)} Hz" for one in f)
    return f" from {number(f[0])} to {number(f[-1])} Hz"


def identification_json(result: Identification) -> dict[str, Any]:
    """The result for ``identified.json``."""
    held: dict[str, Any] = {"recordings": [_recording(r) for r in result.recordings]}
    if result.levels:
        held["levels"] = [as_data(level_tables(study)) for study in result.levels]
    return held


def _recording(r: RecordingModes) -> dict[str, Any]:
    m = r.modes
    return {
        "name": r.recording.name,
        "band_hz": m.band,
        "frequency_hz": m.frequency,
        "frequency_sd_hz": m.frequency_sd,
        "damping": m.damping,
        "damping_sd": m.damping_sd,
        "firm": r.firm,
        "struck_out": r.struck,
        "mpc": shapes(m).collinearity if m.order else [],
        "shape_spread": shape_spread(m),
        "share_of_orders": r.diagram.seen(m),
        "chi": m.chi,
        "outputs": m.outputs,
        "inputs": m.inputs,
        "screening": screening_json(r.screening),
    }
