"""The diagnosis that follows from a decision, and the explanations that it leaves open."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..inference.hypothesis_fit import HypothesisFit
from .decide import Decision
from .decision_in_words import BEYOND, imitated, refusal, settled_by
from .diagnosis import Diagnosis
from .hypotheses import ALONE, Hypotheses

NAMED = ("missing physics", "calibration only", "nothing missing")  # by one explanation
MOST_OPEN = 3  # effects whose further measurements are forecast


def concluded(case: Hypotheses, decision: Decision) -> tuple[Diagnosis, tuple[str, ...]]:
    """The diagnosis that follows from a decision, and reasons not to trust it."""
    found, tested, lead = case.found, decision.tested, next(iter(decision.order), None)
    settled = settled_by(decision.one_of) if decision.named else ""
    said = replace(
        found, verdict=decision.verdict, notes=(*found.notes, *decision.sentences),
        hypotheses=tuple(h.fit for h in decision.order),
        adequacy=None if tested is None else tested.chances.test,
        one_of=(*decision.one_of, settled) if settled else decision.one_of,
        refused=refusal(case, lead, decision.reason) if lead and decision.refused else "",
        passed_over=tuple((h.name, refusal(case, h, why)) for h, why in decision.passed_over),
    )  # fmt: skip
    if lead is None or not decision.named:
        return said, tuple(_doubts(case, decision))
    gains = lead.together.gains if lead.together else ()
    fits = (lead.own, *said.hypotheses[1:])
    said = replace(said, hypotheses=fits, written=lead.written, halved=lead.halved, gains=gains)
    return said, lead.distrust


def _doubts(case: Hypotheses, decision: Decision) -> Iterator[str]:
    if not decision.refused or decision.news is None or not decision.one_of:
        return
    lead = decision.order[0]
    gain = case.gain(lead) + decision.news
    if gain > decision.due:
        yield imitated(case, lead, decision.reason, gain)


def open_explanations(
    case: Hypotheses, decision: Decision, found: Diagnosis
) -> tuple[list[HypothesisFit], list[str], np.ndarray]:
    """Explanations that the data cannot separate, or the only one: fits, names, probabilities.

    The probabilities are even.  Empty where no explanation stands.
    Calibration with its errors of form stands for what the catalogue lacks as well.
    """
    listed = [h for h in decision.order if h.name in decision.one_of][:MOST_OPEN]
    names = [h.name for h in listed]
    if other := [name for name in (ALONE, BEYOND) if name in decision.one_of]:
        listed, names = [*listed, case.null], [*names, " or ".join(other)]
    if len(listed) < 2:
        if found.verdict not in NAMED or decision.one_of:
            return [], [], np.zeros(0)
        one = found.found or found.null
        return [one], [one.name], np.ones(1)
    return [h.whole for h in listed], names, np.full(len(listed), 1 / len(listed))
