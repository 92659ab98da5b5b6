"""One decision: from hypotheses to a verdict with its reasons, and the diagnosis that follows.

Numbers that cost a fit are computed when they are read, so that only the fits that decide are made.

1. The leader is named if it reaches the required gain and fits.
2. Few data support a name only if they could contradict it and nothing else is tied with it.
3. Fitted and held-out data are one evidence: together they bring the required gain.
4. A set of effects that all reach the required gain precedes one effect.
5. The leader is fitted again and tested on held-out data.
6. If the leader is refused, its rivals are tested.
7. Tied effects are listed together; a leader that is not named puts calibration in doubt.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..inference.hypothesis_fit import HypothesisFit
from . import decision_in_words as words
from .decision_in_words import BEYOND, Reason
from .decision_rules import RULES, fits
from .diagnosis import Diagnosis
from .hypotheses import ALONE, Explanation, Hypotheses

ONE = ("missing physics", "calibration only", "nothing missing")  # verdicts of one explanation
MOST_OPEN = 3  # effects whose further measurements are forecast
Passed = tuple[tuple[Explanation, Reason], ...]
Step = str | Callable[[], str]


@dataclass(frozen=True, eq=False)
class Decision:
    """The outcome of a diagnosis, with its reasons."""

    verdict: str  # one of the public verdicts
    order: tuple[Explanation, ...] = ()  # the named one, or the best candidate, is first
    reason: Reason = Reason.NOTHING_DUE  # why the decision ended
    due: float = 0.0  # gain required to name the first
    named: bool = False  # whether the first is named
    one_of: tuple[str, ...] = ()  # names that the data cannot separate
    tested: Explanation | None = None  # whose test of fit is the absolute one
    news: float | None = None  # gain of the first on the held-out data
    passed_over: Passed = ()  # tested before the first, and the refusal of each
    steps: tuple[Step, ...] = ()  # sentences; one that costs a fit is made when it is read

    @property
    def refused(self) -> bool:
        """True if a leader reached the required gain but is not named."""
        return not self.named and self.reason is not Reason.NOTHING_DUE

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for every step that has something to report."""
        every, last = (step if isinstance(step, str) else step() for step in self.steps), ""
        if self.tested and not (self.named or self.one_of):
            test = self.tested.chances.test
            last = words.test_of_fit(self.tested) if test and not test.passes else ""
        return tuple(s + words.UNEXPLAINED if s == last else s for s in every if s)

    def then(self, *steps: Step, **changes: Any) -> "Decision":
        """A copy with the sentences of further steps and changed fields."""
        return replace(self, steps=(*self.steps, *steps), **changes)


def decide(case: Hypotheses) -> Decision:
    """Return the decision; too few data list the explanations near the best, with calibration."""
    decision = _decided(case)
    answer = _with_ties(case, decision)
    alone = case.contradicted and decision.named and len(answer.one_of) < 2
    if case.enough or alone:
        return answer
    gains = {ALONE: 0.0} | {h.name: case.gain(h) for h in decision.order}
    least = max(gains.values()) - RULES.tied
    one_of = tuple(name for name, gain in gains.items() if gain >= least)
    return decision.then(
        words.too_few(case, one_of),
        verdict="not in catalogue", reason=Reason.TOO_FEW, named=False, one_of=one_of,
    )  # fmt: skip


def _decided(case: Hypotheses) -> Decision:
    """The name by the odds, if any, or what refused it."""
    decision = _first(case)
    refusals: list[str] = []
    for whole in reversed([s for s in case.sets if s.together and s.together.pay]):
        found = _together(case, decision, whole)
        if isinstance(found, Decision):
            return found
        refusals.append(found)
    decision = decision.then(*refusals)
    if decision.named:
        decision = _on_accurate_model(case, decision, decision.order[0])
    return _alternatives_tested(case, decision) if decision.refused else decision


