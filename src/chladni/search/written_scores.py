"""Q of states, and of decks as written: without mesh error, scatter or gain errors.

The response of a structure at its sensors comes from Rayleigh-Ritz on its own modes and static
responses.  The static loads are unit loads at sensors and shakers, as in the reduced model of a
diagnosis.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from ..dynamics.reduction import attachments, orthonormal, shifted
from ..effects.effect import ChannelChange, SpinTerm, Term, of
from ..ema.identification import Identified, equalised
from ..fem.modelled import Modelled
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.likelihood import LN10, Responses
from ..inference.pole_data import Poles
from ..reduced.gyroscopic import spin
from ..reduced.reduced_model import State
from ..reduced.reduced_problem import REACH
from .question import Prepared, Question


def written_Q(
    prepared: Prepared, model: Modelled, sets: tuple[np.ndarray, ...],
    real: np.ndarray | None = None, fault: HypothesisFit | None = None,
) -> tuple[float, ...]:  # fmt: skip
    """Q of a structure on each of these sets of samples; ``real`` poles alone are modes.

    Faults of channels among the named effects, ``fault``, are removed from the recording before it
    is compared, and spinning parts are added to the structure. Where the gain is unknown, the mean
    level over the fitted samples is removed as well.
    """
    f_max, terms = prepared.problem.setup.f_max, list[Term]()
    if fault is not None:
        terms = [t for effect in fault.effects for t in effect.terms(fault.fit.of(effect))]
    data, state = seen(prepared.question, prepared.score, model, f_max, of(SpinTerm, terms))
    if isinstance(data, Poles):
        return tuple(data.Q(state, use, real) for use in sets)
    n = len(data.a)
    offset = sum((change.value for change in of(ChannelChange, terms)), np.zeros(n, complex))
    offset = offset + gain_offset(prepared, data, replace(state, offset=offset))
    state = replace(state, offset=offset)
    return tuple(data.Q(state, use) for use in sets)


def equalised_deviation(
    question: Question, found: Identified, model: Modelled, s: np.ndarray
) -> np.ndarray:
    """δ (n_f, n_out, n_in) of a structure on equalised lines s, as every reported Q has it."""
    built = model.structure
    rows = question.outputs.rows(built), question.inputs.rows(built)
    data = Responses(
        equalised(found, s), s, *rows, np.ones((len(s), rows[0].shape[0]), bool), found.quantity,
        direct=question.outputs.moved_with_base(question.inputs),
    )  # fmt: skip
    compared, state = seen(question, data, model, float(s.imag.max()) / (2 * np.pi))
    assert isinstance(compared, Responses)
    delta = compared.deviation(state)
    return delta if question.gain_known else delta - delta.real.mean()


def gain_offset(prepared: Prepared, data: Responses, state: State) -> np.ndarray:
    """log10 of the unknown common gain of all channels (n_out,); zero where the gain is known."""
    none = np.zeros(len(data.a), complex)
    if prepared.question.gain_known:
        return none
    return none - data.deviation(state)[prepared.score.use].real.mean()


def seen(
    question: Question, score: Responses | Poles, model: Modelled, f_max: float,
    spinning: Sequence[SpinTerm] = (),
) -> tuple[Responses | Poles, State]:  # fmt: skip
    """The data with this structure's rows in its own modes, and the state of those modes."""
    built, modes = model.structure, model.up_to(REACH * f_max)
    basis = modes.shapes
    if isinstance(score, Poles):
        lam = (2 * np.pi * modes.frequency) ** 2
        if score.a is not None:
            score = replace(score, a=question.outputs.around(built) @ basis)
        if score.b is not None:
            score = replace(score, b=question.driven_around(built) @ basis)
        return score, _state(lam, np.eye(len(lam)))
    rows_o, rows_i = question.outputs.rows(built), question.inputs.loads(built)
    flexible = modes.frequency[modes.frequency > 0.02 * f_max]
    hertz = 0.5 * float(flexible[0]) if len(flexible) else 0.1 * f_max
    still = attachments(shifted(built.system, hertz), sp.csr_array(sp.vstack([rows_o, rows_i])))
    basis = orthonormal(built.system.M, [basis, still], kept=basis.shape[1])
    K, M = (basis.T @ (A @ basis) for A in (built.system.elastic, built.system.M))
    lam, phi = sl.eigh((K + K.T) / 2, (M + M.T) / 2)
    state = _state(lam, phi)
    if spinning:
        turns = (built.along(np.full(3, t.grid), np.eye(3), turning=True) for t in spinning)
        parts = zip(spinning, (rows @ basis @ phi for rows in turns), strict=True)
        state = replace(state, spin=spin([(t, slice(0, 0), own, {}) for t, own in parts]))
    return replace(score, a=rows_o @ basis, b=rows_i @ basis), state


def _state(lam: np.ndarray, phi: np.ndarray) -> State:
    return State(lam, phi, np.zeros((0, len(lam))), None, None, 0.0, np.zeros(0), None, None)


def noise_Q(prepared: Prepared, use: np.ndarray, real: np.ndarray | None = None) -> float | None:
    """Expected Q from the noise of the recording alone; None where it is unknown.

    For responses it holds to first order.  It fails where noise is as large as the response, above
    1/ln² 10, and is None there.
    """
    if isinstance(prepared.score, Poles):
        chosen = use if real is None else use & real
        variance = prepared.score.noise(chosen)
    else:
        assert prepared.noise is not None
        variance = prepared.noise[use]
    Q = float(variance.mean()) if variance.size else np.inf
    return Q if Q < LN10**-2 else None


def scores_of(
    prepared: Prepared, winner: HypothesisFit, fits: Sequence[HypothesisFit], held: np.ndarray
) -> list[list[float]]:
    """Q of some fits, one list for the fitted data and one for the held-out data ``held``."""
    real = real_poles(prepared, winner)
    return [
        [prepared.score.rebased(one.model).Q(one.fit.state, use, real) for one in fits]
        for use in (prepared.score.use, of_channels(prepared, winner, held))
    ]


def of_channels(prepared: Prepared, winner: HypothesisFit, held: np.ndarray) -> np.ndarray:
    """Held-out samples; for a fault of one channel, those of that channel alone."""
    if not winner.channels or held.ndim < 2:
        return held
    own = held & np.isin(prepared.problem.labels, winner.channels)
    return own if own.any() else held


def real_poles(prepared: Prepared, winner: HypothesisFit) -> np.ndarray | None:
    """Poles of the test that are modes (n,) bool: those listed, or with a partner in the winner."""
    if not isinstance(prepared.score, Poles):
        return None
    data = prepared.score.rebased(winner.model)
    if data.listed:
        return np.ones(len(data.frequency), bool)
    wide = replace(data, scale=max(3 * getattr(winner.fit.data, "scale", 0.01), 0.02))
    real = np.zeros(len(data.frequency), bool)
    real[wide.pairs(winner.fit.state, np.ones(len(real), bool))[0]] = True
    return real
