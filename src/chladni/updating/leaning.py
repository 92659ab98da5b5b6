"""Ordinary numbers that ended where no ordinary number is: they stand for something else."""

from collections.abc import Sequence

import numpy as np

from ..effects.effect import Effect
from ..effects.freed import Freed
from .map_fit import Fit

FAR = 3.0  # prior standard deviations from the deck's value


def leaning(fit: Fit) -> list[str]:
    """A sentence for every ordinary number on a bound or far from the deck's value."""
    return [
        said
        for effect in fit.effects
        if effect.kind == "ordinary" and (said := _said(effect, fit.of(effect)))
    ]


def _said(effect: Effect, x: np.ndarray) -> str:
    if isinstance(effect, Freed) and effect.on_bound(x):
        return f"{effect.text} ended on a bound, so it may stand for something else"
    away = _away(effect, x)
    if len(x) == 1 and away > FAR:
        return (
            f"{effect.text} ended {away:.2g} standard deviations of its prior from the deck's "
            "value, so it stands for something else"
        )
    return ""


def _away(effect: Effect, x: np.ndarray) -> float:
    """The largest distance from the prior's mean, in its standard deviations."""
    each: Sequence[float] = [
        abs(v - p.mean) / p.sd for v, p in zip(x, effect.parameters, strict=True)
    ]
    return max(each, default=0.0)
