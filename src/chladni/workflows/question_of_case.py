"""Convert a case into the question of a diagnosis."""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..case.recording_groups import relation
from ..ema.setup import Recording
from ..errors import FileError
from ..inference.map_fit import MassMeasurement
from ..search.preparation import prepare
from ..search.question import OtherRecording, Prepared, Question
from .place_words import further_places
from .unit_check import refuse_other_units


def nothing_measured(case: Case) -> FileError:
    """Return the error for a case without data to compare a model with."""
    if not case.recordings:
        how = 'recordings = ["recording.uff"] under [test]'
        if case.asked.by_program:
            how = "the argument recording"
        return FileError(
            f"{case.path} has no recording to compare with the model; give it as {how}"
        )
    return FileError(f"{case.path}: the recordings have neither FRFs nor a table of poles")


def question_of(case: Case) -> Question:
    """Build the question of a case."""
    refuse_other_units(case)
    frfs = case.frfs
    poles = [r.poles for r in case.recordings if r.poles is not None]
    if not frfs and not poles:
        raise nothing_measured(case)
    base_question = Question(
        case.assembly,
        case.outputs,
        case.inputs,
        mass_measurement=_weighed(case),
        hangers=case.setup.hangers,
        band=case.band or (0.0, np.inf),
        exclude=case.exclude,
        held_sensors=case.held_sensors,
        held_band=case.held_band,
        gain_known=case.gain_known,
        parameters=case.parameters,
        sensor_masses=case.sensor_masses,
        accuracy=case.setup.accuracy,
        effects=case.effects,
        further=further_places(case),
    )
    if frfs:
        first = case.recordings[0]
        return replace(
            base_question, frf=frfs[0], others=_others(case), level=first.level,
            control=first.control, article=_article(first),
        )  # fmt: skip
    state = poles[0].of(poles[0].states[0])
    listed = replace(
        base_question, frequency=state.frequency, frequency_sd=state.frequency_sd,
        damping=state.damping,
    )  # fmt: skip
    modal = case.recordings[0].modal
    if modal is None:
        return listed
    size = np.sqrt((np.abs(modal.values) ** 2).mean(axis=0))
    sd = (
        modal.sd
        if case.shape_sd is None
        else case.shape_sd * np.ones_like(modal.values.real) * size
    )
    return replace(listed, shapes=modal.values, shape_sd=sd)


MASS_SD = 0.002  # of the mass, where the user gives none


def _weighed(case: Case) -> MassMeasurement | None:
    """Return the weighed mass of the fitted recording, else that of the article."""
    mass, sd = case.recordings[0].mass, case.setup.mass_sd
    if mass is not None:
        return MassMeasurement(mass, sd or MASS_SD * mass)
    return None if case.setup.mass is None else MassMeasurement(case.setup.mass, sd)


def _others(case: Case) -> tuple[OtherRecording, ...]:
    """Return repeats, articles and levels of the fitted recording, without other states."""
    first = case.recordings[0]
    kinds = [(r, relation(first, r)) for r in case.recordings[1:] if r.frf is not None]
    return tuple(
        OtherRecording(
            r.name, kind, r.frf, r.level, r.control, _article(first if kind == "repeat" else r)
        )
        for r, kind in kinds
        if r.frf is not None and kind != "state"
    )


def _article(r: Recording) -> str:
    """Return the name of the article; without one, that of the recording."""
    return r.article or r.name


def prepared(case: Case) -> Prepared:
    """Prepare a case for updating: identify, reduce, and choose the held-out data."""
    return prepare(question_of(case))
