"""A diagnosis in words and tables: the contents of its page, from ``diagnosis.json``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .blocks import Block, Code, Facts, Items, Links, Picture, Section, Table, Text
from .words import interval, number, percent, quantity

HEADING = {
    "missing physics": "Missing physics found",
    "calibration only": "Calibration only",
    "nothing missing": "Nothing missing",
    "measurement fault": "Measurement fault",
    "nonlinear": "Not linear",
    "not in catalogue": "Not in the catalogue",
}
TONE = {
    "missing physics": "found",
    "calibration only": "calm",
    "nothing missing": "calm",
    "measurement fault": "warn",
    "nonlinear": "warn",
    "not in catalogue": "warn",
}
PLACES = {  # name of a figure: (section it belongs to, caption)
    "frf": ("frf", "One channel: test, model before, model after."),
    "frf_fitted": ("frf", "A channel that was fitted."),
    "frf_held_out": ("frf", "A channel the fit never saw."),
    "frf_grid": ("frf", "Channels spread evenly over the list."),
    "nyquist": ("frf", "Nyquist."),
    "waterfall": ("scores", "Deviation Q on fitted data, step by step."),
    "held_out": ("scores", "Deviation Q on held-out data."),
    "deviation": ("scores", "Where the deviation is left: channel by band."),
    "frequencies": ("modes", "Deviation of each frequency from the test."),
    "mac": ("modes", "Modal assurance criterion, test against model."),
    "modes": ("modes", "Mode shapes of the model after."),
    "stabilisation": ("modes", "Stabilisation diagram of the test."),
    "evidence": ("why", "Log evidence of every explanation tried, relative to the best."),
    "setup": ("test", "Where sensors and shaker sit."),
}
_HALF = ("waterfall", "held_out")  # two of them stand side by side
_FILES = {
    "deck": "the updated deck",
    "report": "this page",
    "diagnosis": "the result for other programs",
    "frf": "test and model as arrays",
}


def sentence(d: Mapping[str, Any]) -> str:
    """The verdict in one sentence."""
    verdict, effects, gain = d.get("verdict", ""), d.get("effects") or [], _gain(d)
    names = " and ".join(e.get("name", "?") for e in effects)
    claims = "; ".join(e["claim"] for e in effects if e.get("claim"))
    places = "; ".join(p for e in effects if (p := _where(e)))
    what = f"{names}{f' ({claims})' if claims else ''}{f', {places}' if places else ''}"
    if verdict == "missing physics":
        return f"The model lacks {what}{gain}."
    if verdict == "measurement fault":
        return f"The recording is at fault, not the model: {what}{gain}."
    if verdict == "nonlinear":
        why = what or "no linear model fits"
        return f"The structure does not answer in proportion to the force: {why}."
    if "alternatives" in d and not d["alternatives"] and not effects:
        return f"Ordinary parameters were calibrated; missing physics was not looked for{gain}."
    if verdict == "calibration only":
        return f"Ordinary parameters explain the recording; no physics is missing{gain}."
    if verdict == "nothing missing":
        return "Model and recording agree within what repeats and dispersion allow."
    if d.get("too_little"):
        return f"Nothing is named: {d['too_little']}."
    if verdict == "not in catalogue":
        near = f": {what}" if what else ""
        return f"Something is missing that the catalogue does not hold{near}."
    return str(verdict)


def sections(
    d: Mapping[str, Any],
    figures: Mapping[str, Path],
    notes: Sequence[str],
    more: Sequence[Section],
    command: str,
) -> list[Section]:
    """All of the page under its verdict, in the order an engineer asks."""

    def shown(place: str) -> list[Block]:
        return [
            Picture(path, PLACES[name][1], wide=name not in _HALF)
            for name, path in figures.items()
            if name in PLACES and PLACES[name][0] == place
        ]

    rest = [Picture(p, n) for n, p in figures.items() if n not in PLACES and n != "where"]
    return [
        Section("At a glance", _glance(d)),
        Section("What was found", _effects(d)),
        Section("Test and model", shown("frf")),
        Section("Scores", [*_scores(d), *shown("scores")]),
        Section("Frequencies", [*_frequencies(d), *shown("modes")]),
        Section("Why not something else", [*_alternatives(d), *shown("why")]),
        Section("The test", shown("test")),
        Section("What was done, and why", [Items(list(notes))] if notes else []),
        *more,
        Section("More pictures", rest),
        Section("Files", _files(d)),
        Section("Run it again", [Code([command])] if command else []),
    ]


def _gain(d: Mapping[str, Any]) -> str:
    held = (d.get("fit") or {}).get("held_out") or {}
    after = held.get("Q_with_effect", held.get("Q_calibrated"))
    if not held.get("Q_nominal") or after is None:
        return ""
    return (
        f"; on data the fit never saw the deviation Q goes from {number(held['Q_nominal'], 3)} "
        f"to {number(after, 3)}"
    )


def _where(effect: Mapping[str, Any]) -> str:
    return str((effect.get("where") or {}).get("text") or "")


def _glance(d: Mapping[str, Any]) -> list[Block]:
    fit, mass = d.get("fit") or {}, d.get("mass") or {}
    held = fit.get("held_out") or {}
    facts = []
    for name, q in (("Q, fitted data", fit), ("Q, held-out data", held)):
        after = q.get("Q_with_effect", q.get("Q_calibrated"))
        if q.get("Q_nominal") is not None and after is not None:
            change = percent(after, q["Q_nominal"])
            facts.append((name, f"{number(q['Q_nominal'], 3)} → {number(after, 3)}  ({change})"))
    if mass.get("model_kg") is not None:
        weighed = f", weighed {number(mass['weighed_kg'])}" if mass.get("weighed_kg") else ""
        facts.append(("Mass", f"model {number(mass['model_kg'])} kg{weighed}"))
    rows = [r for r in d.get("frequencies") or [] if r.get("test_hz")]
    for name, key in (("before", "before_hz"), ("after", "after_hz")):
        off = [abs(r[key] / r["test_hz"] - 1) for r in rows if r.get(key)]
        if off:
            mean, worst = 100 * sum(off) / len(off), 100 * max(off)
            text = f"mean {number(mean, 2)} %, worst {number(worst, 2)} % off"
            facts.append((f"Frequencies {name}", text))
    return [Facts(facts)] if facts else []


def _effects(d: Mapping[str, Any]) -> list[Block]:
    blocks: list[Block] = []
    for effect in d.get("effects") or []:
        blocks.append(Text([": ".join(str(effect[k]) for k in ("name", "claim") if effect.get(k))]))
        rows = [(p.get("name", ""), _interval(p)) for p in effect.get("parameters") or []]
        place = [(name, text) for name, text in _place(effect.get("where") or {}) if text]
        if rows:
            blocks.append(Table(("parameter", "value (interval)"), rows, ("parameter",)))
        if place:
            blocks.append(Table(("where", ""), place, ("where", "")))
    return blocks


def _interval(p: Mapping[str, Any]) -> str:
    return interval(p.get("value"), p.get("low"), p.get("high"), p.get("unit") or "")


def _place(where: Mapping[str, Any]) -> list[tuple[str, str]]:
    point, radius, band = where.get("point_m"), where.get("radius_m"), where.get("band_hz")
    grids = [str(g) for g in where.get("grids") or []]
    some = ", ".join(grids[:12]) + (f" … ({len(grids)} in all)" if len(grids) > 12 else "")
    at = ""
    if point:
        at = "(" + ", ".join(number(x) for x in point) + ") m"
        at += f", within {quantity(radius, 'm')}" if radius else ""
    return [
        ("place", str(where.get("text") or "")),
        ("parts", ", ".join(str(p) for p in where.get("parts") or [])),
        ("grids", some),
        ("point", at),
        ("band", f"{number(band[0])} to {number(band[1])} Hz" if band else ""),
        ("channels", ", ".join(str(c) for c in where.get("channels") or [])),
    ]


def _scores(d: Mapping[str, Any]) -> list[Block]:
    fit = d.get("fit") or {}
    held = fit.get("held_out") or {}
    steps = (
        ("nominal model", "Q_nominal"),
        ("calibrated, nothing added", "Q_calibrated"),
        ("with the effect", "Q_with_effect"),
        ("floor (noise, repeats)", "Q_floor"),
    )
    rows = []
    for name, key in steps:
        if fit.get(key) is None and held.get(key) is None:
            continue
        changes = ["–", "–"]
        if key in ("Q_calibrated", "Q_with_effect"):
            changes = [percent(q.get(key), q.get("Q_nominal")) for q in (fit, held)]
        rows.append((name, number(fit.get(key)), changes[0], number(held.get(key)), changes[1]))
    if not rows:
        return []
    columns = ("model", "Q fitted", "change", "Q held out", "change ")
    what = f"Held out: {held['what']}. " if held.get("what") else ""
    meaning = "Q: mean over channels and lines of |log10(H model / H test)|²; lower is better."
    return [Table(columns, rows, ("model",), what + meaning)]


def _frequencies(d: Mapping[str, Any]) -> list[Block]:
    rows = [
        (
            number(r.get("test_hz")),
            number(r.get("before_hz")),
            percent(r.get("before_hz"), r.get("test_hz")),
            number(r.get("after_hz")),
            percent(r.get("after_hz"), r.get("test_hz")),
            number(r.get("mac_before"), 3),
            number(r.get("mac_after"), 3),
        )
        for r in d.get("frequencies") or []
    ]
    heads = ("test [Hz]", "before [Hz]", "off", "after [Hz]", "off ", "MAC before", "MAC after")
    return [Table(heads, rows)] if rows else []


def _alternatives(d: Mapping[str, Any]) -> list[Block]:
    named = [e.get("log_evidence") for e in d.get("effects") or []]
    top = max((value for value in named if value is not None), default=None)
    rows = []
    for other in d.get("alternatives") or []:
        value = other.get("log_evidence")
        below = None if value is None or top is None else value - top
        why = other.get("why_not") or ""
        rows.append((other.get("name", ""), number(value), number(below), why))
    heads = ("explanation", "log evidence", "against the best", "why not")
    return [Table(heads, rows, ("explanation", "why not"))] if rows else []


def _files(d: Mapping[str, Any]) -> list[Block]:
    files = [(str(f), _FILES.get(name, name)) for name, f in (d.get("files") or {}).items() if f]
    return [Links(files)] if files else []
