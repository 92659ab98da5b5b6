"""One decision: from rows of numbers to a verdict, or to the one fit that is still missing.

It computes nothing of a structure and makes no sentence. What it needs and does not find in the
table it asks for by name; whoever measures that puts it in and calls again.

1. the leader is named where it gains what is due and fits;
2. too few data name nothing;
3. all data together may bear what was fitted alone does not;
4. several effects that pay in full come before one;
5. the leader is renewed and data that no fit saw are asked; where it leaves too much, sets that pay
   in part, and what is usual, are next;
6. where the leader is refused, its rivals are asked;
7. what is tied is one of several, and what leads without a name leaves calibration in doubt;
8. where nothing is named, the numbers of the calibration are chosen.
"""

from collections.abc import Sequence
from dataclasses import replace

from .answer import with_numbers, with_ties
from .decision_rules import DecisionRules
from .hypothesis_table import NULL, HypothesisTable, Missing, Row, SetRow, Wanted
from .judgement import JudgedTable, judged, tested, untested
from .named_sets import largest_named
from .reasons import ALONE, Decision, Reason, Step, steps

RULES = DecisionRules()
WITH_KNOWN_NOISE = RULES.without("most_left")  # the test of fit knows what may be left


def decide(table: HypothesisTable, rules: DecisionRules = RULES) -> Decision | Wanted:
    """The decision, or what is still to be measured for it."""
    case = JudgedTable(table, rules)
    try:
        return with_numbers(case, with_ties(case, _named(case)))
    except Missing as missing:
        return missing.wanted


def called(table: HypothesisTable, rules: DecisionRules = RULES) -> Decision | Wanted:
    """What is said of the effects alone, before data that no fit saw are asked."""
    try:
        return _first(JudgedTable(table, rules))
    except Missing as missing:
        return missing.wanted


def _named(case: JudgedTable) -> Decision:
    """The name, if any, or what refused it."""
    decision = _first(case)
    if not case.table.enough and case.rules.enough_data:
        return _too_few(case, decision)
    alone = _borne_by_all_data(case, decision)
    sets = case.table.sets if case.rules.sets else ()
    found, refusals = largest_named(case, alone, [s for s in sets if s.pays])
    if found is not None:
        return found
    decision = replace(alone, steps=steps(alone, *refusals))
    if decision.named:
        decision = _with_lead_renewed(case, alone, decision, [s for s in sets if not s.pays])
    if decision.refused and decision.whole is None and case.rules.rivals:
        decision = _rivals_heard(case, decision)
    return decision


def _first(case: JudgedTable) -> Decision:
    """The leader is named where it gains what is due; it, or calibration, must fit."""
    table, order = case.table, case.table.singles
    lead = table.rows[order[0]] if order else None
    due = case.due(lead)
    begun = Decision(case.calibrated(), order, due=due)
    if lead is not None and table.gain(lead) > due:
        return tested(case, begun, lead)
    return untested(case, begun)


def _too_few(case: JudgedTable, decision: Decision) -> Decision:
    """No name: a list of what explains the data and cannot be told apart by them."""
    some = [r.name for r in case.rows(decision.order) if case.table.gain(r) > 0]
    one_of = (ALONE, *some)
    step = Step(Reason.TOO_FEW, names=one_of)
    return replace(
        decision, verdict="not in catalogue", reason=Reason.TOO_FEW, named=False, one_of=one_of,
        steps=steps(decision, step),
    )  # fmt: skip


def _borne_by_all_data(case: JudgedTable, decision: Decision) -> Decision:
    """The decision with a name that all data together bear, those that no fit saw included.

    A fifth of a dozen natural frequencies is much of what is known, and held-out sensors and lines
    may feel an effect that the fitted band hardly does. The Bayes factor of all data is the product
    of that of the fitted ones and of how well the others are foretold, and the bound on false
    alarms holds for it as for the first alone. Responses bear a good part of it themselves.
    """
    table, poles = case.table, case.table.poles
    if not decision.order or decision.named or decision.refused:
        return decision
    lead = table.rows[decision.order[0]]
    gain = table.gain(lead)
    if gain <= (0.0 if poles else case.rules.good_part * decision.due):
        return decision
    if not case.carried(gain, lead.heard(), decision.due, poles):
        return decision
    done = tuple(s for s in decision.steps if s.key != NULL)  # what was said of calibration
    borne = replace(decision, steps=(*done, Step(Reason.BORNE_BY_ALL, lead.key)))
    return tested(case, borne, lead)


