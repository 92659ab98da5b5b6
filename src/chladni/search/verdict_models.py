"""The structures that a verdict speaks of, and how well they agree with the recording."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.pole_data import Poles
from ..inference.written_hypothesis import as_foretold, as_written
from ..model.assembly import Assembly
from ..reduced.reduced_model import State, evaluate
from .diagnosis import Diagnosis
from .question import Prepared, Question


@dataclass(frozen=True, eq=False)
class Models:
    """The structure as the deck has it, calibrated without new physics, and with the effect."""

    nominal: Assembly
    calibrated: Assembly
    final: Assembly


def models(question: Question, diagnosis: Diagnosis) -> Models:
    """The assemblies of all stages of a diagnosis."""
    found = diagnosis.found
    nothing = diagnosis.verdict == "nothing missing"
    calibrated = question.assembly if nothing else applied(question.assembly, diagnosis.plain)
    if found is None or not found.physics:
        return Models(question.assembly, calibrated, calibrated)
    return Models(
        question.assembly, calibrated, applied(question.assembly, diagnosis.as_deck or found)
    )


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


@dataclass(frozen=True, eq=False)
class FittedScores:
    """Q of the fits: all include mesh error and an unknown gain, the last also scatter.

    The deck of natural frequencies is fitted without a mesh error: it has only the last.
    """

    calibrated: float | None
    effect: float | None
    scatter: float


def fitted_scores(prepared: Prepared, diagnosis: Diagnosis) -> tuple[FittedScores, FittedScores]:
    """Q on the fitted data and on the held-out data."""
    winner = diagnosis.found or diagnosis.null
    stages, reported = _states(prepared.problem, diagnosis, winner), prepared.held.reporting
    both = [FittedScores(*Q) for Q in scores_of(prepared, winner, stages, reported)]
    if isinstance(prepared.score, Poles):
        both = [replace(Q, calibrated=None, effect=None) for Q in both]
    first, second = both
    return first, second


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


def with_deck(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with the values of the updated deck, where it names an effect of its own."""
    found = diagnosis.found
    if found is None or diagnosis.shared:
        return diagnosis
    mass = prepared.problem.mass_measurement
    return replace(diagnosis, deck=as_foretold(found, mass, prepared.unseen.whole))


def real_poles(prepared: Prepared, winner: HypothesisFit) -> np.ndarray | None:
    """Poles of the test with a partner in the winning model (n,) bool; the rest are spurious."""
    if not isinstance(prepared.score, Poles):
        return None
    data = prepared.score.rebased(winner.model)
    fitted = winner.fit.data
    wide = Poles(**{**vars(data), "scale": max(3 * getattr(fitted, "scale", 0.01), 0.02)})
    real = np.zeros(len(data.frequency), bool)
    real[wide.pairs(winner.fit.state, np.ones(len(real), bool))[0]] = True
    return real


def _as_given(problem: UpdatingProblem, null: HypothesisFit) -> State:
    """The state with the deck's own values, mesh error and gain as fitted, and no scatter."""
    return evaluate(null.model, problem.base, given(problem, null), False)


def given(problem: UpdatingProblem, null: HypothesisFit) -> np.ndarray:
    """Base parameters x with the deck's own values, mesh error and gain as fitted, no scatter."""
    x, at = problem.mean(), 0
    for e in problem.base:
        n = len(e.parameters)
        if e.kind == "calibration":
            x[at : at + n] = [p.nominal for p in e.parameters]
        elif e.traits.writable:
            x[at : at + n] = null.fit.of(e)
        at += n
    return x


def _states(
    problem: UpdatingProblem, diagnosis: Diagnosis, winner: HypothesisFit
) -> list[tuple[HypothesisFit, State]]:
    """The calibrated deck, the updated deck, and the last fit with all its nuisances."""
    null, plain = diagnosis.null, diagnosis.plain
    if diagnosis.verdict == "nothing missing":
        nominal = _as_given(problem, null)
        return [(null, nominal), (null, nominal), (null, null.fit.state)]
    if diagnosis.found is None:
        state = plain.fit.state
        return [(plain, state), (plain, state), (null, null.fit.state)]
    final = diagnosis.written or as_written(winner, problem.mass_measurement)
    return [
        (plain, plain.fit.state), (winner, final.fit.state), (winner, winner.fit.state)
    ]  # fmt: skip
