"""Complete a decision: tied explanations and doubts about calibration."""

from dataclasses import replace

from .decision_rules import RULES
from .hypotheses import Hypotheses
from .reasons import ALONE, BEYOND, Decision, Reason, Step
from .tied import tied


def with_ties(case: Hypotheses, decision: Decision) -> Decision:
    """Add the explanations that the data cannot separate to a decision."""
    if decision.whole is not None and decision.named:
        return decision
    return _with_confusers(decision) if decision.named else _with_doubt(case, decision)


def _with_confusers(decision: Decision) -> Decision:
    """Add the effects that explain the data as well as the named one, if there are any."""
    best, *_ = every = decision.order
    over = {h.name for h, _ in decision.passed_over}
    names = tied(best, [h for h in every if h.name not in over])
    if len(names) < 2:
        return decision
    return decision.then(Step(Reason.TIED, best, names=names), one_of=names)


def _with_doubt(case: Hypotheses, decision: Decision) -> Decision:
    """Add the effects that are clearly better than calibration, but are not named.

    The statement that no physics is missing needs evidence too. If an effect leads by more than
    ``RULES.tied`` on all data, the answer is calibration or that effect. It is so at any gain if
    calibration strains a family of joints beyond its scatter and the effect does not. If
    calibration alone does not fit, the answer is that effect or one outside the catalogue. A
    leader that was refused leaves the latter open as well.
    """
    plainly = decision.verdict in ("nothing missing", "calibration only")
    unfit = not plainly and decision.reason in (Reason.TOO_LITTLE, Reason.WORSE)
    news = decision.news or 0.0
    if not (decision.order and (plainly or unfit)) or (unfit and news < 0):
        return decision
    lead = decision.order[0]
    relieved = case.null.strained and not lead.strained
    gain, least = case.gain(lead), 0.0 if relieved else RULES.tied
    if gain + news <= least:
        return decision
    least = max(least, gain - RULES.tied)
    near = (h.name for h in decision.order
            if case.gain(h) >= least and not (relieved and h.strained))  # fmt: skip
    open_ = (BEYOND,) if decision.refused else ()
    one_of = (*(() if unfit else (ALONE,)), *near, *open_)
    return replace(decision.then(Step(Reason.DOUBT, lead, names=one_of)), one_of=one_of)
