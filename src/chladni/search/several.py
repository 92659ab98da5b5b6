"""Search for sets of two or three effects, by repeated searches of what a set leaves.

1. Grow: the whole catalogue is scanned again with the found effects in the base.  The leading
   candidates are fitted, and the earlier effects stay free.
2. Revise: each older effect is searched again with the newer ones in place, because alone it had to
   explain more than its share.
3. Prune: an effect that does not gain its price in the presence of the others is removed (Efroymson
   1960, stepwise regression).  Effects with a place have different places.
4. Pair: one effect alone may leave a misfit that no second effect explains well enough.  The
   leading families are then tried in pairs, because some effects explain only together.

The members of a set are compared under one error of the model's form, from the set's own state.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..effects.effect import Effect
from ..effects.search_context import Candidate
from ..errors import ModelError
from ..inference.hypothesis_fit import ROUGH, HypothesisFit, UpdatingProblem, fitted
from ..inference.likelihood import Responses
from ..inference.map_fit import unknowns
from ..progress import Progress, silent, within
from ..reduced.reduced_model import Reduced, evaluate
from .candidates import candidates, repeats
from .decision_rules import RULES
from .search_round import search_round, taken

MOST_EFFECTS = 3  # effects in one answer
FITTED = 6  # candidates of a later round that are fitted
WORTH = 0.25  # of the gain due, by rough fits: a round whose best is below it is dropped
PAIRED = 4  # leading families that are tried in pairs
BETTER = 1.0  # gain in -2 ln evidence from which another effect replaces a member
ATTEMPTS = 4  # rounds that may change the set


@dataclass(frozen=True)
class AlternativeRow:
    """A family that could replace one member of a set."""

    name: str
    behind: float  # gap to the member, in -2 ln evidence
    implausible: str = ""  # why its value is physically impossible; "" if it is possible


@dataclass(frozen=True, eq=False)
class Several:
    """Effects that explain the recording together, each with enough gain; largest gain first."""

    hypothesis: HypothesisFit  # comparable with the effects that were tried alone
    own: HypothesisFit  # all of them, with errors of the model's form from its own state
    gains: tuple[float, ...]  # loss of ``own`` in -2 ln evidence without each, others fitted again
    without: tuple[HypothesisFit, ...]  # the best fit without each, comparable with ``own``
    alternatives: tuple[tuple[AlternativeRow, ...], ...]  # that explain as much in place of each
    due: float  # gain that each needed
    about: Reduced  # the model whose state errors of form spread from in ``own``
    ahead: float = np.inf  # gain over the best effect alone, in -2 ln evidence

    @property
    def pay(self) -> bool:
        """True where each member, and the set over one effect, gains its full price when fitted."""
        return min(*self.gains, self.ahead) > self.due


@dataclass(frozen=True, eq=False)
class Search:
    """Sets that a search found from a leader, in the order they grew, and a note on its course."""

    sets: tuple[Several, ...]
    note: str


def several(
    problem: UpdatingProblem, singles: Sequence[HypothesisFit], due: float, unfit: bool,
    progress: Progress = silent,
) -> Search:  # fmt: skip
    """Sets of effects grown from the best one, where every member gains a good part of its price.

    Sets that :attr:`Several.pay` can be named. The members of the others may be present too. A set
    must be ahead of the best effect alone, which is first of ``singles``; ``unfit``: it does not
    fit. One effect needs the gain ``due`` in -2 ln evidence to be named.
    """
    lead, *others = singles
    search = _begun_with(problem, lead, due, within(progress, 0.0, 0.4))
    for other in others[:1]:
        simpler = len(unknowns(other.effects)) < len(unknowns(lead.effects))
        if simpler or (unfit and not any(s.pay for s in search.sets)):
            part = within(progress, 0.4, 0.8)
            search = _better(search, _begun_with(problem, other, due, part, lead, search.sets))
    if unfit and not any(s.pay for s in search.sets):
        progress("effects in pairs", 0.8)
        with suppress(ModelError):
            pairs = _in_pairs(problem, singles[:PAIRED], price(due, 2))
            search = replace(search, sets=(*search.sets, *pairs))
    sets = (replace(s, ahead=_gain(lead, s.hypothesis)) for s in search.sets)
    return replace(search, sets=tuple(s for s in sets if s.ahead > RULES.good_part * s.due))


def _gain(without: HypothesisFit, hypothesis: HypothesisFit) -> float:
    """Gain of a hypothesis over a simpler one, in -2 ln evidence."""
    return without.neg2_log_evidence - hypothesis.neg2_log_evidence


def price(due: float, size: int) -> float:
    """Gain that the last of so many effects needs: every round of a search adds to it."""
    return due + 2 * float(np.log(size))


def _better(one: Search, other: Search) -> Search:
    """The search that ended with the better set; a set with full gains precedes all others."""

    def end(search: Search) -> tuple[bool, float]:
        last = next((s for s in reversed(search.sets) if s.pay), search.sets[-1])
        return not last.pay, last.hypothesis.neg2_log_evidence

    return min((s for s in (one, other) if s.sets), key=end, default=one)


def _begun_with(
    problem: UpdatingProblem, lead: HypothesisFit, due: float, progress: Progress,
    best: HypothesisFit | None = None, known: Sequence[Several] = (),
) -> Search:  # fmt: skip
    """Sets grown from one hypothesis, until no further effect gains enough or the best is ahead.

    A search ends where it reaches a known set, because it would continue as the earlier one did.
    """
    current, out, note, seen = lead, list[Several](), "", list[set[int]]()
    for k in range(ATTEMPTS):
        progress(f"the residual of {current.name}", k / ATTEMPTS)
        size = len(current.effects) + 1
        if size > MOST_EFFECTS:
            break
        try:
            more, note = _grown(problem, current, price(due, size))
            if more is None or (best and _gain(best, _as_alone(problem, more.hypothesis)) < 0):
                break
            found, paid = _revised(problem, more, current.effects, price(due, size))
        except ModelError as error:  # the fit reached an impossible structure
            note = f"the residual of {current.name} could not be searched: {error}"
            break
        current, members = found.own, {id(e) for e in found.own.effects}
        if members in seen or any(_same(problem, current, other.own) for other in known):
            break
        seen.append(members)
        out += [s for s in (paid, found) if s is not None and len(s.gains) > 1]
    return Search(tuple(out), note)


def _same(problem: UpdatingProblem, one: HypothesisFit, other: HypothesisFit) -> bool:
    """True where two sets hold the same effects at the same places."""

    def has(effect: Effect) -> bool:
        its = ((e, other.fit.of(e)) for e in other.effects if e.name == effect.name)
        x = one.fit.of(effect)
        return any(repeats(replace(problem, found=(each,)), effect, x) for each in its)

    return len(one.effects) == len(other.effects) and all(map(has, one.effects))


def _standing(
    problem: UpdatingProblem, lead: HypothesisFit
) -> tuple[UpdatingProblem, HypothesisFit]:
    """The problem with a hypothesis in its base and model errors from its state; its fit there."""
    held = problem.holding([(e, lead.fit.of(e)) for e in lead.effects])
    if isinstance(lead.data, Responses) and lead.data.error is not None:
        x = np.concatenate([lead.fit.of(e) for e in held.base])
        state = evaluate(held.reduced.model, held.base, x, False)
        held = held.allowing_errors(state, lead.data.error.delta)
    null = _in_order(held, lead)
    assert isinstance(null.data, Responses)
    return replace(_moved(held, null), data=null.data), null


def _moved(held: UpdatingProblem, to: HypothesisFit) -> UpdatingProblem:
    """The problem with its found effects at the values of a hypothesis."""
    return replace(held, found=tuple((e, to.fit.of(e)) for e, _ in held.found))


def _holding(
    problem: UpdatingProblem, lead: HypothesisFit, effects: Sequence[Effect]
) -> UpdatingProblem:
    """The problem with some effects of a hypothesis in its base, and the hypothesis's data."""
    held = problem.holding([(e, lead.fit.of(e)) for e in effects])
    assert isinstance(lead.data, Responses)
    return replace(held, data=lead.data.rebased(held.reduced.model))


