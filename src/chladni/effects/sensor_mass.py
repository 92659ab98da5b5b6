"""What hangs on the structure only while it is measured."""

from dataclasses import dataclass, replace

import numpy as np

from .family import Article, Family
from .points import MassEffect, strength, with_masses
from .surroundings import Surroundings


@dataclass(frozen=True, eq=False)
class SensorMass(MassEffect):
    """Accelerometers (and their cables) weigh something; taken off before weighing."""

    name = "sensor-mass"
    claim = "the accelerometers' mass is missing from the model"

    def weight(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Nothing: the article is weighed without its sensors."""
        return 0.0, np.zeros(1)


def sensor_mass(where: Surroundings) -> list[SensorMass]:
    """One mass for all sensors; median 0.4 % of the structure's mass each, at least 2 g."""
    setup = where.setup
    if not setup.sensors:
        return []
    grids = tuple(sorted(set(setup.sensors)))
    scale = max(2e-3, 0.06 * setup.weight / len(grids))
    m = strength("M", "kg", scale, 1.3, (-2.0, -1.0, 0.0))
    text = f"at the {len(grids)} sensors"
    rows = where.translations(grids)
    return [SensorMass((m,), text, grids=grids, rows=rows, directions=np.eye(3))]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """0.25 to 0.6 % of the article's mass at every sensor, taken off before weighing."""
    each = float(rng.uniform(0.0025, 0.006)) * article.weight
    loaded = with_masses(article.assembly, article.grids_at(article.outputs), each)
    truth = {"value": each, "parameters": {"M": each}}
    return replace(article, assembly=loaded, truth=truth, off_scale=each * len(article.outputs))


FAMILY = Family(SensorMass, conceal, placed=sensor_mass, cards=("CONM2",))
