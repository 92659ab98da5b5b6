"""One decision: from hypotheses to a verdict with its reasons.

Numbers that cost a fit are computed when they are read, so that only the fits that decide are made.

1. The leader is named if it reaches the required gain and fits.
2. Few data support a name only if they could contradict it and nothing else is tied with it.
3. Fitted and held-out data are one evidence: together they bring the required gain.
4. A set of effects that all reach the required gain precedes one effect.
5. The leader is fitted again and tested on held-out data.
6. If the leader is refused, its rivals are tested.
7. Tied effects are listed together; a leader that is not named puts calibration in doubt.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from . import decision_in_words as words
from .decision_in_words import BEYOND, Reason
from .decision_rules import RULES, TIED, fits
from .hypotheses import ALONE, Explanation, Hypotheses

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
        every = (step if isinstance(step, str) else step() for step in self.steps)
        one = None if self.named or self.one_of else self.tested
        test = None if one is None else one.chances.test
        last = words.test_of_fit(one) if one and test and not test.passes else ""
        return tuple(s + words.UNEXPLAINED if s == last else s for s in every if s)

    def then(self, *steps: Step, **changes: Any) -> "Decision":
        """A copy with the sentences of further steps and changed fields."""
        return replace(self, steps=(*self.steps, *steps), **changes)


def decide(case: Hypotheses) -> Decision:
    """Return the decision."""
    decision = _decided(case)
    answer = _with_ties(case, decision)
    alone = case.contradicted and decision.named and len(answer.one_of) < 2
    return answer if case.enough or alone else _too_few(case, decision)


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
        decision = _with_lead_refined(case, decision)
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


def _with_lead_refined(case: Hypotheses, decision: Decision) -> Decision:
    """Decide on the leader, fitted again on a refined basis, with all data."""
    lead, *behind = decision.order
    made = lead.refined
    decision = decision.then(made.note, order=(made, *behind))
    if made.lost:
        return decision.then(verdict="not in catalogue", reason=Reason.NOT_FITTED, named=False)
    return _apply_held_out(case, decision.then(due=case.due(made)))


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
        following = _decided_next(case, refused, alternative, over)
        one, why = following.order[0], following.reason
        if following.named:
            if fits(one.p_after(lead)):
                return following
            why = Reason.DAMPING
        over = (*over, (one, why))
    return refused.then(passed_over=over)


def _decided_next(
    case: Hypotheses, refused: Decision, alternative: Explanation, over: Passed
) -> Decision:
    """Test a rival, placed in front of the explanations that were passed over."""
    made = alternative.refined
    others = (h for h in refused.order if h is not alternative)
    led = refused.then(
        words.next_is(case, *over[-1], made), made.note,
        order=(made, *others), due=case.due(made), passed_over=over, one_of=(), news=None,
    )  # fmt: skip
    if made.lost:
        return led.then(reason=Reason.NOT_FITTED, named=False)
    led = _tested(led, made)
    return _apply_held_out(case, led) if led.named else led


def _too_few(case: Hypotheses, decision: Decision) -> Decision:
    """Name nothing; list the explanations within ``RULES.tied`` of the best, with calibration."""
    gains = {ALONE: 0.0} | {h.name: case.gain(h) for h in decision.order}
    least = max(gains.values()) - RULES.tied
    one_of = tuple(name for name, gain in gains.items() if gain >= least)
    return decision.then(
        words.too_few(case, one_of),
        verdict="not in catalogue", reason=Reason.TOO_FEW, named=False, one_of=one_of,
    )  # fmt: skip


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


def tied(best: Explanation, rows: Sequence[Explanation], gap: float = TIED) -> tuple[str, ...]:
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
    return tuple(n for n, b in behind.items() if b < gap or n == best.fit.remarks.nearly)


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