@dataclass(frozen=True, eq=False)
class _More:
    """A set with one further effect."""

    hypothesis: HypothesisFit
    # by the id of a member, as far as known: hypotheses that explain as much in its place
    alternatives: dict[int, list[HypothesisFit]]
    without: dict[int, HypothesisFit]  # the same: the best fit without it
    about: Reduced  # from a state of which errors of form spread


def _grown(
    problem: UpdatingProblem, current: HypothesisFit, due: float
) -> tuple[_More | None, str]:
    """The set with the best further effect if its gain is enough, and a sentence on the gain."""
    held, null = _standing(problem, current)
    found = _round(held, null, candidates(held, null, FITTED), WORTH * due)
    if not found:
        return None, ""
    gain = _gain(null, found[0])
    note = (
        f"with {current.name} in place the best further effect, {found[0].effect.name}, gains "
        f"{gain:.1f} in -2 ln evidence; {due:.0f} are required"
    )
    if gain <= RULES.good_part * due:
        return None, note
    newest = id(found[0].effect)
    others = [t for t in found[1:] if _other(t, found[0].effect)]
    return _More(found[0], {newest: others}, {newest: null}, held.reduced.model), note


def _round(
    held: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], least: float
) -> list[HypothesisFit]:
    """A round of a search, less effects that moved onto a present effect of their own family."""
    hypotheses = search_round(held, null, tried, silent, least)
    return [t for t in hypotheses if not repeats(_moved(held, t), t.effect, t.fit.of(t.effect))]


