"""The next thing to do after every verdict, "no" included: the most useful one first."""

from collections.abc import Sequence

from ..effects.registry import families
from ..ema.level_study import SETTLED_BY
from ..errors import named
from ..inference.result import CalibratedParameter
from ..search.next_measurement import ODDS
from ..workflows.diagnosis_result import DiagnosisResult
from .sentence import against, only_fitted
from .words import interval, percent, quantity

_FAR = 0.05  # relative change of a calibration parameter that is worth a measurement
_MOST = 6  # steps


def next_steps(result: DiagnosisResult) -> list[str]:
    """Return imperative sentences; for several states those of each."""
    if result.states:
        return [
            f"{s.name or 'The first state'}: {step[0].lower()}{step[1:]}"
            for s in result.states
            for step in _steps(s.result)[:2]
        ]
    return _steps(result)[:_MOST]


def _steps(result: DiagnosisResult) -> list[str]:
    by_verdict = {
        "missing physics": _confirm,
        "measurement fault": _measure_again,
        "nonlinear": _levels,
        "not in catalogue": _look,
        "calibration only": _check_values,
        "nothing missing": _keep,
    }
    first, last = [*_advised(result), *_settle(result)], list[str]()
    if not result.one_of:
        first, last = [], _advised(result)
    advise = _search if only_fitted(result) else by_verdict.get(result.verdict, _keep)
    of_verdict = advise(result)
    steps = [*_mend(result), *first, *of_verdict, *_weigh(result), *last]
    return list(dict.fromkeys(steps))


def _mend(result: DiagnosisResult) -> list[str]:
    """Put faults of the recording first: a fit to them distorts the model."""
    if result.screening is None:
        return []
    return [
        f"Correct the recording, {f.kind}{' of ' + named(f.channels, 3) if f.channels else ''}: "
        f"{f.repair or f.text}."
        for f in result.screening.faults
    ]


def _advised(result: DiagnosisResult) -> list[str]:
    """Name the measurements that tell most, and what they will probably do."""
    if not (every := result.next_measurements):
        return []
    what = "; ".join(m.what for m in every)
    if about := every[-1].about:
        return [
            f"Measure with {what}: the interval of {about}, the least known quantity, then has "
            f"{100 * every[-1].narrows:.0f} % of its width."
        ]
    return [
        f"Measure with {what}: one explanation then has odds of {ODDS:.0f} : 1 or better in "
        f"{100 * every[-1].settles:.0f} % of cases, and a wrong one in "
        f"{100 * every[-1].misleads:.0f} %."
    ]


def _settle(result: DiagnosisResult) -> list[str]:
    """Return the measurements that separate tied explanations."""
    known = {f.name: f.settled_by for f in families()}
    tried = {e.name: e.where.text for e in result.effects}
    tried |= {a.name: a.where.text for a in result.alternatives if a.where is not None}
    names = [name for group in result.one_of for name in group if known.get(name)]
    return [
        _at(tried.get(name, ""), f"{known[name]}, which distinguishes {name} from the others")
        for name in names
    ]


def _at(place: str, what: str) -> str:
    """A sentence with its place first."""
    text = f"{place}: {what}" if place else what
    return f"{text[0].upper()}{text[1:]}."


def _confirm(result: DiagnosisResult) -> list[str]:
    """Ask to inspect each place for the expected size, then name the proof."""
    known = {f.name: f.settled_by for f in families()}
    tied = {name for group in result.one_of for name in group}
    steps = []
    for e in result.effects:
        size = ", ".join(f"{p.name} {interval(p.value, p.low, p.high, p.unit)}"
                         for p in e.parameters[:2])  # fmt: skip
        steps.append(_at(e.where.text, f"check if {e.claim or e.name}{f' ({size})' * bool(size)}"))
        if known.get(e.name) and e.name not in tied:
            steps.append(_at("", f"{known[e.name]}, which confirms {e.name}"))
    return [*steps, *_take_the_deck(result), *_validate(result)]


def _take_the_deck(result: DiagnosisResult) -> list[str]:
    deck, lost = result.files.get("deck"), _without_card(result)
    if not deck or not result.deck_changed:
        return []
    if result.distrust:
        return [f"Do not use {deck} before the reasons for doubt are settled."]
    if worse := against(result):
        return [f"Do not use {deck}: {worse}."]
    if lost:
        use = f"Use {deck} for the structure without {named(lost)}, which no card of it holds"
    else:
        use = f"Use {deck}: it contains the change"
    if result.halved:
        use += f"; every shell of it is halved, because {result.halved}"
    return [f"{use}."]


def _without_card(result: DiagnosisResult) -> list[str]:
    """Names of the effects of the structure that no deck can hold."""
    out = {f.name for f in families() if f.no_cards and f.effect.kind == "physics"}
    return [e.name for e in result.effects if e.name in out]


