"""A case made ready for a fit: everything that diagnose and calibrate refuse before they fit.

``chladni check`` and ``chladni init`` ask the same, so that what they find in order is not refused.
"""

from ..case import Case
from ..ema.finding import Finding, Screening
from ..ema.screening_lines import screening_lines
from ..errors import FileError
from ..progress import Progress, silent
from ..search.preparation import prepare
from ..search.question import Prepared
from .axes_check import refuse_turned_axes
from .mended_case import undone as mapped_away
from .question_of_case import question_of
from .screening_of_case import (
    RecordingAtFault,
    screened_prepared,
    screened_unprepared,
    unmendable,
)


def refuse_without_effects(case: Case) -> None:
    """Refuse a deck without parts for the effects."""
    made = case.assembly
    if not len(made.shells) + len(made.beams) + sum(map(len, made.solids)):
        raise FileError(
            f"{case.path}: the deck has no shells, beams or solids, but the effects of diagnose "
            "act on these; calibrate and correlate accept any deck"
        )


def ready(
    case: Case, diagnosing: bool, progress: Progress = silent, fitted: bool = True,
    undone: tuple[Finding, ...] = (),
) -> tuple[Prepared, Screening | None]:  # fmt: skip
    """Identify the recording, build the reduced problem, screen; nothing is fitted.

    Parameters
    ----------
    diagnosing : False for a calibration, which takes any deck and fits a recording at fault
    fitted : False if nothing will be fitted: a long recording is then identified from the lines
        that its screening needs, and the error of the mesh is left out
    undone : faults of the recording that were mapped away already
    """
    if diagnosing:
        refuse_without_effects(case)
    question = question_of(case)
    use = None if fitted or question.frf is None else screening_lines(question.frf)
    try:
        prepared = prepare(question, progress, use, fitted)
    except FileError:  # a recording at fault may hold nothing to fit, and says so itself
        alone = screened_unprepared(case)
        if alone is None or not alone.faults:
            raise
        raise RecordingAtFault(alone) from None
    if prepared.identified is not None:
        refuse_turned_axes(case, prepared.identified, prepared.nominal)
    lines = None if use is None else case.lines(case.frfs[0].frequency) & use
    progress("faults of the recording", 1.0)
    screening = screened_prepared(case, prepared, lines)
    of_shapes = question.shapes is not None and screening is not None and bool(screening.faults)
    if screening is not None and (unmendable(screening) or of_shapes):
        if diagnosing or mapped_away(case, screening, undone) is not None:
            raise RecordingAtFault(screening)
    return prepared, screening
