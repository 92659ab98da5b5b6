"""One round of a search: candidates are fitted, and the best of every family is followed.

The base of the round contains the effects found before it. A later round therefore finds the gain
of an effect in addition to the others.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..effects.effect import Effect
from ..effects.search_context import Candidate
from ..inference.hypothesis_fit import FAILED, ROUGH, HypothesisFit, UpdatingProblem, fitted
from ..inference.likelihood import Responses
from ..inference.map_fit import Status
from ..inference.own_optimum import LocalOptimum, distinct
from ..parallel import in_parallel
from ..progress import Progress
from ..reduced.reduced_model import Reduced
from ..sparse.freed_memory import give_back_freed_memory
from .candidates import UpdatingContext, already_there
from .decision_rules import RULES

BEHIND = 30.0  # price of any effect, in -2 ln evidence, with room to spare
FIRST = 5  # families that are fitted jointly, whatever they promise; ``LATER`` in later rounds
RUNNING = 3  # families that are fitted to the end, at rest or not; more where they are tied
LATER = 2  # of them in later rounds
WHOLE = 6  # that keep their model, 10 to 300 MB each on a tailgate
FOOT = 0.01  # of the gain (a tenth of the amplitude), by which a simpler effect may fall behind


def search_round(
    problem: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], progress: Progress,
    least: float | None = None,
) -> list[HypothesisFit]:  # fmt: skip
    """The best hypothesis of every family, best first.

    None is followed further if all gain less by rough fits than ``least``, in -2 ln evidence.
    """
    later = least is not None  # the bases of the first round are still there
    whole, running = (LATER, LATER) if later else (WHOLE, RUNNING)
    progress(f"trying {len(tried)} candidates", 0.0)
    hypotheses, left = list[HypothesisFit](), list[HypothesisFit]()
    others = dict[str, _Others]()
    for fits, behind in _family_fits(problem, null, tried, progress, least, left):
        hypotheses = _lighter(problem, by_family([*hypotheses, *fits]), whole)
        others |= {t.effect.name: behind for t in fits}
        give_back_freed_memory()
    worst = BEHIND + _best(hypotheses, 0.0)
    more = in_parallel(lambda t: others[t.effect.name].tried(problem, null, t, worst), hypotheses)
    hypotheses = _lighter(problem, by_family([t for fits in more for t in fits]), whole)
    if least is not None and null.neg2_log_evidence - _best(hypotheses) <= least:
        return simplest_first(by_family([*hypotheses, *left]), null.neg2_log_evidence)
    progress("refining the place", 0.8)
    running = running if later else max(running, _in_the_running(hypotheses[:whole]))
    ahead, rest = hypotheses[:running], hypotheses[running:]
    finished = list(in_parallel(lambda t: _finished(problem, t, True), ahead))
    rest = rest if later else [_finished(problem, t, False) for t in rest]
    hypotheses = by_family([*finished, *rest])
    give_back_freed_memory()
    closer = in_parallel(lambda t: _closer(problem, null, t), hypotheses[:running])
    best = by_family([*hypotheses, *(t for fits in closer for t in fits)])
    best = by_family([*best, *_of_the_same_lump(problem, best)])
    return simplest_first(by_family([*best, *left]), null.neg2_log_evidence)


def simplest_first(hypotheses: Sequence[HypothesisFit], null: float) -> list[HypothesisFit]:
    """Sort hypotheses best first; a preferred one close behind the leader takes its place.

    A resonator tuned above all spectral lines acts as a point mass. The simpler effect leads,
    unless the flank of that resonance brings more than a hundredth of the gain. If the interval of
    the tuning merely includes such values, the simpler effect leads only if it is tied. Likewise a
    tied row with physically possible values leads one without (a sealant as stiff as steel).
    ``null`` is -2 ln evidence without any of them.
    """
    for k, row in enumerate(hypotheses[1:], 1):
        lead, known = hypotheses[0], hypotheses[0].remarks
        behind = row.neg2_log_evidence - lead.neg2_log_evidence
        foot = FOOT * (null - lead.neg2_log_evidence)
        sounder = bool(known.implausible) and not row.remarks.implausible
        near = behind < RULES.tied and (sounder or row.name == known.nearly)
        if near or (row.name == known.becomes and behind < max(RULES.tied, foot)):
            return [row, *hypotheses[:k], *hypotheses[k + 1 :]]
    return list(hypotheses)


def _best(hypotheses: Sequence[HypothesisFit], none: float = np.inf) -> float:
    """The least -2 ln evidence."""
    return min((t.neg2_log_evidence for t in hypotheses), default=none)


def _in_the_running(hypotheses: Sequence[HypothesisFit]) -> int:
    """How many are one answer with the best of them by rough fits."""
    return sum(t.neg2_log_evidence < _best(hypotheses) + RULES.tied for t in hypotheses)


@dataclass(frozen=True, eq=False)
class _Others:
    """Other own optima of a family than that of its joint fit, best first.

    ``slack`` is the largest difference of a joint fit from its own optimum.
    """

    optima: Sequence[HypothesisFit] = ()
    slack: float = 0.0

    def tried(
        self, problem: UpdatingProblem, null: HypothesisFit, lead: HypothesisFit, worst: float
    ) -> list[HypothesisFit]:
        """Fit those jointly that may become the best of the family, and better than ``worst``.

        The linear base may be as wrong about another as it was about the best. An optimum
        that is not fitted is known only where it cannot be better than the best fit.
        """
        fits, slack = [lead], self.slack
        for k, own in enumerate(self.optima):
            expected, best = own.neg2_log_evidence, fits[0].neg2_log_evidence
            if expected - slack > min(best, worst):
                behind = [t.own for t in self.optima[k:] if t.neg2_log_evidence - slack > best]
                return [fits[0].knowing(behind), *fits[1:]]
            found = _from_own(problem, null, own)
            slack = max([slack, *(abs(expected - t.neg2_log_evidence) for t in found)])
            fits = sorted([*fits, *found], key=lambda t: t.neg2_log_evidence)
        return fits


Fits = tuple[list[HypothesisFit], _Others]


def _family_fits(
    problem: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], progress: Progress,
    least: float | None, left: list[HypothesisFit],
) -> Iterator[Fits]:  # fmt: skip
    """Rough joint fits, one family after the other; ``left`` gets own optima of those behind.

    Poles are paired anew by every change: each candidate is fitted from its start.
    """
    responses, families = isinstance(problem.data, Responses), dict[str, list[Candidate]]()
    for c in tried:
        families.setdefault(c.effect.name, []).append(c)

    def begun(some: Sequence[Candidate]) -> list[HypothesisFit]:
        if responses:
            return _own_optima(problem, null, some)
        return [t for c in some for t in _tried(problem, null, c.effect, c.start, c.base)]

    def each() -> Iterator[list[HypothesisFit]]:
        every = in_parallel(begun, families.values())
        for k, (name, fits) in enumerate(zip(families, every, strict=True)):
            progress(f"tried {name}", 0.8 * (k + 1) / len(families))
            yield fits

    if responses:
        yield from _leaders(problem, null, each(), least, left)
    else:
        yield from ((fits, _Others()) for fits in each())


def _own_optima(
    problem: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate]
) -> list[HypothesisFit]:
    """Own optima of a family, each once, best first; only the first keeps its basis.

    The own parameters of every candidate are optimised, and the base is linear about the null or
    the deck.
    """
    about, every = (null.fit.x, problem.mean()), dict[LocalOptimum, HypothesisFit]()
    for c in {(c.effect.text, *c.start): c for c in tried}.values():
        with suppress(*FAILED):
            found = problem.own_optimum(c.effect, c.start, about)
            lead = min(every, key=lambda v: v.neg2_log_evidence, default=None)
            if lead is not None:
                if found.neg2_log_evidence < lead.neg2_log_evidence:
                    every[lead] = on_common_basis(problem, every[lead])
                else:
                    found = on_common_basis(problem, found)
            every[found.own] = found
    return [every[own] for own in distinct(every)]


def _leaders(
    problem: UpdatingProblem, null: HypothesisFit, families: Iterable[list[HypothesisFit]],
    least: float | None, left: list[HypothesisFit],
) -> Iterator[Fits]:  # fmt: skip
    """Joint fits of the leaders of all families that may win; ``left`` gets the others.

    The linear base may hide as much of one family as it hid of the leading ones. The most that a
    joint fit of these gained over its own optimum is the slack of all others.
    """
    first, ranked = FIRST if least is None else LATER, list[list[HypothesisFit]]()
    for optima in (each for each in families if each):
        ranked = sorted([*ranked, optima], key=lambda each: each[0].neg2_log_evidence)
        for each in ranked[first:]:
            each[0] = on_common_basis(problem, each[0])
    slack, worst = 0.0, np.inf if least is None else null.neg2_log_evidence - least
    jointly, leading = partial(_jointly, problem, null), ranked[:first]
    for (own, *_), found in zip(leading, in_parallel(jointly, leading), strict=True):
        joint = _best(found[0])
        slack, worst = max(slack, own.neg2_log_evidence - joint), min(worst, joint + BEHIND)
        yield found
    may = list[list[HypothesisFit]]()
    for each in ranked[first:]:
        if each[0].neg2_log_evidence - slack < worst:
            may.append(each)
        else:
            left.append(each[0].knowing([t.own for t in each[1:]]))
    yield from in_parallel(jointly, may)


def _jointly(
    problem: UpdatingProblem, null: HypothesisFit, optima: Sequence[HypothesisFit]
) -> Fits:
    """Rough joint fits of the first of a family's own optima that is a structure."""
    for k, own in enumerate(optima):
        if fits := _from_own(problem, null, own):
            slack = max(abs(own.neg2_log_evidence - t.neg2_log_evidence) for t in fits)
            return fits, _Others(optima[k + 1 :], slack)
    return [], _Others()


