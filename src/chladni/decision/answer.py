"""Complete a decision: tied explanations and doubts about calibration."""

from dataclasses import replace

from .judgement import JudgedTable
from .reasons import ALONE, BEYOND, Decision, Reason, Step, names_of, steps
from .tied import tied


def with_ties(case: JudgedTable, decision: Decision) -> Decision:
    """Add the explanations that the data cannot separate to a decision."""
    if decision.whole is not None and decision.named:
        return decision
    return _with_confusers(case, decision) if decision.named else _with_doubt(case, decision)


def _with_confusers(case: JudgedTable, decision: Decision) -> Decision:
    """Add the effects that explain the data as well as the named one, if there are any."""
    best, *_ = every = case.rows(decision.order)
    over = dict(decision.passed_over)
    names = tied(best, [r for r in every if r.name not in over], case.rules.tied)
    if len(names) < 2:
        return decision
    step = Step(Reason.TIED, best.key, names=names)
    return replace(decision, one_of=names, steps=steps(decision, step))


def _with_doubt(case: JudgedTable, decision: Decision) -> Decision:
    """Add the effects that are clearly better than calibration, but are not named.

    The statement that no physics is missing needs evidence too. If an effect leads by more than
    ``rules.tied`` on all data, the answer is calibration or that effect. It is so at any gain if
    calibration strains a family of joints beyond its scatter and the effect does not. If
    calibration alone does not fit, the answer is that effect or one outside the catalogue. A
    leader that was refused leaves the latter open as well.
    """
    table, rules = case.table, case.rules
    plainly = decision.verdict in ("nothing missing", "calibration only")
    unfit = not plainly and decision.reason in (Reason.TOO_LITTLE, Reason.WORSE)
    news = decision.news or 0.0
    against = unfit and news < 0
    if not (decision.order and (plainly or unfit)) or against:
        return decision
    every = case.rows(decision.order)
    lead = every[0]
    relieved = table.null.strained and not lead.strained
    gain, least = table.gain(lead), 0.0 if relieved else rules.tied
    if gain + news <= least:
        return decision
    least = max(least, gain - rules.tied)
    near = (r for r in every if table.gain(r) >= least and not (relieved and r.strained))
    open_ = (BEYOND,) if decision.refused else ()
    one_of = (*(() if unfit else (ALONE,)), *names_of(tuple(near)), *open_)
    step = Step(Reason.DOUBT, lead.key, names=one_of)
    return replace(decision, one_of=one_of, steps=steps(decision, step))
