"""Chapter 6 of the thesis, tables 13 to 15 and figures 34 and 35; then the hem itself."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from chladni.ema.mode_pairing import pair
from chladni.io.nastran import write_assembly, write_deck
from chladni.progress import Progress, within
from chladni.report.blocks import Block, Facts, Items, Picture, Section, Table, Text
from chladni.report.sentence import sentence
from chladni.report.words import hertz, number, quantity
from chladni.units import units
from chladni.view import charts
from chladni.view.chart_png import png
from chladni.workflows.diagnose import diagnose
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni_bench import FREQUENCIES, WEIGHTS

from .thesis_chapter import Chapter
from .thesis_corrections import MAPPED, compared, deviations
from .thesis_desk import UNITS, Desk
from .thesis_modes import spread
from .thesis_numbers import TABLE_13, TABLE_14, TABLE_15
from .thesis_scores import BEYOND, FIT, ModelScore, read_score, scored_model

HEM, TRUE = "hem.bdf", "article.bdf"
CLOSE = 0.95  # MAC of a mode that correlates well, section 2.7.1
_NONE = "–"


def _numbers(desk: Desk, chapter: str) -> dict[str, Any]:
    """Numbers of a finished chapter."""
    text = (desk.folder / f"{chapter}.json").read_text(encoding="utf-8")
    return dict(json.loads(text)["numbers"])


def told_scores(desk: Desk) -> dict[str, ModelScore]:
    """Scores of all decks of the earlier chapters, in their order."""
    mapping, calibration = _numbers(desk, "mapping"), _numbers(desk, "calibration")
    nominal, mapped = map(read_score, mapping["scores"])
    return {
        "nominal": nominal,
        "mapped thickness": mapped,
        "stiff adhesive": read_score(_numbers(desk, "adhesive")["stiff"]),
        "calibrated": read_score(calibration["calibrated"]),
        "calibrated, weighed": read_score(calibration["weighed"]),
    }


def results_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Nominal and calibrated deck against the test: mass, frequencies, shapes, responses."""
    progress("tables 13 to 15", 0.2)
    scores, floor = told_scores(desk), float(_numbers(desk, "mapping")["floor_Q"])
    nominal, calibrated = scores["nominal"], scores["calibrated"]
    weights = np.array(_numbers(desk, "test")["table_4"]["ours_kg"])
    pictures = [Picture(_mac(desk, name), f"Figure 34: {name}.") for name in
                ("nominal", "calibrated")]  # fmt: skip
    progress("figures 34 and 35", 0.6)
    whole = compared(desk, "figure_35.png", {"nominal": "before", "calibrated": "after"})
    steps = {"fitted": {k: s.fit for k, s in scores.items()}}
    chart = charts.steps(steps, {"fitted": floor}, "between articles")
    fall = png(chart, desk.folder / "waterfall.png")
    sections = (
        Section("Table 13: mass", _masses(scores, weights)),
        Section("Table 14: frequencies", _frequencies(nominal, calibrated)),
        Section("Figure 34: shapes", [*pictures, Facts(_likeness(scores))]),
        Section("Table 15 and figure 35: responses", [
            Picture(whole, "Figure 35: nominal (before) and calibrated (after)."),
            deviations(TABLE_15, (nominal, calibrated), ("nominal", "calibrated")),
            Picture(fall, f"Q of tailgate A step by step, {FIT[0]:g} to {FIT[1]:g} Hz; the line is "
                          "Q between two articles."),
        ]),
    )  # fmt: skip
    numbers = {
        "table_13": {"thesis_kg": TABLE_13, "ours_kg": {k: s.mass for k, s in scores.items()}},
        "table_14": {"thesis_hz": TABLE_14, "test": nominal.test, "nominal": nominal.model,
                     "calibrated": calibrated.model},
        "table_15": {"thesis": TABLE_15, "ours": [nominal.Q, calibrated.Q], "floor": floor},
        "waterfall": {k: s.fit for k, s in scores.items()},
    }  # fmt: skip
    off = 100 * (calibrated.mass / weights.mean() - 1)
    theirs = 100 * (TABLE_13["calibrated"] / TABLE_13["test"] - 1)
    lead = (
        f"the calibrated deck has Q {number(calibrated.Q, 3)} of {number(nominal.Q, 3)} (thesis: "
        f"{TABLE_15[1]} of {TABLE_15[0]}), frequencies {number(100 * calibrated.error, 2)} % off "
        f"on average, and weighs {off:+.1f} % (thesis: {theirs:+.1f} %)"
    )
    return Chapter(lead, sections, numbers)


