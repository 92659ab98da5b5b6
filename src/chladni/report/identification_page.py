"""Identified modes as a page: the table, the stabilisation diagram, indicators, shapes, the fit."""

import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..case import Case
from ..dofs import parse
from ..dynamics.frf import FRF, UNIT
from ..ema.correlation import auto_mac
from ..ema.finding import of_all
from ..ema.identification import evaluate
from ..ema.level_table import level_tables
from ..ema.mode_indicators import cmif, mif
from ..ema.shapes import driven_shapes, real_shapes, shape_spread, shapes
from ..errors import ChladniError, LabelError
from ..io.tables.write_modal import write_shape_table, write_state_space
from ..io.tables.write_tables import write_levels, write_poles
from ..view import charts
from ..view.chart import Chart, ChartAxis, Mark, Panel, Series
from ..view.surface import Surface
from ..workflows.correlate import on_whole_mesh
from ..workflows.identify import Identification, RecordingModes
from . import frf_charts
from .blocks import Block, Drawing, PageParts, Section, Table, still
from .level_blocks import level_drawings, level_section
from .live_mesh import ModeSet
from .live_mesh import shapes as live_shapes
from .mesh_drawings import EXPANDED, ON_MESH, TURN, case_shown, spatial
from .screening_blocks import SEVERAL, screening_json, screening_section
from .shown import Shown
from .typed_fields import as_data
from .words import hertz, number

if TYPE_CHECKING:
    from ..view.annotations import Marker

_SHOWN = 6  # channels in the picture of the fit
_CIRCLES = 30  # modes drawn
_MATRIX = 40  # modes of an AutoMAC that can still be read
_MOST_POLES = 5000
_QUICK = 20_000  # grids of a model that is solved to draw shapes on it
_CLASSES = {  # letter of a pole: (mark, tint, size, meaning)
    "o": ("dot", "line", 3.0, "new"),
    "f": ("cross", "soft", 3.5, "frequency"),
    "d": ("up", "#e69f00", 4.0, "and damping"),
    "v": ("down", "#56b4e9", 4.0, "and shape"),
    "s": ("circle", "calm", 5.0, "all steady"),
}
_POLES = (
    "Poles of every order, compared with the order before (Heylen, Lammens and Sas, 1997). "
    "Lines: poles kept; dotted: poles rejected. Point at a pole for its numbers, click it to "
    "pick it."
)
_AROUND = 4.0  # half bandwidths of a circle


def as_page(folder: Path, found: Identification, command: str = "") -> PageParts:
    """Sections of the page; its tables are written into the folder.

    ``command`` is the line to which a click on a pole adds it.
    """
    sections, files = [], []
    share, (shown, sensors) = len(found.recordings), _places(found)
    command = command or shlex.join(["chladni", "identify", *_paths(found)])
    for k, r in enumerate(found.recordings):
        stem, name = "" if len(found.recordings) == 1 else f"_{k + 1}", r.recording.name
        write_poles(folder / f"poles{stem}.csv", r.poles)
        files.append((f"poles{stem}.csv", f"poles of {name}"))
        shapes = _shapes(f"shapes{stem}", r, shown, sensors, found.origin)
        table = replace(_table(r), opens=f"shapes{stem}" if shapes else "")
        sections.append(Section(name, [*shapes, table, *_drawings(stem, r, share, command)]))
        files += _modal_files(folder, stem, r)
    for k, study in enumerate(found.levels):
        tables = level_tables(study)
        stem = "" if len(found.levels) == 1 else f"_{k + 1}"
        write_levels(folder / f"levels{stem}.csv", tables)
        files.append((f"levels{stem}.csv", "every mode at every level, with its intervals"))
        sections.insert(k, level_section(tables, level_drawings(tables, stem)))
    sections.append(screening_section(*(r.screening for r in found.recordings), folded=True))
    return PageParts(_lead(found.recordings), sections, found.notes, files)


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
        (str(k), hertz(f), number(sf, 2), f"{z:#.3g}", number(sz, 2), f"{c:.3f}", number(v, 2),
         f"{100 * s:.0f}")
        for k, (f, sf, z, sz, c, v, s) in enumerate(zip(*columns, strict=True), 1)
    ]  # fmt: skip
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
    return Table(heads, rows, caption=caption, at=range(len(rows)))


def _paths(found: Identification) -> list[str]:
    """The case, or the file of the recording."""
    case = found.origin
    return [str(case.path.parent if isinstance(case, Case) else found.recordings[0].recording.name)]


