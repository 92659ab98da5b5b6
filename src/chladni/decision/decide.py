"""One decision: from rows of numbers to a verdict, or to the one fit that is still missing.

The module computes nothing about a structure and writes no text. If the table lacks a number, the
decision returns a request for it by name. The caller computes it, adds it and calls again.

1. The leader is named if it reaches the required gain and fits.
2. Few data bear a name only if they could contradict it and nothing else is tied with it.
3. Fitted and held-out data are one evidence: together they bring the required gain.
4. A set of effects that all reach the required gain precedes one effect.
5. The leader is fitted again and tested on held-out data.
6. If the leader is refused, its rivals are tested.
7. Tied effects are listed together; a leader that is not named puts calibration in doubt.
"""

from dataclasses import replace

from .answer import with_ties
from .decision_rules import DecisionRules
from .hypothesis_table import HypothesisTable, Missing, Row, Wanted, fits
from .judgement import JudgedTable, apply_held_out, tested, untested
from .named_sets import largest_named
from .reasons import ALONE, Decision, Reason, Step, steps

RULES = DecisionRules()


def decide(table: HypothesisTable, rules: DecisionRules = RULES) -> Decision | Wanted:
    """Return the decision, or the number that is still missing for it."""
    case = JudgedTable(table, rules)
    try:
        return with_ties(case, _named(case))
    except Missing as missing:
        return missing.wanted


def called(table: HypothesisTable, rules: DecisionRules = RULES) -> Decision | Wanted:
    """Return the decision on single effects, before held-out data are used."""
    try:
        return _first(JudgedTable(table, rules), fitted_alone=True)
    except Missing as missing:
        return missing.wanted


def _named(case: JudgedTable) -> Decision:
    """The name, if any, or what refused it."""
    decision = _decided(case)
    few = not case.table.enough
    contradicted = case.table.contradicted and decision.named
    alone = contradicted and len(with_ties(case, decision).one_of) < 2
    return _too_few(case, decision) if few and not alone else decision


def _decided(case: JudgedTable) -> Decision:
    """The name by the odds, if any, or what refused it."""
    alone = _first(case)
    found, refusals = largest_named(case, alone, [s for s in case.table.sets if s.pays])
    if found is not None:
        return found
    decision = replace(alone, steps=steps(alone, *refusals))
    if decision.named:
        decision = _with_lead_refined(case, decision)
    if decision.refused and decision.whole is None:
        decision = _alternatives_tested(case, decision)
    return decision


def _first(case: JudgedTable, fitted_alone: bool = False) -> Decision:
    """Name the leader if it reaches the required gain; it, or calibration, must fit.

    A fifth of a dozen natural frequencies is a large part of the information. Held-out sensors and
    spectral lines may be sensitive to an effect that the fitted band hardly shows. So all data
    together may bring the gain that the fitted data alone do not.
    """
    table, order = case.table, case.table.singles
    lead = table.rows[order[0]] if order else None
    due = case.due(lead)
    begun = Decision(case.calibrated(), order, due=due)
    if lead is not None and table.gain(lead) > due:
        return tested(case, begun, lead)
    if lead is None or fitted_alone or not case.suffices(lead, table.gain(lead), due):
        return untested(case, begun)
    return tested(case, replace(begun, steps=(Step(Reason.SUPPORTED_BY_ALL, lead.key),)), lead)


def _too_few(case: JudgedTable, decision: Decision) -> Decision:
    """Name nothing; list the explanations within ``rules.tied`` of the best, with calibration."""
    gains = {ALONE: 0.0} | {r.name: case.table.gain(r) for r in case.rows(decision.order)}
    least = max(gains.values()) - case.rules.tied
    one_of = tuple(name for name, gain in gains.items() if gain >= least)
    step = Step(Reason.TOO_FEW, names=one_of)
    return replace(
        decision, verdict="not in catalogue", reason=Reason.TOO_FEW, named=False, one_of=one_of,
        steps=steps(decision, step),
    )  # fmt: skip


def _with_lead_refined(case: JudgedTable, decision: Decision) -> Decision:
    """Decide on the leader, fitted again on a refined basis, with all data."""
    key, *behind = decision.order
    lead, step = case.table.refinement(key), Step(Reason.RENEWED, key)
    if not lead.fitted:
        return replace(
            decision, verdict="not in catalogue", reason=Reason.NOT_FITTED, named=False,
            steps=steps(decision, step),
        )  # fmt: skip
    named = replace(
        decision, order=(lead.key, *behind), due=case.due(lead), steps=steps(decision, step)
    )
    return apply_held_out(case, named)


def _alternatives_tested(case: JudgedTable, refused: Decision) -> Decision:
    """Name the first rival that passes every test, after the leader was refused.

    The evidence of the fitted data orders the explanations. Held-out data, the residual and the
    modal damping can refuse one. The next explanations undergo the same tests: one of them may be
    the true cause, while the leader imitates it and fits slightly better for a wrong reason. A
    leader that is ahead by the required gain refutes the others, as it refutes calibration alone.
    """
    table, (lead, *alternatives) = case.table, case.rows(refused.order)
    ahead = table.gain(lead)
    over: tuple[tuple[str, Reason], ...] = ((lead.name, refused.reason),)
    for alternative in alternatives:
        gain = table.gain(alternative)
        if gain <= refused.due or ahead - gain > refused.due:
            break
        following = _decided_next(case, refused, alternative, over)
        why = _against(case, refused, following) if following.named else following.reason
        if why is None:
            return following
        over = (*over, (alternative.name, why))
    return replace(refused, passed_over=over)


def _decided_next(
    case: JudgedTable, refused: Decision, alternative: Row, over: tuple[tuple[str, Reason], ...]
) -> Decision:
    """Test a rival, placed in front of the explanations that were passed over."""
    row = case.table.refinement(alternative.key)
    others = (k for k in refused.order if k != alternative.key)
    led = replace(
        refused, order=(row.key, *others), due=case.due(row), passed_over=over, one_of=(),
        news=None,
        steps=steps(
            refused, Step(Reason.NEXT, row.key, over[-1][1], names=(over[-1][0],)),
            Step(Reason.RENEWED, alternative.key),
        ),
    )  # fmt: skip
    if not row.fitted:
        return replace(led, reason=Reason.NOT_FITTED, named=False)
    led = tested(case, led, row)
    return apply_held_out(case, led) if led.named else led


def _against(case: JudgedTable, refused: Decision, following: Decision) -> Reason | None:
    """Return the reason that refutes a rival which passed its own tests, or None.

    Modal damping that follows the leader's change refutes a lossless rival.
    """
    (lead, *_), (alternative, *_) = case.rows(refused.order), case.rows(following.order)
    follows = not fits(case.table.after(alternative, lead), case.rules)
    return Reason.DAMPING if follows else None
