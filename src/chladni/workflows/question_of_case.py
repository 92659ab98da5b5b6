"""From a case to the question a diagnosis is asked."""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..errors import FileError
from ..updating.map_fit import MassMeasurement
from ..updating.preparation import prepare
from ..updating.question import Prepared, Question
from .unit_check import refuse_other_units


def question(case: Case) -> Question:
    """The question of a case.

    Raises
    ------
    FileError
        If the recordings hold neither FRFs nor poles, or the deck's unit system cannot be right.
    """
    refuse_other_units(case)
    frfs = case.frfs
    poles = [r.poles for r in case.recordings if r.poles is not None]
    if not frfs and not poles:
        raise FileError(f"{case.path}: the recordings hold neither FRFs nor a table of poles")
    mass_measurement = None
    if case.setup.mass is not None:
        mass_measurement = MassMeasurement(case.setup.mass, case.setup.mass_sd)
    asked = Question(
        case.assembly,
        case.outputs,
        case.inputs,
        mass_measurement=mass_measurement,
        hangers=case.setup.hangers,
        band=case.band or (0.0, np.inf),
        exclude=case.exclude,
        held_sensors=case.held_sensors,
        held_band=case.held_band,
        gain_known=case.gain_known,
        parameters=case.parameters,
        carried=case.carried,
    )
    if frfs:
        return replace(asked, frf=frfs[0])
    state = poles[0].of(poles[0].states[0])
    return replace(asked, frequency=state.frequency, frequency_sd=state.frequency_sd)


def prepared(case: Case) -> Prepared:
    """A case made ready for updating: identified, reduced, what is held out chosen."""
    return prepare(question(case))