def _revised(
    problem: UpdatingProblem, more: _More, members: Sequence[Effect], due: float
) -> tuple[Several, Several | None]:
    """Search some members again, then remove members without a good part of their price.

    Where some members gain only a part, the members with full gains form a second set.
    """
    for member in members:
        more = _sought_anew(problem, more, member)
    found = _paying(problem, more, due, RULES.good_part)
    if found.pay or len(found.gains) < 2:
        return found, None
    known = {id(e): t for e, t in zip(found.own.effects, found.without, strict=True)}
    more = replace(more, hypothesis=found.own, without=known)
    return found, _paying(problem, more, due, 1.0)


def _sought_anew(problem: UpdatingProblem, more: _More, member: Effect) -> _More:
    """The set with one member replaced by an effect that is better, or simpler and tied."""
    lead = more.hypothesis
    rest = _without(problem, lead, member)
    held = _holding(problem, rest, rest.effects)
    null = _in_order(held, rest, ROUGH)
    itself = Candidate(member, lead.fit.of(member), taken(held, lead, ("calibration", "nuisance")))
    found = _round(held, null, [itself, *candidates(held, null, FITTED)], 0.0)
    if not found:
        return more
    best, known = found[0], member.remarks(lead.fit.of(member))
    simpler = known.becomes == best.effect.name or bool(known.implausible)
    tied = simpler and best.effect.name != member.name and _gain(lead, best) > -RULES.tied
    kept = not (tied or _gain(lead, best) > BETTER)
    member = member if kept else best.effect
    others = {**more.alternatives, id(member): [t for t in found if _other(t, member)]}
    if kept:
        return replace(more, alternatives=others, without={**more.without, id(member): rest})
    return replace(more, hypothesis=best, alternatives=others, without={id(member): rest})


def _other(hypothesis: HypothesisFit, member: Effect) -> bool:
    """True for another family whose fitted effect is not the member under another name."""
    return member.name not in (hypothesis.effect.name, hypothesis.remarks.becomes)