def _first(case: Hypotheses) -> Decision:
    """Name the leader if it reaches the required gain; it, or calibration, must fit.

    A fifth of a dozen natural frequencies is a large part of the information. Held-out sensors and
    spectral lines may be sensitive to an effect that the fitted band hardly shows. So all data
    together may bring the gain that the fitted data alone do not.
    """
    due = case.found.due
    begun = Decision(case.calibrated, case.singles, due=due)
    if not case.singles:
        return _untested(case, begun)
    lead = case.singles[0]
    if case.gain(lead) > due:
        return _tested(begun, lead)
    if not case.suffices(case.gain(lead), due, lambda: lead.news):
        return _untested(case, begun)
    return _tested(begun.then(words.supported_by_all(case, lead, due)), lead)


def _tested(decision: Decision, one: Explanation) -> Decision:
    """Name a hypothesis if it fits, and refuse it otherwise."""
    decision = decision.then(words.test_of_fit(one), tested=one)
    if one.chances.fits:
        return decision.then(verdict=one.fit.verdict, reason=Reason.NAMED, named=True)
    return decision.then(verdict="not in catalogue", reason=Reason.UNFIT, named=False)


def _untested(case: Hypotheses, decision: Decision) -> Decision:
    """Name nothing; calibration alone fits, or nothing in the catalogue explains the data."""
    null = case.null
    verdict = case.calibrated if null.chances.fits else "not in catalogue"
    return decision.then(words.test_of_fit(null), verdict=verdict, tested=null, named=False)


def _apply_held_out(case: Hypotheses, decision: Decision) -> Decision:
    """Decide on the first hypothesis with the held-out data.

    The fitted data must still support the name after the second fit. It is refused

    - if all data together bring less than the required gain;
    - if the deck with the effect fits worse than the calibrated deck.

    Data that are insensitive to the effect are predicted equally well without it and bring nothing.
    A refused effect refutes nothing: its gain may come from a wrong model of the errors. The test
    of fit of calibration alone decides then, and the leader is one of several explanations.
    """
    one = decision.order[0]
    enough = case.suffices(case.gain(one), decision.due, lambda: one.news)
    decision = decision.then(news=one.news)
    if enough and not one.worse:
        return decision.then(
            words.held_out(one), verdict=one.fit.verdict, reason=Reason.NAMED, named=True
        )
    little = Reason.AGAINST if one.news < 0 else Reason.TOO_LITTLE
    why = Reason.WORSE if enough else little
    said = partial(words.refused, case, one, why)
    return _untested(case, decision.then(said, reason=why, named=False, one_of=()))


def _together(case: Hypotheses, alone: Decision, whole: Explanation) -> Decision | str:
    """Name several effects together, or return the sentence on what refuses them.

    A second effect may only compensate for a small error of the first. So every member must be
    supported with all others in place, as one effect is against calibration alone. The set must
    pass the test of fit and the rules for held-out data, as a single effect must.
    """
    made, s = whole.refined, whole.together
    assert s is not None
    if made.lost:
        return words.set_refused(made, Reason.NOT_FITTED)
    lost = max(0.0, made.fit.neg2_log_evidence - whole.fit.neg2_log_evidence)
    steps = [words.found_together(whole)]
    for k, gain in enumerate(s.gains):
        steps.append(words.held_out_of_set(whole, k))
        if not case.suffices(gain - lost, s.due, partial(whole.news_of, k)):
            return words.set_refused(made, Reason.NOT_SUPPORTED, steps[-1])
    order = (made, *alone.order)
    found = _tested(Decision(alone.verdict, order, due=case.due(made), steps=tuple(steps)), made)
    found = _apply_held_out(case, found) if found.named else found
    if not found.named:
        return words.set_refused(made, found.reason)
    found = found.then(reason=Reason.TOGETHER)
    for k, rivals in enumerate(s.alternatives):
        if rivals:
            one_of = (whole.fit.effects[k].name, *(r.name for r in rivals))
            found = found.then(words.rival_of_member(one_of, rivals), one_of=one_of)
            break
    return found.then(made.note, *_perhaps_present(case, whole))


