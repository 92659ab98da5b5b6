"""Lead from a case to the result of a diagnosis or calibration, on one path for all.

1. The recording is read and the held-out data are chosen (``prepare``).
2. Hypotheses are fitted and compared by evidence (``search.diagnosis``).
3. The reported fit is repeated if it left the reduced model's range of validity (``refined``).
4. The decision reads the tests, scores and decks of hypotheses, which are made then (``decide``).
5. The result is written into the deck, and every number is taken from the decks as written.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..case import Case
from ..ema.finding import Finding, Screening
from ..inference.calibration_result import CalibrationStudy
from ..inference.implausible_values import error_of_mesh, in_doubt
from ..inference.joint_fit import Posterior, informed
from ..inference.result import LeftPlace
from ..progress import Progress, within
from ..search.articles import articles_together
from ..search.basis_refinement import refined
from ..search.calibration import FULL, CalibrationSettings, calibration
from ..search.compensation import compensating
from ..search.decide import concluded, decide, open_explanations
from ..search.decision_in_words import BEYOND
from ..search.diagnosis import Diagnosis
from ..search.diagnosis import diagnose as compared
from ..search.earlier_answer import EarlierAnswer, digests, earlier_answer
from ..search.hypotheses import ALONE, Hypotheses
from ..search.left_frequencies import damping_by_part, left_frequencies, regions_to_free
from ..search.measurement_forecasts import outlook
from ..search.next_measurement import Outlook, advised
from ..search.preparation import NOT_WEIGHED
from ..search.question import Prepared
from ..search.result_parts import foretells_worse
from .decks_of_diagnosis import on_preferred_mesh, result_of, updated_models
from .diagnosis_result import DiagnosisResult
from .mended_case import mending, with_undone
from .over_levels import over_levels
from .ready_case import ready
from .screening_of_case import instead_of_effects, settled, unlike
from .sign_of_gain import with_sign_of_gain


@dataclass(frozen=True, eq=False)
class Explained:
    """A case whose hypotheses are fitted and, with ``distrust``, decided; nothing is written."""

    case: Case
    prepared: Prepared
    found: Diagnosis
    screening: Screening | None = None
    study: CalibrationStudy | None = None
    distrust: tuple[str, ...] = ()
    outlook: Outlook | None = None
    earlier: EarlierAnswer | None = None
    posterior: EarlierAnswer | None = None


def searched(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None = None,
    settings: CalibrationSettings = FULL, earlier: EarlierAnswer | None = None,
) -> Explained:  # fmt: skip
    """Fit all hypotheses of one state of a case; without ``diagnosing`` only calibration.

    A fault of the recording that is beyond doubt and that a map undoes is undone first.

    Parameters
    ----------
    known : posterior of the shared parameters from other states
    settings : of a calibration
    earlier : the answer that a diagnosis builds on

    Raises
    ------
    RecordingAtFault
        If the recording shows a fault that neither a map nor a fit can compensate.
    """
    made, faults = mending(
        with_sign_of_gain(case),
        lambda case, faults: _searched(
            case, diagnosing, progress, known, settings, faults, earlier
        ),
    )
    return replace(made, screening=with_undone(made.screening, faults))


def _searched(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None,
    settings: CalibrationSettings, faults: tuple[Finding, ...], earlier: EarlierAnswer | None,
) -> Explained:  # fmt: skip
    """Fit the recording as it is; ``faults`` were undone already."""
    progress("identifying the recording", 0.0)
    stage = within(progress, 0.0, 0.1)
    prepared, screening = ready(case, diagnosing, stage, undone=faults)
    if known:
        base = tuple(informed(prepared.problem.base, known))
        notes = tuple(n for n in prepared.notes if n != NOT_WEIGHED)
        prepared = replace(prepared, problem=replace(prepared.problem, base=base), notes=notes)
    if earlier is not None:
        informed_too = earlier.informed(prepared.problem)
        prepared = replace(prepared, problem=informed_too, notes=(earlier.note, *prepared.notes))
    stage = within(progress, 0.1, 0.85)
    if diagnosing:
        found = compared(prepared.problem, stage)
        return Explained(case, prepared, found, screening, earlier=earlier)
    problem, found, study = calibration(prepared.problem, stage, settings)
    study = replace(study, articles=articles_together(prepared, found.null))
    return Explained(case, replace(prepared, problem=problem), found, screening, study)


def explained(
    case: Case, diagnosing: bool, progress: Progress, known: Posterior | None = None,
    settings: CalibrationSettings = FULL, earlier: EarlierAnswer | None = None,
) -> Explained:  # fmt: skip
    """Diagnose (or, without ``diagnosing``, only calibrate) one state of a case."""
    made = searched(case, diagnosing, progress, known, settings, earlier)
    found, distrust, known_outlook = _apply_held_out(made, diagnosing)
    seen = made.screening
    if seen is not None and seen.faults and not diagnosing:
        distrust = (*distrust, f"{seen.sentence}; a fit to it distorts the model")
    left = _left_to_later(made, found) if diagnosing else None
    return replace(made, found=found, distrust=distrust, outlook=known_outlook, posterior=left)


def _left_to_later(made: Explained, found: Diagnosis) -> EarlierAnswer:
    """Odds and posterior of the answer, for a later recording of the same object."""
    case, names = made.case, found.one_of
    named = found.found
    said = named.name if named else f"one of {', '.join(names)}" if names else found.verdict
    return earlier_answer(found, said, case.setup.mass, data_of(case), made.earlier)


def data_of(case: Case) -> dict[str, str]:
    """Digests of the recording that is fitted."""
    poles = case.recordings[0].poles
    return digests(case.frfs[:1], None if poles is None else poles.frequency)


def build_result(known: Explained, diagnosing: bool, progress: Progress) -> DiagnosisResult:
    """Write an explanation into decks and compute every number of the result from them."""
    case, prepared, found = known.case, known.prepared, known.found
    progress("the updated deck", 0.85)
    mended = () if known.screening is None else known.screening.mended
    stages, lost = updated_models(case, prepared, found, mended)
    progress("scores", 0.95)
    result = result_of(prepared, found, stages)
    stages, result = on_preferred_mesh(case, prepared, found, stages, result, mended)
    seen = known.screening
    if diagnosing and seen is not None:
        fit = (found.found or found.null).fit
        seen = settled(case, seen, prepared.above, stages.final.model, fit)
    result = over_levels(prepared, stages, result, diagnosing)
    distrust = known.distrust
    if diagnosing and result.verdict in ("calibration only", "nothing missing"):
        coarse = error_of_mesh(found.null.fit) if found.halved else 0.0
        result = replace(result, mesh_error=coarse)
        distrust = (*distrust, *in_doubt(found.plain.fit, found.null.fit, coarse))
    study = known.study
    if not diagnosing:
        reasons = compensating(
            found.plain.fit, result.agreement, result.mass, prepared.question.mass_measurement,
            result.residual_localisation, result.compared == "responses",
        )  # fmt: skip
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
        left, cause = left_frequencies(result.frequencies, stages.final.model)
        distrust = (*left, *distrust)
        if left and result.verdict == "not in catalogue":
            result = replace(result, one_of=beyond_calibration(result.one_of, cause))
        if cause and result.adequate is not None:
            there = LeftPlace(f"the joints along the folds, because the deviations show {cause}")
            result = replace(result, adequate=replace(result.adequate, where=(there,)))
    distrust = (*far_off(result), *distrust)
    if diagnosing:
        doubts = (*instead_of_effects(result.verdict, seen), *unlike(result, seen))
        distrust = (*distrust, *doubts)
    said = () if seen is None else seen.notes
    notes = (*said, *result.notes, *lost, *case.said("diagnose" if diagnosing else "calibrate"))
    ahead = known.outlook
    further = () if ahead is None else advised([ahead])
    if ahead is not None and not further:
        notes = (*notes, ahead.nothing_left)
    return replace(
        result, notes=notes, distrust=distrust, searched=diagnosing, screening=seen, study=study,
        outlook=ahead, next_measurements=further,
        posterior=known.posterior,
    )  # fmt: skip


def beyond_calibration(
    groups: tuple[tuple[str, ...], ...], cause: str = ""
) -> tuple[tuple[str, ...], ...]:
    """Tied explanations with a cause outside the catalogue in place of calibration alone.

    The calibrated deck leaves too much of the frequencies to be an explanation. The ``cause`` that
    these show is named, where nothing explains them it alone.
    """
    beyond = f"{BEYOND} ({cause})" if cause else BEYOND
    if cause and not groups:
        return ((beyond,),)
    return tuple(
        tuple(dict.fromkeys(beyond if name in (ALONE, BEYOND) else name for name in group))
        for group in groups
    )


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
    case = Hypotheses(prepared, made.found)
    decision = decide(case)
    found, distrust = concluded(case, decision)
    ahead = None
    if diagnosing:
        rivals = open_explanations(case, decision, found)
        ahead = outlook(prepared.problem, *rivals, allowed=prepared.question.further)
    plain, note, doubts = refined(prepared, found.plain, written=True)
    found = replace(found, plain=plain)
    if found.found is not None:
        return found, distrust, ahead
    return replace(found, notes=(*found.notes, note)), (*doubts, *distrust), ahead