def _in_order(held: UpdatingProblem, fit: HypothesisFit, steps: int = 30) -> HypothesisFit:
    """A fit of the base of a problem, repeated with its parameters in the order of that base."""
    x, model = np.concatenate([fit.fit.of(e) for e in held.base]), held.reduced.model
    again = fitted(model, held.base, held.data, held.mass_measurement, x, steps)
    return replace(fit, fit=again, model=model)


def _without(problem: UpdatingProblem, lead: HypothesisFit, member: Effect) -> HypothesisFit:
    """The best fit of a set without one member, starting from the values of the set."""
    first, *rest = (e for e in lead.effects if e is not member)
    held = _holding(problem, lead, rest)
    tries = []
    for kinds in (("calibration", "nuisance"), ("calibration",)):
        with suppress(ModelError):
            base = taken(held, lead, kinds)
            tries.append(held.fitted_with(first, lead.fit.of(first), base))
    if not tries:
        raise ModelError(f"without {member.name} no structure is left")
    return min(tries, key=lambda t: t.neg2_log_evidence)


def _paying(problem: UpdatingProblem, more: _More, due: float, part: float) -> Several:
    """The set without members that gain less than ``part`` of their price among the others."""
    lead, known = more.hypothesis, more.without
    while True:
        if len(lead.effects) < 2:
            return Several(lead, lead, (np.inf,), (lead,), ((),), due, more.about)
        without = {id(e): known.get(id(e)) or _without(problem, lead, e) for e in lead.effects}
        gain = {key: _gain(t, lead) for key, t in without.items()}
        weakest = min(gain, key=lambda key: gain[key])
        if gain[weakest] > part * due:
            break
        lead, known = without[weakest], {}
    order = sorted(lead.effects, key=lambda e: -gain[id(e)])
    own = replace(lead, effect=order[0], found_before=tuple(order[1:]))
    return Several(
        _as_alone(problem, own), own, tuple(gain[id(e)] for e in order),
        tuple(without[id(e)] for e in order),
        tuple(_close(more.alternatives.get(id(e), []), lead) for e in order), due, more.about,
    )  # fmt: skip


def _as_alone(problem: UpdatingProblem, own: HypothesisFit) -> HypothesisFit:
    """The set fitted with the errors of the model's form that single effects were compared with."""
    data = problem.data.rebased(own.model)
    fit = fitted(own.model, own.fit.effects, data, problem.mass_measurement, own.fit.x)
    return replace(own, fit=fit)


def _close(
    alternatives: Sequence[HypothesisFit], lead: HypothesisFit
) -> tuple[AlternativeRow, ...]:
    """Other families that explain as much as a member in its place."""
    close = (t for t in alternatives if _gain(t, lead) < RULES.tied)
    return tuple(
        AlternativeRow(t.effect.name, _gain(t, lead), t.remarks.implausible) for t in close
    )


def _in_pairs(
    problem: UpdatingProblem, singles: Sequence[HypothesisFit], due: float
) -> list[Several]:
    """The best pair of leading families, if it beats one alone and both members gain enough."""
    base, alone = _standing(problem, singles[0])
    tries = []
    for one, other in combinations(singles, 2):
        held = problem.holding([(one.effect, one.fit.of(one.effect))])
        held = replace(held, data=base.data.rebased(held.reduced.model))
        start, x = other.fit.of(other.effect), taken(held, one, ("calibration",))
        if not repeats(held, other.effect, start):
            with suppress(ModelError):
                tries.append(held.fitted_with(other.effect, start, x, ROUGH))
    best = min([alone, *tries], key=lambda t: t.neg2_log_evidence)
    if _gain(alone, best) < WORTH * due:
        return []
    more = _More(best, {}, {}, base.reduced.model)
    found, _ = _revised(problem, more, best.effects, due)
    return [found] if len(found.gains) > 1 else []
