"""Decide if several effects may be named together.

A second effect may only compensate for a small error of the first. Therefore each is tested with
all others in place, as the first is tested against calibration alone. The set as a whole must fit,
and held-out data must support it against calibration alone.
"""

from collections.abc import Sequence
from dataclasses import replace

from .hypothesis_table import SetRow
from .judgement import JudgedTable, apply_held_out, tested
from .reasons import Decision, Reason, Step, steps


def largest_named(
    case: JudgedTable, alone: Decision, sets: Sequence[SetRow]
) -> tuple[Decision | None, tuple[Step, ...]]:
    """Name the last set that passes; otherwise return None and the refusal of each set."""
    refusals: list[Step] = []
    for whole in reversed(sets):
        found = _together(case, alone, whole)
        if isinstance(found, Decision):
            return found, ()
        refusals.append(found)
    return None, tuple(refusals)


def _together(case: JudgedTable, alone: Decision, whole: SetRow) -> Decision | Step:
    """Name several effects together, or return the step that refuses them.

    Every member must be supported with all others in place. The set must pass the test of fit and
    the rules for held-out data, as a single effect must.
    """
    table = case.table
    row = table.refinement(whole.key)
    if not row.fitted:
        return Step(Reason.SET_REFUSED, whole.key, Reason.NOT_FITTED)
    lost = max(0.0, row.neg2_log_evidence - table.rows[whole.key].neg2_log_evidence)
    done = [Step(Reason.FOUND_TOGETHER, whole.key)]
    for k, gain in enumerate(whole.gains):
        if not case.suffices(table.rows[whole.member(k)], gain - lost, whole.due):
            return Step(Reason.SET_REFUSED, whole.key, Reason.NOT_SUPPORTED, k)
        done.append(Step(Reason.HELD_OUT_OF_SET, whole.key, member=k))
    begun = replace(
        alone, order=(row.key, *alone.order), due=case.due(row, 1), steps=tuple(done), whole=whole
    )
    found = tested(case, begun, row)
    if not found.named:
        return Step(Reason.SET_REFUSED, whole.key, Reason.UNFIT)
    found = apply_held_out(case, found)
    if not found.named:
        return Step(Reason.SET_REFUSED, whole.key, found.reason)
    found = replace(found, reason=Reason.TOGETHER)
    for k, alternatives in enumerate(whole.alternatives):
        if alternatives:
            one_of = (whole.members[k], *(r.name for r in alternatives))
            step = Step(Reason.RIVAL_OF_MEMBER, whole.key, member=k, names=one_of)
            found = replace(found, one_of=one_of, steps=steps(found, step))
            break
    refined = Step(Reason.RENEWED, whole.key)
    return replace(found, steps=steps(found, refined, *_perhaps_of_set(case, whole)))


def _perhaps_of_set(case: JudgedTable, named: SetRow) -> tuple[Step, ...]:
    """One step for every effect that reaches a part of its required gain after the named ones."""
    part: dict[str, Step] = {}
    for other in case.table.sets:
        for k, (name, gain) in enumerate(zip(other.members, other.gains, strict=True)):
            if gain <= other.due and name not in named.members:
                part[name] = Step(Reason.PERHAPS_PRESENT, other.key, member=k, names=named.members)
    return tuple(part.values())
