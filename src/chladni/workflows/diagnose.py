"""Name the physics that a deck left out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Unpack

from ..arguments import checked
from ..case.make_case import CaseWords, Measured
from ..progress import Progress, silent
from .diagnosis_result import DiagnosisResult
from .given_case import Source, given_case
from .silent_channels import without_silent
from .states import diagnose_states


@checked
def diagnose(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    earlier: str | Path | None = None,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> DiagnosisResult:
    """Name the physics a model lacks, or find that none is missing, judged on held-out data.

    Parameters
    ----------
    source : a deck (path, or a model of :func:`chladni.load`), or a case (folder, ``case.toml`` or
        :func:`chladni.load_case`), which then says everything else itself
    recording : one or several: paths, ``FRF`` with channels as ``412:+Z``, ``PoleTable``,
        ``Recording``, or dicts with the keys of a [[recording]]; the first is compared
    earlier : folder of an answer about the same object, from other data: its odds and posterior
        are the prior here
    progress : is called with a text and a share of the work
    words : units, sensors, mass, band, effects and the other words of a case, as
        :class:`chladni.CaseWords` lists them (SI, Hz); without units a deck's materials say them

    Returns
    -------
    DiagnosisResult
        With ``verdict``, ``effects``, ``summary()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence that names the argument (or file and line), the offender and the alternatives.

    Examples
    --------
    ::

        found = chladni.diagnose("deck.bdf", "test.uff", units="mm-t-s", mass=2.1)
        print(found.summary())
        found.save("runs/first")
    """
    case = without_silent(given_case(source, recording, words))
    found = diagnose_states(case, True, progress, earlier=earlier)
    return replace(found, origin=case)
