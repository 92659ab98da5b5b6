"""Complete a decision: tied explanations, doubts about calibration and the calibrated numbers."""

from dataclasses import replace

from .hypothesis_table import CalibratedDeck, HypothesisTable
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
    """Add the effects that are clearly better than calibration, but too weak to be named.

    The statement that no physics is missing needs evidence too. If an effect leads by more than
    ``rules.tied`` and no held-out data reject it, the answer is calibration or that effect. It is
    so at any gain if calibration strains a family of joints beyond its scatter and the effect does
    not. If calibration alone does not fit, the answer is that effect or one outside the catalogue.
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


def _physical(table: HypothesisTable) -> tuple[CalibratedDeck, ...]:
    """The numbers of the null: as found, unless natural frequencies are compared, and as fitted.

    A deck on its own mesh must have the frequencies itself, so its numbers are always fitted.
    """
    fitted = (CalibratedDeck.WRITTEN,)
    return fitted if table.poles else (CalibratedDeck.FOUND, *fitted)


def _best_deck(table: HypothesisTable) -> CalibratedDeck | None:
    """The calibration that fits best as it is written, where the given deck leaves the scales."""
    plain = () if table.implausible else (CalibratedDeck.PLAIN,)
    tried = (*_physical(table), *plain)
    Q = {deck: table.deck(deck)[-1] for deck in tried if table.deck(deck)}
    return min(Q, key=Q.__getitem__, default=None)


def with_numbers(case: JudgedTable, decision: Decision) -> Decision:
    """Choose the numbers of the calibration, where no effect is named.

    Plain calibration would distort E, rho and t to compensate for errors of mesh and joints. The
    candidates, in this order, are the numbers found by the null, these fitted again without
    scatter, and plain calibration. The last must have plausible numbers and the weighed mass. The
    first of the former two that fits no worse than the given deck, with and without its mesh error,
    is taken. Otherwise it is plain calibration or the first of the two, if that is not worse in
    both respects. Otherwise the given deck stays; where it leaves the scales, the best is taken
    instead. Joints beyond their usual scatter count as calibrated, whatever E, rho and t gain.
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

    def worse(deck: CalibratedDeck) -> list[bool]:
        return [q > b for q, b in zip(table.deck(deck), before, strict=True)]

    physical = _physical(table)
    plain = () if table.implausible else (CalibratedDeck.PLAIN,)
    for deck in physical:
        if table.deck(deck) and not any(worse(deck)):  # no Q is no worse
            return replace(decision, deck=deck)
    for deck in (*plain, *physical):
        if table.deck(deck) and not all(worse(deck)):
            return replace(decision, deck=deck)
    if table.off_the_scales and (best := _best_deck(table)) is not None:
        return replace(decision, deck=best)
    verdict = decision.verdict
    verdict = "nothing missing" if verdict == "calibration only" else verdict
    return replace(
        decision, deck=CalibratedDeck.GIVEN, verdict=verdict,
        steps=steps(decision, Step(Reason.DECK_STAYS)),
    )  # fmt: skip
