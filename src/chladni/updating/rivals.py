"""What is the answer where the leader is refused: a rival that nothing refuses.

Evidence of the fitted data puts explanations in an order; data that no fit saw, what an explanation
leaves and how modes are damped refuse some. What comes behind one that was refused is asked the
same, for it may be what is missing, and the leader another name for it that fits a little better
for the wrong reason. Yet a leader that is far ahead refutes its rivals as it refutes calibration
alone: it found what they do not explain.
"""

from collections.abc import Callable
from dataclasses import replace

from .diagnosis import UNEXPLAINED, Diagnosis, tested
from .held_out_evidence import HeldOutEvidence
from .hypothesis_fit import HypothesisFit
from .outcome import CONFLICT, judged
from .question import Prepared
from .renewal import Renewal


def rival_named(
    prepared: Prepared, refused: Diagnosis, renew: Callable[[HypothesisFit], Renewal]
) -> tuple[Diagnosis | None, tuple[str, ...]]:
    """The diagnosis with the first rival named that nothing refuses, and reasons not to trust it.

    None where the leader is not refused, or every rival in the running is.

    Parameters
    ----------
    refused : the diagnosis, its leader refused by what it leaves or by data that no fit saw
    renew : a hypothesis on a reduced model that bears it
    """
    if refused.found is not None or not refused.refused or prepared.too_little:
        return None, ()
    lead, *rivals = refused.hypotheses
    over: tuple[tuple[str, str], ...] = ((lead.effect.name, refused.refused),)
    for rival in rivals:
        if refused.two_log_bayes_factor(rival) <= refused.due:
            break
        whole = renew(rival)
        asked = tested(_led_by(refused, whole, over), prepared.problem)
        if asked.found is not None:
            asked = judged(prepared, asked)
        if asked.found is not None and not refuted(refused, lead, asked):
            return asked, whole.distrust
        over = (*over, (rival.effect.name, asked.refused))
    return None, ()


def refuted(refused: Diagnosis, lead: HypothesisFit, asked: Diagnosis) -> bool:
    """Whether a leader that was refused is so far ahead that its rival does not explain the data.

    By twice the gain due on what was fitted, or by the gain due with what was held out: as
    calibration alone is refuted.
    """
    ahead = asked.hypotheses[0].neg2_log_evidence - lead.neg2_log_evidence
    together = ahead + _news(refused.heard) - _news(asked.heard)
    return ahead > CONFLICT * refused.due or together > refused.due


def _news(heard: HeldOutEvidence | None) -> float:
    return 0.0 if heard is None else heard.held_out or 0.0


def _led_by(refused: Diagnosis, whole: Renewal, over: tuple[tuple[str, str], ...]) -> Diagnosis:
    """The diagnosis as it is with a rival in front of those that were passed over."""
    rival = whole.hypothesis
    others = (t for t in refused.hypotheses if t.effect.name != rival.effect.name)
    note = f"{over[-1][0]} is not the answer, for {over[-1][1]}; {rival.name} is asked next"
    return replace(
        refused, hypotheses=(rival, *others), passed_over=over, refused="", adequacy=None,
        heard=None, written=None, one_of=(), verdict=rival.verdict,
        notes=(*(n.removesuffix(UNEXPLAINED) for n in refused.notes), note, whole.note),
    )  # fmt: skip
