"""Sensor mass: additional mass on the structure during the measurement only."""

from dataclasses import dataclass, replace

import numpy as np

from ..fem.locate import Share
from ..model.assembly import Assembly
from .effect import Weight
from .effect_context import EffectContext
from .family import Article, Family
from .points import AtPoints, strength, with_masses


@dataclass(frozen=True, eq=False)
class SensorMass(AtPoints):
    """M + m Σ bᵀb over all sensors: mass of accelerometers and cables, removed before weighing.

    ``places`` are the (grid id, weight) pairs to which each sensor is attached.
    """

    name = "sensor-mass"
    claim = "the accelerometers' mass is missing from the model"
    matrix = "M"

    places: tuple[Share, ...] = ()

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write CONM2 at the grids, in proportion to their weights."""
        m = self.parameters[0].value(x[0])
        total: dict[int, float] = {}
        for grid, weight in (pair for share in self.places for pair in share):
            total[grid] = total.get(grid, 0.0) + weight * m
        return with_masses(assembly, tuple(total), np.array(list(total.values())))

    def weight(self, x: np.ndarray) -> Weight:
        """The sensors, without which the article is weighed."""
        return Weight(0.0, np.zeros(1), len(self.places) * self.parameters[0].value(x[0]))


def sensor_mass(where: EffectContext) -> list[SensorMass]:
    """One mass for every sensor; median 6 % of the structure's mass in total, 2 g each or more."""
    setup = where.setup
    if not setup.sensors:
        return []
    shares = tuple(sorted(set(setup.sensors)))
    scale = max(2e-3, 0.06 * setup.weight / len(shares))
    m = strength("M", "kg", scale, 1.3, (-2.0, -1.0, 0.0))
    text = f"at the {len(shares)} sensors"
    grids = tuple(sorted({max(share, key=lambda pair: pair[1])[0] for share in shares}))
    rows = where.at_shares(shares)
    return [SensorMass((m,), text, grids=grids, rows=rows, places=shares)]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add 0.25 to 0.6 % of the article's mass at every sensor, removed before weighing."""
    each = float(rng.uniform(0.0025, 0.006)) * article.weight
    loaded = with_masses(article.assembly, article.grids_at(article.outputs), each)
    hidden = article.with_hidden(loaded, {"M": each})
    return replace(hidden, off_scale=each * len(article.outputs))


FAMILY = Family(
    SensorMass,
    conceal,
    placed=sensor_mass,
    cards=("CONM2",),
    settled_by="measure again with half of the sensors removed",
)
