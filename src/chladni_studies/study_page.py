"""A parameter study as a page: influences, parallel coordinates, results over parameters."""

from pathlib import Path
from typing import Any

import numpy as np

from chladni.output import plain
from chladni.report import live_samples
from chladni.report.blocks import Block, Code, Facts, Items, PageParts, Picture, Section, Table
from chladni.report.live_pages import Page
from chladni.report.words import number, quantity, unit_text

from .parameter_study import ParameterStudy
from .sensitivity import Sensitivity

_SHOWN = 4  # results drawn over the parameters
_AXES = 5  # parameters drawn
_LAW = 0.8  # share of the variance a power law explains where its slopes are drawn
_LONGEST = 36  # letters of a name on an axis
_LISTED = 12  # failed samples on the page; all are in the table
READ = (
    'pandas.read_csv("samples.csv")',
    'pandas.read_json("samples.jsonl", lines=True)   # while it runs',
    'xarray.open_dataset("study.nc")',
)


def study_json(found: ParameterStudy) -> dict[str, Any]:
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


def study_page(folder: Path, found: ParameterStudy) -> PageParts:
    """Sections of the page; its pictures are written into the folder."""
    said, page = in_words(found), Page()
    files: list[tuple[str, str]] = []
    sections = list(said.sections)
    if len(found.rows) > len(found.failed):
        sections += [
            Section("Sensitivities", _sensitivities(page, folder, found, files)),
            Section("Results over parameters", _pictures(page, folder, found, files)),
        ]
    if found.failed:
        why_not = [f"sample {k}: {why}" for k, why in found.failed[:_LISTED]]
        sections.append(Section(f"{len(found.failed)} samples failed", [Items(why_not)]))
    sections.append(Section("Read it", [Code(READ)]))
    return PageParts(said.lead, sections, said.notes, files, page.drawings)


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
        (v.name, *(quantity(value, v.unit) for value in (v.nominal, v.low, v.high)),
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


def _sensitivities(
    page: Page, folder: Path, found: ParameterStudy, files: list[tuple[str, str]]
) -> list[Block]:
    from . import study_plots

    lawful = [s for s in found.sensitivities if np.isfinite(s.log_slope).any() and s.r2 >= _LAW]
    blocks: list[Block] = []
    if lawful:
        path = folder / "slopes.png"
        values = np.stack([s.log_slope for s in lawful])
        results = [label(s.result) for s in lawful]
        names = [_drawable(name) for name in found.names]
        study_plots.slope_map(path, values, results, names, "d ln result / d ln parameter")
        files.append((path.name, "logarithmic slopes"))
        still = Picture(
            path, "d ln result / d ln parameter: at 1, a parameter one per cent higher gives a "
            "result one per cent higher.",
        )  # fmt: skip
        data = live_samples.influences(values, results, found.names)
        blocks.append(page.live(path.stem, "influences", data, [still], still.caption))
    for measure, title in (("total", "Total Sobol' index"), ("mu_star", "mean |effect|")):
        rows = [_row(s, measure) for s in found.sensitivities]
        if kept := [r for r in rows if any(cell != "–" for cell in r[1:])]:
            caption = f"{title}; ± is half the 95 % interval." if measure == "total" else title
            blocks.append(_indices(page, found, measure))
            blocks.append(Table(("result", *found.names), kept, words=("result",), caption=caption))
    facts = [
        (label(s.result), f"R² {number(s.r2, 3)} of a power law, {s.used} samples")
        for s in found.sensitivities
        if np.isfinite(s.r2) and s.r2 < 0.95
    ]
    return [*blocks, Facts(facts)] if facts else blocks


def _indices(page: Page, found: ParameterStudy, measure: str) -> Block:
    """Bars of a result's measure over its parameters, with the other measure of its method."""
    shown = [s for s in found.sensitivities if np.isfinite(getattr(s, measure)).any()]
    if measure == "total":
        axis = "Sobol' index; bars of error: 95 % interval"
        results: dict[str, live_samples.Measures] = {
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
    data = live_samples.indices(results, found.names, axis)
    return page.live(f"indices_{measure}", "indices", data)


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
    ('mode 3 [Hz]', 'mass [kg]', 'Q')
    """
    if column.endswith("_hz") and column[1:-3].isdigit():
        return f"mode {column[1:-3]} [Hz]"
    return "mass [kg]" if column == "mass_kg" else column


def _pictures(
    page: Page, folder: Path, found: ParameterStudy, files: list[tuple[str, str]]
) -> list[Block]:
    from . import study_plots

    parameters = {_with_unit(v.name, v.unit): found.column(v.name) for v in found.varied[:_AXES]}
    labels = {v.name: _with_unit(v.name, v.unit) for v in found.varied}
    results = {label(c): found.column(c) for c in _drawn(found)}
    labels |= {c: label(c) for c in found.columns}
    if not results:
        return []
    decades = [_with_unit(v.name, v.unit) for v in found.varied if v.log]
    whole, colour = {**parameters, **results}, next(iter(results))
    nominal = {labels.get(k, k): v for k, v in plain(found.nominal).items()
               if isinstance(v, float)}  # fmt: skip
    blocks: list[Block] = []
    if np.isfinite(np.stack(list(whole.values()))).all(axis=0).sum() > 1:
        path = study_plots.parallel_coordinates(folder / "parallel.png", whole, colour, decades)
        files.append((path.name, "parallel coordinates"))
        still = Picture(path, f"Each line is a sample; colour: {colour}.")
        blocks.append(_lines(page, found, still))
    path = study_plots.response_plots(
        folder / "responses.png", results, parameters, nominal, decades
    )
    files.append((path.name, "results over parameters"))
    still = Picture(path, "Dots: samples; dashed: the deck's own values.")
    at = _share(page, found)
    data = {"x": at[found.names[0]], "y": at[_drawn(found)[0]]}
    return [*blocks, page.live("responses", "cloud", data, [still], still.caption)]


def _share(page: Page, found: ParameterStudy) -> dict[str, int]:
    """Give the page all samples; return the position of each column in them, by its name."""
    units = {v.name: unit_text(v.unit) for v in found.varied}
    text = {n: f"{_shortened(n)} [{u}]" if u else _shortened(n) for n, u in units.items()}
    text |= {c: _shortened(label(c)) for c in found.columns}
    nominal = {k: v for k, v in plain(found.nominal).items() if isinstance(v, float)}
    columns = {name: found.column(name) for name in text}
    decades = [v.name for v in found.varied if v.log]
    page.shared = {"samples": live_samples.samples(columns, text, nominal, decades)}
    return {name: k for k, name in enumerate(text)}


def _lines(page: Page, found: ParameterStudy, still: Picture) -> Block:
    """Every sample as a line across parameters and results."""
    at, results = _share(page, found), _drawn(found)
    axes = [at[name] for name in (*(v.name for v in found.varied[:_AXES]), *results)]
    few = f" The first {live_samples.MOST} are drawn." * (len(found.rows) > live_samples.MOST)
    text = f"Draw a box over an axis to keep the samples within it.{few} {still.caption}"
    data = {"axes": axes, "by": at[results[0]]}
    return page.live("parallel", "parallel", data, [still], text)


def _with_unit(name: str, unit: str) -> str:
    """Label of an axis."""
    return f"{_drawable(name)} [{unit_text(unit)}]" if unit_text(unit) else _drawable(name)


def _drawable(name: str) -> str:
    """Shorten a user's name for a picture's label, and prevent its reading as a formula."""
    return _shortened(name).replace("$", r"\$")


def _shortened(name: str) -> str:
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 12]}…{name[-11:]}"


def _drawn(found: ParameterStudy) -> list[str]:
    """Q first, then the lowest modes; none that no sample has."""
    modes = [c for c in found.columns if c.startswith("f") and c.endswith("_hz")]
    first = (["Q"] if "Q" in found.columns else []) + modes[: _SHOWN - ("Q" in found.columns)]
    return [c for c in first if np.isfinite(found.column(c)).any()]
