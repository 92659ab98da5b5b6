"""Lead from a case to the result of a diagnosis or calibration, on one path for all.

1. The recording is read and the held-out data are chosen (``prepare``).
2. Hypotheses are fitted and compared by evidence (``search.diagnosis``).
3. The reported fit is repeated if it left the reduced model's range of validity (``refined``).
4. The decision is made on rows of numbers, and requests the fits that it needs (``decided``).
5. The result is written into the deck, and every number is taken from the decks as written.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..case import Case
from ..decision.decision_rules import RULES, odds_of_something_else
from ..dynamics.frf import FRF
from ..ema.finding import Finding, Screening
from ..errors import FileError, LabelError, ModelError
from ..fem.energy import mass_properties
from ..fem.modelled import Modelled, modelled
from ..geometry.refine import refined as halved
from ..inference.calibration_result import CalibrationStudy
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.implausible_values import implausible_values, in_doubt, strained
from ..inference.joint_fit import Posterior, informed
from ..inference.likelihood import Responses
from ..inference.residual_localisation import ResidualLocalisation, residual_localisation
from ..inference.result import Adequacy, LeftPlace, MassComparison, Scores
from ..io.nastran.edit.model_changes import changes
from ..io.nastran.edit.written_assembly import written_assembly
from ..model.assembly import Assembly
from ..progress import Progress, within
from ..search.articles import articles_together
from ..search.basis_refinement import Refinement, refined
from ..search.calibration import FULL, CalibrationSettings, calibration
from ..search.compensation import compensating
from ..search.damping_by_part import damping_by_part
from ..search.deciding import decided, open_explanations
from ..search.decision_in_words import concluded
from ..search.diagnosis import Diagnosis
from ..search.diagnosis import diagnose as compared
from ..search.frequency_table import frequency_error, frequency_rows
from ..search.left_frequencies import left_frequencies
from ..search.measured_modes import MeasuredModes, measured_modes
from ..search.measurement_forecasts import outlook
from ..search.next_measurement import Outlook, advised
from ..search.other_recordings import scored_others
from ..search.preparation import NOT_WEIGHED
from ..search.question import Prepared, Question
from ..search.regions_to_free import regions_to_free
from ..search.result_parts import (
    agreement,
    alternatives,
    blind_note,
    calibrated,
    foretells_worse,
    laid_on_sheets,
    last_step_in_words,
    named_effects,
    otherwise,
    remainder,
    values_kept,
)
from ..search.verdict_models import models, of_channels, real_poles, scores_of
from ..search.written_scores import noise_Q, written_Q
from .case_model import DAMPING, model_frf
from .deck_comments import with_mended, with_remarks
from .diagnosis_result import ChangedDeck, DiagnosisResult, UpdatedModels
from .mended_case import mending, with_undone
from .over_levels import over_levels
from .ready_case import ready
from .screening_of_case import instead_of_effects, unlike
from .sign_of_gain import with_sign_of_gain


@dataclass(frozen=True, eq=False)
class Explained:
    """A case whose hypotheses are fitted and, with ``distrust``, decided; nothing is written."""

    case: Case
    question: Question
    prepared: Prepared
    found: Diagnosis
    screening: Screening | None = None
    study: CalibrationStudy | None = None
    distrust: tuple[str, ...] = ()
    outlook: Outlook | None = None

    def refine(self, hypothesis: HypothesisFit) -> Refinement:
        """Fit a hypothesis again on a reduced model that can represent it."""
        return refined(self.question, self.prepared, hypothesis)


def searched(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None = None,
    settings: CalibrationSettings = FULL,
) -> Explained:  # fmt: skip
    """Fit all hypotheses of one state of a case; without ``diagnosing`` only calibration.

    A fault of the recording that is beyond doubt and that a map undoes is undone first.

    Parameters
    ----------
    known : posterior of the shared parameters from other states
    settings : of a calibration

    Raises
    ------
    RecordingAtFault
        If the recording shows a fault that neither a map nor a fit can compensate.
    """
    made, faults = mending(
        with_sign_of_gain(case),
        lambda case, faults: _searched(case, diagnosing, progress, known, settings, faults),
    )
    return replace(made, screening=with_undone(made.screening, faults))


def _searched(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None,
    settings: CalibrationSettings, faults: tuple[Finding, ...],
) -> Explained:  # fmt: skip
    """Fit the recording as it is; ``faults`` were undone already."""
    progress("identifying the recording", 0.0)
    stage = within(progress, 0.0, 0.1)
    question, prepared, screening = ready(case, diagnosing, stage, undone=faults)
    if known:
        base = tuple(informed(prepared.problem.base, known))
        notes = tuple(n for n in prepared.notes if n != NOT_WEIGHED)
        prepared = replace(prepared, problem=replace(prepared.problem, base=base), notes=notes)
    stage = within(progress, 0.1, 0.85)
    if diagnosing:
        return Explained(case, question, prepared, compared(prepared.problem, stage), screening)
    made = calibration(prepared.problem, stage, settings)
    articles = articles_together(question, prepared, made.diagnosis.null)
    study = replace(made.study, articles=articles)
    prepared = replace(prepared, problem=made.problem)
    return Explained(case, question, prepared, made.diagnosis, screening, study)


def explained(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None = None,
    settings: CalibrationSettings = FULL,
) -> Explained:  # fmt: skip
    """Diagnose (or, without ``diagnosing``, only calibrate) one state of a case."""
    made = searched(case, diagnosing, progress, known, settings)
    found, distrust, known_outlook = _apply_held_out(made, diagnosing)
    seen = made.screening
    if seen is not None and seen.faults and not diagnosing:
        distrust = (*distrust, f"{seen.sentence}; a fit to it distorts the model")
    return replace(made, found=found, distrust=distrust, outlook=known_outlook)


def build_result(known: Explained, diagnosing: bool, progress: Progress) -> DiagnosisResult:
    """Write an explanation into decks and compute every number of the result from them."""
    case, question, prepared = known.case, known.question, known.prepared
    found = known.found
    progress("the updated deck", 0.85)
    mended = () if known.screening is None else known.screening.mended
    stages, lost = _updated(case, question, prepared, found, mended)
    progress("scores", 0.95)
    result = _result(question, prepared, found, stages)
    if found.halved and (worse := last_step_in_words(result.agreement, bool(result.effects))):
        stages, result = _on_preferred_mesh(case, question, prepared, found, stages, result, worse)
    result = over_levels(question, prepared, stages, result, diagnosing)
    distrust = known.distrust
    if diagnosing and result.verdict in ("calibration only", "nothing missing"):
        distrust = (*distrust, *in_doubt(found.plain.fit, found.null.fit))
    study = known.study
    if not diagnosing:
        reasons = compensating(found.plain.fit, result, question.mass_measurement)
        distrust = (*distrust, *reasons)
        if study is not None:
            rows, fit = result.frequencies, found.plain.fit
            next_ = regions_to_free(rows, stages.final.model, fit, study)
            lossy = damping_by_part(rows, stages.final.model)
            study = replace(study, compensating=reasons, guidance=next_, damping=lossy)
    else:
        distrust = (*foretells_worse(result.agreement, bool(result.effects)), *distrust)
    if diagnosing and prepared.too_little and result.verdict == "not in catalogue":
        distrust = (f"no effect is named: {prepared.too_little}", *distrust)
    if result.compared != "responses":
        distrust = (*left_frequencies(result.frequencies, stages.final.model), *distrust)
    seen, distrust = known.screening, (*far_off(result), *distrust)
    if diagnosing:
        doubts = (*instead_of_effects(result.verdict, seen), *unlike(result, seen))
        distrust = (*distrust, *doubts)
    said = () if seen is None else seen.notes
    notes = (*said, *result.notes, *lost, *case.said("diagnose" if diagnosing else "calibrate"))
    ahead = known.outlook
    return replace(
        result, notes=notes, distrust=distrust, searched=diagnosing, screening=seen, study=study,
        outlook=ahead, next_measurements=() if ahead is None else advised([ahead]),
    )  # fmt: skip


FAR_OFF = 1.0  # Q of a deck whose responses are tenfold or a tenth of the recording's


def far_off(result: DiagnosisResult) -> Iterator[str]:
    """Reason not to trust an answer whose deck leaves a factor of ten in the responses."""
    Q = None if result.agreement is None else result.agreement.fitted.after
    if Q is not None and Q > FAR_OFF and result.compared == "responses":
        yield (
            f"the responses of the deck differ from the recording by a factor of "
            f"{10 ** np.sqrt(Q):.2g} (rms, Q = {Q:.3g}); no calibration explains that; check "
            "units, channels, places and directions"
        )


def _apply_held_out(
    made: Explained, diagnosing: bool
) -> tuple[Diagnosis, tuple[str, ...], Outlook | None]:
    """Return the verdict by all data, reasons not to trust it, and what would settle a tie."""
    prepared = made.prepared
    prepared = prepared if diagnosing else replace(prepared, too_little="")  # nothing to name
    case, decision = decided(prepared, made.found, made.refine)
    found, distrust = concluded(prepared, made.found, case, decision)
    ahead = None
    if diagnosing:
        ahead = outlook(prepared.problem, *open_explanations(case, decision, found))
    plain = refined(made.question, prepared, found.plain, written=True)
    found = replace(found, plain=plain.hypothesis)
    if found.found is not None:
        return found, distrust, ahead
    return replace(found, notes=(*found.notes, plain.note)), (*plain.distrust, *distrust), ahead


def _updated(
    case: Case, question: Question, prepared: Prepared, found: Diagnosis, mended: tuple[str, ...]
) -> tuple[UpdatedModels, list[str]]:
    """Return the structures before and after, each solved once, as their decks describe them.

    Comments of a changed deck say what of the recording was ``mended``.
    """
    stages, nominal = models(question, found), as_it_is(question, prepared.nominal)
    calibrated, lost = _deck(case, question, nominal, stages.calibrated)
    final = calibrated
    if stages.final is not stages.calibrated:
        final, lost = _deck(case, question, nominal, stages.final)
        final = with_remarks(final, found.as_deck)
    final = with_mended(final, mended)
    test = measured_modes(prepared)
    made = UpdatedModels(nominal, calibrated, final, held_out=_unseen(prepared), test=test)
    return replace(made, curves=_curves(case, made, test)), lost


def _on_preferred_mesh(
    case: Case, question: Question, prepared: Prepared, found: Diagnosis, stages: UpdatedModels,
    result: DiagnosisResult, worse: str,
) -> tuple[UpdatedModels, DiagnosisResult]:  # fmt: skip
    """Return decks with every shell halved, if the data prefer that mesh and they foretell better.

    ``worse`` says what is wrong with the decks on the given mesh.
    """
    plain, *named = found.halved
    found = replace(found, plain=plain, written=named[0] if named else None)
    made = models(question, found)

    def deck(assembly: Assembly) -> ChangedDeck:
        finer = halved(assembly)
        return ChangedDeck(modelled(question.tested(finer), stages.nominal.band), None, finer)

    calibrated = deck(made.calibrated)
    final = calibrated if made.final is made.calibrated else deck(made.final)
    better = replace(stages, calibrated=calibrated, final=final)
    better = replace(better, curves=_curves(case, better, better.test))
    again = _result(question, prepared, found, better)
    if last_step_in_words(again.agreement, bool(again.effects)):
        return stages, result
    note = (
        f"the mesh of the deck is too coarse to show the change: on it {worse}; the decks that "
        "are written have every shell halved"
    )
    return better, replace(again, notes=(*again.notes, note))


def as_it_is(question: Question, searched: Modelled) -> Modelled:
    """Return the deck's own structure; the searched one has stiff springs in place of rigid ties.

    Scores use the structure that a user of the deck obtains.
    """
    given = question.tested(question.assembly)
    if len(given.points) == len(searched.assembly.points):
        return searched
    return modelled(given, searched.band)


def _deck(
    case: Case, question: Question, nominal: Modelled, changed: Assembly
) -> tuple[ChangedDeck, list[str]]:
    """Return edits of the deck with its new structure, or a sentence if no card can hold them."""
    if changed is case.as_deck:
        return ChangedDeck(nominal, ()), []
    try:
        edits = tuple(changes(case.deck, case.as_deck, changed, case.units))
        written = written_assembly(case.deck, edits, case.units)
    except (FileError, LabelError, ModelError) as error:
        known = modelled(question.tested(changed), nominal.band)
        return ChangedDeck(known, None), [f"no updated deck was written: {error}"]
    return ChangedDeck(modelled(question.tested(written), nominal.band), edits), []


def _unseen(prepared: Prepared) -> tuple[str, ...]:
    """Return labels of the held-out outputs."""
    data = prepared.problem.data
    if not isinstance(data, Responses):
        return ()
    labels = prepared.problem.labels
    return tuple(label for k, label in enumerate(labels) if not data.use[:, k].any())


def _curves(case: Case, made: UpdatedModels, modes: MeasuredModes) -> dict[str, FRF]:
    """Return the recording and the deck's responses before and after, over the compared band.

    Each mode of a deck has the damping of its partner in the test. With the default damping,
    peaks would be too low or too high, which is not an error of the deck.
    """
    if not case.frfs:
        return {}
    low, high = case.band or (0.0, np.inf)
    high = max(high, (case.held_band or (low, high))[1])
    test = case.frfs[0].sel(band=(max(low, 1e-6), high))

    def response(model: Modelled) -> FRF:
        damping = modes.damping_of(case.outputs, model, case.damping or DAMPING)
        return model_frf(case, model, damping, test)

    after = before = response(made.nominal)
    if made.final.model is not made.nominal:
        after = response(made.final.model)
    return {"test": test, "before": before, "after": after}


def _result(
    question: Question, prepared: Prepared, found: Diagnosis, stages: UpdatedModels
) -> DiagnosisResult:
    """Collect all numbers and words, from the decks as written."""
    last, deck = found.found or found.null, found.as_deck or found.plain
    real = real_poles(prepared, last)
    every = (
        ("before", stages.nominal),
        ("calibrated", stages.calibrated.model),
        ("after", stages.final.model),
    )
    rows = frequency_rows(question, prepared, stages.test, every, real)
    fitted, held = _scores(question, prepared, found, stages, real)
    left = remainder(prepared, found)
    away = dict.fromkeys((*implausible_values(deck.fit), *strained(last.fit)))
    spot = residual_localisation(last, question.mass_measurement)
    weighed = None if question.mass_measurement is None else question.mass_measurement.mass
    return DiagnosisResult(
        verdict=found.verdict,
        effects=named_effects(found),
        alternatives=alternatives(found),
        agreement=agreement(prepared, found, fitted, held),
        calibrated=calibrated(found),
        mass=MassComparison(weighed, _article_mass(question, stages, deck)),
        frequencies=rows,
        frequency_error=frequency_error(rows),
        structured=left,
        adequate=_adequate(found, spot),
        residual_localisation=spot,
        notes=(
            *prepared.notes,
            *found.notes,
            *laid_on_sheets(found, weighed, mass_properties(question.assembly)[0]),
            *otherwise(found),
            *values_kept(found),
            *away,
            left.sentence,
            *blind_note(spot),
        ),
        one_of=(found.one_of,) if found.one_of else (),
        compared=prepared.score.compared,
        models=stages,
        recordings=scored_others(question, prepared, [model for _, model in every]),
    )


def _adequate(found: Diagnosis, spot: ResidualLocalisation | None) -> Adequacy | None:
    """Return the absolute test of fit in the form of the page."""
    test = found.adequacy
    if test is None:
        return None
    place = LeftPlace(test.where, test.modes_hz)
    if spot is not None:
        place = replace(place, parts=spot.parts, grid=spot.grid, point_m=spot.point_m)
    where = () if test.passes else (place,)
    odds = odds_of_something_else(test.against, RULES.something_else)
    return Adequacy(test.passes, test.p, test.what, where, test.statistics, odds)


def _article_mass(question: Question, stages: UpdatedModels, deck: HypothesisFit) -> float:
    """Return the mass of the updated deck: the structure as tested minus its sensors [kg].

    Sensor masses that were found are subtracted too: they were not weighed either.
    """
    sensors = sum(m for _, m in question.sensor_masses)
    if stages.final.model is not stages.nominal:
        fit = deck.fit
        sensors += sum(e.weight(fit.of(e)).removed for e in fit.effects if e.traits.writable)
    return mass_properties(stages.final.model.assembly)[0] - sensors


def _scores(
    question: Question, prepared: Prepared, found: Diagnosis, stages: UpdatedModels,
    real: np.ndarray | None,
) -> tuple[Scores, Scores]:  # fmt: skip
    """Return Q of the three decks on fitted and held-out data, of noise, and with nuisances."""
    winner = found.found or found.null
    sets = prepared.score.use, of_channels(prepared, winner, prepared.held.reporting)
    named = found.found
    nominal = written_Q(question, prepared, stages.nominal, sets, real)
    calibrated = final = nominal
    if stages.calibrated.model is not stages.nominal:
        final = calibrated = written_Q(question, prepared, stages.calibrated.model, sets, real)
    if named is not None or stages.final is not stages.calibrated:
        final = written_Q(question, prepared, stages.final.model, sets, real, named)
    known = scores_of(prepared, winner, [(winner, winner.fit.state)], prepared.held.reporting)
    first, second = (
        (*decks, noise_Q(prepared, use, real), *nuisances)
        for *decks, use, nuisances in zip(nominal, calibrated, final, sets, known, strict=True)
    )
    return Scores(*map(_finite, first)), Scores(*map(_finite, second))


def _finite(value: float | None) -> float | None:
    """Return the value, or None for the mean of no data."""
    return value if value is not None and np.isfinite(value) else None
