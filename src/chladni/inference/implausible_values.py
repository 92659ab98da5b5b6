"""Calibrated numbers with implausible values: they may stand for something else."""

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from scipy.special import chdtrc

from ..effects.effect import Effect
from ..effects.joint_stiffness import FAR, JOINTS, ModelFamily
from ..effects.model_errors import MeshError
from ..effects.user_parameters import UserParameter
from .map_fit import Fit


def implausible_values(fit: Fit) -> list[str]:
    """Sentences, one for every calibrated number on a bound or far from the deck's value."""
    return [
        said
        for effect in fit.effects
        if effect.kind == "calibration" and (said := _said(effect, fit.of(effect)))
    ]


def in_doubt(plain: Fit, null: Fit, coarse: float = 0.0) -> tuple[str, ...]:
    """Reasons why a calibration that explains the whole recording is not to be trusted.

    "Nothing is missing" is a claim too.  A number that no structure of this deck has may stand for
    missing physics, in the reported deck or in the null.  Several numbers may do so together,
    although each alone is plausible.  For example, the frequencies of a strip determine only one
    combination of E, rho and t.  A mesh that the data reject takes frequencies off by
    ``coarse``. The numbers of the reported deck then stand for it, and small effects are not seen.
    """
    own = _far(plain)
    far = list(dict.fromkeys((*own, *strained(null))))
    if not far:
        return ()
    if coarse and own and not _far(null):
        return (
            f"{'; '.join(far)}: that is the mesh of the deck, whose frequencies are off by up to "
            f"{100 * coarse:.2g} %; refine it and diagnose again, because an effect "
            "smaller than this error is not seen",
        )
    return (
        f"calibration alone explains the recording, but {'; '.join(far)}: measure it first, and "
        "correct the deck; if it was only guessed, free it by a [[parameter]] with a matching sd",
    )


def _far(fit: Fit) -> list[str]:
    """Sentences on calibrated numbers, each or all together, that no structure of the deck has."""
    return implausible_values(fit) or _far_together(fit)


def error_of_mesh(null: Fit) -> float:
    """Largest relative error of a frequency by the fitted error of the elements."""
    mesh = next(e for e in null.effects if type(e) is MeshError)
    return mesh.largest(float(null.of(mesh)[0]))


def strained(fit: Fit) -> list[str]:
    """Sentences, one for every family of joints whose change exceeds the scatter of its kind."""
    return [_more(e, x) for e in fit.effects if is_strained(e, x := fit.of(e))]


def is_strained(effect: Effect, x: np.ndarray) -> TypeGuard[ModelFamily]:
    """True for a family of joints whose change exceeds the scatter of joints of its kind."""
    known = isinstance(effect, ModelFamily) and effect.text in JOINTS
    return known and _away(effect, x) > FAR


def _more(family: Effect, x: np.ndarray) -> str:
    times = family.parameters[0].value(x[0])
    return (
        f"the stiffness of {family.text} as a whole ended at {times:.2g} times the deck's, "
        f"{_away(family, x):.2g} standard deviations of its prior: it may be the cause"
    )


def _far_together(fit: Fit) -> list[str]:
    """Sentence where all calibrated numbers together are as improbable as one beyond ``FAR``.

    With z = (x - μ)/σ, |z|² is χ² where the deck is right.  Its degrees of freedom are the number
    of directions that the data determine: the prior's trace less that of the covariance of z.
    """
    own = [e for e in fit.effects if e.kind == "calibration" and e.parameters]
    if not own:
        return []
    z = np.concatenate([(fit.of(e) - _each(e, "mean")) / _each(e, "sd") for e in own])
    left = sum(float(((fit.sd(e) / _each(e, "sd")) ** 2).sum()) for e in own)
    freedom = max(1.0, len(z) - left)
    if chdtrc(freedom, z @ z) >= chdtrc(1, FAR**2):
        return []
    names = ", ".join(e.text for e in own)
    return [
        f"{names} together ended {np.sqrt(z @ z):.2g} standard deviations of their priors from "
        "the deck's values, so they compensate for another cause"
    ]


def _each(effect: Effect, name: str) -> np.ndarray:
    """An attribute of each parameter of an effect."""
    return np.array([getattr(p, name) for p in effect.parameters])


def _said(effect: Effect, x: np.ndarray) -> str:
    if isinstance(effect, UserParameter) and effect.on_bound(x):
        return f"{effect.text} ended on a bound, so it may compensate for another cause"
    if is_strained(effect, x):
        return _more(effect, x)
    away = _away(effect, x)
    if len(x) == 1 and away > FAR:
        return (
            f"{effect.text} ended {away:.2g} standard deviations of its prior from the deck's "
            "value, so it compensates for another cause"
        )
    return ""


def _away(effect: Effect, x: np.ndarray) -> float:
    """Largest distance from the prior mean, in standard deviations of the prior."""
    each: Sequence[float] = [
        abs(v - p.mean) / p.sd for v, p in zip(x, effect.parameters, strict=True)
    ]
    return max(each, default=0.0)
