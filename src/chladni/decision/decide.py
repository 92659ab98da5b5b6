"""One decision: from hypotheses to a verdict.

The module computes nothing about a structure and writes no text. Numbers that cost a fit are
computed when they are read, so that only the fits that decide are made.

1. The leader is named if it reaches the required gain and fits.
2. Few data bear a name only if they could contradict it and nothing else is tied with it.
3. Fitted and held-out data are one evidence: together they bring the required gain.
4. A set of effects that all reach the required gain precedes one effect.
5. The leader is fitted again and tested on held-out data.
6. If the leader is refused, its rivals are tested.
7. Tied effects are listed together; a leader that is not named puts calibration in doubt.
"""

from .answer import with_ties
from .decision_rules import RULES
from .hypotheses import Explanation, Hypotheses, fits
from .judgement import apply_held_out, tested, untested
from .named_sets import largest_named
from .reasons import ALONE, Decision, Reason, Step

Passed = tuple[tuple[Explanation, Reason], ...]


def decide(case: Hypotheses) -> Decision:
    """Return the decision."""
    decision = _decided(case)
    if case.enough:
        return with_ties(case, decision)
    answer = with_ties(case, decision)
    alone = case.contradicted and decision.named and len(answer.one_of) < 2
    return answer if alone else _too_few(case, decision)


def called(case: Hypotheses) -> Decision:
    """Return the decision on single effects, before held-out data are used."""
    return _first(case, fitted_alone=True)


def _decided(case: Hypotheses) -> Decision:
    """The name by the odds, if any, or what refused it."""
    alone = _first(case)
    found, refusals = largest_named(case, alone)
    if found is not None:
        return found
    decision = alone.then(*refusals)
    if decision.named:
        decision = _with_lead_refined(case, decision)
    return _alternatives_tested(case, decision) if decision.refused else decision


def _first(case: Hypotheses, fitted_alone: bool = False) -> Decision:
    """Name the leader if it reaches the required gain; it, or calibration, must fit.

    A fifth of a dozen natural frequencies is a large part of the information. Held-out sensors and
    spectral lines may be sensitive to an effect that the fitted band hardly shows. So all data
    together may bring the gain that the fitted data alone do not.
    """
    lead = case.singles[0] if case.singles else None
    due = case.due(lead)
    begun = Decision(case.calibrated, case.singles, due=due)
    if lead is None:
        return untested(case, begun)
    if case.gain(lead) > due:
        return tested(begun, lead)
    if fitted_alone or not case.suffices(case.gain(lead), due, lambda: lead.numbers.news):
        return untested(case, begun)
    return tested(begun.then(Step(Reason.SUPPORTED_BY_ALL, lead)), lead)


def _too_few(case: Hypotheses, decision: Decision) -> Decision:
    """Name nothing; list the explanations within ``RULES.tied`` of the best, with calibration."""
    gains = {ALONE: 0.0} | {h.name: case.gain(h) for h in decision.order}
    least = max(gains.values()) - RULES.tied
    one_of = tuple(name for name, gain in gains.items() if gain >= least)
    return decision.then(
        Step(Reason.TOO_FEW, names=one_of),
        verdict="not in catalogue", reason=Reason.TOO_FEW, named=False, one_of=one_of,
    )  # fmt: skip


def _with_lead_refined(case: Hypotheses, decision: Decision) -> Decision:
    """Decide on the leader, fitted again on a refined basis, with all data."""
    lead, *behind = decision.order
    made = lead.numbers.refined
    if not made.fitted:
        return decision.then(
            Step(Reason.RENEWED, made),
            order=(made, *behind), verdict="not in catalogue", reason=Reason.NOT_FITTED,
            named=False,
        )  # fmt: skip
    named = decision.then(Step(Reason.RENEWED, made), order=(made, *behind), due=case.due(made))
    return apply_held_out(case, named)


def _alternatives_tested(case: Hypotheses, refused: Decision) -> Decision:
    """Name the first rival that passes every test, after the leader was refused.

    The evidence of the fitted data orders the explanations. Held-out data, the residual and the
    modal damping can refuse one. The next explanations undergo the same tests: one of them may be
    the true cause, while the leader imitates it and fits slightly better for a wrong reason. A
    leader that is ahead by the required gain refutes the others, as it refutes calibration alone.
    """
    lead, *alternatives = refused.order
    over: Passed = ((lead, refused.reason),)
    for alternative in alternatives:
        gain = case.gain(alternative)
        if gain <= refused.due or case.gain(lead) - gain > refused.due:
            break
        following = _decided_next(case, refused, alternative, over)
        why = _against(lead, following) if following.named else following.reason
        if why is None:
            return following
        over = (*over, (following.order[0], why))
    return refused.then(passed_over=over)


def _decided_next(
    case: Hypotheses, refused: Decision, alternative: Explanation, over: Passed
) -> Decision:
    """Test a rival, placed in front of the explanations that were passed over."""
    made = alternative.numbers.refined
    others = (h for h in refused.order if h is not alternative)
    before, why = over[-1]
    led = refused.then(
        Step(Reason.NEXT, made, why, names=(before.name,)), Step(Reason.RENEWED, made),
        order=(made, *others), due=case.due(made), passed_over=over, one_of=(), news=None,
    )  # fmt: skip
    if not made.fitted:
        return led.then(reason=Reason.NOT_FITTED, named=False)
    led = tested(led, made)
    return apply_held_out(case, led) if led.named else led


def _against(lead: Explanation, following: Decision) -> Reason | None:
    """Return the reason that refutes a rival which passed its own tests, or None.

    Modal damping that follows the leader's change refutes a lossless rival.
    """
    return None if fits(following.order[0].numbers.p_after(lead)) else Reason.DAMPING
