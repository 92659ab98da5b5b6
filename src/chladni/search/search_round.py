"""One round of a search: candidates are fitted, and the best of every family is followed.

The base of the round contains the effects found before it. A later round therefore finds the gain
of an effect in addition to the others.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..effects.effect import Effect
from ..effects.search_context import Candidate
from ..inference.hypothesis_fit import (
    FAILED,
    ROUGH,
    HypothesisFit,
    UpdatingProblem,
    fitted,
)
from ..inference.likelihood import Responses
from ..inference.map_fit import Status
from ..inference.own_optimum import LocalOptimum, distinct
from ..parallel import in_parallel
from ..reduced.reduced_model import Reduced
from ..sparse.freed_memory import give_back_freed_memory
from .candidates import UpdatingContext, already_there
from .decision_rules import TIED

T = TypeVar("T")
BEHIND = 30.0  # price of any effect, in -2 ln evidence, with room to spare
FIRST = 5  # families that are fitted jointly, whatever they promise; ``LATER`` in later rounds
RUNNING = 3  # families that are fitted to the end, at rest or not; more where they are tied
LATER = 2  # of them in later rounds
WHOLE = 6  # that keep their model, 10 to 300 MB each on a tailgate
FOOT = 0.01  # of the gain (a tenth of the amplitude), by which a simpler effect may fall behind

Say = Callable[[str, float], None]


def search_round(
    problem: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], progress: Say,
    least: float | None = None,
) -> list[HypothesisFit]:  # fmt: skip
    """The best hypothesis of every family, best first.

    Parameters
    ----------
    null : the best without any of them
    least : gain in -2 ln evidence by rough fits, below which none is followed further
    """
    later = least is not None  # the bases of the first round are still there
    whole, running = (LATER, LATER) if later else (WHOLE, RUNNING)
    progress(f"trying {len(tried)} candidates", 0.0)
    hypotheses, left = list[HypothesisFit](), list[HypothesisFit]()
    for fits, behind in _family_fits(problem, null, tried, progress, least):
        hypotheses = _lighter(problem, by_family([*hypotheses, *fits]), whole)
        left += behind
        give_back_freed_memory()
    if least is not None and not _gained(null, hypotheses, least):
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

    Parameters
    ----------
    hypotheses : best first
    null : -2 ln evidence without any of them
    """
    for k, row in enumerate(hypotheses[1:], 1):
        lead, known = hypotheses[0], hypotheses[0].remarks
        behind = row.neg2_log_evidence - lead.neg2_log_evidence
        foot = FOOT * (null - lead.neg2_log_evidence)
        sounder = bool(known.implausible) and not row.remarks.implausible
        near = behind < TIED and (sounder or row.name == known.nearly)
        if near or (row.name == known.becomes and behind < max(TIED, foot)):
            return [row, *hypotheses[:k], *hypotheses[k + 1 :]]
    return list(hypotheses)


def _in_the_running(hypotheses: Sequence[HypothesisFit]) -> int:
    """How many are one answer with the best of them by rough fits."""
    least = min((t.neg2_log_evidence for t in hypotheses), default=0.0)
    return sum(t.neg2_log_evidence < least + TIED for t in hypotheses)


def _gained(null: HypothesisFit, hypotheses: Sequence[HypothesisFit], least: float) -> bool:
    """True if the best hypothesis gains at least this much over the null."""
    best = min((t.neg2_log_evidence for t in hypotheses), default=np.inf)
    return bool(null.neg2_log_evidence - best > least)


def _by_name(tried: Sequence[Candidate]) -> dict[str, list[Candidate]]:
    """Candidates of each family."""
    out: dict[str, list[Candidate]] = {}
    for c in tried:
        out.setdefault(c.effect.name, []).append(c)
    return out


Fits = tuple[list[HypothesisFit], list[HypothesisFit]]


