"""Evidence of held-out data: the log predictive density of data that a fit did not see.

p(held | fitted) = p(held, fitted) / p(fitted): a ratio of evidences about the existing fit, with
the learned error of the model.  Data that are insensitive to an effect do not count, as they are
predicted equally well without it.
"""

import numpy as np

from ..reduced.reduced_model import Reduced
from .hypothesis_fit import HypothesisFit, UpdatingProblem, over_scales
from .likelihood import Data
from .map_fit import posterior
from .pole_data import Poles


def held_out_evidence(
    problem: UpdatingProblem, unseen: np.ndarray, null: HypothesisFit, hypothesis: HypothesisFit,
    about: Reduced | None = None,
) -> float:  # fmt: skip
    """Gain of a hypothesis over the null in 2 ln predictive density; 0 if nothing is held out.

    Errors of form spread from the state of the model ``about``, which is that of the null unless it
    is given. ``unseen`` has the shape of ``problem.data.use``.
    """
    if not unseen.any():
        return 0.0
    data = null.data.rebased(about or null.model)
    both = data.using(data.use | unseen)
    return _news(problem, null, both) - _news(problem, hypothesis, both)


def _news(problem: UpdatingProblem, hypothesis: HypothesisFit, both: Data) -> float:
    """-2 ln p(held out | fitted), the parameters linear about their fit, up to a constant.

    ``both`` are the fitted data and those held out.
    """
    both = both.rebased(hypothesis.model)
    return _evidence(problem, hypothesis, both) - _evidence(problem, hypothesis, hypothesis.data)


def _evidence(problem: UpdatingProblem, hypothesis: HypothesisFit, data: Data) -> float:
    """-2 ln evidence of some data, the parameters linear about the existing fit."""
    fit, mass = hypothesis.fit, problem.mass_measurement
    _, there = posterior(hypothesis.model, fit.effects, data, mass, fit.x).sloped()
    if isinstance(data, Poles):
        return over_scales(data, there.state, there.r0, there.model.J0)
    S = float(there.model.neg2_log_evidence(there.r, there.r0))
    return S if data.error is not None else S + 2 * float(np.log(data.std()[data.use]).sum())
