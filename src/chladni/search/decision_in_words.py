"""Sentences of a decision: the only module that puts its reasons into English."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

from ..decision.decision_rules import RULES
from ..decision.hypotheses import EffectSet, Explanation, Hypotheses
from ..decision.reasons import ALONE, Decision, Reason, Step
from ..effects.registry import family
from ..inference.adequacy import FitTest
from .deciding import Evaluated
from .diagnosis import Diagnosis
from .question import Prepared

UNEXPLAINED = "; nothing in the catalogue explains the recording"
REFUSED = {
    Reason.AGAINST: "the held-out data speak against it",
    Reason.TOO_LITTLE: "all data together give too little evidence",
    Reason.WORSE: "the deck with it fits worse than the calibrated deck",
}


def concluded(
    prepared: Prepared, found: Diagnosis, case: Hypotheses, decision: Decision
) -> tuple[Diagnosis, tuple[str, ...]]:
    """The diagnosis that follows from a decision, and reasons not to trust it."""
    words = DecisionWords(prepared, case, decision)
    order, whole = [_of(h) for h in decision.order], decision.whole
    settled = words.settled() if decision.named else ""
    said = replace(
        found, verdict=decision.verdict, notes=(*found.notes, *words.sentences()),
        hypotheses=tuple(h.fit for h in order),
        adequacy=words.test(),
        one_of=(*decision.one_of, settled) if settled else decision.one_of,
        gains=whole.gains if decision.named and whole else (),
        refused=words.refusal(decision.order[0], decision.reason) if decision.refused else "",
        passed_over=tuple((h.name, words.refusal(h, why)) for h, why in decision.passed_over),
    )  # fmt: skip
    if not decision.named:
        return said, tuple(words.doubts())
    halved = (*found.halved, order[0].halved) if found.halved else ()
    return replace(said, written=order[0].written, halved=halved), order[0].distrust


def _of(one: Explanation | None) -> Evaluated:
    """The fit of a hypothesis, with all tests that were made of it."""
    assert one is not None
    return cast(Evaluated, one.numbers)


@dataclass(frozen=True, eq=False)
class DecisionWords:
    """The sentences of a decision and of the fits that were made for it."""

    prepared: Prepared
    case: Hypotheses
    decision: Decision

    def sentences(self) -> tuple[str, ...]:
        """One sentence for every step that has something to report."""
        every = (_SENTENCES[s.reason](self, s) for s in self.decision.steps)
        return tuple(text for text in every if text)

    def test(self) -> FitTest | None:
        """The absolute test of fit, of the hypothesis that was tested."""
        tested = self.decision.tested
        return None if tested is None else _of(tested).chances.test

    def refusal(self, one: Explanation, why: Reason) -> str:
        """Reason why a hypothesis is not named."""
        made = _of(one)
        if why is Reason.TOO_FEW:
            return self.prepared.too_little
        if why is Reason.NOT_FITTED:
            return f"it could not be fitted again: {made.lost}"
        if why is Reason.DAMPING:
            assert made.after is not None
            return made.after.what
        if why is Reason.UNFIT:
            assert made.chances.test is not None
            return f"its residual is not explained: {made.chances.test.what}"
        return REFUSED[why]

    def doubts(self) -> Iterator[str]:
        """Reason not to trust calibration where a refused effect gains what is required."""
        decision = self.decision
        if not decision.refused or decision.news is None:
            return
        lead = decision.order[0]
        gain = self.case.gain(lead) + decision.news
        if decision.one_of and gain > decision.due:
            yield (
                f"all data together give {lead.name} {gain:.0f} in -2 ln evidence over "
                f"calibration alone, but {self.refusal(lead, decision.reason)}: a cause outside "
                "the catalogue may imitate it"
            )

    def settled(self) -> str:
        """Measurements that would separate the explanations that these data cannot separate."""
        return settled_by(self.decision.one_of)

    def _tested(self, step: Step) -> str:
        test, one = _of(step.of).chances.test, step.of
        if test is None or one is None:
            return ""
        note = (
            f"{100 * test.p:.0f} % of recordings drawn from a right model are as unusual with "
            f"{one.name or ALONE}: {test.what}"
        )
        if test.passes:
            return note
        last = one is self.decision.tested and not self.decision.named
        return f"{note}, {test.where}{UNEXPLAINED if last else ''}"

    def _refined(self, step: Step) -> str:
        return _of(step.of).note

    def _too_few(self, step: Step) -> str:
        return (
            f"{self.prepared.too_little}; these explain the data, which cannot distinguish them: "
            f"{', '.join(step.names)}; more modes, or more sensors of known gain, would separate "
            "them"
        )

    def _supported_by_all(self, step: Step) -> str:
        one, data = _one(step), "poles" if self.case.poles else "data"
        return (
            f"{one.name} gained {self.case.gain(one):.1f} in -2 ln evidence on the {data} that "
            f"were fitted, and {one.numbers.news:.1f} on the held-out data: together "
            f"more than the required {self.decision.due:.0f}"
        )

    def _held_out(self, step: Step) -> str:
        one = _one(step)
        return f"{one.name}: {news_in_words(one.numbers.news)}"

    def _refused(self, step: Step) -> str:
        one = _one(step)
        left = one.numbers.left
        (seen, seen_with), (held, held_with) = left.fitted, left.held_out
        return (
            f"{one.name} gained {self.case.gain(one):.0f} in -2 ln evidence, but "
            f"{REFUSED[step.reason]} ({news_in_words(one.numbers.news)}; held-out Q "
            f"{held:.3g} calibrated, {held_with:.3g} with it; fitted Q {seen:.3g} and "
            f"{seen_with:.3g}), so it is not named"
        )

    def _found_together(self, step: Step) -> str:
        s = _whole(step)
        gains = ", ".join(f"{n} {g:.0f}" for n, g in zip(s.members, s.gains, strict=True))
        return (
            f"{' and '.join(s.members)} explain the recording together; with the others in place "
            f"each gains in -2 ln evidence: {gains} (required: {s.due:.0f})"
        )

    def _held_out_of_set(self, step: Step) -> str:
        s = _whole(step)
        others = " and ".join(n for k, n in enumerate(s.members) if k != step.member)
        said = news_in_words(s.news(step.member))
        return f"{s.members[step.member]} added to {others}: {said}"

    def _set_refused(self, step: Step) -> str:
        assert step.why is not None
        if step.why is Reason.NOT_SUPPORTED:
            why = f"that is too little for {self._held_out_of_set(step)}"
        elif step.why is Reason.UNFIT:
            test = _of(step.of).chances.test
            why = f"the residual is not explained: {'' if test is None else test.what}"
        elif step.why is Reason.NOT_FITTED:
            why = f"they could not be fitted again: {_of(step.of).lost}"
        else:
            why = REFUSED[step.why]
        return f"{self._found_together(step)}; but {why}"

    def _perhaps_of_set(self, step: Step) -> str:
        s, k = _whole(step), step.member
        return (
            f"with {' and '.join(step.names)} in place {s.members[k]} gains {s.gains[k]:.0f} of "
            f"the required {s.due:.0f} in -2 ln evidence: it may be present too"
        )

    def _rival_of_member(self, step: Step) -> str:
        alternatives = _whole(step).alternatives[step.member]
        behind = ", ".join(f"{r.name} by {r.behind:.0f}" for r in alternatives)
        note = (
            f"with the others in place these data do not distinguish {step.names[0]} from the "
            f"next ones, which are behind in -2 ln evidence: {behind}"
        )
        odd = [needs_impossible(r.name, r.implausible) for r in alternatives if r.implausible]
        return _with_check("; ".join([note, *odd]), step.names)

    def _next(self, step: Step) -> str:
        before, why = next(
            (h, why) for h, why in self.decision.passed_over if h.name == step.names[0]
        )
        return f"{before.name} is refused: {self.refusal(before, why)}; {_one(step).name} is next"

    def _tied(self, step: Step) -> str:
        best = _one(step)
        each = {h.name: h for h in self.decision.order}
        first, *others = step.names
        gap = {n: each[n].neg2_log_evidence - best.neg2_log_evidence for n in others}
        odds = "; ".join(f"2 ln B = {gap[n]:.1f} against {n}" for n in others)
        known = [(n, _of(h).fit) for n, h in each.items() if n in step.names]
        odd = [(n, t.effect.remarks(t.fit.of(t.effect)).implausible) for n, t in known]
        due = f"{RULES.tied:.0f} are required to separate two explanations"
        note = f"these data do not distinguish {first} from the others: {odds}; {due}"
        impossible = [needs_impossible(n, why) for n, why in odd if why]
        return _with_check("; ".join([note, *impossible]), step.names)

    def _doubt(self, step: Step) -> str:
        one = _one(step)
        note = (
            f"{one.name} explains the recording better than calibration alone, by "
            f"{self.case.gain(one):.1f} in -2 ln evidence; {self.decision.due:.0f} are required "
            "to name it: neither is certain"
        )
        return _with_check(note, (one.name,))


_SENTENCES: Mapping[Reason, Callable[[DecisionWords, Step], str]] = {
    Reason.TESTED: DecisionWords._tested,
    Reason.RENEWED: DecisionWords._refined,
    Reason.TOO_FEW: DecisionWords._too_few,
    Reason.SUPPORTED_BY_ALL: DecisionWords._supported_by_all,
    Reason.HELD_OUT: DecisionWords._held_out,
    Reason.AGAINST: DecisionWords._refused,
    Reason.TOO_LITTLE: DecisionWords._refused,
    Reason.WORSE: DecisionWords._refused,
    Reason.FOUND_TOGETHER: DecisionWords._found_together,
    Reason.HELD_OUT_OF_SET: DecisionWords._held_out_of_set,
    Reason.SET_REFUSED: DecisionWords._set_refused,
    Reason.PERHAPS_PRESENT: DecisionWords._perhaps_of_set,
    Reason.RIVAL_OF_MEMBER: DecisionWords._rival_of_member,
    Reason.NEXT: DecisionWords._next,
    Reason.TIED: DecisionWords._tied,
    Reason.DOUBT: DecisionWords._doubt,
}


def _one(step: Step) -> Explanation:
    """The hypothesis that a step is about."""
    assert step.of is not None
    return step.of


def _whole(step: Step) -> EffectSet:
    """The set that a step is about."""
    assert step.whole is not None
    return step.whole


def news_in_words(news: float) -> str:
    """The gain on the held-out data in words."""
    return f"the held-out data bring {news:+.0f} in 2 ln predictive density"


def needs_impossible(name: str, why: str) -> str:
    """Sentence on an explanation that physics excludes, although the data do not."""
    return f"{name} would need a value it cannot have: {why}"


def settled_by(names: Sequence[str]) -> str:
    """Measurements that would separate these families."""
    return "; or ".join(c for c in (family(name).settled_by for name in names) if c)


def _with_check(note: str, names: Sequence[str]) -> str:
    check = settled_by(names)
    return f"{note}; to settle it: {check}" if check else note
