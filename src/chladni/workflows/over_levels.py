"""Include levels of excitation in a diagnosis: verdict, effects, comments of the deck."""

from dataclasses import replace

from ..ema.level_table import level_tables
from ..inference.level_effects import LinearJoint, joint_comment, level_effects, linear_joints
from ..io.nastran.edit.changes import Add
from ..search.question import Prepared
from .diagnosis_result import ChangedDeck, DiagnosisResult, UpdatedModels


def over_levels(
    prepared: Prepared, stages: UpdatedModels, result: DiagnosisResult, diagnosing: bool
) -> DiagnosisResult:
    """Add the modes over levels; the verdict is nonlinear if they move and no effect is named.

    An effect of the catalogue is linear: it can explain one level, but not a difference between
    levels. An effect named from the fitted level stays, with a note that levels differ.
    """
    study = prepared.levels
    result = replace(result, levels=level_tables(study))
    if not (diagnosing and study.nonlinear):
        return result
    if result.effects:
        note = (
            f"modes change with level, and {' and '.join(e.name for e in result.effects)} does "
            "not explain this: it belongs to the fitted level"
        )
        return replace(result, notes=(*result.notes, note))
    kept = () if result.verdict == "nothing missing" else result.calibrated
    note = (
        f"for the fitted level alone the verdict is {result.verdict!r}; no linear effect changes "
        "modes with level, so the verdict is 'nonlinear'"
    )
    model = stages.final.model
    joints = linear_joints(study, model, prepared.question.level)
    return replace(
        result, verdict="nonlinear", effects=level_effects(study, model), joints=joints,
        models=_with_comment(stages, joints), calibrated=kept, notes=(*result.notes, note),
    )  # fmt: skip


def _with_comment(stages: UpdatedModels, joints: tuple[LinearJoint, ...]) -> UpdatedModels:
    """Add joints over levels to the updated deck as comments."""
    if not joints or stages.final.changes is None:
        return stages
    changes = (*stages.final.changes, Add((), joint_comment(joints)))
    final = ChangedDeck(stages.final.model, changes)
    calibrated = final if stages.calibrated is stages.final else stages.calibrated
    return replace(stages, calibrated=calibrated, final=final)
