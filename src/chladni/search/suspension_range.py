"""The range of a recording in which a free article moves on its suspension."""

import numpy as np

from ..fem.modelled import Modelled
from ..inference.channel_screening import FAR_BELOW, first_elastic
from .question import Question


def suspended_below(
    question: Question, nominal: Modelled, frequency: np.ndarray, high: float
) -> float:
    """Frequency between the modes on a suspension and those of a free deck [Hz]; 0 without both.

    The deck holds neither the cords nor, without hangers, their places. Its responses follow the
    test from halfway (in the logarithm) to the first elastic mode on.

    Parameters
    ----------
    frequency : of the modes of the test [Hz]
    """
    first = 0.0 if question.hangers or question.base is not None else first_elastic(nominal.modes)
    slow = frequency[frequency < first / FAR_BELOW]
    if not len(slow) or first > high:
        return 0.0
    return float(
        np.sqrt(slow.max() * min(first, frequency[frequency > slow.max()].min(initial=first)))
    )


def suspension_note(above: float) -> list[str]:
    """Sentence on the range that is left out, where there is one."""
    return (
        [
            "the deck is free and names no hangers, and the test has modes far below the first "
            f"elastic one: they are those of a suspension, so that the range below {above:.3g} Hz "
            "is not compared"
        ]
        if above
        else []
    )
