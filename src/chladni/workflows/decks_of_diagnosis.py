"""The decks of a diagnosis, each solved as its file describes it, and all numbers of them."""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..dynamics.frf import FRF
from ..errors import FileError, LabelError, ModelError
from ..fem.energy import mass_properties
from ..fem.modelled import Modelled, modelled
from ..geometry.refine import refined as halved
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.implausible_values import implausible_values, strained
from ..inference.likelihood import Responses
from ..inference.residual_localisation import ResidualLocalisation, residual_localisation
from ..inference.result import Adequacy, LeftPlace, MassComparison, Scores
from ..io.nastran import assembly
from ..io.nastran.edit.model_changes import changes
from ..io.nastran.edit.written_assembly import written_assembly
from ..model.assembly import Assembly
from ..search.decision_rules import RULES, odds_of_something_else
from ..search.diagnosis import Diagnosis, assemblies
from ..search.measured_modes import (
    MeasuredModes,
    frequency_error,
    frequency_rows,
    measured_modes,
)
from ..search.other_recordings import scored_others
from ..search.question import Prepared, Question
from ..search.result_parts import (
    agreement,
    alternatives,
    blind_note,
    calibrated,
    laid_on_sheets,
    last_step_in_words,
    named_effects,
    otherwise,
    remainder,
    values_kept,
)
from ..search.written_scores import noise_Q, of_channels, real_poles, scores_of, written_Q
from .case_model import DAMPING, model_frf
from .deck_comments import with_mended, with_remarks
from .diagnosis_result import ChangedDeck, DiagnosisResult, UpdatedModels
from .loaded_model import exported_deck


def updated_models(
    case: Case, prepared: Prepared, found: Diagnosis, mended: tuple[str, ...]
) -> tuple[UpdatedModels, list[str]]:
    """Return the structures before and after, each solved once, as their decks describe them.

    Comments of a changed deck say what of the recording was ``mended``.
    """
    question = prepared.question
    nominal = as_it_is(question, prepared.nominal)
    plain, named = assemblies(question.assembly, found)
    calibrated, lost = _deck(case, question, nominal, plain)
    final = calibrated
    if named is not plain:
        final, lost = _deck(case, question, nominal, named)
        final = with_remarks(final, found.as_deck)
    final = with_mended(final, mended)
    test = measured_modes(prepared)
    made = UpdatedModels(nominal, calibrated, final, held_out=_unseen(prepared), test=test)
    return replace(made, curves=_curves(case, made, test)), lost


def on_preferred_mesh(
    case: Case, prepared: Prepared, found: Diagnosis, stages: UpdatedModels,
    result: DiagnosisResult, mended: tuple[str, ...],
) -> tuple[UpdatedModels, DiagnosisResult]:  # fmt: skip
    """Return decks with every shell halved, if the data prefer that mesh and they predict better.

    The decks on the given mesh stay where the last one is better than the one before it.
    """
    worse = last_step_in_words(result.agreement, bool(result.effects))
    if not (found.halved and worse):
        return stages, result
    question, (plain, *named) = prepared.question, found.halved
    found = replace(found, plain=plain, written=named[0] if named else None)
    before, after = assemblies(question.assembly, found)

    def deck(changed: Assembly) -> ChangedDeck:
        source = exported_deck(halved(changed), case.units)
        finer = question.tested(assembly(source, case.units))
        return ChangedDeck(modelled(finer, stages.nominal.band), (), source)

    try:
        calibrated = deck(before)
        final = calibrated
        if after is not before:
            final = with_remarks(deck(after), found.as_deck)
    except (FileError, ModelError):  # no card holds what changed
        return stages, result
    final = with_mended(final, mended)
    better = replace(stages, calibrated=calibrated, final=final)
    better = replace(better, curves=_curves(case, better, better.test))
    again = result_of(prepared, found, better)
    if last_step_in_words(again.agreement, bool(again.effects)):
        return stages, result
    return better, replace(again, halved=f"on the given mesh {worse}")


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


def result_of(prepared: Prepared, found: Diagnosis, stages: UpdatedModels) -> DiagnosisResult:
    """Collect all numbers and words, from the decks as written."""
    question = prepared.question
    last, deck = found.found or found.null, found.as_deck or found.plain
    real = real_poles(prepared, last)
    every = (
        ("before", stages.nominal),
        ("calibrated", stages.calibrated.model),
        ("after", stages.final.model),
    )
    rows = frequency_rows(prepared, stages.test, every, real)
    fitted, held = _scores(prepared, found, stages, real)
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
        mass=MassComparison(weighed, article_mass(question, stages, deck)),
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
        recordings=scored_others(prepared, [model for _, model in every]),
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
    return Adequacy(test.passes, test.p, test.what, where, test.statistics, odds, test.step)


def article_mass(question: Question, stages: UpdatedModels, deck: HypothesisFit) -> float:
    """Return the mass of the updated deck: the structure as tested minus its sensors [kg].

    Sensor masses that were found are subtracted too: they were not weighed either.
    """
    sensors = sum(m for _, m in question.sensor_masses)
    if stages.final.model is not stages.nominal:
        fit = deck.fit
        sensors += sum(e.weight(fit.of(e)).removed for e in fit.effects if e.traits.writable)
    return mass_properties(stages.final.model.assembly)[0] - sensors


def _scores(
    prepared: Prepared, found: Diagnosis, stages: UpdatedModels,
    real: np.ndarray | None,
) -> tuple[Scores, Scores]:  # fmt: skip
    """Return Q of the three decks on fitted and held-out data, of noise, and with nuisances."""
    winner = found.found or found.null
    sets = prepared.score.use, of_channels(prepared, winner, prepared.held.reporting)
    named = found.found
    nominal = written_Q(prepared, stages.nominal, sets, real)
    calibrated = final = nominal
    if stages.calibrated.model is not stages.nominal:
        final = calibrated = written_Q(prepared, stages.calibrated.model, sets, real)
    if named is not None or stages.final is not stages.calibrated:
        final = written_Q(prepared, stages.final.model, sets, real, named)
    known = scores_of(prepared, winner, [winner], prepared.held.reporting)
    first, second = (
        (*decks, noise_Q(prepared, use, real), *nuisances)
        for *decks, use, nuisances in zip(nominal, calibrated, final, sets, known, strict=True)
    )
    return Scores(*map(_finite, first)), Scores(*map(_finite, second))


def _finite(value: float | None) -> float | None:
    """Return the value, or None for the mean of no data."""
    return value if value is not None and np.isfinite(value) else None
