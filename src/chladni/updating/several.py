"""Two effects at once, and three: what one left is searched again with it in place.

1. grown: with what was found in the base, the whole catalogue is scanned again and the leading
   candidates are fitted, all that was found before moving along;
2. revised: each older one is sought anew beside the younger, for alone it had to explain more than
   its own;
3. backward: what does not gain its price beside the others goes (Efroymson 1960, stepwise
   regression); what has a place stands at one of its own;
4. where one effect alone leaves what it should explain and no second pays, the families in front
   are tried in pairs, for an effect may explain only beside another.

All of a set are compared with errors of the model's form as they spread from the set's own state.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..decision.decision_rules import GOOD_PART, TIED
from ..decision.hypothesis_table import Rival
from ..effects.effect import Effect
from ..effects.search_context import Candidate
from ..errors import ModelError
from ..progress import within
from .candidates import candidates, repeats
from .hypothesis_fit import ROUGH, HypothesisFit, UpdatingProblem, fitted
from .likelihood import Responses
from .map_fit import unknowns
from .reduced_model import Reduced, evaluate
from .search_round import search_round, taken

MOST = 3  # effects in one answer
FITTED = 6  # candidates of a later round that are fitted
WORTH = 0.25  # of the gain due, by rough fits: below it none of a round is followed further
PAIRED = 4  # families in front that are tried in pairs
BETTER = 1.0  # in -2 ln evidence, from which another hypothesis takes the place of one
ATTEMPTS = 4  # rounds that may change the set

Say = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Several:
    """Effects that explain the recording together, each of which pays; most gain first.

    Attributes
    ----------
    hypothesis : all of them, comparable with the effects that were tried alone
    own : the same with errors of the model's form as they spread from its own state
    gains : in -2 ln evidence, what ``own`` loses without each, the others fitted again
    without : comparable with ``own``, the best without each
    rivals : of each, other families that would do in its place
    due : gain that each had to bring
    about : the model whose state errors of form spread from in ``own``
    ahead : of the best effect alone, in -2 ln evidence
    """

    hypothesis: HypothesisFit
    own: HypothesisFit
    gains: tuple[float, ...]
    without: tuple[HypothesisFit, ...]
    rivals: tuple[tuple[Rival, ...], ...]
    due: float
    about: Reduced
    ahead: float = np.inf

    @property
    def pay(self) -> bool:
        """Whether what was fitted pays the whole price, of each beside the others and of all."""
        return min(*self.gains, self.ahead) > self.due


@dataclass(frozen=True, eq=False)
class Search:
    """What was found beside a leader, in the order in which the sets grew, and how it went."""

    sets: tuple[Several, ...]
    note: str


def several(
    problem: UpdatingProblem, singles: Sequence[HypothesisFit], due: float, unfit: bool,
    progress: Say = lambda text, share: None,
) -> Search:  # fmt: skip
    """Sets of effects that grow from the best one, every member of which pays a good part.

    Those that :attr:`Several.pay` stand by what was fitted alone; for others the data that no fit
    saw are to pay the rest.

    Parameters
    ----------
    singles : the best hypothesis of every family alone, best first; a set must be ahead of them
    due : gain in -2 ln evidence that one effect needs to be named
    unfit : whether the best of them does not fit
    """
    lead, *others = singles
    search = _begun_with(problem, lead, due, within(progress, 0.0, 0.4))
    for other in others[:1]:
        simpler = len(unknowns(other.effects)) < len(unknowns(lead.effects))
        if simpler or (unfit and not any(s.pay for s in search.sets)):
            say = within(progress, 0.4, 0.8)
            search = _better(search, _begun_with(problem, other, due, say, lead, search.sets))
    if unfit and not any(s.pay for s in search.sets):
        progress("effects in pairs", 0.8)
        with suppress(ModelError):
            pairs = _in_pairs(problem, singles[:PAIRED], price(due, 2))
            search = replace(search, sets=(*search.sets, *pairs))
    sets = (replace(s, ahead=_gain(lead, s.hypothesis)) for s in search.sets)
    return replace(search, sets=tuple(s for s in sets if s.ahead > GOOD_PART * s.due))


def _gain(without: HypothesisFit, hypothesis: HypothesisFit) -> float:
    """In -2 ln evidence."""
    return without.neg2_log_evidence - hypothesis.neg2_log_evidence


def price(due: float, size: int) -> float:
    """Gain that the last of so many effects has to bring: every round of a search is paid for."""
    return due + 2 * float(np.log(size))


def _better(one: Search, other: Search) -> Search:
    """The search that ended with the better set; what pays in full is before what pays in part."""

    def end(search: Search) -> tuple[bool, float]:
        last = next((s for s in reversed(search.sets) if s.pay), search.sets[-1])
        return not last.pay, last.hypothesis.neg2_log_evidence

    return min((s for s in (one, other) if s.sets), key=end, default=one)


def _begun_with(
    problem: UpdatingProblem, lead: HypothesisFit, due: float, progress: Say,
    best: HypothesisFit | None = None, known: Sequence[Several] = (),
) -> Search:  # fmt: skip
    """The sets that grow from one hypothesis, until none more pays or they stay behind the best.

    A search that comes upon a set that is known would go on as the one that found it, and ends.
    """
    current, out, note, seen = lead, list[Several](), "", list[set[int]]()
    for k in range(ATTEMPTS):
        progress(f"what {current.name} leaves", k / ATTEMPTS)
        size = len(current.effects) + 1
        if size > MOST:
            break
        try:
            more, note = _grown(problem, current, price(due, size))
            if more is None:
                break
            if best is not None and _gain(best, _as_alone(problem, more.hypothesis)) < 0:
                break
            found, paid = _revised(problem, more, current.effects, price(due, size))
        except ModelError as error:  # a fit that has left all structures that can be
            note = f"what {current.name} leaves could not be searched: {error}"
            break
        again = any(_same(problem, found.own, other.own) for other in known)
        if again or {id(e) for e in found.own.effects} in seen:
            break
        seen.append({id(e) for e in found.own.effects})
        current = found.own
        out += [s for s in (paid, found) if s is not None and len(s.gains) > 1]
    return Search(tuple(out), note)


def _same(problem: UpdatingProblem, one: HypothesisFit, other: HypothesisFit) -> bool:
    """Whether two sets hold the same effects, each where the other has it."""

    def has(effect: Effect) -> bool:
        its = ((e, other.fit.of(e)) for e in other.effects if e.name == effect.name)
        x = one.fit.of(effect)
        return any(repeats(replace(problem, found=(each,)), effect, x) for each in its)

    return len(one.effects) == len(other.effects) and all(map(has, one.effects))


def _standing(
    problem: UpdatingProblem, lead: HypothesisFit
) -> tuple[UpdatingProblem, HypothesisFit]:
    """The problem with a hypothesis in its base, errors spreading from it; its fit there."""
    held = problem.holding([(e, lead.fit.of(e)) for e in lead.effects])
    model, x = held.reduced.model, np.concatenate([lead.fit.of(e) for e in held.base])
    if isinstance(lead.data, Responses) and lead.data.error is not None:
        state = evaluate(model, held.base, x, False)
        held = held.allowing_errors(state, lead.data.error.delta)
    fit = fitted(model, held.base, held.data, held.mass_measurement, x)
    found = tuple((e, fit.of(e)) for e, _ in held.found)
    assert isinstance(fit.data, Responses)
    return replace(held, found=found, data=fit.data), replace(lead, fit=fit, model=model)


def _holding(
    problem: UpdatingProblem, lead: HypothesisFit, effects: Sequence[Effect]
) -> UpdatingProblem:
    """The problem with some effects of a hypothesis in its base, and the data as it has them."""
    held = problem.holding([(e, lead.fit.of(e)) for e in effects])
    assert isinstance(lead.data, Responses)
    return replace(held, data=lead.data.over(held.reduced.model))


@dataclass(frozen=True, eq=False)
class _More:
    """A set with one effect more.

    ``rivals`` would do in the places of its members, ``without`` are the best fits without them;
    both by the id of the member, as far as they are known. Errors of form spread from a state of
    the model ``about``.
    """

    hypothesis: HypothesisFit
    rivals: dict[int, list[HypothesisFit]]
    without: dict[int, HypothesisFit]
    about: Reduced


def _grown(
    problem: UpdatingProblem, current: HypothesisFit, due: float
) -> tuple[_More | None, str]:
    """The set with the best effect more, if that pays, and how much it gains."""
    held, null = _standing(problem, current)
    found = _round(held, null, candidates(held.begun_wide(), null, FITTED), WORTH * due)
    if not found:
        return None, ""
    gain = _gain(null, found[0])
    note = (
        f"with {current.name} in place the best effect more, {found[0].effect.name}, gains "
        f"{gain:.1f} in -2 ln evidence; {due:.0f} are needed"
    )
    if gain <= GOOD_PART * due:
        return None, note
    newest = id(found[0].effect)
    others = [t for t in found[1:] if _other(t, found[0].effect)]
    return _More(found[0], {newest: others}, {newest: null}, held.reduced.model), note


def _round(
    held: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], least: float
) -> list[HypothesisFit]:
    """A round of a search; what moved onto one of its own family that is there is left out."""
    hypotheses = search_round(held, null, tried, lambda text, share: None, least)
    return [t for t in hypotheses if not repeats(_moved(held, t), t.effect, t.fit.of(t.effect))]


def _moved(held: UpdatingProblem, to: HypothesisFit) -> UpdatingProblem:
    """The problem with what was found where a hypothesis has it."""
    return replace(held, found=tuple((e, to.fit.of(e)) for e, _ in held.found))


def _revised(
    problem: UpdatingProblem, more: _More, members: Sequence[Effect], due: float
) -> tuple[Several, Several | None]:
    """The set with some of its members sought anew, less what does not pay a good part.

    Where some of it pay no more than that, those that pay in full are a set as well.
    """
    for member in members:
        more = _sought_anew(problem, more, member)
    found = _paying(problem, more, due, GOOD_PART)
    if found.pay or len(found.gains) < 2:
        return found, None
    known = {id(e): t for e, t in zip(found.own.effects, found.without, strict=True)}
    more = replace(more, hypothesis=found.own, without=known)
    return found, _paying(problem, more, due, 1.0)


def _sought_anew(problem: UpdatingProblem, more: _More, member: Effect) -> _More:
    """The set with what explains most in the place of one of its members, which may be itself."""
    lead = more.hypothesis
    rest = _without(problem, lead, member)
    held = _holding(problem, rest, rest.effects)
    null = _in_order(held, rest)
    itself = Candidate(member, lead.fit.of(member), taken(held, lead, ("ordinary", "nuisance")))
    found = _round(held, null, [itself, *candidates(held.begun_wide(), null, FITTED)], 0.0)
    if not found:
        return more
    best = found[0]
    if not _preferred(best, lead, member):
        known, others = {**more.without, id(member): rest}, [t for t in found if _other(t, member)]
        return replace(more, rivals={**more.rivals, id(member): others}, without=known)
    new = id(best.effect)
    rivals = {**more.rivals, new: [t for t in found[1:] if _other(t, best.effect)]}
    return replace(more, hypothesis=best, rivals=rivals, without={new: rest})


def _other(hypothesis: HypothesisFit, member: Effect) -> bool:
    """Whether it is of another family, and as it was fitted no other name for the same."""
    effect = hypothesis.effect
    return member.name not in (effect.name, effect.becomes(hypothesis.fit.of(effect)))


def _preferred(best: HypothesisFit, lead: HypothesisFit, member: Effect) -> bool:
    """Whether another effect stands in the place of a member: it is better, or simpler and tied."""
    ahead, x = _gain(lead, best), lead.fit.of(member)
    simpler = member.becomes(x) == best.effect.name or bool(member.implausible(x))
    return ahead > BETTER or (simpler and best.effect.name != member.name and ahead > -TIED)


def _in_order(held: UpdatingProblem, fit: HypothesisFit) -> HypothesisFit:
    """A fit of the base of a problem with its parameters in the order of that base."""
    x = np.concatenate([fit.fit.of(e) for e in held.base])
    model, data = held.reduced.model, held.data
    again = fitted(model, held.base, data, held.mass_measurement, x, ROUGH)
    return replace(fit, fit=again, model=model)


def _without(problem: UpdatingProblem, lead: HypothesisFit, member: Effect) -> HypothesisFit:
    """The best fit of all but one of a set's members, from where the set has them."""
    first, *rest = (e for e in lead.effects if e is not member)
    held = _holding(problem, lead, rest)
    tries = []
    for kinds in (("ordinary", "nuisance"), ("ordinary",)):
        with suppress(ModelError):
            base = taken(held, lead, kinds)
            tries.append(held.fitted_with(first, lead.fit.of(first), base))
    if not tries:
        raise ModelError(f"without {member.name} no structure is left")
    return min(tries, key=lambda t: t.neg2_log_evidence)


