"""What is the answer where the leader is refused: a rival that nothing refuses.

Evidence of the fitted data puts explanations in an order; data that no fit saw, what an explanation
leaves and how modes are damped refuse some. What comes behind one that was refused is asked the
same, for it may be what is missing, and the leader another name for it that fits a little better
for the wrong reason. Yet a leader that is far ahead refutes its rivals as it refutes calibration
alone: it found what they do not explain.
"""

from collections.abc import Callable
from dataclasses import replace

from ..errors import ModelError
from .diagnosis import UNEXPLAINED, Diagnosis, tested
from .held_out_evidence import HeldOutEvidence
from .hypothesis_fit import HypothesisFit, UpdatingProblem
from .likelihood import Poles, Responses
from .lossy_place import heard_of_damping
from .outcome import CONFLICT, judged
from .question import Prepared
from .renewal import Renewal
from .search_round import taken


def heard_of_rivals(
    prepared: Prepared, refused: Diagnosis, renew: Callable[[HypothesisFit], Renewal]
) -> tuple[Diagnosis, tuple[str, ...]]:
    """The diagnosis with the first rival named that nothing refuses, and reasons not to trust it.

    As it was, with what refused them, where every rival in the running is refused as well.

    Parameters
    ----------
    refused : the diagnosis, its leader refused by what it leaves or by data that no fit saw
    renew : a hypothesis on a reduced model that bears it
    """
    lead, *rivals = refused.hypotheses
    ahead = refused.two_log_bayes_factor(lead)
    over: tuple[tuple[str, str], ...] = ((lead.effect.name, refused.refused),)
    for rival in rivals:
        gain = refused.two_log_bayes_factor(rival)
        if gain <= refused.due or ahead - gain > CONFLICT * refused.due:
            break
        try:
            whole = renew(_on_its_own_basis(prepared.problem, refused, rival))
        except ModelError as error:
            over = (*over, (rival.effect.name, f"it could not be fitted again: {error}"))
            continue
        asked = tested(_led_by(refused, whole, over), prepared.problem)
        if asked.found is not None:
            asked = judged(prepared, asked)
        why = asked.refused or _against(refused, asked, prepared.problem)
        if not why:
            return asked, whole.distrust
        over = (*over, (rival.effect.name, why))
    return replace(refused, passed_over=over), ()


def _on_its_own_basis(
    problem: UpdatingProblem, refused: Diagnosis, rival: HypothesisFit
) -> HypothesisFit:
    """A rival fitted again from where it was: a diagnosis keeps the model of its leader alone."""
    null = refused.null.data
    assert isinstance(null, (Responses, Poles))
    problem = replace(problem, data=null.over(problem.reduced.model))
    base = taken(problem, rival, ("ordinary", "nuisance"))
    return problem.fitted_with(rival.effect, rival.fit.of(rival.effect), base)


def _against(refused: Diagnosis, asked: Diagnosis, problem: UpdatingProblem) -> str:
    """What refutes a rival that is refused by nothing itself, in words; nothing where nothing does.

    Damping that follows what the leader changes refutes what does not dissipate itself.
    """
    lead, (rival, *_) = refused.hypotheses[0], asked.hypotheses
    if refuted(refused, lead, asked):
        return f"{lead.name}, which is refused itself, explains far more than it does"
    damping = problem.damping
    if asked.adequacy is None or damping is None:
        return ""
    test = heard_of_damping(asked.adequacy, lead, damping.beyond(rival.fit.state))
    return "" if test.passes else test.what


def refuted(refused: Diagnosis, lead: HypothesisFit, asked: Diagnosis) -> bool:
    """Whether a leader that was refused refutes a rival, of what was fitted and what was held out.

    By the gain due, as calibration alone is refuted; by twice that of what was fitted it is not
    even asked.
    """
    leads, follows = (refused.two_log_bayes_factor(t) for t in (lead, asked.hypotheses[0]))
    return leads + _news(refused.heard) - follows - _news(asked.heard) > refused.due


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