def _from_own(
    problem: UpdatingProblem, null: HypothesisFit, own: HypothesisFit
) -> list[HypothesisFit]:
    """Rough joint fits from an own optimum, over its basis if it has one."""
    each = (own.fit.of(e) if e in own.fit.effects else problem.begun([e]) for e in problem.base)
    model = None if own.model is problem.reduced.model else own.model
    base = np.concatenate([np.zeros(0), *each])
    return _tried(problem, null, own.effect, own.fit.of(own.effect), base, model)


def _tried(
    problem: UpdatingProblem, null: HypothesisFit, effect: Effect, start: np.ndarray,
    base: np.ndarray, model: Reduced | None = None,
) -> list[HypothesisFit]:  # fmt: skip
    """Rough fits; a second one begins at the null if the first remains worse than the null.

    With the effect idle a hypothesis is the null. A fit that is worse by more than its price has
    stopped too early. A start with negative stiffness is not a structure and is left out.
    """
    out: list[HypothesisFit] = []
    for x in (base, null.fit.x):
        if out and out[0].neg2_log_evidence < null.neg2_log_evidence + BEHIND:
            break
        with suppress(*FAILED):
            out.append(problem.fitted_with(effect, start, x, ROUGH, model))
    return out


def by_family(hypotheses: list[HypothesisFit]) -> list[HypothesisFit]:
    """The best hypothesis of every family, best first."""
    best: dict[str, HypothesisFit] = {}
    for t in hypotheses:
        both = best.get(t.effect.name, t), t
        ahead, behind = sorted(both, key=lambda f: f.fit.neg2_log_evidence)
        best[t.effect.name] = t if ahead is behind else ahead.among(behind)
    return sorted(best.values(), key=lambda t: t.neg2_log_evidence)


