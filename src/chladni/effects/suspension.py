"""What the structure hangs on."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .family import Article, Family
from .points import AtPoints, strength, with_springs
from .surroundings import Surroundings


@dataclass(frozen=True, eq=False)
class Suspension(AtPoints):
    """Cords at the hangers hold the structure, so it is not free."""

    name = "suspension"
    claim = "the suspension's stiffness is missing from the model"

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """A spring to ground at each hanger: CELAS2, or CBUSH where it is askew."""
        k = self.parameters[0].value(x[0])
        return with_springs(assembly, self.grids, self.directions, k)


def suspension(where: Surroundings) -> list[Suspension]:
    """Springs at the hangers, along the surface normal or along every direction."""
    hangers = tuple(where.setup.hangers)
    if not hangers:
        return []
    known = {int(g): n for g, n in zip(where.grids.grids, where.grids.normal, strict=True)}
    normal = np.array([known.get(int(g), np.array([0.0, 0.0, 1.0])) for g in hangers])
    k = strength("K", "N/m", 0.1 * where.setup.stiffness, 2.0, (-3.0, -1.5, 0.0, 1.5))
    text = f"at hangers {', '.join(map(str, hangers))}"
    along = where.groups.structure.along(np.array(hangers), normal)
    every = np.tile(np.eye(3), (len(hangers), 1))
    return [
        Suspension((k,), text, grids=hangers, rows=along, directions=normal),
        Suspension(
            (k,), text + ", every direction", grids=tuple(np.repeat(hangers, 3)), trials_factor=2,
            rows=where.translations(hangers), directions=every,
        ),
    ]  # fmt: skip


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Cords of 0.8 to 6 kN/m along z at the hangers."""
    K = float(np.exp(rng.uniform(np.log(800), np.log(6000))))
    at = article.grids_at(article.hangers)
    up = np.tile([0.0, 0.0, 1.0], (len(at), 1))
    truth = {"value": K, "parameters": {"K": K}}
    return replace(article, assembly=with_springs(article.assembly, at, up, K), truth=truth)


FAMILY = Family(
    Suspension,
    conceal,
    placed=suspension,
    cards=("CELAS2", "CBUSH", "PBUSH", "CORD2R"),
    settled_by="measure again on softer cords",
)
