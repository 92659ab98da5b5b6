"""Calibrate a deck with other models of its joints, and compare them on held-out data."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Unpack

from ..case import Case
from ..case.free_parameters import free_parameters
from ..case.make_case import CaseWords, Measured
from ..case.recording_groups import states
from ..effects.joint_variants import JointVariant, joint_variants
from ..errors import ChladniError, FileError
from ..inference.result import Scores
from ..io.nastran import assembly, read_deck, write_assembly
from ..model.assembly import Assembly
from ..progress import Progress, silent, within
from ..results import Result
from ..search.calibration import CalibrationSettings
from .diagnosis_result import DiagnosisResult
from .given_case import Source, given_case
from .states import diagnose_states

QUICK = CalibrationSettings(quick=True)


@dataclass(frozen=True, eq=False)
class JointModelFit:
    """A deck with one kind of joint modelled in another way, calibrated."""

    name: str  # joints and model, as "welds rigid"; "deck" for the deck itself
    # why it could not be made or fitted, in one sentence; then nothing else is known
    refused: str = ""
    # fitted, held_out: Q before and after the calibration
    fitted: Scores = field(default_factory=Scores)
    held_out: Scores = field(default_factory=Scores)
    # of ln(model/test) of the paired frequencies before and after [%]
    frequency_rms: tuple[float | None, float | None] = (None, None)
    mass: float | None = None  # of the calibrated deck [kg]
    distrust: tuple[str, ...] = ()  # reasons not to trust the calibration
    assembly: Assembly | None = None  # before the calibration


@dataclass(frozen=True, eq=False, repr=False)
class JointModels(Result):
    """Models of the joints of a deck, each calibrated to the same data.

    Attributes
    ----------
    rows : the deck first
    what : the held-out data in words
    """

    rows: tuple[JointModelFit, ...]
    what: str = ""
    notes: tuple[str, ...] = ()

    @property
    def best(self) -> JointModelFit:
        """The model that predicts the held-out data best; without such data, that fits best."""

        def score(row: JointModelFit) -> tuple[float, float]:
            q = row.held_out.calibrated, row.fitted.calibrated
            return tuple(float("inf") if x is None else x for x in q)  # type: ignore[return-value]

        return min((r for r in self.rows if not r.refused), key=score)


def joint_models(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> JointModels:
    """Calibrate the deck and every variant of its joints to the same data.

    Welds of solids become bars, springs or rigid bodies; adhesive becomes springs; screws become
    rigid, or their spiders RBE3.  One kind of joint changes at a time.

    Parameters
    ----------
    source, recording, progress, words : as in :func:`chladni.calibrate`
    """
    case = given_case(source, recording, words)
    if len(states(case.recordings)) > 1 and ("test", "use") not in case.given:
        raise FileError(
            f"{case.path} has several states; name one with [test] use to compare models of joints"
        )
    variants = joint_variants(case.assembly)
    if len(variants) == 1:
        raise FileError(
            f"{case.path}: the deck has no welds or adhesive of solids and no screws of bars "
            "between spiders, so its joints have no other model"
        )
    rows, what = [], ""
    for k, variant in enumerate(variants):
        stage = within(progress, k / len(variants), (k + 1) / len(variants))
        stage(variant.name, 0.0)
        row, found = _fitted(case, variant, stage)
        rows.append(row)
        if found is not None and found.agreement is not None:
            what = found.agreement.what
    return JointModels(tuple(rows), what, tuple(case.said("calibrate")), origin=case)


def _fitted(
    case: Case, variant: JointVariant, progress: Progress
) -> tuple[JointModelFit, DiagnosisResult | None]:
    """The row of a variant; errors of the deck itself are the user's."""
    if variant.assembly is None:
        return JointModelFit(variant.name, variant.refused), None
    if not variant.model:
        found = diagnose_states(case, False, progress, QUICK)
        return _row(variant, found), found
    try:
        found = diagnose_states(with_joints(case, variant.assembly), False, progress, QUICK)
    except ChladniError as error:
        return JointModelFit(variant.name, str(error)), None
    return _row(variant, found), found


def with_joints(case: Case, made: Assembly) -> Case:
    """The case with a deck of its own for a structure with other joints.

    Raises
    ------
    LabelError, ModelError
        If a free parameter belongs to a joint that is no longer there.
    """
    with tempfile.TemporaryDirectory(prefix="chladni-") as folder:
        path = write_assembly(made, Path(folder) / case.deck.path.name, case.units)
        deck = read_deck(path)
    read = assembly(deck, case.units)
    parameters = free_parameters(case.asked.parameters, read, deck)
    return replace(case, deck=deck, assembly=read, as_deck=read, parameters=parameters)


def _row(variant: JointVariant, found: DiagnosisResult) -> JointModelFit:
    known, error, mass = found.agreement, found.frequency_error, found.mass
    return JointModelFit(
        variant.name,
        fitted=Scores() if known is None else known.fitted,
        held_out=Scores() if known is None else known.held_out,
        frequency_rms=(None, None) if error is None else (error.before, error.calibrated),
        mass=None if mass is None else mass.model_kg,
        distrust=found.distrust,
        assembly=variant.assembly,
    )
