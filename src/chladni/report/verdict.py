"""A diagnosis in tables and pictures: the contents of its page."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import mean

from ..effects.estimate import Location
from ..inference.calibration_result import ParameterKnowledge
from ..inference.result import (
    Adequacy,
    Agreement,
    LeftPlace,
    NamedEffect,
)
from ..workflows.diagnosis_result import DiagnosisResult
from .blocks import Block, Code, Drawing, Facts, Items, Links, Picture, Section, Table, Text
from .calibration_blocks import study_sections
from .level_blocks import level_section
from .measurement_table import next_measurements
from .screening_blocks import screening_section
from .sentence import only_fitted
from .states_table import of_estimate, states_table
from .words import criterion, fixed, hertz, number, percent, quantity, share

HEADING = {
    "missing physics": "Missing physics found",
    "calibration only": "Calibration only",
    "nothing missing": "Nothing missing",
    "measurement fault": "Measurement fault",
    "nonlinear": "Not linear",
    "not in catalogue": "Not in the catalogue",
}
ONE_ANSWER = ("missing physics", "calibration only", "nothing missing")
TONE = {
    "missing physics": "found",
    "calibration only": "calm",
    "nothing missing": "calm",
    "measurement fault": "warn",
    "nonlinear": "warn",
    "not in catalogue": "warn",
}
APART = 0.01  # relative difference of a written value from the found one that is explained
_FILES = {
    "deck": "the updated deck",
    "calibrated": "the deck calibrated without the effect",
    "report": "this page",
    "diagnosis": "the result for other programs",
    "calibration": "what could be known, basins, covariance and profiles for other programs",
    "frf": "test and model as arrays",
    "outlook": "forecasts of further measurements, for chladni next",
    "posterior": "odds and posterior, for chladni diagnose --earlier",
}


def badge(result: DiagnosisResult) -> str:
    """The verdict in a few words, no surer than its sentence."""
    if only_fitted(result):
        fits = "in doubt" if result.distrust else "fits"
        return f"Calibrated: {'does not fit' if result.verdict == 'not in catalogue' else fits}"
    if result.one_of and not result.effects:
        return "No effect named"
    if result.searched and result.distrust and result.verdict in ONE_ANSWER:
        return "Physics may be missing"
    return HEADING.get(result.verdict, result.verdict)


def three_numbers(result: DiagnosisResult) -> list[tuple[str, str]]:
    """Held-out deviation, frequencies and mass, before and after."""
    facts, agreement, mass = [], result.agreement or Agreement(), result.mass
    held = agreement.held_out
    (one, before), (last, after) = held.last_step(bool(result.effects)).items()
    if before is not None and after is not None:
        text = f"{one} deck {number(before, 3)} → {last} deck {number(after, 3)}"
        facts.append(("Held-out deviation Q", f"{text} ({percent(after, before)})"))
    if (off := [_off(result, key) for key in ("before_hz", "after_hz")])[0]:
        text = " → ".join(share(mean(x)) for x in off if x)
        facts.append(("Frequencies, mean deviation", text))
    if mass is not None and mass.model_kg is not None:
        weighed = f", weighed {number(mass.weighed_kg)} kg" if mass.weighed_kg else ", not weighed"
        facts.append(("Mass", f"model {number(mass.model_kg)} kg{weighed}"))
    return facts


def _off(result: DiagnosisResult, key: str) -> list[float]:
    """|f/f_test - 1| of the modes with a partner."""
    return [abs(f / r.test_hz - 1) for r in result.frequencies if r.test_hz
            if (f := getattr(r, key))]  # fmt: skip


def _joints(result: DiagnosisResult) -> Table:
    """Tabulate the joints of a linear deck at every level."""
    rows = [tuple(number(x) for x in vars(j).values()) for j in result.joints]
    heads = ("mode [Hz]", "level", "K, times", "GE", "share of strain energy")
    what = (
        "Springs and bushes of a linear deck that matches the mode at one level: K relative to "
        "the updated deck, and GE (PBUSH). The updated deck contains them as comments."
    )
    return Table(heads, rows, caption=what)


def sections(
    result: DiagnosisResult,
    figures: Mapping[str, Path],
    notes: Sequence[str],
    more: Sequence[Section],
    command: str,
    drawings: Sequence[Drawing] = (),
) -> list[Section]:
    """Return all sections under the verdict, in the order of an engineer's questions.

    ``figures`` are the pictures that there are, by name.
    """
    held = {name for d in drawings for name in d.pictures} | {"where"}

    def shown(place: str) -> list[Drawing]:
        return [d for d in drawings if d.place == place]

    found = screening_section(result.screening)
    of_levels = {int(d.name.rpartition("_")[2]) - 1: d for d in shown("levels")}
    return [
        Section("Reasons for doubt", [Items(result.distrust)]),
        *([found] if result.screening and result.screening.findings else []),
        Section("States", states_table(result)),
        Section("Next measurement", [next_measurements(result.next_measurements), *shown("next")]),
        Section("At a glance", [_glance(result)]),
        Section("Findings", [*_effects(result.effects), *shown("found")]),
        level_section(result.levels, of_levels),
        Section("Joints at each level", [_joints(result)]),
        Section("Calibrated parameters", _calibrated(result)),
        *study_sections(result.study, shown("study"), shown("guidance")),
        Section("Test and model", shown("frf")),
        Section("Scores", [_scores(result), _recordings(result), *shown("scores")]),
        Section("Frequencies", [_frequencies(result), *shown("modes")]),
        Section("Why not something else", [_alternatives(result), *shown("why")]),
        Section("The test", shown("test")),
        *([found] if result.screening and not result.screening.findings else []),
        Section("Steps and reasons", [Items(notes)]),
        *more,
        Section("More pictures", [Picture(p, n) for n, p in figures.items() if n not in held]),
        Section("Files", [_files(result)]),
        Section("Run it again", [Code([command] if command else [])]),
    ]


def _glance(result: DiagnosisResult) -> Facts:
    """Numbers in addition to the three of the first screen."""
    facts, fit = [], (result.agreement or Agreement()).fitted
    if fit.nominal is not None and fit.after is not None:
        change = percent(fit.after, fit.nominal)
        text = f"{number(fit.nominal, 3)} → {number(fit.after, 3)} ({change})"
        facts.append(("Q, fitted data", text))
    for name in ("before", "after"):
        if off := _off(result, f"{name}_hz"):
            text = f"mean error {share(mean(off))}, largest {share(max(off))}"
            facts.append((f"Frequencies {name}", text))
    if result.adequate is not None:
        facts.append(("Test of fit", _fits(result.adequate)))
    return Facts(facts)


def _fits(test: Adequacy) -> str:
    """The absolute test in one line."""
    if test.passes:
        return (
            f"passed: {number(100 * test.p, 2)} % of recordings of a right model have a residual "
            f"as unusual{_odds(test)}"
        )
    place = "; ".join(_spot(place) for place in test.where)
    return f"failed: {test.what}{f' ({place})' if place else ''}{_odds(test)}"


def _odds(test: Adequacy) -> str:
    """Odds of a cause outside the catalogue, where they are known."""
    if (odds := test.something_else) is None:
        return ""
    ratio = f"{number(odds, 2)} : 1" if odds >= 1 else f"1 : {number(1 / odds, 2)}"
    return f"; odds of a cause outside the catalogue: at most {ratio}"


def _spot(place: LeftPlace) -> str:
    parts = f"; on {', '.join(place.parts[:3])}" if place.parts else ""
    return f"{place.text}{parts}{f', near grid {place.grid}' if place.grid else ''}"


def _effects(effects: Sequence[NamedEffect]) -> list[Block]:
    blocks: list[Block] = []
    gains = [(e.name, number(e.gain)) for e in effects if e.gain is not None]
    if len(effects) > 1 and gains:
        heads = ("effect", "loss in -2 ln evidence without it, the others fitted again")
        blocks.append(Table(heads, gains, ("effect",)))
    for effect in effects:
        blocks.append(Text([": ".join(t for t in (effect.name, effect.claim) if t)]))
        place = [(name, text) for name, text in _place(effect.where) if text]
        if rows := _estimates(effect):
            columns = ("parameter", "found (95 % interval)", "updated deck")[: len(rows[0])]
            note = _BRACKETS if any("%" in cell for row in rows for cell in row[2:]) else ""
            blocks.append(Table(columns, rows, ("parameter",), note))
        if place:
            blocks.append(Table(("where", ""), place, ("where", "")))
    return blocks


def _estimates(effect: NamedEffect) -> list[tuple[str, ...]]:
    """A row for each number of an effect: as found, and as the updated deck has it."""
    rows: list[tuple[str, ...]] = [(p.name, of_estimate(p)) for p in effect.parameters]
    if not effect.written:
        return rows
    each = zip(rows, effect.parameters, effect.written, strict=True)
    return [(*row, _beside(value, p.value, p.unit)) for row, p, value in each]


def _place(where: Location) -> list[tuple[str, str]]:
    grids, band = [str(g) for g in where.grids], where.band_hz
    some = ", ".join(grids[:12]) + (f" … ({len(grids)} in all)" if len(grids) > 12 else "")
    at = ""
    if where.point_m:
        at = "(" + ", ".join(fixed(x, 4) for x in where.point_m) + ") m"
        at += f", within {quantity(where.radius_m, 'm')}" if where.radius_m else ""
    return [
        ("place", where.text),
        ("parts", ", ".join(str(p) for p in where.parts)),
        ("grids", some),
        ("point", at),
        ("band", f"{number(band[0])} to {number(band[1])} Hz" if band else ""),
        ("channels", ", ".join(str(c) for c in where.channels)),
    ]


def _calibrated(result: DiagnosisResult) -> list[Block]:
    """Tabulate the values that differ between the given and the updated deck."""
    if not (result.calibrated and (result.deck_changed or result.study)):
        return []
    rows = [
        (
            c.where,
            quantity(c.deck_value, c.estimate.unit),
            of_estimate(c.estimate),
            percent(c.estimate.value, c.deck_value),
            _beside(
                c.written_value, c.estimate.value if result.deck_changed else None, c.estimate.unit
            ),
        )
        for c in result.calibrated
    ]
    rows += [
        (f.name, quantity(f.value, f.unit), f"frozen ({_range(f)} by its prior)", "–",
         quantity(f.value, f.unit))
        for f in (result.study.identifiability.parameters if result.study else ())
        if f.frozen
    ]  # fmt: skip
    heads = ("parameter", "deck", "found (95 % interval)", "change", "updated deck")
    note = f"{_REACHED} {_BRACKETS}" if result.deck_changed else f"{_REACHED} {_KEPT}"
    return [Table(heads, rows, ("parameter",), note)]


def _beside(written: float | None, found: float | None, unit: str) -> str:
    """A written value, with its difference from the one that was found, if there is any."""
    value = quantity(written, unit)
    if written is None or not found or abs(written / found - 1) < APART:
        return value
    return f"{value} ({percent(written, found)})"


def _range(p: ParameterKnowledge) -> str:
    """Both ends of the 95 % interval of a prior."""
    low, high = (p.value * math.exp(z * p.prior_sd) for z in (-1.96, 1.96))
    return f"{quantity(low, p.unit)} to {quantity(high, p.unit)}"


_REACHED = (
    "Estimated together with the errors of scatter, joints, mesh and folds. The updated deck "
    "does not contain these errors and may need other values for the same response. Scores and "
    "Frequencies show the result: before and after."
)
_BRACKETS = (
    "Updated deck, in brackets: difference from the found value, because it was fitted without "
    "errors of mesh and scatter."
)
_KEPT = "The deck keeps its values, because the found ones gain too little."


def _scores(result: DiagnosisResult) -> Table:
    """Tabulate Q of every deck on fitted and on held-out data."""
    agreement = result.agreement or Agreement()
    fit, held = agreement.fitted, agreement.held_out
    steps = (
        ("nominal deck", "nominal", False),
        ("calibrated deck without an effect", "calibrated", True),
        *((("updated deck", "with_effect", True),) if result.effects else ()),
        (
            "with errors of mesh, joints and scatter, which no deck contains",
            "with_nuisances",
            False,
        ),
        ("floor: the recording's noise alone", "floor", False),
    )
    rows = []
    for name, key, changed in steps:
        values = [getattr(q, key) for q in (fit, held)]
        if values == [None, None]:
            continue
        sides = zip(values, (fit, held), strict=True)
        changes = [percent(v, q.nominal) if changed else "–" for v, q in sides]
        rows.append((name, number(values[0]), changes[0], number(values[1]), changes[1]))
    columns = ("model", "Q fitted", "change", "Q held out", "change ")
    what = f"Held out: {agreement.what}. " if agreement.what else ""
    what += f"Q: mean {_MEANING[result.compared]}; lower is better. "
    what += "Every run of the same deck gives the same Q."
    return Table(columns, rows, ("model",), what)


def _recordings(result: DiagnosisResult) -> Table:
    """Tabulate Q of every deck on each repeat, article and level that was held out."""
    rows = [
        (r.name, r.relation, *map(number, (r.apart, r.nominal, r.calibrated, r.with_effect)))
        for r in result.recordings
    ]
    heads = ("recording", "is a", "apart", "nominal deck", "calibrated deck", "updated deck")
    return Table(heads, rows, ("recording", "is a"), _APART)


_APART = (
    "Q of the decks on the held-out recordings, over all lines and channels. 'Apart' is the Q of "
    "the fitted recording on them: no deck can be expected to come closer."
)
_MEANING = {
    "responses": "over channels and lines of |log10(H model / H test)|²",
    "frequencies": "over the paired frequencies of |log10(f model / f test)|²",
    "modes": "over the paired modes of |log10(f model / f test)|² + (1 - MAC)/ln²10",
}


def _frequencies(result: DiagnosisResult) -> Table:
    rows = [
        (hertz(r.test_hz), "–" if r.damping is None else f"{100 * r.damping:#.3g}",
         hertz(r.before_hz), percent(r.before_hz, r.test_hz), hertz(r.after_hz),
         percent(r.after_hz, r.test_hz), criterion(r.mac_before), criterion(r.mac_after))
        for r in result.frequencies
    ]  # fmt: skip
    heads = ("test [Hz]", "damping [%]", "before [Hz]", "off", "after [Hz]", "off ", "MAC before",
             "MAC after")  # fmt: skip
    return Table(heads, rows, opens="shapes", at=range(len(rows)))


def _alternatives(result: DiagnosisResult) -> Table:
    named = [e.log_evidence for e in result.effects]
    top = max((value for value in named if value is not None), default=None)
    rows = []
    for other in result.alternatives:
        value = other.log_evidence
        below = None if value is None or top is None else value - top
        rows.append((other.name, number(value), number(below), other.why_not))
    heads = ("explanation", "log evidence", "compared with the best", "why not")
    return Table(heads, rows, ("explanation", "why not"))


def _files(result: DiagnosisResult) -> Links:
    return Links([(str(f), _FILES.get(name, name)) for name, f in result.files.items() if f])
