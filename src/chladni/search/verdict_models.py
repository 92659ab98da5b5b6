"""The structures that a verdict speaks of, and how well they agree with the recording."""

from collections.abc import Sequence

import numpy as np

from ..effects.effect import Effect
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.pole_data import Poles
from ..model.assembly import Assembly
from ..reduced.reduced_model import State
from .diagnosis import Diagnosis
from .question import Prepared, Question


def assemblies(question: Question, diagnosis: Diagnosis) -> tuple[Assembly, Assembly]:
    """The structure calibrated without new physics, and with the effect: one if none is named."""
    found = diagnosis.found
    nothing = diagnosis.verdict == "nothing missing"
    calibrated = question.assembly if nothing else applied(question.assembly, diagnosis.plain)
    if found is None or not found.physics:
        return calibrated, calibrated
    return calibrated, applied(question.assembly, diagnosis.as_deck or found)


def applied(assembly: Assembly, hypothesis: HypothesisFit) -> Assembly:
    """The assembly with the calibrated parameters and the effects of a hypothesis in it.

    Effects that change the material of a part come before effects that divide the part.
    """

    def turn(effect: Effect) -> int:
        if effect not in hypothesis.effects:
            return 0
        return 1 if effect.traits.remakes_structure else 2

    for effect in sorted(hypothesis.fit.effects, key=turn):
        assembly = effect.apply(assembly, hypothesis.fit.of(effect))
    return assembly


def scores_of(
    prepared: Prepared, winner: HypothesisFit, stages: Sequence[tuple[HypothesisFit, State]],
    held: np.ndarray,
) -> list[list[float]]:  # fmt: skip
    """Q of some states, one list for the fitted data and one for the held-out data ``held``."""
    real = real_poles(prepared, winner)
    return [
        [prepared.score.rebased(fit.model).Q(state, use, real) for fit, state in stages]
        for use in (prepared.score.use, of_channels(prepared, winner, held))
    ]


def of_channels(prepared: Prepared, winner: HypothesisFit, held: np.ndarray) -> np.ndarray:
    """Held-out samples; for a fault of one channel, those of that channel alone."""
    if not winner.channels or held.ndim < 2:
        return held
    mine = np.isin(prepared.problem.labels, winner.channels)
    own = held & mine
    return own if own.any() else held


def real_poles(prepared: Prepared, winner: HypothesisFit) -> np.ndarray | None:
    """Poles of the test that are modes (n,) bool: those listed, or with a partner in the winner."""
    if not isinstance(prepared.score, Poles):
        return None
    data = prepared.score.rebased(winner.model)
    if data.listed:
        return np.ones(len(data.frequency), bool)
    fitted = winner.fit.data
    wide = Poles(**{**vars(data), "scale": max(3 * getattr(fitted, "scale", 0.01), 0.02)})
    real = np.zeros(len(data.frequency), bool)
    real[wide.pairs(winner.fit.state, np.ones(len(real), bool))[0]] = True
    return real