def _masses(scores: dict[str, ModelScore], weights: np.ndarray) -> list[Block]:
    ours = weights.mean()
    rows = [
        ("three articles", f"{TABLE_13['test']:.3f}", "", f"{ours:.3f}", ""),
        ("difference between them [%]", "", number(100 * spread(np.array([WEIGHTS]))[0], 2), "",
         number(100 * spread(weights[None])[0], 2)),
    ]  # fmt: skip
    for name, s in scores.items():
        theirs = TABLE_13.get(name)
        off = "" if theirs is None else f"{100 * (theirs / TABLE_13['test'] - 1):+.1f}"
        rows.append((name, _NONE if theirs is None else f"{theirs:.3f}", off, f"{s.mass:.3f}",
                     f"{100 * (s.mass / ours - 1):+.1f}"))  # fmt: skip
    columns = ("", "thesis [kg]", "difference [%]", "ours [kg]", "difference [%]")
    return [
        Table(columns, rows, ("",)),
        Text([
            "The thesis did not weigh in its fit. To meet the scales its mapped model would need "
            "2.9 % more density; the fit took 4.9 % less. Density stood for what the hem's "
            "stand-in leaves. The last row is the same fit with the mass as a datum.",
        ]),
    ]  # fmt: skip


def _frequencies(nominal: ModelScore, calibrated: ModelScore) -> list[Block]:
    theirs = [t for t in TABLE_14 if t[0] is not None]
    partner = pair(nominal.test, FREQUENCIES[0])
    of = {int(i): theirs[int(j)] for i, j in zip(partner.model, partner.test, strict=True)}
    rows = []
    for k, f in enumerate(nominal.test):
        t = of.get(k)
        printed = [_NONE] * 5 if t is None else _both(t[0], t[1], t[2])
        rows.append([str(k + 1), *printed, *_both(f, nominal.model[k], calibrated.model[k])])
    columns = ("our mode", "thesis: A", "nominal", "[%]", "calibrated", "[%]", "ours: A",
               "nominal", "[%]", "calibrated", "[%]")  # fmt: skip
    alone = [
        (name, "84.7 Hz" if name == "nominal" else "none",
         ", ".join(hertz(f) for f in s.alone) or "none")
        for name, s in (("nominal", nominal), ("calibrated", calibrated))
    ]  # fmt: skip
    error = [np.mean([abs(t[k] / t[0] - 1) for t in theirs]) for k in (1, 2)]  # type: ignore[operator]
    means = [("nominal", f"{100 * error[0]:.1f}", f"{100 * nominal.error:.1f}"),
             ("calibrated", f"{100 * error[1]:.1f}", f"{100 * calibrated.error:.1f}")]  # fmt: skip
    return [
        Table(columns, rows, (), "Hz, and difference from A. Rows of the thesis are nearest in "
                                 "frequency; its percentages are taken from its own values."),
        Table(("", "thesis [%]", "ours [%]"), means, ("",), "Mean absolute difference."),
        Table(("modes without partner", "thesis", "ours"), alone,
              ("modes without partner", "thesis", "ours")),
    ]  # fmt: skip


def _both(test: float | None, before: float | None, after: float | None) -> list[str]:
    """A, nominal, its difference, calibrated, its difference."""
    out = [_hertz(test)]
    for f in (before, after):
        known = f is not None and test is not None and np.isfinite(f)
        out += [_hertz(f), f"{100 * (f / test - 1):+.1f}" if known else _NONE]  # type: ignore[operator]
    return out


def _hertz(f: float | None) -> str:
    return _NONE if f is None or not np.isfinite(f) else hertz(f)


def _mac(desk: Desk, name: str) -> Any:
    with np.load(desk.folder / f"responses_{name}.npz", allow_pickle=False) as held:
        M, f = held["mac"], held["modes"]
    chart = charts.mac(f, {"test": (M, told_scores(desk)["nominal"].test, [])}, f"{name} model")
    return png(chart, desk.folder / f"figure_34_{name}.png")


