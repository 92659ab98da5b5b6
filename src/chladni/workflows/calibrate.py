"""Fit the calibration parameters of a deck alone."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..case import Case
from ..effects.joints import solid_parts
from ..effects.weld_patch import FIELD as WELD_PATCH
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
    found = diagnose_states(case, False, progress)
    return replace(found, notes=(*found.notes, *proposed(case)))


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
