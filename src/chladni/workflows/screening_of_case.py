"""The compared recording of a case, screened alone and against the model, before any fit."""

import numpy as np

from ..case import Case
from ..effects.estimate import Estimate, Location
from ..ema.finding import Finding, Screening
from ..ema.identification import Identified, identify
from ..ema.recording_screening import screened
from ..errors import ChladniError
from ..fem.modelled import Modelled
from ..updating.channel_screening import against_model
from ..updating.question import Prepared
from ..updating.result import NamedEffect
from .diagnosis_result import DiagnosisResult

FITTED = ("reversed sign",)  # of one channel: diagnosis weighs and measures it


class RecordingAtFault(ChladniError):
    """A recording that is to be mended before anything is fitted to it."""

    def __init__(self, screening: Screening) -> None:
        super().__init__(screening.sentence)
        self.screening = screening


def screened_by_model(
    case: Case, found: Identified, model: Modelled, use: np.ndarray | None = None
) -> Screening:
    """All checks of the first recording.

    Parameters
    ----------
    found : identified from its FRFs
    model : of the deck as it was tested
    use : (n_f,) bool, lines it was identified from, default all
    """
    alone = screened(case.recordings[0], found, case.recordings[1:], _places(case), use)
    return against_model(alone, found, model, case.outputs, case.inputs, case.gain_known)


def _places(case: Case) -> dict[str, np.ndarray]:
    return dict(zip(case.outputs.labels, case.outputs.points, strict=True))


def screened_prepared(case: Case, prepared: Prepared) -> Screening | None:
    """The same with what was identified and solved for a diagnosis; None where no FRF exists."""
    if not case.frfs or prepared.identified is None:
        return None
    return screened_by_model(case, prepared.identified, prepared.nominal)


def screened_alone(case: Case) -> Screening | None:
    """The first recording without a model, where nothing could be prepared from it."""
    if not case.frfs:
        return None
    try:
        frf = case.frfs[0]
        found = identify(frf, case.band, use=case.lines(frf.frequency))
    except ChladniError:
        found = None
    return screened(case.recordings[0], found, case.recordings[1:], _places(case))


def unmendable(screening: Screening) -> bool:
    """Whether a fault was found that no fit could make up for."""
    faults = screening.faults
    return len(faults) > 1 or any(f.kind not in FITTED for f in faults)


def at_fault(case: Case, screening: Screening, diagnosing: bool) -> DiagnosisResult:
    """The answer of a recording that is to be mended first: nothing was fitted to it."""
    note = (
        "Nothing was fitted: physics that is found in a recording at fault may be the fault. Write "
        "the repair, or measure again, and ask once more."
    )
    command = "diagnose" if diagnosing else "calibrate"
    return DiagnosisResult(
        verdict="measurement fault",
        effects=tuple(_named(f) for f in screening.faults),
        notes=(*screening.notes, note, *case.said(command)),
        distrust=() if diagnosing else (f"{screening.sentence}; nothing was calibrated",),
        searched=diagnosing,
        screening=screening,
    )


def _named(fault: Finding) -> NamedEffect:
    size = () if np.isnan(fault.value) else (Estimate(fault.kind, float(fault.value)),)
    where = Location(fault.text.rstrip("."), channels=fault.channels)
    return NamedEffect("sensor-fault", fault.kind, None, where, size)