def _lighter(
    problem: UpdatingProblem, hypotheses: list[HypothesisFit], whole: int
) -> list[HypothesisFit]:
    """All families; those far down and at rest keep their fit, not the basis made for it."""
    moving = Status.OUT_OF_STEPS
    return hypotheses[:whole] + [
        t if t.fit.status is moving else on_common_basis(problem, t) for t in hypotheses[whole:]
    ]


def on_common_basis(problem: UpdatingProblem, hypothesis: HypothesisFit) -> HypothesisFit:
    """A hypothesis that keeps its fit, not the vectors that were added to the basis for it."""
    model = problem.reduced.model
    if hypothesis.model is model:
        return hypothesis
    fit = replace(hypothesis.fit, data=hypothesis.data.rebased(model))
    return replace(hypothesis, fit=fit, model=model)


def _finished(problem: UpdatingProblem, hypothesis: HypothesisFit, running: bool) -> HypothesisFit:
    """A hypothesis in the running, or not yet at rest, fitted to the end from where it is."""
    at_rest = hypothesis.fit.status is not Status.OUT_OF_STEPS
    if not isinstance(problem.data, Responses) or (at_rest and not running):
        return hypothesis
    model, begun = hypothesis.model, hypothesis.fit
    try:
        fit = fitted(model, begun.effects, hypothesis.data, problem.mass_measurement, begun.x)
    except FAILED:
        return hypothesis
    return replace(hypothesis, fit=min(begun, fit, key=lambda f: f.neg2_log_evidence))