def _with_lead_renewed(
    case: JudgedTable, alone: Decision, decision: Decision, in_part: Sequence[SetRow]
) -> Decision:
    """The decision on the leader, on a model that bears it, by all data.

    Where several things are missing at once, each leaves what the others would explain. What was
    fitted may then bear an effect more by a good part of its price, if all that no fit saw speaks
    for it and all data together pay the whole: so much is asked of a name alone as well.

    Beside a small effect the scatter of an article leaves much, as errors of the model's form do.
    That much may stay where the test of fit all but surely passes, where all that was asked speaks
    for the name, and where a fifth of Q goes of what was fitted or of what was not.
    """
    key, *behind = decision.order
    lead, rules = case.table.renewal(key), case.rules
    step = Step(Reason.RENEWED, key)
    named = replace(
        decision, order=(lead.key, *behind), due=case.due(lead), steps=steps(decision, step)
    )
    refused = judged(case, named, rules.most_left)
    if refused.reason is not Reason.LEAVES_MORE:
        return refused
    found, refusals = largest_named(case, alone, in_part if rules.sets_in_part else ())
    if found is not None:
        return found
    refused = replace(refused, steps=steps(refused, *refusals))
    p = case.table.rows[key].fit(rules)
    if not (p > rules.usual and lead.heard().all_for):
        return refused
    usual = judged(case, named, rules.most_usual_left)
    if not usual.named:
        return refused
    return replace(usual, steps=steps(usual, Step(Reason.USUAL_LEFT, lead.key), *refusals))


def _rivals_heard(case: JudgedTable, refused: Decision) -> Decision:
    """The decision with the first rival named that nothing refuses, the leader being refused.

    Evidence of the fitted data puts explanations in an order; data that no fit saw, what an
    explanation leaves and how modes are damped refuse some. What comes behind one that was refused
    is asked the same, for it may be what is missing, and the leader another name for it that fits a
    little better for the wrong reason. Yet a leader that is far ahead refutes its rivals as it
    refutes calibration alone: it found what they do not explain.
    """
    table, (lead, *rivals) = case.table, case.rows(refused.order)
    ahead = table.gain(lead)
    over: tuple[tuple[str, Reason], ...] = ((lead.name, refused.reason),)
    for rival in rivals:
        gain = table.gain(rival)
        if gain <= refused.due or ahead - gain > case.rules.running * refused.due:
            break
        asked = _asked_next(case, refused, rival, over)
        why = _against(case, refused, asked) if asked.named else asked.reason
        if why is None:
            return asked
        over = (*over, (rival.name, why))
    return replace(refused, passed_over=over)


def _asked_next(
    case: JudgedTable, refused: Decision, rival: Row, over: tuple[tuple[str, Reason], ...]
) -> Decision:
    """The decision with a rival in front of those that were passed over."""
    row = case.table.renewal(rival.key)
    others = (k for k in refused.order if k != rival.key)
    led = replace(
        refused, order=(row.key, *others), due=case.due(row), passed_over=over, one_of=(),
        refuting=None, votes=None,
        steps=steps(
            refused, Step(Reason.NEXT, row.key, over[-1][1], names=(over[-1][0],)),
            Step(Reason.RENEWED, rival.key),
        ),
    )  # fmt: skip
    if not row.fitted:
        return replace(led, reason=Reason.NOT_FITTED, named=False)
    led = tested(case, led, row)
    return judged(case, led, case.rules.most_left) if led.named else led


def _against(case: JudgedTable, refused: Decision, asked: Decision) -> Reason | None:
    """What refutes a rival that nothing of its own refuses; None where nothing does.

    The leader refutes it by the gain due, of what was fitted and held out, as calibration alone is
    refuted. Damping that follows what the leader changes refutes what does not dissipate itself.
    """
    table, rules = case.table, case.rules
    (lead, *_), (rival, *_) = case.rows(refused.order), case.rows(asked.order)
    news = [0.0 if d.votes is None else d.votes.news for d in (refused, asked)]
    if table.gain(lead) + news[0] - table.gain(rival) - news[1] > rules.refuted * refused.due:
        return Reason.REFUTED
    return Reason.DAMPING if table.after(rival, lead) < rules.fits_damping else None
