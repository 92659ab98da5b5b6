"""A parameter study as a page: influences, parallel coordinates, results over parameters."""

from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import UNIT
from chladni.output import plain
from chladni.report.blocks import (
    Block,
    Code,
    Drawing,
    Facts,
    Items,
    PageParts,
    Section,
    Table,
    still,
)
from chladni.report.words import counted, display_unit, number, quantity
from chladni.view.chart import Column

from . import study_charts
from .parameter_study import ParameterStudy
from .sensitivity import Sensitivity
from .study_tables import response_files

_SHOWN = 4  # results drawn over the parameters
_AXES = 5  # parameters drawn
_LAW = 0.8  # share of the variance a power law explains where its slopes are drawn
_LONGEST = 36  # letters of a name on an axis
_RESPONSES, _CHANNELS = 40, 12  # samples and channels whose responses are drawn
_LISTED = 12  # failed samples on the page; all are in the table
READ = (
    'pandas.read_csv("samples.csv")',
    'pandas.read_json("samples.jsonl", lines=True)   # while it runs',
    'xarray.open_dataset("study.nc")',
)


def as_json(found: ParameterStudy) -> dict[str, Any]:
    """``study.json``: ranges, provenance, sensitivities, what failed."""
    return {
        **found.provenance,
        "taken": len(found.rows),
        "finished_before": found.kept,
        "failed": [{"sample": k, "why": why} for k, why in found.failed],
        "nominal": found.nominal,
        "range": {c: _range(found.column(c)) for c in found.columns},
        "sensitivities": {s.result: _measures(s, found.names) for s in found.sensitivities},
        "notes": [*found.notes, *_notes(found)],
    }


def _measures(s: Sensitivity, names: list[str]) -> dict[str, Any]:
    by_name = {
        key: dict(zip(names, getattr(s, key).tolist(), strict=True))
        for key in ("log_slope", "standardised", "first", "first_interval", "total",
                    "total_interval", "mu_star", "sigma")
        if np.isfinite(getattr(s, key)).any()
    }  # fmt: skip
    return {"samples": s.used, "r2": s.r2, **by_name}


def _range(y: np.ndarray) -> dict[str, float] | None:
    y = y[np.isfinite(y)]
    if not len(y):
        return None
    return {"low": y.min(), "mean": y.mean(), "high": y.max(), "sd": y.std()}


def as_page(folder: Path, found: ParameterStudy) -> PageParts:
    """Sections of the page."""
    said = in_words(found)
    sections = list(said.sections)
    if len(found.rows) > len(found.failed):
        sections += [
            Section("Sensitivities", _sensitivities(found)),
            Section("Results over parameters", _samples(found)),
            Section("Responses", _responses(found)),
        ]
    if found.failed:
        why_not = [f"sample {k}: {why}" for k, why in found.failed[:_LISTED]]
        sections.append(
            Section(counted(len(found.failed), "sample failed", "samples failed"), [Items(why_not)])
        )
    sections.append(Section("Read it", [Code(READ)]))
    return PageParts(said.lead, sections, said.notes)


def in_words(found: ParameterStudy) -> PageParts:
    """The page without its pictures."""
    done = len(found.rows) - len(found.failed)
    lead = f"{done} of {len(found.rows)} samples of {', '.join(found.names)} were solved"
    first = found.column("f1_hz")
    if np.isfinite(first).any():
        span = number(np.nanmin(first)), number(np.nanmax(first))
        lead += f"; the first elastic mode lies between {span[0]} and {span[1]} Hz"
    sections = [Section("Varied parameters", [_ranges(found)])]
    return PageParts(f"{lead}.", sections, [*found.notes, *_notes(found)])


def _notes(found: ParameterStudy) -> list[str]:
    out = []
    if found.kept:
        out.append(f"{found.kept} samples were finished by an earlier run and were not repeated.")
    lost = [c.replace("f", "mode ").replace("_hz", "") for c in found.columns
            if c.startswith("f") and c.endswith("_hz")
            and np.isnan(found.column(c)).sum() > len(found.failed)]  # fmt: skip
    if lost:
        out.append(
            f"{', '.join(lost)}: in some samples no mode matches that of the deck (MAC below 0.5, "
            "or beyond the solved modes); its frequency is left out there."
        )
    return out


def _ranges(found: ParameterStudy) -> Block:
    rows = [
        (v.name, *(quantity(value, v.unit, v.nominal) for value in (v.nominal, v.low, v.high)),
         "logarithmic" if v.log else "even")
        for v in found.varied
    ]  # fmt: skip
    s = found.settings
    caption = (
        f"{len(found.rows)} samples, {s.sampler}, seed {s.seed}. Mode 1 is the first elastic one; "
        "chladni modes counts rigid motions too."
    )
    heads = ("parameter", "deck", "from", "to", "steps")
    return Table(heads, rows, words=("parameter", "steps"), caption=caption)


def _sensitivities(found: ParameterStudy) -> list[Block]:
    lawful = [s for s in found.sensitivities if np.isfinite(s.log_slope).any() and s.r2 >= _LAW]
    blocks: list[Block] = []
    if lawful:
        values = np.stack([s.log_slope for s in lawful])
        chart = study_charts.slopes(
            values, [label(s.result) for s in lawful], [_shortened(n) for n in found.names]
        )
        text = (
            "d ln result / d ln parameter: at 1, a parameter one per cent higher gives a result "
            "one per cent higher."
        )
        blocks.append(Drawing("slopes", chart, text, what="logarithmic slopes"))
    for measure, title in (("total", "Total Sobol' index"), ("mu_star", "mean |effect|")):
        rows = [_row(s, measure) for s in found.sensitivities]
        if kept := [r for r in rows if any(cell != "–" for cell in r[1:])]:
            caption = f"{title}; ± is half the 95 % interval." if measure == "total" else title
            blocks.append(_indices(found, measure))
            blocks.append(Table(("result", *found.names), kept, words=("result",), caption=caption))
    facts = [
        (label(s.result), f"R² {number(s.r2, 3)} of a power law, {s.used} samples")
        for s in found.sensitivities
        if np.isfinite(s.r2) and s.r2 < 0.95
    ]
    return [*blocks, Facts(facts)] if facts else blocks