def _validate(result: DiagnosisResult) -> list[str]:
    """Suggest a second test, which is worth more than a second fit."""
    if result.recordings:
        return []
    return ["Measure again with another drive point, and diagnose with both recordings."]


def _measure_again(result: DiagnosisResult) -> list[str]:
    faults = [e for e in result.effects if e.where.channels]
    again = [
        f"Measure {named(e.where.channels, 3)} again with another sensor and another cable."
        for e in faults
    ]
    until = [
        f"Until then write no in the column use of sensors.csv for {named(e.where.channels, 3)}, "
        "and diagnose the other channels."
        for e in faults
    ]
    return [*again, *until] or ["Correct the fault, measure again and diagnose again."]


def _levels(result: DiagnosisResult) -> list[str]:
    moving = [t.sentence for t in result.levels if t.sentence]
    steps = [f"{SETTLED_BY[0].upper()}{SETTLED_BY[1:]}."] if moving else []
    if not result.levels:
        steps.append("Measure at three or more levels, each in its own recording.")
    if result.joints:
        steps.append("Choose the service level, and use K and GE of the joints at that level.")
    return [*steps, *_take_the_deck(result)]


def _look(result: DiagnosisResult) -> list[str]:
    """Advise if no effect of the catalogue fits: place first, then recording, then more data."""
    spots = [w for w in (result.adequate.where if result.adequate else ())]
    steps = [result.adequate.step] if result.adequate and result.adequate.step else []
    for w in spots:
        place = f" near grid {w.grid}" if w.grid else ""
        parts = f" on {named(w.parts, 3)}" if w.parts else ""
        steps.append(
            f"Look at the structure{place}{parts} for physics that the deck lacks: {w.text}."
        )
    steps += _odd_checks(result)
    if not result.levels:
        steps.append(
            "Measure at half and at twice the level: modes that change with the level are not "
            "linear, and no linear effect explains them."
        )
    if any(w.grid for w in spots):
        steps.append("Measure again with more sensors near that place, and another drive point.")
    near = [a for a in result.alternatives if a.log_evidence is not None][:1]
    known = {f.name: f.settled_by for f in families()}
    steps += [
        _at(
            a.where.text if a.where else "",
            f"{known[a.name]}, because {a.name} is the closest explanation",
        )
        for a in near
        if known.get(a.name)
    ]
    there = " there" * any(w.grid or w.parts for w in spots)
    steps.append(
        f"Check the idealisation of the structure{there}: mesh, ties, supports. You can add your "
        "own effects (docs/extending.md)."
    )
    return steps


def _odd_checks(result: DiagnosisResult) -> list[str]:
    checks = [] if result.screening is None else result.screening.checks
    return [f"Check the recording, {c.name}: {c.result}." for c in checks if c.passed is False]


def _search(result: DiagnosisResult) -> list[str]:
    """Advise after a calibration, which cannot say where physics is missing."""
    run = "Run chladni diagnose, which searches for missing physics."
    return [run, *_odd_checks(result), *_take_the_deck(result)]


def _check_values(result: DiagnosisResult) -> list[str]:
    finer = [
        f"Refine the mesh, which takes frequencies up to {100 * result.mesh_error:.2g} % off, and "
        "diagnose again: effects that are smaller than this are then seen."
    ] * bool(result.mesh_error)
    return [*finer, *_measured(result.calibrated), *_take_the_deck(result), *_validate(result)]


def _measured(calibrated: Sequence[CalibratedParameter]) -> list[str]:
    """The parameters that moved most, to be measured on the article."""
    moved = [
        (abs(c.estimate.value / c.deck_value - 1), c)
        for c in calibrated
        if c.deck_value and abs(c.estimate.value / c.deck_value - 1) > _FAR
    ]
    return [
        f"Measure {c.where} on the article: the deck has "
        f"{quantity(c.deck_value, c.estimate.unit)}, the recording indicates "
        f"{quantity(c.estimate.value, c.estimate.unit)} "
        f"({percent(c.estimate.value, c.deck_value)})."
        for _, c in sorted(moved, key=lambda one: -one[0])[:2]
    ]


def _keep(result: DiagnosisResult) -> list[str]:
    """Advise if no effect is named."""
    if result.distrust:
        return ["Settle the reasons for doubt, and diagnose again.",
                *_odd_checks(result)]  # fmt: skip
    return [
        "Keep the deck: it agrees with the recording within the allowed errors.",
        *_odd_checks(result),
        "For a finer result, refine the mesh where it bends most, measure with more sensors, or "
        "widen the band.",
    ]


def _weigh(result: DiagnosisResult) -> list[str]:
    if result.mass is None or result.mass.weighed_kg:
        return []
    return [
        "Weigh the test article as tested, and write mass and mass_sd under [test]: a weighed "
        "mass separates mass from stiffness."
    ]
