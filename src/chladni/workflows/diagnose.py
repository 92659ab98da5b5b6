"""Name the physics that a deck left out."""

from ..case import Case
from ..progress import Progress, silent
from .diagnosis_result import DiagnosisResult
from .states import diagnose_states


def diagnose(case: Case, progress: Progress = silent) -> DiagnosisResult:
    """The missing physics of a case, or that none is missing, judged on data no fit saw.

    Raises
    ------
    FileError
        If the recordings hold nothing to compare, or the deck's unit system cannot be right.
    """
    return diagnose_states(case, True, progress)