def _indices(found: ParameterStudy, measure: str) -> Block:
    """Bars of a result's measure over its parameters, with the other measure of its method."""
    shown = [s for s in found.sensitivities if np.isfinite(getattr(s, measure)).any()]
    if measure == "total":
        axis = "Sobol' index; bars of error: 95 % interval"
        results: dict[str, study_charts.Measures] = {
            label(s.result): {
                "first order": (s.first, s.first_interval),
                "total": (s.total, s.total_interval),
            }
            for s in shown
        }
    else:
        axis = "elementary effect [unit of the result]"
        results = {
            label(s.result): {"mean |effect|": (s.mu_star, None), "its deviation": (s.sigma, None)}
            for s in shown
        }
    chart = study_charts.indices(results, found.names, axis)
    return Drawing(f"indices_{measure}", chart, what="sensitivity indices")


def _row(s: Sensitivity, measure: str) -> tuple[str, ...]:
    values = getattr(s, measure)
    if measure != "total":
        return (label(s.result), *(number(v, 3) for v in values))
    spread = (
        f"{number(v, 2)} ± {number(w, 1)}" if np.isfinite(v) else "–"
        for v, w in zip(values, s.total_interval, strict=True)
    )  # fmt: skip
    return (label(s.result), *spread)


def label(column: str) -> str:
    """A column in words.

    >>> label("f3_hz"), label("mass_kg"), label("Q")
    ('mode 3 [Hz]', 'mass [kg]', 'Q of curves')
    """
    if column.endswith("_hz") and column[1:-3].isdigit():
        return f"mode {column[1:-3]} [Hz]"
    return {"mass_kg": "mass [kg]", "Q": "Q of curves"}.get(column, column)


def _samples(found: ParameterStudy) -> list[Block]:
    """Draw every sample across the axes, and one column over another."""
    table = _columns(found)
    drawn, names = _drawn(found), [v.name for v in found.varied[:_AXES]]
    if not drawn:
        return []
    said = study_charts.samples(list(table.values()))
    blocks: list[Block] = []
    axes = [table[n] for n in (*names, *drawn)]
    if np.isfinite(np.stack([c.values for c in axes])).all(axis=0).sum() > 1:
        few = f" The first {study_charts.MOST} are drawn." * (len(found.rows) > study_charts.MOST)
        text = (
            f"Draw a box over an axis to keep the samples within it.{few} Each line is a sample; "
            f"colour: {table[drawn[0]].name}."
        )
        chart = study_charts.parallel(axes, said, len(names))
        blocks.append(Drawing("parallel", chart, text, what="parallel coordinates"))
    at = {name: k for k, name in enumerate(table)}
    chart = study_charts.cloud(list(table.values()), said, at[found.names[0]], at[drawn[0]])
    grid = study_charts.results_over_parameters(
        [table[n] for n in names], [table[n] for n in drawn]
    )
    text = "Dots: samples; dashed: the deck's own values."
    blocks.append(
        Drawing("responses", chart, text, {"responses": still(grid)}, "results over parameters")
    )
    return blocks


def _responses(found: ParameterStudy) -> list[Block]:
    """Kept responses of samples spread evenly over the study, channel by channel."""
    files, _ = response_files(found)
    some = [files[k] for k in list(files)[:: -(-len(files) // _RESPONSES) or 1]]
    if not some:
        return []
    values = []
    for path in some:
        with np.load(path, allow_pickle=False) as held:
            values.append(np.abs(held["values"]))
            f, quantity = held["frequency_hz"], str(held["quantity"])
            names = [f"{o} from {i}" for o in held["outputs"] for i in held["inputs"]]
    H = np.array(values).reshape(len(values), len(f), -1)[:, :, :_CHANNELS]
    title = f"|{quantity}| [{UNIT.get(quantity, '')}]"
    chart = study_charts.spread(f, H, names[:_CHANNELS], title)
    text = f"{len(some)} of {len(files)} samples (grey), and the median of each line."
    return [Drawing("frf", chart, text, what="responses of the samples")]


def _columns(found: ParameterStudy) -> dict[str, Column]:
    """Parameters and results by their own names, in the units of the table."""
    units = {v.name: display_unit(v.nominal, v.unit) for v in found.varied}
    text = {n: f"{_shortened(n)} [{u}]" if u else _shortened(n) for n, (_, u) in units.items()}
    text |= {c: _shortened(label(c)) for c in found.columns}
    nominal = {k: v for k, v in plain(found.nominal).items() if isinstance(v, float)}
    decades = {v.name for v in found.varied if v.log}
    scale = {n: units[n][0] if n in units else 1.0 for n in text}
    return {
        n: Column(t, np.asarray(found.column(n), float) / scale[n], n in decades,
                  nominal.get(n, np.nan) / scale[n])
        for n, t in text.items()
    }  # fmt: skip


def _shortened(name: str) -> str:
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 12]}…{name[-11:]}"


def _drawn(found: ParameterStudy) -> list[str]:
    """Q first, then the lowest modes; none that no sample has."""
    modes = [c for c in found.columns if c.startswith("f") and c.endswith("_hz")]
    first = (["Q"] if "Q" in found.columns else []) + modes[: _SHOWN - ("Q" in found.columns)]
    return [c for c in first if np.isfinite(found.column(c)).any()]