def _family_fits(
    problem: UpdatingProblem, null: HypothesisFit, tried: Sequence[Candidate], progress: Say,
    least: float | None,
) -> Iterator[Fits]:  # fmt: skip
    """Rough joint fits, one family after the other, and the own optima of those behind.

    Poles are paired anew by every change: each candidate is fitted from its start.
    """
    families = _by_name(tried)

    def said(each: Iterable[T]) -> Iterator[T]:
        for k, (name, fits) in enumerate(zip(families, each, strict=True)):
            progress(f"tried {name}", 0.8 * (k + 1) / len(families))
            yield fits

    if isinstance(problem.data, Responses):
        every = in_parallel(lambda some: _own_optima(problem, null, some), families.values())
        yield from _leaders(problem, null, said(every), least)
        return
    for fits in said(in_parallel(
        lambda some: [t for c in some for t in _tried(problem, null, c.effect, c.start, c.base)],
        families.values(),
    )):  # fmt: skip
        yield fits, []


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
    least: float | None,
) -> Iterator[Fits]:  # fmt: skip
    """Joint fits of the leaders of all families that may win; of the others their own optimum.

    The linear base may hide as much of one family as it hid of the leading ones. The most that a
    joint fit of these gained over its own optimum is the slack of all others.

    Parameters
    ----------
    families : own optima of each, as :func:`_own_optima` gives them
    least : gain in -2 ln evidence that a hypothesis must reach
    """
    first, ranked = FIRST if least is None else LATER, list[list[HypothesisFit]]()
    for optima in (each for each in families if each):
        ranked = sorted([*ranked, optima], key=lambda each: each[0].neg2_log_evidence)
        for each in ranked[first:]:
            each[0] = on_common_basis(problem, each[0])
    fits = list(in_parallel(lambda each: _jointly(problem, null, each), ranked[:first]))
    joint = [min((t.neg2_log_evidence for t in each.fits), default=np.inf) for each in fits]
    hidden = (own.neg2_log_evidence - S for (own, *_), S in zip(ranked, joint, strict=False))
    slack, best = max(hidden, default=0.0), min(joint, default=np.inf)
    worst = min(best + BEHIND, np.inf if least is None else null.neg2_log_evidence - least)
    may, behind = list[list[HypothesisFit]](), list[HypothesisFit]()
    for lead, *others in ranked[first:]:
        if lead.neg2_log_evidence - max(slack, 0.0) < worst:
            may.append([lead, *others])
        else:
            behind.append(lead.knowing([t.own for t in others]))
    fits += in_parallel(lambda each: _jointly(problem, null, each), may)
    best = min((t.neg2_log_evidence for each in fits for t in each.fits), default=np.inf)
    yield [], behind
    for more in in_parallel(lambda each: each.whole(problem, null, BEHIND + best), fits):
        yield more, []


@dataclass(frozen=True, eq=False)
class _Leader:
    """Joint fits of the best of a family, and the own optima of its others, best first.

    ``slack`` is the largest difference of a joint fit from its own optimum.
    """

    fits: Sequence[HypothesisFit]
    others: Sequence[HypothesisFit]
    slack: float

    def whole(
        self, problem: UpdatingProblem, null: HypothesisFit, worst: float
    ) -> list[HypothesisFit]:
        """Joint fits of all that may become the best of the family, and better than ``worst``.

        An optimum that is not fitted is known only where it cannot be better than the best fit.
        """
        fits, slack = by_evidence(self.fits), self.slack
        for k, own in enumerate(self.others):
            expected, best = own.neg2_log_evidence, fits[0].neg2_log_evidence
            if expected - slack > min(best, worst):
                behind = [t.own for t in self.others[k:] if t.neg2_log_evidence - slack > best]
                return [fits[0].knowing(behind), *fits[1:]]
            found = _from_own(problem, null, own)
            slack = max([slack, *(abs(expected - t.neg2_log_evidence) for t in found)])
            fits = by_evidence([*fits, *found])
        return fits