def _closer(
    problem: UpdatingProblem, null: HypothesisFit, lead: HypothesisFit
) -> list[HypothesisFit]:
    """The leader begun anew about the place it moved to, or at a better one, while it moves."""
    out = [lead]
    closer = next((f.closer for f in problem.families if f.name == lead.effect.name), None)
    for _ in range(3 if closer else 0):
        effect, x = out[-1].effect, out[-1].fit.of(out[-1].effect)
        context = UpdatingContext(problem, null, taken(problem, out[-1], ("calibration",)))
        try:
            again = closer and closer(context, effect, x)
            if again is None:
                break
            out.append(problem.fitted_with(again.effect, again.start, again.base))
        except FAILED:
            break
        if out[-1].fit.neg2_log_evidence > out[-2].fit.neg2_log_evidence - 1:
            break
    return out[1:]


def _of_the_same_lump(
    problem: UpdatingProblem, hypotheses: Sequence[HypothesisFit]
) -> list[HypothesisFit]:
    """Families that are not tied with the leading mass, begun at its place with its mass.

    On a tailgate (tuning 561) a point mass at the edge had converged 16 mm from its place with a
    gain of 113, and a resonator led with 222. Begun at the resonator's place, the mass gains 226.
    """
    lead = hypotheses[0] if hypotheses else None
    if lead is None or not lead.effect.traits.lump or not isinstance(problem.data, Responses):
        return []
    x = lead.fit.of(lead.effect)
    lump = np.array(lead.effect.location(x).point_m), lead.effect.parameters[0].value(x[0])
    base, out = taken(problem, lead, ("calibration", "nuisance")), list[HypothesisFit]()
    tied = {t.effect.name for t in hypotheses[: _in_the_running(hypotheses)]}
    for family in (f for f in problem.families if f.name not in tied):
        begun = None if family.of_lump is None else family.of_lump(problem.where, *lump)
        if begun is not None and not already_there(problem, *begun):
            with suppress(*FAILED):
                rough = problem.fitted_with(*begun, base, ROUGH)
                near = rough.neg2_log_evidence < lead.neg2_log_evidence + BEHIND
                out.append(_finished(problem, rough, True) if near else rough)
    return out


def taken(problem: UpdatingProblem, lead: HypothesisFit, kinds: tuple[str, ...]) -> np.ndarray:
    """Base parameters at their prior mean, those of these kinds with the leader's values.

    Effects found before have the leader's values too.
    """
    x, at = problem.mean(), 0
    for e in problem.base:
        if e in lead.fit.effects and (e.kind in kinds or e in lead.effects):
            x[at : at + len(e.parameters)] = lead.fit.of(e)
        at += len(e.parameters)
    return x
