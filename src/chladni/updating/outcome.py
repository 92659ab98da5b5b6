"""The verdict on held-out data, and the structures it speaks of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..effects.effect import Effect
from ..effects.registry import families
from ..ema.odds import evidence_in_words
from ..errors import ModelError
from ..model.assembly import Assembly
from .adequacy import FitTest
from .diagnosis import UNEXPLAINED, Diagnosis, tested, verdict
from .held_out_evidence import HeldOutEvidence, held_out_evidence
from .hypothesis_fit import HypothesisFit, UpdatingProblem
from .leaning import leaning, strained
from .likelihood import Poles
from .map_fit import fit
from .question import Prepared, Question
from .reduced_model import State, evaluate
from .several import GOOD_PART
from .ties import tied
from .written_hypothesis import as_foretold, as_found, as_written, of_mesh


@dataclass(frozen=True, eq=False)
class Models:
    """The structure as the deck has it, calibrated without new physics, and with the effect."""

    nominal: Assembly
    calibrated: Assembly
    final: Assembly


def models(question: Question, diagnosis: Diagnosis) -> Models:
    """Every stage written into the assembly."""
    found = diagnosis.found
    nothing = diagnosis.verdict == "nothing missing"
    calibrated = question.assembly if nothing else applied(question.assembly, diagnosis.plain)
    if found is None or not found.physics:
        return Models(question.assembly, calibrated, calibrated)
    return Models(
        question.assembly, calibrated, applied(question.assembly, diagnosis.as_deck or found)
    )


def applied(assembly: Assembly, hypothesis: HypothesisFit) -> Assembly:
    """The assembly with the ordinary parameters and the effects of a hypothesis in it.

    What makes another material of a part comes before what divides the part.
    """

    def turn(effect: Effect) -> int:
        return 0 if effect not in hypothesis.effects else 1 if effect.remakes_structure else 2

    for effect in sorted(hypothesis.fit.effects, key=turn):
        assembly = effect.apply(assembly, hypothesis.fit.of(effect))
    return assembly


@dataclass(frozen=True, eq=False)
class FittedScores:
    """Q of the fits: mesh error and an unknown gain are in all of them, scatter in the last."""

    calibrated: float
    effect: float
    scatter: float


def fitted_scores(prepared: Prepared, diagnosis: Diagnosis) -> tuple[FittedScores, FittedScores]:
    """Q on the data that were fitted, and on those held out."""
    winner = diagnosis.found or diagnosis.null
    stages = _states(prepared.problem, diagnosis, winner)
    out, real = [], real_poles(prepared, winner)
    for use in (prepared.score.use, held_out(prepared, winner)):
        values = [prepared.score.over(fit.model).Q(state, use, real) for fit, state in stages]
        out.append(FittedScores(*values))
    return out[0], out[1]


def held_out(prepared: Prepared, winner: HypothesisFit) -> np.ndarray:
    """Samples the fit never saw; of a fault of one channel, that channel's alone."""
    held = prepared.held
    if not winner.channels or held.ndim < 2:
        return held
    mine = np.isin(prepared.problem.labels, winner.channels)
    own = held & mine
    return own if own.any() else held


CONFLICT = 2.0  # times the gain due: what was fitted refutes calibration, whatever else says
HARM = 1.5  # held-out Q of the deck with the effect over that of plain calibration: no better model
MOST_LEFT = 0.5  # of the Q of plain calibration: beyond it more is left than was explained
AGAINST = "the data that no fit saw speak against it"
WORSE = "but the deck with it is worse on the data that no fit saw"
USUAL = 0.9  # p of the absolute test, above which what is left is what the model's form errs by:
MOST_USUAL_LEFT = 0.8  # then this much may be left of the smaller: scatter of articles leaves it
TOO_LITTLE = "gained too little, of all data together"
LEAVES_MORE = "leaves more than it explains"
MORE_LEFT = "but with it in place more is left than it explains"
BEYOND = "something that the catalogue does not hold"


