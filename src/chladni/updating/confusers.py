"""Effects that the data cannot tell apart, and the measurement that would."""

from dataclasses import replace

from ..effects.registry import family
from ..ema.odds import evidence_in_words
from .diagnosis import Diagnosis
from .leaning import strained
from .outcome import BEYOND, TOO_LITTLE
from .ties import TIED, needs_impossible, tied


def with_doubt(diagnosis: Diagnosis) -> Diagnosis:
    """A calibration with what explains the data clearly better, if not by enough to be named.

    That no physics is missing is a claim as well: where an effect leads by more than what is told
    apart, and no data that were not fitted have refused it, the answer is one of both.  So it is
    where calibration strains a family of joints that stays as it is with the effect.  Where
    calibration alone does not fit at all, it is that effect or what the catalogue does not hold.
    """
    plainly, heard = diagnosis.verdict in ("nothing missing", "calibration only"), diagnosis.heard
    against = heard is not None and not all(g > 0 for g in heard.votes.values())
    unfit = not plainly and diagnosis.refused == f"it {TOO_LITTLE}"
    if not (plainly or unfit) or not diagnosis.hypotheses or against:
        return diagnosis
    lead = diagnosis.hypotheses[0]
    gain = diagnosis.two_log_bayes_factor(lead)
    relieved = bool(strained(diagnosis.null.fit)) and not strained(lead.fit)
    least = 0.0 if relieved else TIED
    if gain <= least:
        return diagnosis
    least = max(least, gain - TIED)
    near = [t for t in diagnosis.hypotheses if diagnosis.two_log_bayes_factor(t) > least]
    names = tuple(t.effect.name for t in near if not (relieved and strained(t.fit)))
    note = (
        f"{lead.effect.name} explains the recording better than calibration alone, by {gain:.1f} "
        f"in -2 ln evidence, of which {diagnosis.due:.0f} are needed to name it: neither is certain"
    )
    if check := family(lead.effect.name).settled_by:
        note = f"{note}; what would settle it: {check}"
    notes = (*diagnosis.notes, note)
    one_of = (*names, BEYOND) if unfit else ("calibration alone", *names)
    return replace(diagnosis, one_of=one_of, notes=notes)


def with_confusers(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with what explains the data as well as the named effect, if anything does."""
    best, over = diagnosis.found, dict(diagnosis.passed_over)
    if best is None:
        return diagnosis
    behind = tied(best, (t for t in diagnosis.hypotheses if t.effect.name not in over))
    names = tuple(behind)
    if len(names) < 2:
        return diagnosis
    check = "; or ".join(c for c in (family(name).settled_by for name in names) if c)
    odds = "; ".join(f"{evidence_in_words(behind[name])} against {name}" for name in names[1:])
    note = f"{best.effect.name} is not told apart by these data: {odds}"
    odd = [
        needs_impossible(t.effect.name, why)
        for t in diagnosis.hypotheses
        if t.effect.name in names and (why := t.effect.implausible(t.fit.of(t.effect)))
    ]
    note = "; ".join([note, *odd])
    if not check:
        return replace(diagnosis, one_of=names, notes=(*diagnosis.notes, note))
    note = f"{note}; what would settle it: {check}"
    return replace(diagnosis, one_of=(*names, check), notes=(*diagnosis.notes, note))
