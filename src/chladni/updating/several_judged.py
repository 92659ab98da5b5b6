"""Whether several effects may be named together: each must be borne by data that no fit saw.

A second effect beside a first one that is a little off mops up what that leaves. Therefore each is
asked beside all others, as the first is beside calibration alone; and all together must fit, and
must be borne by the data held out against calibration alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..effects.effect import Effect
from ..effects.registry import family
from .adequacy import FitTest
from .diagnosis import Diagnosis, tested
from .held_out_evidence import held_out_evidence
from .hypothesis_fit import HypothesisFit
from .outcome import LEAVES_MORE, carried, judged, said
from .question import Prepared
from .renewal import Renewal
from .several import Rival, Several
from .ties import needs_impossible

PLAINLY = 0.05  # p of a set where one effect alone did not fit


def named_together(
    prepared: Prepared, alone: Diagnosis, more: Several, whole: HypothesisFit
) -> tuple[Diagnosis | None, str]:
    """The diagnosis with a set of effects named; or None, and why the set is not.

    Parameters
    ----------
    alone : of the effects that were tried alone
    whole : the set after its fit was renewed
    """
    lost = max(0.0, whole.neg2_log_evidence - more.hypothesis.neg2_log_evidence)
    notes = [_found(more)]
    for effect, gain, without in zip(more.own.effects, more.gains, more.without, strict=True):
        heard = held_out_evidence(prepared.problem, prepared.unseen, without, more.own, more.about)
        beside = f"{effect.name} beside {without.name}: {said(heard)}"
        if not carried(gain - lost, heard, more.due):
            return None, f"{_found(more)}; but data that no fit saw do not bear {beside}"
        notes.append(f"asked of {beside}")
    found = replace(
        alone, hypotheses=(whole, *alone.hypotheses), gains=more.gains, notes=tuple(notes),
        verdict=whole.verdict,
    )  # fmt: skip
    found = tested(found, prepared.problem)
    if found.found is None or not _fits_beyond(alone.adequacy, found.adequacy):
        return None, f"{_found(more)}; but {found.notes[-1]}"
    found = judged(prepared, found)
    if found.found is None:
        return None, f"{_found(more)}; but {found.notes[-1]}"
    return _with_rivals(found, more), ""


def largest_named(
    prepared: Prepared, alone: Diagnosis, sets: Sequence[Several],
    renew: Callable[[HypothesisFit], Renewal],
) -> tuple[Diagnosis | None, tuple[str, ...]]:  # fmt: skip
    """The diagnosis with the last of some sets named that may be, and reasons not to trust it.

    None where none may be, and what refused each.
    """
    refusals: list[str] = []
    for more in reversed(sets):
        whole = renew(more.hypothesis)
        found, why_not = named_together(prepared, alone, more, whole.hypothesis)
        if found is not None:
            notes = (*found.notes, whole.note, *perhaps_beside(more, alone.sets))
            return replace(found, notes=notes), whole.distrust
        refusals.append(why_not)
    return None, tuple(refusals)


def named_beside_more(
    prepared: Prepared, alone: Diagnosis, refused: Diagnosis,
    renew: Callable[[HypothesisFit], Renewal],
) -> tuple[Diagnosis, tuple[str, ...]]:  # fmt: skip
    """The diagnosis with effects beside a leader that is refused for what it leaves.

    Where several things are missing at once, each leaves what the others would explain. What was
    fitted may then bear an effect more by a good part of its price, if all that no fit saw speaks
    for it and all data together pay the whole: so much is asked of a name alone as well.

    Parameters
    ----------
    alone : with the leader named, as it was before it was judged
    refused : the same, judged
    """
    if refused.refused != f"it {LEAVES_MORE}":
        return refused, ()
    in_part = [s for s in alone.sets if not s.pay]
    found, said = largest_named(prepared, alone, in_part, renew)
    if found is not None:
        return found, said
    return replace(refused, notes=(*refused.notes, *said)), ()


def perhaps_beside(named: Several, sets: Sequence[Several]) -> tuple[str, ...]:
    """A sentence an effect that pays a part of its price beside those that are named."""
    known = {e.name for e in named.own.effects}
    part = {
        e.name: (gain, s.due)
        for s in sets
        for e, gain in zip(s.own.effects, s.gains, strict=True)
        if gain <= s.due and e.name not in known
    }
    return tuple(
        f"beside {named.own.name} {name} gains {gain:.0f} in -2 ln evidence of the {due:.0f} that "
        "are needed: it may be there as well"
        for name, (gain, due) in part.items()
    )


def _fits_beyond(alone: FitTest | None, together: FitTest | None) -> bool:
    """Whether a set fits where one effect alone did not: not just across the same limit.

    More parameters lower what is left of anything, so that p just above the limit says nothing.
    """
    if alone is None or together is None or alone.passes:
        return True
    return together.p >= PLAINLY


def _found(more: Several) -> str:
    """What was found together, and what each gains."""
    gains = ", ".join(
        f"{e.name} {g:.0f}" for e, g in zip(more.own.effects, more.gains, strict=True)
    )
    return (
        f"{more.own.name} explain the recording together; beside the others each gains in -2 ln "
        f"evidence: {gains} ({more.due:.0f} are needed)"
    )


def _with_rivals(found: Diagnosis, more: Several) -> Diagnosis:
    """The diagnosis with the families that would do in the place of one of the set."""
    for effect, rivals in zip(more.own.effects, more.rivals, strict=True):
        if rivals:
            return _tied(found, effect, rivals)
    return found


def _tied(found: Diagnosis, effect: Effect, rivals: tuple[Rival, ...]) -> Diagnosis:
    names = (effect.name, *(rival.name for rival in rivals))
    check = "; or ".join(c for c in (family(name).settled_by for name in names) if c)
    behind = ", ".join(f"{rival.name} by {rival.behind:.0f}" for rival in rivals)
    note = (
        f"beside the others {effect.name} is not told apart by these data; behind it in -2 ln "
        f"evidence: {behind}"
    )
    odd = [needs_impossible(r.name, r.implausible) for r in rivals if r.implausible]
    note = "; ".join([note, *odd])
    note = f"{note}; what would settle it: {check}" if check else note
    one_of = (*names, check) if check else names
    return replace(found, one_of=one_of, notes=(*found.notes, note))
