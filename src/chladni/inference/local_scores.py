"""Scores of effects on few degrees of freedom, without a basis of their own."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..reduced.local_effect import LocalEffect
from ..reduced.reduced_problem import ReducedProblem
from .hypothesis_fit import FAILED
from .likelihood import Responses
from .scan import Baseline


def local_scores(
    base: Baseline, reduced: ReducedProblem, data: Responses, effect: Effect,
    starts: Sequence[np.ndarray],
) -> np.ndarray | None:  # fmt: skip
    """Score of an effect at each start (n,); None for an effect or a base of another kind."""
    local = LocalEffect.of(reduced, base.effects, effect, base.state, base.x, starts[0])
    if local is None:
        return None
    out = np.full(len(starts), np.inf)
    for k, start in enumerate(starts):
        with suppress(*FAILED):
            other = local.added(base.state, base.x, start)
            r = data.scaled(other, False)[0][:, None]
            out[k] = base.score(replace(base, state=other).with_mass(r, 0.0))[0]
    return out
