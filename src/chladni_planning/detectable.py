"""The smallest mass, softening and thinning a layout would find, before anything is measured.

The recording is taken to be the model's own responses. A change is found when it lowers -2 ln p by
more than an effect needs to be named. That is the threshold of a diagnosis plus 2 ln of the number
of places tried, because the place is unknown. The value of -2 ln p is that of a diagnosis
(``scan``). The covariance holds E, rho and t, scatter within parts, joints and the weighing. It
also holds the errors of the mesh and of the model's form. A change that calibration could explain
is therefore not counted. Held-out data count like the other data.
"""

from dataclasses import dataclass

import numpy as np

from chladni.effects.registry import families
from chladni.inference.likelihood import Responses
from chladni.inference.residual_localisation import bumps
from chladni.inference.scan import baseline, field_slopes, point_scores
from chladni.reduced.reduced_model import evaluate
from chladni.search.decision_rules import required_gain
from chladni.search.question import Question
from chladni.search.simulated_test import NOISE, unmeasured

MASSES = np.geomspace(1e-5, 0.3, 40)  # tried, of the structure's mass
MOST_CHANGE = 0.9  # of stiffness or thickness: a change that would have to be larger is not found


@dataclass(frozen=True, eq=False)
class Detectable:
    """Smallest detectable changes, place by place; NaN where none of a sensible size exists.

    Attributes
    ----------
    grids : (k,) int       places of the mass
    points : (k, 3) [m]
    mass : (k,) [kg]
    softer, thinner : (g,) share of E and of t, over a tenth of the sheet round each group of shells
    group : (m,) int       group of each shell
    due : float            drop of -2 ln p at which something is found
    lines, weight : lines that are compared, mass of the structure [kg]
    """

    grids: np.ndarray
    points: np.ndarray
    mass: np.ndarray
    softer: np.ndarray
    thinner: np.ndarray
    group: np.ndarray
    due: float
    lines: int
    weight: float


def detectable(question: Question, noise: float = NOISE) -> Detectable:
    """Smallest changes of the structure that a test with these sensors and shakers would find.

    Parameters
    ----------
    question, noise : as in :func:`unmeasured`
    """
    problem = unmeasured(question, noise)
    reduced, x, data = problem.reduced, problem.mean(), problem.data
    assert isinstance(data, Responses)
    data = data.allowing_errors(evaluate(reduced.model, problem.base, x))
    base = baseline(reduced.model, problem.base, data, problem.mass_measurement, x)
    places, weight = problem.where.places, problem.setup.weight
    due = required_gain(False, len(families())) + 2 * float(np.log(len(places)))
    score = point_scores(
        base, reduced.model, data, places, "M", weight * MASSES, reduced.flexibility(places)
    )
    local = bumps(reduced.groups)
    shares = []
    for field in ("E", "t"):
        columns = field_slopes(base, reduced.model, data, field) @ local
        share = 1 - np.exp(-np.sqrt(due / np.maximum(base.score(columns), 1e-12)))
        shares.append(np.where(share < MOST_CHANGE, share, np.nan))
    gained = score - base.score(base.residual[:, None])[0]
    shells = len(reduced.structure.assembly.shells)
    return Detectable(
        places.grids, places.point, weight * _smallest(gained, due), shares[0], shares[1],
        reduced.groups.group[:shells], due, len(data.s), weight,
    )  # fmt: skip


def _smallest(gained: np.ndarray, due: float) -> np.ndarray:
    """Smallest mass whose gain (n_places, n_masses) reaches ``due``, interpolated; NaN: none."""
    out = np.full(len(gained), np.nan)
    for k, gain in enumerate(gained):
        enough = np.flatnonzero(gain >= due)
        if not len(enough):
            continue
        j = int(enough[0])
        out[k] = MASSES[0]
        if j:
            share = (due - gain[j - 1]) / (gain[j] - gain[j - 1])
            out[k] = MASSES[j - 1] * (MASSES[j] / MASSES[j - 1]) ** share
    return out
