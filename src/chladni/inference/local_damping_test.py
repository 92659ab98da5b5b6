"""Tests of whether a named effect also dissipates, or is damping itself.

A crack, a missing weld, a soft patch or a spring to ground changes stiffness alone.  A joint that
slips or a viscous layer is compliant at the same place, foam or rubber is stiff there, and all of
these dissipate.  The damping ratio of a mode grows by half the loss factor times its share of the
strain energy there.  Its eigenvalue moves by the same share (Ungar and Kerwin 1962, J. Acoust. Soc.
Am. 34, 954-957).  So an elastic effect is not the full explanation where the modes that it changes
most are also damped most, beyond the scatter of damping.

A dashpot in one place makes modes complex by a symmetric coupling, a spinning part by a skew one.
"""

import numpy as np

from ..effects.effect import SpinTerm, of
from ..reduced.reduced_model import evaluate
from .adequacy import FitTest
from .damping_scatter import FEWEST, ModalDamping
from .hypothesis_fit import HypothesisFit, UpdatingProblem
from .likelihood import Responses
from .scan import baseline, dashpot_scores, spin_scores

NEAR_MODE = (
    0.05  # largest relative distance of natural frequencies between a pole and its model mode
)


def damping_test_along_effect(
    test: FitTest, hypothesis: HypothesisFit, damping: ModalDamping | None
) -> FitTest:
    """The given test, or the test of damping along the effect where its p-value is smaller."""
    elastic = [e.name for e in hypothesis.effects if e.traits.elastic]
    if damping is None or not elastic:
        return test
    lowest = float(damping.frequency.min(initial=np.inf))
    frequency, shift = shifted(hypothesis, (1 - NEAR_MODE) * lowest)
    off = np.abs(frequency / damping.frequency[:, None] - 1)
    own = off.min(axis=1, initial=np.inf) < NEAR_MODE
    if own.sum() < FEWEST:
        return test
    near = shift[off[own].argmin(axis=1)]
    gives = "is compliant and dissipates, as a slipping joint or a viscous layer"
    holds = "is stiff and dissipates, as foam or rubber"
    what = (
        f"the modes that {' and '.join(elastic)} changes most have the highest damping: the "
        f"material or joint there {gives if near.sum() > 0 else holds}; a recording at another "
        "level of excitation would distinguish them"
    )
    p, row = damping.of(own).following(np.abs(near))
    return test.or_less_likely(p, row, what=what, where=hypothesis.effect.text)


def damping_instead_of_spin(
    test: FitTest, hypothesis: HypothesisFit, problem: UpdatingProblem
) -> FitTest:
    """The given test, or that a dashpot explains less than a spinning part, if it is less likely.

    Both are linear about the fit without spin, each at its best place. If a part spins, the odds of
    a dashpot exceed B with a probability of 1/B at most (Markov).
    """
    fit, data, model = hypothesis.fit, hypothesis.data, hypothesis.model
    if fit.state.spin is None or not isinstance(data, Responses):
        return test
    spinning = [e for e in fit.effects if of(SpinTerm, e.terms(fit.of(e)))]
    rest = [e for e in fit.effects if e not in spinning]
    x, where = np.concatenate([fit.of(e) for e in rest]), problem.where
    about = baseline(model, rest, data, problem.mass_measurement, x)
    rows, sd = where.rotations(where.places.grids), spinning[0].parameters[0].scale
    damped = dashpot_scores(about, model, data, where.places)
    ahead = float(spin_scores(about, model, data, rows, sd)[1].min() - damped.min())
    p = float(np.exp(-max(ahead, 0.0) / 2))
    return test.or_less_likely(
        p, step="" if problem.coupling is None else problem.coupling.step,
        what="damping in one place explains the responses better than a part that spins",
        where=f"near grid {where.places.grids[int(damped.argmin())]}", modes_hz=(),
    )  # fmt: skip


def shifted(hypothesis: HypothesisFit, above: float) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] above a limit (m,), and the relative change of λ without the effect.

    The change is φᵀK₀φ / φᵀM₀φ / λ - 1 with the modes φ as fitted, K₀ and M₀ without the effect. It
    is positive where the effect softens the mode, negative where it stiffens it.
    """
    fit = hypothesis.fit
    kept = [
        (e, fit.of(e)) for e in fit.effects if e not in hypothesis.effects or not e.traits.elastic
    ]
    x = np.concatenate([np.zeros(0), *(own for _, own in kept)])
    idle, state = evaluate(hypothesis.model, [e for e, _ in kept], x, False), fit.state
    frequency = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    seen = frequency > above
    T = np.linalg.solve(idle.vectors, state.vectors[:, seen])
    energy, mass = idle.lam @ T**2, (T**2).sum(axis=0)
    return frequency[seen], energy / mass / state.lam[seen] - 1
