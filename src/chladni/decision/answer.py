"""The answer beyond the name: what is tied with it, what is in doubt, numbers of a calibration."""

from dataclasses import replace

from .hypothesis_table import CalibratedDeck
from .judgement import JudgedTable
from .reasons import ALONE, BEYOND, Decision, Reason, Step, names_of, steps
from .tied import tied


def with_ties(case: JudgedTable, decision: Decision) -> Decision:
    """The decision with what the data do not tell apart."""
    if decision.whole is not None and decision.named:
        return decision
    return _with_confusers(case, decision) if decision.named else _with_doubt(case, decision)


def _with_confusers(case: JudgedTable, decision: Decision) -> Decision:
    """The decision with what explains the data as well as the named effect, if anything does."""
    best, *_ = every = case.rows(decision.order)
    over = dict(decision.passed_over)
    names = tied(best, [r for r in every if r.name not in over], case.rules.tied)
    if len(names) < 2:
        return decision
    step = Step(Reason.TIED, best.key, names=names)
    return replace(decision, one_of=names, steps=steps(decision, step))


def _with_doubt(case: JudgedTable, decision: Decision) -> Decision:
    """Calibration with what explains the data clearly better, if not by enough to be named.

    That no physics is missing is a claim as well: where an effect leads by more than what is told
    apart, and no data that were not fitted have refused it, the answer is one of both. So it is
    where calibration strains a family of joints that stays as it is with the effect. Where
    calibration alone does not fit at all, it is that effect or what the catalogue does not hold.
    """
    table, rules = case.table, case.rules
    plainly = decision.verdict in ("nothing missing", "calibration only")
    against = decision.votes is not None and not decision.votes.all_for
    unfit = not plainly and decision.reason is Reason.TOO_LITTLE
    if not (rules.doubt and decision.order and (plainly or unfit)) or against:
        return decision
    every = case.rows(decision.order)
    lead = every[0]
    relieved = rules.strained and table.null.strained and not lead.strained
    gain, least = table.gain(lead), 0.0 if relieved else rules.tied
    if gain <= least:
        return decision
    least = max(least, gain - rules.tied)
    near = (r for r in every if table.gain(r) > least and not (relieved and r.strained))
    names = names_of(tuple(near))
    one_of = (*names, BEYOND) if unfit else (ALONE, *names)
    step = Step(Reason.DOUBT, lead.key, names=one_of)
    return replace(decision, one_of=one_of, steps=steps(decision, step))


def with_numbers(case: JudgedTable, decision: Decision) -> Decision:
    """The decision with the numbers of the calibration, where nothing is named.

    Plain calibration would bend E, rho and t to make up for mesh and joints. Numbers as the null
    found them come first, then fitted anew. Where errors of the model are so large that both fit
    worse than the deck as it was given, with its mesh error or as it is written, plain calibration
    is the answer; where that needs numbers no structure of this deck has, or fits no better either,
    the deck's own stay. Joints that took more than joints scatter are calibrated, whatever E, rho
    and t gain beside them.
    """
    table, rules = case.table, case.rules
    if decision.named:
        return decision
    if decision.verdict == "nothing missing" and rules.strained and table.null.strained:
        decision = replace(decision, verdict="calibration only")
    if decision.verdict == "nothing missing":
        return replace(decision, deck=CalibratedDeck.WRITTEN)
    if not rules.prudent:
        return decision
    before = table.deck(CalibratedDeck.GIVEN)
    for deck in (CalibratedDeck.FOUND, CalibratedDeck.WRITTEN):
        Q = table.deck(deck)
        if Q and not any(q > b for q, b in zip(Q, before, strict=True)):  # no Q is no worse
            return replace(decision, deck=deck)
    if not table.leaning:
        Q = table.deck(CalibratedDeck.PLAIN)
        if not all(q > b for q, b in zip(Q, before, strict=True)):
            return decision
    verdict = decision.verdict
    verdict = "nothing missing" if verdict == "calibration only" else verdict
    return replace(
        decision, deck=CalibratedDeck.GIVEN, verdict=verdict,
        steps=steps(decision, Step(Reason.DECK_STAYS)),
    )  # fmt: skip
