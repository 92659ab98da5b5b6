"""Replay of recorded decisions, also with each rule switched off, to measure its worth."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from chladni.decision.decide import RULES, decide
from chladni.decision.decision_rules import DecisionRules, rule
from chladni.decision.hypothesis_table import NULL, HypothesisTable, Wanted
from chladni.decision.reasons import Decision
from chladni.errors import FileError
from chladni.inference.likelihood import Responses

from .blind_diagnosis import Answer
from .outcome_row import called, outcome_of
from .pair_kinds import catalogued
from .recorded_case import RecordedCase
from .recorded_rows import Likelihood, unpacked

Decide = Callable[[HypothesisTable], Decision | Wanted]
RIGHT = ("right", "part", "among")


@dataclass(frozen=True)
class Replayed:
    """Result of one decision on a case."""

    said: str  # the name, or the verdict
    one_of: tuple[str, ...] = ()  # names that it cannot distinguish
    outcome: str = ""  # compared with the truth; "" where that is unknown
    wanted: str = ""  # the request that was not recorded


@dataclass(frozen=True)
class RuleWorth:
    """Effect of a rule, measured by switching it off."""

    # name, why: of the rule
    name: str
    why: str
    changed: tuple[str, ...]  # cases with another verdict without it
    # saves, spoils: cases that are right only with it, and only without it
    saves: tuple[str, ...]
    spoils: tuple[str, ...]
    open: tuple[str, ...]  # cases where the answer without it needs a fit that was not recorded


def replayed(case: RecordedCase, decided: Decide = decide) -> Replayed:
    """Decide a recorded case again."""
    found = decided(case.table)
    if isinstance(found, Wanted):
        return Replayed("", wanted=f"{found.ask.value}, of {found.key}")
    names = case.table.rows[found.order[0]].names if found.named else ()
    return _scored(case, found.verdict, names, found.one_of)


def recorded(case: RecordedCase) -> Replayed:
    """The decision at the time of recording."""
    return _scored(case, case.verdict, case.names, case.one_of)


def _scored(
    case: RecordedCase, verdict: str, names: Sequence[str], one_of: Sequence[str]
) -> Replayed:
    result: dict[str, Any] = {
        "verdict": verdict, "effects": [{"name": n} for n in names], "one_of": [list(one_of)],
    }  # fmt: skip
    said = called(result)
    if not case.truth:
        return Replayed(said, tuple(one_of))
    truth = {"effect": catalogued(case.truth["effect"])}
    outcome = outcome_of(Answer(0, 0.0, 0.0, "", result), said, truth)
    return Replayed(said, tuple(one_of), outcome)


def ablated(cases: Sequence[RecordedCase]) -> list[RuleWorth]:
    """Worth of every rule, switched off in turn; most changed cases first."""
    before = [replayed(case) for case in cases]
    every = [_worth(f.name, cases, before) for f in fields(DecisionRules)]
    return sorted(every, key=lambda w: (-len(w.changed), w.name))


def _worth(name: str, cases: Sequence[RecordedCase], before: Sequence[Replayed]) -> RuleWorth:
    rules = RULES.without(name)
    after = [replayed(case, lambda table: decide(table, rules)) for case in cases]
    pairs = [(c.name, a, b) for c, a, b in zip(cases, before, after, strict=True) if not b.wanted]
    return RuleWorth(
        name,
        rule(name).metadata["why"],
        _names((n, (a.said, a.one_of) != (b.said, b.one_of)) for n, a, b in pairs),
        _names((n, is_right(a) and not is_right(b) and b.outcome != "") for n, a, b in pairs),
        _names((n, not is_right(a) and is_right(b)) for n, a, b in pairs),
        _names((c.name, b.wanted != "") for c, b in zip(cases, after, strict=True)),
    )


def _names(each: Iterable[tuple[str, bool]]) -> tuple[str, ...]:
    return tuple(name for name, chosen in each if chosen)


def is_right(answer: Replayed) -> bool:
    """True for an answer that is right, or has the truth among its indistinguishable names."""
    return answer.outcome in RIGHT


def case_lines(cases: Sequence[RecordedCase]) -> list[str]:
    """Lines, one a case: hidden effects, recorded answer, present answer."""
    head = f"{'case':22} {'hidden':26} {'recorded':40} now"
    return [head, *(_line(case) for case in cases)]


def _line(case: RecordedCase) -> str:
    then, now = recorded(case), replayed(case)
    hidden = case.truth.get("effect", "-")
    same = (then.said, then.one_of) == (now.said, now.one_of)
    text = "the same" if same else (now.wanted and f"needs {now.wanted}") or _text(now)
    return f"{case.name:22} {hidden:26} {_text(then):40} {text}"


def _text(answer: Replayed) -> str:
    return f"{answer.said} ({answer.outcome})" if answer.outcome else answer.said


def rule_lines(cases: Sequence[RecordedCase]) -> list[str]:
    """Lines, one a rule: verdicts changed without it, right to wrong, wrong to right, unknown."""
    head = f"{'rule switched off':22} changed  right->wrong  wrong->right  not recorded"
    return [
        head,
        *(
            f"{w.name:22} {len(w.changed):7}  {len(w.saves):12}  {len(w.spoils):12}  "
            f"{len(w.open):12}  {w.why}"
            for w in ablated(cases)
        ),
    ]


def another_likelihood(case: RecordedCase, likelihood: Likelihood) -> RecordedCase:
    """The case with the evidence of its rows under another likelihood.

    Other numbers of the rows (tests, votes, Q) stay as recorded. A family far behind lost vectors
    of its basis before it was kept.  So differences of evidence to calibration alone are taken, in
    which the widths of the data cancel.
    """
    kept, rows = unpacked(case.arrays), {}
    if not kept:
        raise FileError(f"{case.name}: natural frequencies are compared; there are no responses")
    before, after = (kept[NULL].spread(made) for made in (lambda data: data, likelihood))
    more = {k: r.neg2_log_evidence(after) - r.neg2_log_evidence(before) for k, r in kept.items()}
    for key in kept:
        was = case.table.rows[key]
        rows[key] = replace(was, neg2_log_evidence=was.neg2_log_evidence + more[key] - more[NULL])
    table = case.table.having(*rows.values())
    order = sorted(table.singles, key=lambda k: table.rows[k].neg2_log_evidence)
    return replace(case, table=replace(table, singles=tuple(order)))


def narrower(noise: float, floor: float | None) -> Likelihood:
    """Responses with their noise scaled, and another floor [decades]."""

    def made(data: Responses) -> Responses:
        sd = None if data.noise is None else noise * data.noise
        return replace(data, noise=sd, sigma_model=data.sigma_model if floor is None else floor)

    return made


def likelihood_lines(cases: Sequence[RecordedCase], likelihood: Likelihood) -> list[str]:
    """Lines, one a case: gain of its leader and answer, as recorded and under a likelihood."""
    head = f"{'case':22} {'hidden':26} {'gain':>8} {'then':>8}  recorded -> then"
    return [head, *(_shadow(case, another_likelihood(case, likelihood)) for case in cases)]


def _shadow(case: RecordedCase, other: RecordedCase) -> str:
    gains = []
    for each in (case, other):
        lead = each.table.singles[:1]
        gains.append(each.table.gain(each.table.rows[lead[0]]) if lead else 0.0)
    now = replayed(other)
    text = f"needs {now.wanted}" if now.wanted else _text(now)
    return (
        f"{case.name:22} {case.truth.get('effect', '-'):26} {gains[0]:8.1f} {gains[1]:8.1f}  "
        f"{_text(recorded(case))} -> {text}"
    )
