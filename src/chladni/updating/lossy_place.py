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
from .discrepancy import RIGID
from .hypothesis_fit import HypothesisFit
from .reduced_model import evaluate

NEAR = 0.05  # relative distance of natural frequencies beyond which a pole is none of the model's


def heard_of_damping(
    test: FitTest, hypothesis: HypothesisFit, damping: ModalDamping | None
) -> FitTest:
    """The test, or that of damping following the effect where it is the less likely of the two."""
    elastic = [e.name for e in hypothesis.effects if e.elastic]
    if damping is None or not elastic:
        return test
    frequency, share = softened(hypothesis)
    ratio = np.abs(frequency / damping.frequency[:, None] - 1)
    own = ratio.min(axis=1, initial=np.inf) < NEAR
    if own.sum() < FEWEST:
        return test
    kept = damping.of(own)
    p, row = kept.following(share[ratio[own].argmin(axis=1)])
    test = replace(test, statistics=(*test.statistics, row))
    if p >= min(test.p, LEAST):
        return test
    what = (
        f"the modes that {' and '.join(elastic)} changes most are damped most: what is there gives "
        "and dissipates, as a joint that slips or a viscous layer does; a recording at another "
        "level of excitation would tell"
    )
    return replace(test, passes=False, p=p, what=what, where=hypothesis.effect.text)


def softened(hypothesis: HypothesisFit) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] of the flexible modes (m,), and how far the effect lowers λ of each.

    φᵀK₀φ / φᵀM₀φ / λ - 1 >= 0 of the modes φ as they are, K₀ and M₀ with the effect idle.
    """
    fit = hypothesis.fit
    x, at = fit.x.copy(), 0
    for effect in fit.effects:
        n = len(effect.parameters)
        if effect in hypothesis.effects and effect.elastic:
            x[at : at + n] = [p.nominal for p in effect.parameters]
        at += n
    idle, state = evaluate(hypothesis.model, fit.effects, x, False), fit.state
    T = np.linalg.solve(idle.vectors, state.vectors)
    energy, mass = idle.lam @ T**2, (T**2).sum(axis=0)
    flexible = state.lam > RIGID**2 * np.median(state.lam)
    lam = state.lam[flexible]
    return np.sqrt(lam) / (2 * np.pi), np.maximum((energy / mass)[flexible] / lam - 1, 0.0)