def by_evidence(hypotheses: Iterable[HypothesisFit]) -> list[HypothesisFit]:
    """Hypotheses, best first."""
    return sorted(hypotheses, key=lambda t: t.neg2_log_evidence)


def _jointly(
    problem: UpdatingProblem, null: HypothesisFit, optima: Sequence[HypothesisFit]
) -> _Leader:
    """Rough joint fits of the first of a family's own optima that is a structure."""
    for k, own in enumerate(optima):
        if fits := _from_own(problem, null, own):
            slack = max(abs(own.neg2_log_evidence - t.neg2_log_evidence) for t in fits)
            return _Leader(fits, optima[k + 1 :], slack)
    return _Leader([], [], 0.0)


def _from_own(
    problem: UpdatingProblem, null: HypothesisFit, own: HypothesisFit
) -> list[HypothesisFit]:
    """Rough joint fits from an own optimum, over its basis if it has one."""
    each = (own.fit.of(e) if e in own.fit.effects else problem.begun([e]) for e in problem.base)
    model = None if own.model is problem.reduced.model else own.model
    base = np.concatenate([np.zeros(0), *each])
    return _tried(problem, null, own.effect, own.fit.of(own.effect), base, model)


def _tried(
    problem: UpdatingProblem,
    null: HypothesisFit,
    effect: Effect,
    start: np.ndarray,
    base: np.ndarray,
    model: Reduced | None = None,
) -> list[HypothesisFit]:
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
        lead = best.get(t.effect.name, t)
        if lead is t:
            best[t.effect.name] = t
        elif t.fit.neg2_log_evidence < lead.fit.neg2_log_evidence:
            best[t.effect.name] = t.among(lead)
        else:
            best[t.effect.name] = lead.among(t)
    return by_evidence(best.values())


def _lighter(
    problem: UpdatingProblem, hypotheses: list[HypothesisFit], whole: int
) -> list[HypothesisFit]:
    """All families; those far down and at rest keep their fit, not the basis made for it."""
    out = hypotheses[:whole]
    for t in hypotheses[whole:]:
        if t.fit.status is Status.OUT_OF_STEPS:
            out.append(t)
            continue
        out.append(on_common_basis(problem, t))
    return out


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
    if fit.neg2_log_evidence < hypothesis.fit.neg2_log_evidence:
        return replace(hypothesis, fit=fit)
    return hypothesis


def _closer(
    problem: UpdatingProblem, null: HypothesisFit, lead: HypothesisFit
) -> list[HypothesisFit]:
    """The leader begun anew about the place it moved to, or at a better one, while it moves."""
    out: list[HypothesisFit] = []
    for _ in range(3):
        try:
            again = _again(problem, null, lead)
            if again is None:
                break
            hypothesis = problem.fitted_with(again.effect, again.start, again.base)
        except FAILED:
            break
        out.append(hypothesis)
        if hypothesis.fit.neg2_log_evidence > lead.fit.neg2_log_evidence - 1:
            break
        lead = hypothesis
    return out


def _of_the_same_lump(
    problem: UpdatingProblem, hypotheses: Sequence[HypothesisFit]
) -> list[HypothesisFit]:
    """Families behind the leading mass that may be it, begun at its place with its mass.

    A point mass at the edge of a tailgate (tuning 561) had converged 16 mm from its place with a
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


def _again(problem: UpdatingProblem, null: HypothesisFit, lead: HypothesisFit) -> Candidate | None:
    """The leader about the place it moved to, or at a better one next to its own; None: at rest."""
    x, base = lead.fit.of(lead.effect), taken(problem, lead, ("calibration",))
    known = next((f for f in problem.families if f.name == lead.effect.name), None)
    if known is None or known.closer is None:
        return None
    return known.closer(UpdatingContext(problem, null, base), lead.effect, x)


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