def _perhaps_present(case: Hypotheses, named: Explanation) -> Sequence[str]:
    """One sentence for every effect that gains a part of what is required after the named ones."""
    part, present = dict[str, str](), {e.name for e in named.fit.effects}
    for other in case.sets:
        s = other.together
        assert s is not None
        for effect, gain in zip(other.fit.effects, s.gains, strict=True):
            if gain <= s.due and effect.name not in present:
                part[effect.name] = words.perhaps_present(named, effect.name, gain, s.due)
    return tuple(part.values())


def _on_accurate_model(case: Hypotheses, decision: Decision, one: Explanation) -> Decision:
    """Decide on an explanation, fitted again on a refined basis, with all data; it is first.

    The leader has passed its test of fit when the decision names it; a rival is tested here.
    """
    made, others = one.refined, (h for h in decision.order if h is not one)
    decision = decision.then(made.note, order=(made, *others), due=case.due(made))
    if made.lost:
        return decision.then(verdict="not in catalogue", reason=Reason.NOT_FITTED, named=False)
    decision = decision if decision.named else _tested(decision, made)
    return _apply_held_out(case, decision) if decision.named else decision


def _alternatives_tested(case: Hypotheses, refused: Decision) -> Decision:
    """Name the first rival that passes every test, after the leader was refused.

    The evidence of the fitted data orders the explanations. Held-out data, the residual and the
    modal damping can refuse one. The next explanations undergo the same tests: one of them may be
    the true cause, while the leader imitates it and fits slightly better for a wrong reason. A
    leader that is ahead by the required gain refutes the others, as it refutes calibration alone.
    Modal damping that follows the leader's change refutes a lossless rival.
    """
    lead, *alternatives = refused.order
    over: Passed = ((lead, refused.reason),)
    for alternative in alternatives:
        gain = case.gain(alternative)
        if gain <= refused.due or case.gain(lead) - gain > refused.due:
            break
        said = words.next_is(case, *over[-1], alternative)
        begun = refused.then(said, passed_over=over, one_of=(), news=None)
        following = _on_accurate_model(case, begun, alternative)
        one, why = following.order[0], following.reason
        if following.named:
            if fits(one.p_after(lead)):
                return following
            why = Reason.DAMPING
        over = (*over, (one, why))
    return refused.then(passed_over=over)


def _with_ties(case: Hypotheses, decision: Decision) -> Decision:
    """Add the explanations that the data cannot separate to a decision."""
    if not decision.named:
        return _with_doubt(case, decision)
    best, *_ = every = decision.order
    if best.together:
        return decision
    over = {h.name for h, _ in decision.passed_over}
    names = tied(best, [h for h in every if h.name not in over])
    if len(names) < 2:
        return decision
    return decision.then(words.tied(every, names), one_of=names)


def tied(best: Explanation, rows: Sequence[Explanation]) -> tuple[str, ...]:
    """Names of the rows that explain the data as well as the best one, whose own name is first.

    A row that reduces to the best one, as fitted or within its intervals, is left out. A simpler
    effect to which the best one reduces within its intervals is included at any odds. Example: a
    point mass on a tailgate (tuning 561) was named a resonator of 253 Hz (interval 74 to 862).
    """
    behind = {
        r.name: r.fit.neg2_log_evidence - best.fit.neg2_log_evidence
        for r in rows
        if best.fit.effect.name not in (r.fit.remarks.becomes, r.fit.remarks.nearly)
    }
    return tuple(n for n, b in behind.items() if b < RULES.tied or n == best.fit.remarks.nearly)


