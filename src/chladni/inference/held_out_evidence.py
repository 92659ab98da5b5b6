"""Evidence of held-out data: the log predictive density of data that a fit did not see.

p(held | fitted) = p(held, fitted) / p(fitted): a ratio of evidences about the existing fit, with
the learned error of the model.  Data that are insensitive to an effect do not count, as they are
predicted equally well without it.
"""

import numpy as np

from ..reduced.reduced_model import Reduced, evaluate
from .hypothesis_fit import HypothesisFit, UpdatingProblem, over_scales
from .likelihood import Responses
from .linear_model import LinearModel
from .map_fit import prior_residuals
from .pole_data import Poles


def held_out_evidence(
    problem: UpdatingProblem, unseen: np.ndarray, null: HypothesisFit, hypothesis: HypothesisFit,
    about: Reduced | None = None,
) -> float:  # fmt: skip
    """Gain of a hypothesis over the null in 2 ln predictive density; 0 if nothing is held out.

    Parameters
    ----------
    unseen : samples held out, in the shape of ``problem.data.use``
    null : without the effects that are tested
    about : the model whose state errors of form spread from; that of ``null`` unless it is given
    """
    if not unseen.any():
        return 0.0
    data = null.data.rebased(about or null.model)
    assert isinstance(data, (Responses, Poles))
    both = data.using(data.use | unseen)
    return _news(problem, null, both) - _news(problem, hypothesis, both)


def _news(problem: UpdatingProblem, hypothesis: HypothesisFit, both: Responses | Poles) -> float:
    """-2 ln p(held out | fitted), the parameters linear about their fit, up to a constant.

    ``both`` are the fitted data and those held out.
    """
    data = hypothesis.data
    assert isinstance(data, (Responses, Poles))
    both = both.rebased(hypothesis.model)
    return _evidence(problem, hypothesis, both) - _evidence(problem, hypothesis, data)


def _evidence(
    problem: UpdatingProblem, hypothesis: HypothesisFit, data: Responses | Poles
) -> float:
    """-2 ln evidence of some data, the parameters linear about the existing fit."""
    fit = hypothesis.fit
    state = evaluate(hypothesis.model, fit.effects, fit.x)
    r, J = data.scaled(state, True)
    r0, J0 = prior_residuals(fit.effects, problem.mass_measurement, fit.x, state)
    if isinstance(data, Poles):
        return over_scales(data, state, r0, J0)
    if data.error is not None:
        return LinearModel(data.error, J, J0).learned(r, r0).neg2_log_evidence
    A, g = J.T @ J + J0.T @ J0, J.T @ r + J0.T @ r0
    cost = r @ r + r0 @ r0 - g @ np.linalg.solve(A, g)
    widths = 2 * np.log(data.std()[data.use]).sum()
    return float(cost + np.linalg.slogdet(A)[1] + widths)
