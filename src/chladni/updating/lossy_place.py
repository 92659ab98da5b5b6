"""Whether what was named only gives, or dissipates as well.

A crack, a missing weld or a soft patch changes stiffness alone.  A joint that slips or a viscous
layer gives at the same place, and there it dissipates: the damping ratio of a mode grows by half
the loss factor times its share of the strain energy there, the very share by which its eigenvalue
falls (Ungar and Kerwin 1962, J. Acoust. Soc. Am. 34, 954-957).  So where the modes that the named
effect changes most are also damped most, beyond how damping scatters, it is not the whole truth.
"""

from dataclasses import replace

import numpy as np

from .adequacy import LEAST, FitTest
from .damping_scatter import FEWEST, ModalDamping
from .hypothesis_fit import HypothesisFit
from .reduced_model import evaluate, slices

NEAR = 0.05  # relative distance of natural frequencies beyond which a pole is none of the model's


def heard_of_damping(
    test: FitTest, hypothesis: HypothesisFit, damping: ModalDamping | None
) -> FitTest:
    """The test, or that of damping following the effect where it is the less likely of the two."""
    elastic = [e.name for e in hypothesis.effects if e.elastic]
    if damping is None or not elastic:
        return test
    lowest = float(damping.frequency.min(initial=np.inf))
    frequency, share = softened(hypothesis, (1 - NEAR) * lowest)
    off = np.abs(frequency / damping.frequency[:, None] - 1)
    own = off.min(axis=1, initial=np.inf) < NEAR
    if own.sum() < FEWEST:
        return test
    kept = damping.of(own)
    p, row = kept.following(share[off[own].argmin(axis=1)])
    test = replace(test, statistics=(*test.statistics, row))
    if p >= min(test.p, LEAST):
        return test
    what = (
        f"the modes that {' and '.join(elastic)} changes most are damped most: what is there gives "
        "and dissipates, as a joint that slips or a viscous layer does; a recording at another "
        "level of excitation would tell"
    )
    return replace(test, passes=False, p=p, what=what, where=hypothesis.effect.text)


def softened(hypothesis: HypothesisFit, above: float) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] above one (m,), and how far the effect lowers λ of each mode.

    φᵀK₀φ / φᵀM₀φ / λ - 1 >= 0 of the modes φ as they are, K₀ and M₀ with the effect idle.
    """
    fit, x = hypothesis.fit, hypothesis.fit.x.copy()
    for effect, at in slices(fit.effects):
        if effect in hypothesis.effects and effect.elastic:
            x[at] = [p.nominal for p in effect.parameters]
    idle, state = evaluate(hypothesis.model, fit.effects, x, False), fit.state
    frequency = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    kept = frequency > above
    T = np.linalg.solve(idle.vectors, state.vectors[:, kept])
    energy, mass = idle.lam @ T**2, (T**2).sum(axis=0)
    return frequency[kept], np.maximum(energy / mass / state.lam[kept] - 1, 0.0)
