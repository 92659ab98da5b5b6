"""Rows of numbers and flags that a decision reads from fitted hypotheses."""

from collections.abc import Sequence

from ..decision.hypothesis_table import NULL, Row
from ..decision.tied import leading
from .hypothesis_fit import HypothesisFit
from .implausible_values import strained


def row_of(hypothesis: HypothesisFit, key: str = "") -> Row:
    """A hypothesis as a row; its key is the name of its effect unless one is given."""
    effect, fit = hypothesis.effect, hypothesis.fit
    known = effect.remarks(fit.of(effect), fit.sd(effect))
    return Row(
        key or effect.name,
        tuple(e.name for e in hypothesis.effects),
        hypothesis.neg2_log_evidence,
        physics=hypothesis.physics,
        channels=bool(hypothesis.channels),
        expected=effect.expected,
        becomes=known.becomes,
        nearly=known.nearly,
        sound=not known.implausible,
        strained=bool(strained(fit)),
    )


def row_of_null(null: HypothesisFit) -> Row:
    """Calibration alone."""
    return Row(NULL, (), null.neg2_log_evidence, strained=bool(strained(null.fit)))


def simplest_first(hypotheses: Sequence[HypothesisFit], null: float) -> list[HypothesisFit]:
    """Sort hypotheses best first; a preferred one close behind the leader takes its place.

    Parameters
    ----------
    null : -2 ln evidence without any of them
    """
    if not hypotheses:
        return []
    k = leading([row_of(t) for t in hypotheses], null)
    return [hypotheses[k], *hypotheses[:k], *hypotheses[k + 1 :]]