def _places(found: Identification) -> tuple[Shown | None, dict[str, "Marker"]]:
    """The ground of the shapes, and sensors by label: of the case, else of the recordings."""
    from ..view.annotations import Marker

    if isinstance(case := found.origin, Case):
        whole = case_shown(case)
        return whole, {m.label: m for m in whole.outputs}
    nodes: dict[int, np.ndarray] = {}
    axes: dict[int, np.ndarray] = {}
    lines: list[tuple[int, int]] = []
    for r in (one.recording for one in reversed(found.recordings)):
        nodes, axes = {**nodes, **r.nodes}, {**axes, **r.axes}
        lines += [pair for element in r.elements for pair in pairwise(element)]
    if not nodes:
        return None, {}
    row = {node: k for k, node in enumerate(nodes)}
    held = [(row[a], row[b]) for a, b in lines if a in row and b in row]
    seen = Surface(np.array(list(nodes.values())), lines=np.array(held, int).reshape(-1, 2))
    sensors = {}
    for label in dict.fromkeys(o for r in found.recordings for o in r.modes.outputs):
        with suppress(LabelError):  # 12:n has no axis here
            node, component, sign = parse(label)
            if node in nodes and component <= 3:
                x, y, z = (float(v) for v in nodes[node])
                a, b, c = (sign * float(v) for v in axes.get(node, np.eye(3))[component - 1])
                sensors[label] = Marker((x, y, z), (a, b, c), label)
    return Shown(seen, ids=np.array(list(nodes))), sensors


def _shapes(
    name: str, r: RecordingModes, shown: Shown | None, sensors: Mapping[str, "Marker"],
    origin: Any = None,
) -> list[Drawing]:  # fmt: skip
    """The identified modes, which move at their sensors, and on the mesh of a case."""
    m = r.modes.sel(r.firm)
    held = [k for k, output in enumerate(m.outputs) if output in sensors]
    if shown is None or not held or not m.order:
        return []
    psi, damping = real_shapes(m)[held], m.damping.tolist()
    sides = {"test": ModeSet(m.frequency, sensors=psi, damping=damping)}
    outputs = [m.outputs[k] for k in held]
    whole = _expanded(origin, outputs, psi, float(m.frequency.max()))
    said = f"{TURN} Click a row of the table for its mode."
    if whole is not None:
        sides = {EXPANDED: ModeSet(m.frequency, whole, psi, damping=damping), **sides}
        said += f" {ON_MESH}"
    auto = auto_mac(driven_shapes(m)) if 1 < m.order <= _MATRIX else None
    alike = {} if auto is None else {f"{name}|{name}": auto for name in sides}
    content = spatial("shapes", shown, lambda: live_shapes(
        sides, [[k] * len(sides) for k in range(m.order)], shown,
        [sensors[label] for label in outputs], alike,
    ))  # fmt: skip
    return [Drawing(name, content, said, {})]


def _expanded(
    case: Any, outputs: Sequence[str], psi: np.ndarray, f_max: float
) -> np.ndarray | None:
    """Shapes on the mesh of a case (n_points, 3, r); None without one, or where it takes long."""
    if not isinstance(case, Case) or len(case.assembly.points) > _QUICK:
        return None
    with suppress(ChladniError):  # a model that cannot be solved is no fault of a recording
        return on_whole_mesh(case, outputs, psi, f_max)
    return None


def _drawings(stem: str, r: RecordingModes, share: int, command: str) -> list[Block]:
    """The stabilisation diagram, indicators, the fit, circles, AutoMAC.

    The page shows ``share`` recordings.
    """
    frf, modal = r.recording.frf, r.modes
    assert frf is not None
    low, high = modal.band
    test = frf.sel(band=(float(low), float(high)))
    fitted = replace(test, values=evaluate(r.whole, 2j * np.pi * test.frequency))
    fit, _ = frf_charts.responses({"test": test, "identified": fitted}, share=share)
    kept = modal.frequency[r.firm]
    blocks: list[Block] = [
        Drawing(f"stabilisation{stem}", stabilisation(r, command), _POLES,
                what="stabilisation diagram"),
        Drawing(f"indicators{stem}", indicators(r, test), "Singular values of the responses; share "
                "in quadrature.", what="mode indicators"),
        Drawing(f"fit{stem}", fit, frf_charts.CAPTION,
                {f"fit{stem}": frf_charts.overview(fit, _SHOWN)},
                "the recording and the identified model"),
    ]  # fmt: skip
    if len(kept):
        chart = circles(_circles(r))
        names = list(chart.views)
        grid = {f"circles{stem}": still(chart.grid(names, 5, (1.9, 1.9)))}
        text = "Each mode at the channel where it is clearest."
        what = "Nyquist circles of the modes"
        blocks.append(Drawing(f"circles{stem}", chart, text, grid, what))
    if 1 < len(kept) <= _MATRIX and len(frf.outputs) > 1:
        auto: dict[str, Any] = {"test": (auto_mac(driven_shapes(modal.sel(r.firm))), kept, [])}
        text = "Off the diagonal: modes that are similar at these sensors."
        chart = charts.mac(kept, auto, opens=f"shapes{stem}")
        blocks.append(Drawing(f"automac{stem}", chart, text, what="AutoMAC of the modes"))
    return blocks