def _paying(problem: UpdatingProblem, more: _More, due: float, part: float) -> Several:
    """The set less what does not gain that part of its price beside the others."""
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
    own = replace(lead, effect=order[0], beside=tuple(order[1:]))
    return Several(
        _as_alone(problem, own), own, tuple(gain[id(e)] for e in order),
        tuple(without[id(e)] for e in order),
        tuple(_close(more.rivals.get(id(e), []), lead) for e in order), due, more.about,
    )  # fmt: skip


def _as_alone(problem: UpdatingProblem, own: HypothesisFit) -> HypothesisFit:
    """The set with errors of the model's form as single effects were compared with."""
    data = problem.data.over(own.model)
    fit = fitted(own.model, own.fit.effects, data, problem.mass_measurement, own.fit.x)
    return replace(own, fit=fit)


def _close(rivals: Sequence[HypothesisFit], lead: HypothesisFit) -> tuple[Rival, ...]:
    """Other families that do as well as a member in its place."""
    every = [
        Rival(t.effect.name, _gain(t, lead), t.effect.implausible(t.fit.of(t.effect)))
        for t in rivals
    ]
    return tuple(rival for rival in every if rival.behind < TIED)


def _in_pairs(
    problem: UpdatingProblem, singles: Sequence[HypothesisFit], due: float
) -> list[Several]:
    """The best pair of the families in front, if it is ahead of one alone and both of it pay."""
    base, alone = _standing(problem, singles[0])
    data = base.data
    tries = []
    for one, other in combinations(singles, 2):
        held = problem.holding([(one.effect, one.fit.of(one.effect))])
        held = replace(held, data=data.over(held.reduced.model))
        start = other.fit.of(other.effect)
        if repeats(held, other.effect, start):
            continue
        with suppress(ModelError):
            tries.append(
                held.fitted_with(other.effect, start, taken(held, one, ("ordinary",)), ROUGH)
            )
    best = min([alone, *tries], key=lambda t: t.neg2_log_evidence)
    if _gain(alone, best) < WORTH * due:
        return []
    more = _More(best, {}, {}, base.reduced.model)
    found, _ = _revised(problem, more, best.effects, due)
    return [found] if len(found.gains) > 1 else []