def _likeness(scores: dict[str, ModelScore]) -> list[tuple[str, str]]:
    close = {k: int((s.mac > CLOSE).sum()) for k, s in scores.items()}
    return [(f"MAC above {CLOSE:g}, {name}", f"{n} of {len(scores[name].test)}" +
             (" (thesis: 8 of 14)" if name == "calibrated" else ""))
            for name, n in close.items()]  # fmt: skip


def hem_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Diagnose the deck with mapped thickness, and score the deck with what was found."""
    mapped = desk.deck(MAPPED)
    words: dict[str, Any] = {"effects": list(desk.effects)} if desk.effects else {}
    case = desk.case(mapped, band=FIT, held_out_band=BEYOND, mass=desk.weight(), **words)
    found = diagnose(case, progress=within(progress, 0.0, 0.9))
    final = None if found.models is None else found.models.final
    edits = None if final is None else final.changes
    assert mapped.deck is not None
    write_deck(mapped.deck, desk.folder / HEM, edits or ())
    progress("scores of the deck with the hem", 0.9)
    with_hem = scored_model(desk, "hem", desk.deck(HEM))
    write_assembly(desk.specimen.article(), desk.folder / TRUE, units(UNITS))
    truth = scored_model(desk, "article", desk.deck(TRUE))
    scores = {**told_scores(desk), "after the diagnosis": with_hem, "the article's model": truth}
    floor, weight = float(_numbers(desk, "mapping")["floor_Q"]), desk.weight()
    columns = ("deck", "mass [%]", "frequencies [%]", f"MAC > {CLOSE:g}", "Q, 26 to 195 Hz",
               "Q of B and C", "Q, 200 to 300 Hz")  # fmt: skip
    rows = [
        (name, f"{100 * (s.mass / weight - 1):+.2f}", number(100 * s.error, 2),
         f"{(s.mac > CLOSE).sum()} of {len(s.test)}", number(s.fit, 3), number(s.other, 3),
         number(s.beyond, 3))
        for name, s in scores.items()
    ]  # fmt: skip
    rows.append(("another article as model", "", "", "", number(floor, 3), "", ""))
    picture = compared(desk, "hem.png", {"calibrated": "before", "hem": "after"})
    blocks: list[Block] = [
        Text([sentence(found)]),
        _effects(found),
        Table(columns, rows, ("deck",), "Differences from tailgate A; B and C and the band above "
                                        "were never fitted."),
        Picture(picture, "Calibrated as in the thesis (before), after the diagnosis (after)."),
        Text([
            "The article's model has formed thickness and the hem of the article before articles "
            "differ. No deck can be better except by chance: what it leaves is the difference "
            "between two articles.",
        ]),
        Items([*_searched(desk), *found.distrust, *_alternatives(found)]),
    ]  # fmt: skip
    numbers = {
        "hem": {
            "verdict": found.verdict, "effects": [e.name for e in found.effects],
            "distrust": found.distrust, "floor": floor, **with_hem.numbers,
        },
        "article": truth.numbers,
    }  # fmt: skip
    lead = (
        f"{sentence(found).rstrip('.')}: Q {number(with_hem.fit, 3)} where the thesis' road ends "
        f"at {number(scores['calibrated'].fit, 3)} and two articles differ by {number(floor, 3)}"
    )
    section = Section("Beyond the thesis: the hem", blocks)
    return Chapter(lead, (section,), numbers, (
        (HEM, "the deck with what was found"), (TRUE, "the article before articles differ"),
    ))  # fmt: skip


def _effects(found: DiagnosisResult) -> Table:
    rows = [
        (e.name, e.where.text, p.name, quantity(p.value, p.unit),
         " to ".join(_NONE if x is None else quantity(x, p.unit) for x in (p.low, p.high)))
        for e in found.effects for p in e.parameters
    ]  # fmt: skip
    columns = ("effect", "where", "parameter", "value", "95 %")
    return Table(columns, rows, columns)


def _searched(desk: Desk) -> Sequence[str]:
    return [f"Only these effects were tried: {', '.join(desk.effects)}."] if desk.effects else []


def _alternatives(found: DiagnosisResult, most: int = 3) -> Sequence[str]:
    return [f"{a.name}: {a.why_not}" for a in found.alternatives[:most]]