def stabilisation(r: RecordingModes, command: str) -> Chart:
    """Poles over model order by class, kept ones as lines, struck ones as dotted lines.

    A click on a pole adds it to the command.
    """
    frf, d = r.recording.frf, r.diagram
    assert frf is not None
    low, high = (float(f) for f in r.modes.band)
    at = np.flatnonzero((low <= d.frequency) & (d.frequency <= high))[:_MOST_POLES]
    series = []
    for letter, (mark, tint, size, text) in _CLASSES.items():
        some = at[d.kind[at] == letter]
        tips = [f"{f:.2f} Hz, damping {100 * z:.3f} %\n{n} states, {text}" for f, z, n in
                zip(d.frequency[some], d.damping[some], d.states[some], strict=True)]  # fmt: skip
        place = np.round(d.frequency[some], 3), d.states[some].astype(float)
        series.append(Series(text, *place, "points", tint, size=size, tips=tips,
                             symbol=mark))  # type: ignore[arg-type] # fmt: skip
    lines = frf_charts.thinned(frf, 2000)
    lines = lines[(low <= frf.frequency[lines]) & (frf.frequency[lines] <= high)]
    rms = np.sqrt((np.abs(frf.values[lines]) ** 2).mean(axis=(1, 2)))
    series.append(Series("rms of |H|", frf.frequency[lines], rms, tint="steel", width=1.0,
                         right=True))  # fmt: skip
    marks = [Mark(f, tint="before", name="kept") for f in r.modes.frequency[r.firm]]
    marks += [Mark(f, tint="ink", dash="dot", name="struck out")
              for f in r.modes.frequency[r.struck]]  # fmt: skip
    unit = UNIT.get(frf.quantity, "")
    behind = ChartAxis(f"rms of |H| [{unit}]" if unit else "rms of |H|", log=True)
    x = replace(charts.FREQUENCY, limits=(low, high))
    panel = Panel(series, x, ChartAxis("states"), marks=marks, right=behind)
    return Chart.of(panel, size=(8.2, 4.6), height=28, pick=command)


def indicators(r: RecordingModes, test: FRF) -> Chart:
    """Singular values of H (complex mode indicator), and the share in quadrature."""
    at = frf_charts.thinned(test, 4000)
    f, values, share = test.frequency[at], cmif(test)[at], mif(test)[at]
    unit = UNIT.get(test.quantity, "")
    above = [Series("", f, values[:, k], tint=("ink", "after", "calm")[k % 3])
             for k in range(values.shape[1])]  # fmt: skip
    marks = [Mark(x, tint="before") for x in r.modes.frequency[r.firm]]
    quadrature = [Series("", f, share, tint="ink")]
    return Chart.of(
        Panel(above, charts.FREQUENCY, ChartAxis(f"CMIF [{unit}]", log=True), marks=marks, share=2),
        Panel(quadrature, charts.FREQUENCY, ChartAxis("MIF", limits=(0, 1.02)), marks=marks),
        one_x=True, size=(8.2, 4.0), height=28,
    )  # fmt: skip


def circles(modes: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Chart:
    """A Nyquist circle of each mode: measured lines as dots (n,), the model as a curve (m,)."""
    views = {
        name: [Panel(
            [Series("identified", model.real, model.imag, tint="after", width=1.2),
             Series("test", test.real, test.imag, "points", "ink", size=3)],
            ChartAxis("Re H"), ChartAxis("Im H"), marks=(Mark(0.0), Mark(0.0, "x")), equal=True,
        )]
        for name, (test, model) in modes.items()
    }  # fmt: skip
    return Chart(views, size=(4.0, 4.0), height=30, choice="mode")


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


def as_json(result: Identification) -> dict[str, Any]:
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
