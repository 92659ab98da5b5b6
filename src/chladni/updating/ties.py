"""When two explanations are one answer, and which of the two is told."""

from .hypothesis_fit import HypothesisFit

TIED = 10.0  # in -2 ln evidence, e^5: odds up to which two explanations are one answer


def simplest_first(hypotheses: list[HypothesisFit]) -> list[HypothesisFit]:
    """Best first, but for a leader that another close behind is to be preferred to.

    A lump on a spring that is tuned above all lines is a point mass: the simpler effect leads. A
    sealant as stiff as steel is no sealant: what has a value it can have leads.
    """
    if not hypotheses:
        return hypotheses
    lead = hypotheses[0]
    at = lead.fit.of(lead.effect)
    simpler, odd = lead.effect.becomes(at), bool(lead.effect.implausible(at))
    for t in hypotheses[1:]:
        sound = not t.effect.implausible(t.fit.of(t.effect))
        preferred = t.effect.name == simpler or (odd and sound)
        if preferred and t.neg2_log_evidence < lead.neg2_log_evidence + TIED:
            return [t, *(other for other in hypotheses if other is not t)]
    return hypotheses
