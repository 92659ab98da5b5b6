"""When two explanations are one answer, and which of the two is told."""

from collections.abc import Iterable

from .hypothesis_fit import HypothesisFit

TIED = 10.0  # in -2 ln evidence, e^5: odds up to which two explanations are one answer
FOOT = 0.01  # of the gain, a tenth of an effect in amplitude: what a simpler one may leave of it


def simplest_first(hypotheses: list[HypothesisFit], null: float) -> list[HypothesisFit]:
    """Best first, but for a leader that another close behind is to be preferred to.

    A lump on a spring that is tuned above all lines is a point mass: the simpler effect leads,
    unless the foot of a resonance that no line shows is more than a hundredth of what was gained.
    Where it may be tuned there, as well as it is known, the simpler leads that is as probable. A
    sealant as stiff as steel is no sealant: what has a value it can have leads.

    Parameters
    ----------
    null : -2 ln evidence without any of them
    """
    if not hypotheses:
        return hypotheses
    lead = hypotheses[0]
    at = lead.fit.of(lead.effect)
    simpler, odd = lead.effect.becomes(at), bool(lead.effect.implausible(at))
    perhaps = lead.effect.nearly(at, lead.fit.sd(lead.effect))
    foot = FOOT * (null - lead.neg2_log_evidence)
    for t in hypotheses[1:]:
        sound = not t.effect.implausible(t.fit.of(t.effect))
        behind = t.neg2_log_evidence - lead.neg2_log_evidence
        near = behind < TIED and ((odd and sound) or t.effect.name == perhaps)
        if near or (t.effect.name == simpler and behind < max(TIED, foot)):
            return [t, *(other for other in hypotheses if other is not t)]
    return hypotheses


def needs_impossible(name: str, why: str) -> str:
    """That an explanation is told apart by physics, where data do not."""
    return f"{name} would need a value it cannot have: {why}"


def same(hypothesis: HypothesisFit, name: str) -> bool:
    """Whether an explanation, as it was fitted or within its intervals, is a simpler one's."""
    effect, fit = hypothesis.effect, hypothesis.fit
    x = fit.of(effect)
    return name in (effect.becomes(x), effect.nearly(x, fit.sd(effect)))


def tied(best: HypothesisFit, hypotheses: Iterable[HypothesisFit]) -> dict[str, float]:
    """Names of what explains the data as well, its own first, and ln odds against each.

    What as it was fitted is another name for the best, or may be, is none of them. What the best is
    somewhere in its intervals is one, whatever the odds: a point mass on a tailgate (tuning 561)
    was called a resonator of 253 Hz, 74 to 862.
    """
    behind = {
        t.effect.name: (t.neg2_log_evidence - best.neg2_log_evidence) / 2
        for t in hypotheses
        if not same(t, best.effect.name)
    }
    also = best.effect.nearly(best.fit.of(best.effect), best.fit.sd(best.effect))
    return {name: gap for name, gap in behind.items() if 2 * gap < TIED or name == also}
