"""Two runs next to each other: what they found, their values, their charts in one."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..output import LIST
from ..workflows.diagnosis_result import DiagnosisResult
from .blocks import Block, Drawing, PageParts, Section, Table
from .drawings import drawings_of
from .run_list import FinishedRun, contents
from .verdict import three_numbers
from .words import hertz, interval, number, percent

_MOST = 300  # numbers in the table
_OF_TEST = ("test", "coherence")  # the same in both runs
_OTHERS = {"@after": "@calm", "@before": "@warn", "@neutral": "@found"}  # colours of the second run
Json = dict[str, Any]


def compared_runs(a: FinishedRun, b: FinishedRun, place: Path) -> PageParts:
    """Sections of the page that lies in ``place``."""
    names = _names(a, b)
    first = [
        ("command", a.command, b.command),
        ("case", a.source, b.source),
        ("written", *(f"{r.written:%Y-%m-%d %H:%M} UTC" for r in (a, b))),
        ("result", a.lead, b.lead),
        ("Q of", *(r.q()[0] for r in (a, b))),
        ("Q before", *(number(r.q()[1], 3) for r in (a, b))),
        ("Q after", *(number(r.q()[2], 3) for r in (a, b))),
    ]
    heads = ("", *names)
    values = [dict(_values(r)) for r in (a, b)]
    alike = a.command == b.command or None not in (a.diagnosis, b.diagnosis)
    every = [k for k in {**values[0], **values[1]} if alike or all(k in one for one in values)]
    rows = [(key, *(one.get(key, "–") for one in values)) for key in every]
    left = len(rows) - _MOST
    folders = [(name, str(r.folder)) for name, r in zip(names, (a, b), strict=True)]
    pages = Table(("page of", "folder"), folders, ("page of", "folder"),
                  links=[r.page_from(place) for r in (a, b)])  # fmt: skip
    caption = f"The files hold {left} more." if left > 0 else ""
    sections = [
        Section("Results", [Table(heads, first, heads), pages]),
        Section("Values", [Table(heads, rows[:_MOST], heads, caption)]),
        Section("Charts of both", _charts(a, b, names)),
    ]
    same = a.lead == b.lead
    lead = (
        f"{names[0]} and {names[1]} come to {'the same result' if same else 'different results'}."
    )
    return PageParts(lead, sections)


def _names(a: FinishedRun, b: FinishedRun) -> tuple[str, str]:
    """The last part of each folder, and more of it where these are equal."""
    one, other = a.folder.resolve(), b.folder.resolve()
    k = next((k for k in range(1, 9) if one.parts[-k:] != other.parts[-k:]), 1)
    return "/".join(one.parts[-k:]), "/".join(other.parts[-k:])


def _values(run: FinishedRun) -> Iterator[tuple[str, str]]:
    """Names and values of a diagnosis in words; of another command every number of its JSON."""
    if run.diagnosis is not None:
        yield from _of_diagnosis(run.diagnosis)
        return
    for path in sorted(run.folder.glob("*.json")):
        if path.name != LIST and not path.is_symlink():
            yield from _flat(contents(run, path.name))


def _of_diagnosis(found: DiagnosisResult) -> Iterator[tuple[str, str]]:
    yield from three_numbers(found)
    for k, e in enumerate(found.effects, 1):
        yield f"effect {k}", ", ".join(t for t in (e.name, e.where.text) if t)
        for p in e.parameters:
            yield f"{p.name} of {e.name}", interval(p.value, p.low, p.high, p.unit)
    for c in found.calibrated:
        yield c.where, interval(c.estimate.value, c.estimate.low, c.estimate.high, c.estimate.unit)
    for r in found.frequencies:
        f = r.after_hz or r.before_hz
        yield f"mode of the test at {hertz(r.test_hz)} Hz", f"{hertz(f)} ({percent(f, r.test_hz)})"


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Numbers of nested data under the keys that lead to them."""
    if isinstance(value, dict | list):
        each = value.items() if isinstance(value, dict) else enumerate(value, 1)
        for key, inner in each:
            yield from _flat(inner, f"{name} {key}".strip().replace("_", " "))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name, number(value)


def _charts(a: FinishedRun, b: FinishedRun, names: tuple[str, str]) -> list[Block]:
    """Charts of the same quantities, overlaid."""
    one, other = (drawings_of(Path(r.folder) / "report.html")[1] for r in (a, b))
    held = {d.name: d.content for d in other}
    out: list[Block] = []
    for d in one:
        both = overlaid(d.content, held.get(d.name), names)
        if both is not None:
            out.append(Drawing(d.name, both, d.caption, {}))
    return out


def overlaid(a: Any, b: Any, names: tuple[str, str]) -> Json | None:
    """One chart of two as pages hold them; None where their quantities differ.

    A chart with a choice, such as of channels, keeps the views that both have.
    """
    charts = [c for c in (a, b) if isinstance(c, Mapping) and c["draw"] == "chart"]
    if len(charts) < 2 or any("brush" in c or len(c.get("choices", ())) > 1 for c in charts):
        return None
    if _axes(a["layout"]) != _axes(b["layout"]) or any(
        t["type"] == "heatmap" for c in charts for t in c["data"]
    ):
        return None
    kept = [k for k, t in enumerate(b["data"]) if t.get("name") not in _OF_TEST]
    made = {k: v for k, v in a.items() if k not in ("choices", "pick")}
    made["data"] = [_named(t, names[0]) for t in a["data"]]
    made["data"] += [_named(b["data"][k], names[1], _OTHERS) for k in kept]
    made["layout"] = {**a["layout"], "showlegend": True}
    if "choices" in a:
        (one,), (other,) = a["choices"], b.get("choices", [{"options": ()}])
        views = {_stem(o): o for o in other["options"]}
        options = []
        for o in (o for o in one["options"] if _stem(o) in views):
            more = [views[_stem(o)]["data"][k] for k in kept]
            options.append({**o, "text": _stem(o), "data": [*o["data"], *more]})
        if not options:
            return None
        made["choices"] = [{**one, "options": options, "marked": {}}]
    return made


def _stem(option: Json) -> str:
    """A channel without its scores."""
    return str(option["text"]).split(", Q ")[0]


def _axes(layout: Json) -> Sequence[Any]:
    """Titles and named ticks of all axes."""
    return [(key, axis.get("title", {}).get("text"), axis.get("ticktext"), axis.get("type"))
            for key, axis in sorted(layout.items()) if "axis" in key]  # fmt: skip


def _named(trace: Json, run: str, colours: Mapping[str, str] | None = None) -> Json:
    """A trace under its own name and that of its run; ``colours`` replace its own."""
    text = json.dumps(trace)
    for old, new in (colours or {}).items():
        text = text.replace(f'"{old}"', f'"{new}"')
    made: Json = json.loads(text)
    if trace.get("name") not in (*_OF_TEST, ""):
        run = run.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        made |= {"name": f"{trace['name']} ({run})", "legendgroup": f"{trace['name']} {run}"}
        if "hovertemplate" in made:
            made["hovertemplate"] = f"{run}, {made['hovertemplate']}"
    return made
