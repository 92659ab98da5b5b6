"""Fit the calibration parameters of a deck alone."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Unpack

from ..case.make_case import CaseWords, Measured
from ..progress import Progress, silent
from .diagnosis_result import DiagnosisResult
from .given_case import Source, given_case
from .states import diagnose_states


def calibrate(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> DiagnosisResult:
    """Fit E, rho and t of the parts (or the ``parameters`` given) at their most probable.

    No new physics is tried.

    Parameters
    ----------
    source, recording, progress, words : as in :func:`chladni.diagnose` (SI, Hz)

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence that names the argument (or file and line), the offender and the alternatives.
    """
    case = given_case(source, recording, words)
    return replace(diagnose_states(case, False, progress), origin=case)