def borne_by_all_data(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with a name that all data together bear, those that no fit saw included.

    A fifth of a dozen natural frequencies is much of what is known, and held-out sensors and lines
    may feel an effect that the fitted band hardly does.  The Bayes factor of all data is the
    product of that of the fitted ones and of how well the others are foretold, and the bound on
    false alarms holds for it as for the first alone.  Responses bear a good part of it themselves.
    """
    lead = diagnosis.hypotheses[0] if diagnosis.hypotheses else None
    if lead is None or diagnosis.found is not None or prepared.too_little or diagnosis.refused:
        return diagnosis
    poles = isinstance(diagnosis.null.data, Poles)
    gain, data = diagnosis.two_log_bayes_factor(lead), "poles" if poles else "data"
    if gain <= (0.0 if poles else GOOD_PART * diagnosis.due):
        return diagnosis
    heard = held_out_evidence(prepared.problem, prepared.unseen, diagnosis.null, lead)
    if not carried(gain, heard, diagnosis.due, poles):
        return diagnosis
    note = (
        f"{lead.name} gained {gain:.1f} in -2 ln evidence on the {data} that were fitted, and "
        f"those that no fit saw speak for it with {heard.held_out or 0.0:.1f}: together more than "
        f"the {diagnosis.due:.0f} that are needed"
    )
    of_null = 0 if diagnosis.adequacy is None else 1  # the last is what was said of calibration
    notes = (*diagnosis.notes[: len(diagnosis.notes) - of_null], note)
    named = replace(diagnosis, verdict=lead.verdict, notes=notes, adequacy=None)
    return tested(named, prepared.problem)


def judged(prepared: Prepared, diagnosis: Diagnosis, most_left: float = MOST_LEFT) -> Diagnosis:
    """The verdict once data that no fit saw have been heard, and the named effect as written.

    The fitted data must carry a name after the fit was renewed.  The others refuse it as surely:
    where they speak against it by the gain that would be needed to name it, where less than that is
    left of all data together, or where the deck with the effect does harm: by far, or at all where
    the fitted data bear the name by less than twice the gain due.  Nor is named what leaves more
    than ``most_left`` of the Q of plain calibration, of what was fitted and of what was not.  Data
    that cannot feel the effect are predicted alike without it and have no vote.  Where all data
    together, or what was fitted by far, still want more than calibration, what is missing is not in
    the catalogue; or it is the leader with more beside it, where no data speak against that.
    """
    if diagnosis.found is None:
        return diagnosis
    lead, problem = diagnosis.hypotheses[0], prepared.problem
    heard = diagnosis.heard
    if heard is None:
        heard = held_out_evidence(problem, prepared.unseen, diagnosis.null, lead)
    gain = diagnosis.two_log_bayes_factor(lead)
    diagnosis = replace(diagnosis, written=as_written(lead, problem.mass_measurement), heard=heard)
    seen, held = fitted_scores(prepared, diagnosis)
    together = gain + (heard.held_out or 0.0)
    due = diagnosis.due
    poles = isinstance(lead.data, Poles)
    voted = carried(gain, heard, due, poles)
    borne = voted and not held.effect > HARM * held.calibrated
    faint = gain < CONFLICT * due and held.effect > held.calibrated
    left = _leaves_more(lead, (seen, held), most_left)
    if borne and not (faint or left):
        notes = (*diagnosis.notes, f"asked of {lead.name}: {said(heard)}")
        return replace(diagnosis, notes=notes)
    why, but = "left the data no fit saw worse explained", AGAINST
    if not any(g < 0 for g in heard.votes.values()):
        why, but = TOO_LITTLE, "but all data together do not pay for it"
    if voted:
        why, but = LEAVES_MORE, MORE_LEFT
    if voted and (faint or not borne):
        why, but = "made the deck worse on data no fit saw", WORSE
    note = (
        f"{lead.name} gained {gain:.0f} in -2 ln evidence but {why} ({said(heard)}; held-out Q "
        f"{held.calibrated:.3g} calibrated, {held.effect:.3g} with it; of what was fitted "
        f"{seen.calibrated:.3g} and {seen.effect:.3g}), so it is not named"
    )
    plainly = verdict(diagnosis.nominal, diagnosis.null, ())
    notes = (*diagnosis.notes, note)
    refused = replace(diagnosis, verdict=plainly, notes=notes, written=None, refused=f"it {why}")
    one_of = (*tied(lead, diagnosis.hypotheses), BEYOND) if voted else ()
    if together > due and not borne:
        return _unexplained(replace(refused, one_of=one_of), lead, together, "all data", but)
    if gain > CONFLICT * due:
        return _unexplained(replace(refused, one_of=one_of), lead, gain, "what was fitted", but)
    return tested(refused, problem)


def named_with_what_is_usual(
    prepared: Prepared, named: Diagnosis, refused: Diagnosis, beside: Sequence[str] = ()
) -> Diagnosis:
    """The diagnosis, its leader named though it leaves more than it explains, where that is usual.

    Beside a small effect the scatter of an article leaves much, as errors of the model's form do.
    That much may stay where the absolute test all but surely passes, where all that was asked
    speaks for the name, and where a fifth of Q goes of what was fitted or of what was not.

    Parameters
    ----------
    named : as it was before it was judged
    refused : the same, judged
    beside : why effects beside it are not named either
    """
    fits, heard = named.adequacy, refused.heard
    if refused.refused != f"it {LEAVES_MORE}" or fits is None or heard is None:
        return refused
    if not (fits.passes and fits.p > USUAL and all(g > 0 for g in heard.votes.values())):
        return refused
    found = judged(prepared, replace(named, heard=heard), MOST_USUAL_LEFT)
    if found.found is None:
        return refused
    note = (
        f"more is left than {found.found.name} explains, but no more than errors of the model's "
        "form leave: something less may be missing beside it"
    )
    return replace(found, notes=(*found.notes, note, *beside))


def _leaves_more(lead: HypothesisFit, of: Sequence[FittedScores], most: float) -> bool:
    """Whether a name leaves more of Q than may be left, fitted and held out.

    A fault of a few channels is asked of what they recorded and no fit saw: of all it is little.
    """
    if not (lead.physics or lead.channels):
        return False
    asked = of[-1:] if lead.channels else of
    return all(q.effect > most * q.calibrated for q in asked)


def with_deck(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with the numbers of the updated deck, where an effect of its own is named."""
    found = diagnosis.found
    if found is None or diagnosis.shared:
        return diagnosis
    mass = prepared.problem.mass_measurement
    return replace(diagnosis, deck=as_foretold(found, mass, prepared.unseen))


def carried(gain: float, heard: HeldOutEvidence, due: float, poles: bool = False) -> bool:
    """Whether fitted data and those that no fit saw bear a name that has to gain what is due.

    ``poles`` are few: all of them together bear it, or do not.  So do responses, where all that was
    asked speaks for the name and what was fitted bears a good part of it.
    """
    together = gain + (heard.held_out or 0.0)
    for_it = gain > GOOD_PART * due and all(g > 0 for g in heard.votes.values())
    least = together if poles or for_it else min(gain, together)
    return least > due and not any(g < -due for g in heard.votes.values())


def _unexplained(
    diagnosis: Diagnosis, lead: HypothesisFit, gain: float, of: str, but: str
) -> Diagnosis:
    """Calibration alone is refuted by some data, and what refuted it does not stand either.

    Where it may stand all the same it is one of several.
    """
    p = float(min(1.0, len(families()) * np.exp(-gain / 2)))
    what = f"{of}: {evidence_in_words(gain / 2)} for {lead.name} against calibration alone; {but}"
    fits = FitTest(False, p, what, lead.effect.text)
    note = f"{what}, {lead.effect.text}{'' if diagnosis.one_of else UNEXPLAINED}"
    notes = (*diagnosis.notes, note)
    return replace(diagnosis, adequacy=fits, verdict="not in catalogue", notes=notes)


def prudently_calibrated(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """Calibration as it is answered with where nothing is named: the null as a deck can hold it.

    Plain calibration would bend E, rho and t to make up for mesh and joints. Numbers as the null
    found them come first, then fitted anew. Where errors of the model are so large that both fit
    worse than the deck as it was given, with its mesh error or as it is written, plain calibration
    is the answer; where that needs numbers no structure of this deck has, or fits no better either,
    the deck's own stay. Joints that took more than joints scatter are calibrated, whatever E, rho
    and t gain beside them.
    """
    null, mass = diagnosis.null, prepared.problem.mass_measurement
    if diagnosis.verdict == "nothing missing" and strained(null.fit):
        diagnosis = replace(diagnosis, verdict="calibration only")
    if diagnosis.verdict == "nothing missing":
        return replace(diagnosis, plain=as_written(null, mass))
    problem, data = prepared.problem, prepared.score.over(null.model)

    def Q(effects: Sequence[Effect], x: np.ndarray) -> np.ndarray:
        """With what the mesh hides, and without, as a deck has it."""
        try:
            each = [evaluate(null.model, effects, at, False) for at in (x, _mesh_idle(effects, x))]
        except ModelError:  # no structure at all: nothing speaks for it
            return np.full(2, np.inf)
        return np.array([data.Q(state, data.use) for state in each])

    before = Q(problem.base, _given(problem, null))
    for made in (as_found, partial(as_written, mass_measurement=mass)):
        try:
            prudent = made(null)
        except ModelError:  # without scatter its numbers are no structure's
            continue
        if not (Q(prudent.fit.effects, prudent.fit.x) > before).any():  # no Q is no worse
            return replace(diagnosis, plain=prudent)
    plain = diagnosis.plain.fit
    if not (leaning(plain) or (Q(plain.effects, plain.x) > before).all()):
        return diagnosis
    return _deck_stays(prepared, diagnosis)


def _deck_stays(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The deck's own numbers, where none that serve better were found."""
    plain, mass = diagnosis.plain, prepared.problem.mass_measurement
    x = [
        np.array([p.nominal for p in e.parameters]) if e.kind == "ordinary" else plain.fit.of(e)
        for e in plain.fit.effects
    ]
    given = fit(
        plain.model, plain.fit.effects, plain.data, mass, np.concatenate([np.zeros(0), *x]),
        max_steps=0,
    )  # fmt: skip
    note = (
        "no calibrated numbers that a structure of this deck may have fit better than its own, "
        "which stay"
    )
    if not (diagnosis.unexplained or diagnosis.one_of):
        note = f"{note}: what is left is of mesh, joints and scatter"
    verdict = "nothing missing" if diagnosis.verdict == "calibration only" else diagnosis.verdict
    notes = (*diagnosis.notes, note)
    return replace(diagnosis, plain=replace(plain, fit=given), verdict=verdict, notes=notes)


def _mesh_idle(effects: Sequence[Effect], x: np.ndarray) -> np.ndarray:
    """The same parameters without what the mesh hides: no deck has it in it."""
    return np.where(of_mesh(effects), 0.0, x)


def said(heard: HeldOutEvidence) -> str:
    """The gains of data that were not fitted, in words."""
    words = [f"{what} {gain:+.0f}" for what, gain in heard.votes.items()]
    return ", ".join(words) + " in 2 ln predictive density" if words else "nothing was held out"


def real_poles(prepared: Prepared, winner: HypothesisFit) -> np.ndarray | None:
    """Poles of the test that have a partner in the winning model; the rest are spurious."""
    if not isinstance(prepared.score, Poles):
        return None
    data = prepared.score.over(winner.model)
    fitted = winner.fit.data
    wide = Poles(**{**vars(data), "scale": max(3 * getattr(fitted, "scale", 0.01), 0.02)})
    real = np.zeros(len(data.frequency), bool)
    real[wide.pairs(winner.fit.state, np.ones(len(real), bool))[0]] = True
    return real


def _as_given(problem: UpdatingProblem, null: HypothesisFit) -> State:
    """The deck's own values, mesh error and gain as the fit found them, no scatter."""
    return evaluate(null.model, problem.base, _given(problem, null), False)


def _given(problem: UpdatingProblem, null: HypothesisFit) -> np.ndarray:
    """The same as parameters of the base."""
    x, at = problem.mean(), 0
    for e in problem.base:
        n = len(e.parameters)
        if e.kind == "ordinary":
            x[at : at + n] = [p.nominal for p in e.parameters]
        elif e.writable:
            x[at : at + n] = null.fit.of(e)
        at += n
    return x


def _states(
    problem: UpdatingProblem, diagnosis: Diagnosis, winner: HypothesisFit
) -> list[tuple[HypothesisFit, State]]:
    """The calibrated and the updated deck, and all that the last fit had beside them."""
    null, plain = diagnosis.null, diagnosis.plain
    if diagnosis.verdict == "nothing missing":
        nominal = _as_given(problem, null)
        return [(null, nominal), (null, nominal), (null, null.fit.state)]
    if diagnosis.found is None:
        state = plain.fit.state
        return [(plain, state), (plain, state), (null, null.fit.state)]
    final = diagnosis.written or as_written(winner, problem.mass_measurement)
    return [
        (plain, plain.fit.state), (winner, final.fit.state), (winner, winner.fit.state)
    ]  # fmt: skip
