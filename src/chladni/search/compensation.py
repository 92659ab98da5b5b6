"""Signs that calibrated values compensate for something that the model lacks.

There are three: the fit predicts held-out data worse than the deck did; it leaves the weighed mass
by more than the error of the weighing; it ends on a bound of what a value can be.
"""

from collections.abc import Iterator

import numpy as np

from ..inference.implausible_values import implausible_values
from ..inference.map_fit import APART, Fit, MassMeasurement
from ..inference.residual_localisation import ResidualLocalisation
from ..inference.result import Agreement, MassComparison
from .result_parts import foretells_worse

CURE = "try chladni diagnose"
OF_RESPONSES = (
    ', [test] gain = "unknown" if the level is uncertain, or position_sd for uncertain places'
)
LEAST = 0.005  # smaller changes of ln mass and stiffness are not named
# powers in the bending stiffness of a part
BENDING = {"E": 1.0, "t": 3.0, "wall": 1.0, "offset": 2.0}


def compensating(
    fit: Fit, agreement: Agreement | None, mass: MassComparison | None,
    weighed: MassMeasurement | None, spot: ResidualLocalisation | None, responses: bool,
) -> tuple[str, ...]:  # fmt: skip
    """The effects that a calibration stands for, and why; empty where it does not compensate.

    The fit is that of the written deck; at ``spot`` a local change would still gain. Responses
    have a level and places, as tables of frequencies do not.
    """
    cures = CURE + OF_RESPONSES * responses
    reasons = (
        *(f"{why}; {cures}" for why in foretells_worse(agreement)),
        *_leaves_the_scales(mass, weighed),
        *implausible_values(fit),
    )  # fmt: skip
    place = "" if spot is None or not spot.parts else f"on {', '.join(spot.parts[:2])}"
    return (_stands_for(fit, place), *reasons) if reasons else ()


def _leaves_the_scales(
    mass: MassComparison | None, weighed: MassMeasurement | None
) -> Iterator[str]:
    if mass is None or mass.model_kg is None or mass.weighed_kg is None or weighed is None:
        return
    off = mass.model_kg - mass.weighed_kg
    if abs(off) > APART * weighed.sd:
        yield (
            f"the calibrated deck weighs {mass.model_kg:.4g} kg, {abs(off):.2g} kg "
            f"{'more' if off > 0 else 'less'} than the article, which is known to "
            f"{weighed.sd:.2g} kg: density or thickness stand for something else"
        )


def _stands_for(fit: Fit, place: str) -> str:
    """The changes of each part in the words of mass and stiffness."""
    changes: dict[str, np.ndarray] = {}  # of ln stiffness and ln mass, and their variances
    for effect in (e for e in fit.effects if e.kind == "calibration" and len(e.parameters) == 1):
        (p,) = effect.parameters
        if p.kind != "log":  # no factor on a value of the deck
            continue
        row = effect.reported(fit.of(effect), np.array([p.sd]))[0]
        change = float(np.log(row.value / p.value(p.nominal)))
        powers = np.array([BENDING.get(p.name, 0.0), float(p.name in ("rho", "t", "wall"))])
        where = ", ".join(effect.parts) or "the joints"
        moments = np.array([powers * change, (powers * fit.sd(effect)[0]) ** 2])
        changes[where] = changes.get(where, 0.0) + moments
    said = [
        f"{where} {' and '.join(words)}"
        for where, row in changes.items()
        if (words := [*_more(row[:, 0], "stiffer", "softer"),
                      *_more(row[:, 1], "heavier", "lighter")])
    ]  # fmt: skip
    if not said:
        return (
            "the deck keeps its values within their standard deviations, as no others fit better "
            "on its mesh: refine the mesh, or look for what is missing with `chladni diagnose`"
        )
    left = f"; what it leaves is largest {place}" if place else ""
    return (
        f"the calibration is compensating: it stands for what makes {'; '.join(said)}{left}; "
        "`chladni diagnose` says which effect does this"
    )


def _more(of: np.ndarray, up: str, down: str) -> Iterator[str]:
    """A change of more than half a per cent and its standard deviation in words.

    It is a factor where it is beyond a doubling or a half.
    """
    change, variance = of
    way = up if change > 0 else down
    if abs(change) > max(np.log(2), np.sqrt(variance)):
        yield f"{way} by a factor of {np.exp(abs(change)):.3g}"
    elif abs(change) > max(LEAST, np.sqrt(variance)):
        yield f"{100 * abs(np.expm1(change)):.1f} % {way}"
