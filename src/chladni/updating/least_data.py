"""How much data a name needs: below it the answer is a list of what cannot be told apart.

E, rho and t are three unknowns; an effect brings up to three (strength and place); two numbers more
must be able to contradict it. A mode gives its frequency and, with responses in absolute scale, one
number more for every channel.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .diagnosis import Diagnosis
from .hypothesis_fit import HypothesisFit
from .question import Prepared

NUMBERS = 8  # 3 + 3 + 2, see above
MODES = 3  # of one mode a shift can be mass or stiffness; of two any place can be made to fit
NOT_BEHIND = 0.0  # an effect that gains less than this over calibration alone explains nothing


def too_little(modes: int, channels: int) -> str:
    """Why nothing can be named from so many modes, each seen by so many fitted channels; or "".

    Channels are 0 where natural frequencies alone are compared.
    """
    numbers = modes * (1 + channels)
    if modes >= MODES and numbers >= NUMBERS:
        return ""
    seen = f" on {channels} channel{'s' * (channels != 1)}" if channels else ""
    due = max(MODES, int(np.ceil(NUMBERS / (1 + channels))))
    return (
        f"{modes} mode{'s' * (modes != 1)}{seen} cannot bear a name: {due} modes are the least, "
        "for three ordinary numbers, an effect of three and two that can contradict it"
    )


def withheld(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis without a name, where the data cannot bear one."""
    if not prepared.too_little:
        return diagnosis
    one_of = tuple(t.effect.name for t in _in_question(diagnosis, diagnosis.hypotheses))
    note = (
        f"{prepared.too_little}; these explain the data and cannot be told apart by them: "
        f"{', '.join(('calibration alone', *one_of))}; more modes, or more sensors of known gain, "
        "would separate them"
    )
    return replace(
        diagnosis, verdict="not in catalogue", notes=(*diagnosis.notes, note), written=None,
        one_of=("calibration alone", *one_of), sets=(), refused=prepared.too_little,
    )  # fmt: skip


def _in_question(diagnosis: Diagnosis, hypotheses: Sequence[HypothesisFit]) -> list[HypothesisFit]:
    return [t for t in hypotheses if diagnosis.two_log_bayes_factor(t) > NOT_BEHIND]
