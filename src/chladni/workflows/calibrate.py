"""Fit the calibration parameters of a deck alone."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Unpack

import numpy as np

from ..arguments import checked
from ..case import Case
from ..case.make_case import CaseWords, Measured
from ..effects.joints import solid_parts
from ..effects.weld_patch import FIELD as WELD_PATCH
from ..effects.weld_patch import SPIDERS, spiders
from ..inference.posterior_samples import sampler_package
from ..progress import Progress, silent
from ..search.calibration import CalibrationSettings
from .diagnosis_result import DiagnosisResult
from .given_case import Source, given_case
from .silent_channels import without_silent
from .states import diagnose_states


@checked
def calibrate(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    sample: bool = False,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> DiagnosisResult:
    """Fit E, rho and t of the parts (or the ``parameters`` given) at their most probable.

    No new physics is tried.

    Parameters
    ----------
    source, recording, progress, words : as in :func:`chladni.diagnose` (SI, Hz)
    sample : draw from the posterior with the package emcee

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence that names the argument (or file and line), the offender and the alternatives.
    """
    if sample:
        sampler_package()  # a missing one is named before any work
    case = without_silent(given_case(source, recording, words))
    found = diagnose_states(case, False, progress, CalibrationSettings(sample=sample))
    return replace(found, notes=(*found.notes, *proposed(case)), origin=case)


def proposed(case: Case) -> Iterator[str]:
    """Sentences on joints that a case may free besides the default parameters of its deck."""
    if case.parameters or not len(case.assembly.shells):
        return
    for soft, field, what in (
        (True, "adhesive-stiffness", "adhesive, over decades with sd = 2"),
        (False, WELD_PATCH, "the sheet about its welds"),
    ):
        rows = {int(p) for group, at in solid_parts(case.assembly, soft)
                for p in np.unique(case.assembly.solids[group].part[at])}  # fmt: skip
        if rows:
            names = ", ".join(f'"{case.assembly.parts[k].name}"' for k in sorted(rows))
            parts = f" and parts = [{names}]" if soft else ""
            yield f'a [[parameter]] with field = "{field}"{parts} frees {what}'
    if spiders(case.assembly):
        yield f'a [[parameter]] with field = "{SPIDERS}" frees the sheet about its RBE2 and RBE3'
