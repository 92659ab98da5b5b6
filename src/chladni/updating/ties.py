"""When two explanations are one answer, and which of the two is told."""

from .hypothesis_fit import HypothesisFit

TIED = 10.0  # in -2 ln evidence, e^5: odds up to which two explanations are one answer


def simplest_first(hypotheses: list[HypothesisFit]) -> list[HypothesisFit]:
    """Best first, but for a leader that has become a simpler effect close behind: that one leads.

    A lump on a spring that is tuned above all lines is a point mass.
    """
    if not hypotheses:
        return hypotheses
    lead = hypotheses[0]
    simpler = lead.effect.becomes(lead.fit.of(lead.effect))
    for t in hypotheses:
        if t.effect.name == simpler and t.neg2_log_evidence < lead.neg2_log_evidence + TIED:
            return [t, *(other for other in hypotheses if other is not t)]
    return hypotheses