def _with_doubt(case: Hypotheses, decision: Decision) -> Decision:
    """Add the effects that are clearly better than calibration, but are not named.

    The statement that no physics is missing needs evidence too. If an effect leads by more than
    ``RULES.tied`` on all data, the answer is calibration or that effect. It is so at any gain if
    calibration strains a family of joints beyond its scatter and the effect does not. If
    calibration alone does not fit, the answer is that effect or one outside the catalogue. A
    leader that was refused leaves the latter open as well. Where no gain reached what is required,
    calibration that does not fit is no alternative, and every effect near the best that fits is.
    """
    plainly = decision.verdict in ("nothing missing", "calibration only")
    small = not plainly and decision.reason is Reason.NOTHING_DUE
    unfit = small or (not plainly and decision.reason in (Reason.TOO_LITTLE, Reason.WORSE))
    news = decision.news or 0.0
    if not (decision.order and (plainly or unfit)) or (unfit and news < 0):
        return decision
    lead = decision.order[0]
    relieved = case.null.strained and not lead.strained
    gain, least = case.gain(lead), 0.0 if relieved or small else RULES.tied
    if gain + news <= least:
        return decision
    least = max(least, gain - RULES.tied)
    near = [h.name for h in decision.order
            if case.gain(h) >= least and not (relieved and h.strained)
            and (not small or h.fits)]  # fmt: skip
    if not near:
        return decision
    open_ = (BEYOND,) if decision.refused or small else ()
    one_of = (*(() if unfit else (ALONE,)), *near, *open_)
    return decision.then(words.doubt(case, lead, decision.due), one_of=one_of)


def concluded(case: Hypotheses, decision: Decision) -> tuple[Diagnosis, tuple[str, ...]]:
    """The diagnosis that follows from a decision, and reasons not to trust it."""
    found, tested, lead = case.found, decision.tested, next(iter(decision.order), None)
    settled = words.settled_by(decision.one_of) if decision.named else ""
    said = replace(
        found, verdict=decision.verdict, notes=(*found.notes, *decision.sentences),
        hypotheses=tuple(h.fit for h in decision.order),
        adequacy=None if tested is None else tested.chances.test,
        one_of=(*decision.one_of, settled) if settled else decision.one_of,
        refused=words.refusal(case, lead, decision.reason) if lead and decision.refused else "",
        passed_over=tuple((h.name, words.refusal(case, h, why)) for h, why in decision.passed_over),
    )  # fmt: skip
    if lead is None or not decision.named:
        return said, tuple(_doubts(case, decision))
    gains = lead.together.gains if lead.together else ()
    fits = (lead.own, *said.hypotheses[1:])
    said = replace(said, hypotheses=fits, written=lead.written, halved=lead.halved, gains=gains)
    return said, lead.distrust


def _doubts(case: Hypotheses, decision: Decision) -> Iterator[str]:
    if not decision.refused or decision.news is None or not decision.one_of:
        return
    lead = decision.order[0]
    gain = case.gain(lead) + decision.news
    if gain > decision.due:
        yield words.imitated(case, lead, decision.reason, gain)


def open_explanations(
    case: Hypotheses, decision: Decision, found: Diagnosis
) -> tuple[list[HypothesisFit], list[str], np.ndarray]:
    """Explanations that the data cannot separate, or the only one: fits, names, probabilities.

    The probabilities are even.  Empty where no explanation stands.
    Calibration with its errors of form stands for what the catalogue lacks as well.
    """
    listed = [h for h in decision.order if h.name in decision.one_of][:MOST_OPEN]
    names = [h.name for h in listed]
    if other := [name for name in (ALONE, BEYOND) if name in decision.one_of]:
        listed, names = [*listed, case.null], [*names, " or ".join(other)]
    if len(listed) < 2:
        if found.verdict not in ONE or decision.one_of:
            return [], [], np.zeros(0)
        one = found.found or found.null
        return [one], [one.name], np.ones(1)
    return [h.whole for h in listed], names, np.full(len(listed), 1 / len(listed))
