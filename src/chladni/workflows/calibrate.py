"""Fit the calibration parameters of a deck alone."""

from ..case import Case
from ..progress import Progress, silent
from .diagnosis_result import DiagnosisResult
from .states import diagnose_states


def calibrate(case: Case, progress: Progress = silent) -> DiagnosisResult:
    """E, rho and t of the parts (or what the case frees) at their most probable; no new physics.

    Raises
    ------
    FileError
        If the recordings hold nothing to compare, or the deck's unit system cannot be right.
    """
    return diagnose_states(case, False, progress)
