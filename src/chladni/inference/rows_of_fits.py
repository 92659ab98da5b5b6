"""Fitted hypotheses in the form that a decision reads."""

from collections.abc import Sequence

from ..decision.hypotheses import Explanation, Numbers
from ..decision.tied import leading
from ..effects.effect import Effect
from .hypothesis_fit import HypothesisFit
from .implausible_values import strained


def hypothesis_of(fitted: HypothesisFit, numbers: Numbers | None = None) -> Explanation:
    """A fitted hypothesis as a decision reads it; calibration alone has no names."""
    effect, fit = fitted.effect, fitted.fit
    if type(effect) is Effect:
        return Explanation((), fitted.neg2_log_evidence, numbers, strained=bool(strained(fit)))
    known = effect.remarks(fit.of(effect), fit.sd(effect))
    return Explanation(
        tuple(e.name for e in fitted.effects),
        fitted.neg2_log_evidence,
        numbers,
        physics=fitted.physics,
        channels=bool(fitted.channels),
        in_deck=any(e.traits.writable for e in fitted.effects),
        expected=effect.expected,
        becomes=known.becomes,
        nearly=known.nearly,
        sound=not known.implausible,
        strained=bool(strained(fit)),
    )


def simplest_first(hypotheses: Sequence[HypothesisFit], null: float) -> list[HypothesisFit]:
    """Sort hypotheses best first; a preferred one close behind the leader takes its place.

    Parameters
    ----------
    null : -2 ln evidence without any of them
    """
    if not hypotheses:
        return []
    k = leading([hypothesis_of(t) for t in hypotheses], null)
    return [hypotheses[k], *hypotheses[:k], *hypotheses[k + 1 :]]
