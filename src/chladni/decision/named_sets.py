"""Decide if several effects may be named together.

A second effect may only compensate for a small error of the first. Therefore each is tested with
all others in place, as the first is tested against calibration alone. The set as a whole must fit,
and held-out data must support it against calibration alone.
"""

from functools import partial

from .hypotheses import EffectSet, Hypotheses
from .judgement import apply_held_out, tested
from .reasons import Decision, Reason, Step


def largest_named(case: Hypotheses, alone: Decision) -> tuple[Decision | None, tuple[Step, ...]]:
    """Name the last set that passes; otherwise return None and the refusal of each set."""
    refusals: list[Step] = []
    for whole in reversed([s for s in case.sets if s.pays]):
        found = _together(case, alone, whole)
        if isinstance(found, Decision):
            return found, ()
        refusals.append(found)
    return None, tuple(refusals)


def _together(case: Hypotheses, alone: Decision, whole: EffectSet) -> Decision | Step:
    """Name several effects together, or return the step that refuses them.

    Every member must be supported with all others in place. The set must pass the test of fit and
    the rules for held-out data, as a single effect must.
    """
    made = whole.hypothesis.numbers.refined
    refusal = partial(Step, Reason.SET_REFUSED, made, whole=whole)
    if not made.fitted:
        return refusal(why=Reason.NOT_FITTED)
    lost = max(0.0, made.neg2_log_evidence - whole.hypothesis.neg2_log_evidence)
    done = [Step(Reason.FOUND_TOGETHER, whole=whole)]
    for k, gain in enumerate(whole.gains):
        if not case.suffices(gain - lost, whole.due, partial(whole.news, k)):
            return refusal(why=Reason.NOT_SUPPORTED, member=k)
        done.append(Step(Reason.HELD_OUT_OF_SET, whole=whole, member=k))
    begun = Decision(
        alone.verdict, (made, *alone.order), due=case.due(made, 1), steps=tuple(done), whole=whole
    )
    found = tested(begun, made)
    found = apply_held_out(case, found) if found.named else found
    if not found.named:
        return refusal(why=found.reason)
    found = found.then(reason=Reason.TOGETHER)
    for k, alternatives in enumerate(whole.alternatives):
        if alternatives:
            one_of = (whole.members[k], *(r.name for r in alternatives))
            step = Step(Reason.RIVAL_OF_MEMBER, whole=whole, member=k, names=one_of)
            found = found.then(step, one_of=one_of)
            break
    return found.then(Step(Reason.RENEWED, made), *_perhaps_of_set(case, whole))


def _perhaps_of_set(case: Hypotheses, named: EffectSet) -> tuple[Step, ...]:
    """One step for every effect that reaches a part of its required gain after the named ones."""
    part: dict[str, Step] = {}
    for other in case.sets:
        for k, (name, gain) in enumerate(zip(other.members, other.gains, strict=True)):
            if gain <= other.due and name not in named.members:
                part[name] = Step(
                    Reason.PERHAPS_PRESENT, whole=other, member=k, names=named.members
                )
    return tuple(part.values())
