"""Stiffness of a region of a sheet that is not what the deck says, its mass unchanged.

It is the name for what lies between the others: bonded ribs, a heat-affected zone, creased or
corrugated sheet, curvature the mesh does not have.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from ..model.properties import Part
from .effect import WIDER, Effect, Parameter
from .estimate import Estimate
from .family import Article, Family
from .ordinary import scaled
from .property_bands import with_bands
from .search_context import Candidate, SearchContext
from .sheet_patch import SheetPatch, patches
from .shell_groups import ShellGroups

MOST = 1.5  # ln of the largest factor a search begins with


@dataclass(frozen=True, eq=False)
class StiffnessPatch(SheetPatch):
    """E(x) = E0 e^(y q(x)): membrane and bending alike, so that it stays positive."""

    name = "stiffness-patch"
    claim = "the sheet is softer or stiffer here than the deck says, and no lighter or heavier"
    quantity = "E"
    scanned = -0.3
    grows = (-np.inf, np.inf)

    @classmethod
    def strength(cls, groups: ShellGroups) -> Parameter:
        """The factor on E in the middle."""
        return Parameter("E", "of the deck's", 0.0, 0.5, step=0.4, starts=(-0.5, 0.5))

    def log(self, x: np.ndarray) -> np.ndarray:
        """Y q over the groups."""
        return np.asarray(x[0] * self.bump(x, self.centre, self.variance) * self.inside)

    @classmethod
    def begun(cls, amount: float) -> float:
        """Factors from 0.2 to 5."""
        return float(np.clip(amount * cls.scanned, -MOST, MOST))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Properties of their own, by bands of equal ratio."""
        centre = assembly.points[assembly.shells.nodes].mean(axis=1)
        return with_bands(assembly, x[0] * self.bump(x, centre) * self.shells, softened)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The factor where it is farthest from one, and the radius R."""
        rows = Effect.reported(self, x, sd)
        q = float(self.bump(x, self.deepest(x)[1][None])[0])
        low, here, high = (float(np.exp(q * (x[0] + s * 1.96 * WIDER * sd[0]))) for s in (-1, 0, 1))
        return replace(rows[0], value=here, low=low, high=high), rows[1]


def softened(part: Part, log: float) -> Part:
    """The part with E times e^log."""
    return scaled(part, "E", float(np.exp(log)))


def candidates(context: SearchContext) -> list[Candidate]:
    """The places where a stiffer or softer patch explains most."""
    return patches(context, StiffnessPatch, each=1)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """E of a disc of 40 to 90 mm round a grid of the first part times 0.4 to 0.6 or 1.7 to 2.5."""
    made = article.assembly
    first = made.shells.part == 0
    centre = made.points[rng.choice(np.unique(made.shells.nodes[first]))]
    log = float(rng.choice([-1, 1]) * rng.uniform(0.5, 0.9))
    radius = float(rng.uniform(0.04, 0.09))
    middle = made.points[made.shells.nodes].mean(axis=1)
    inside = first & (np.linalg.norm(middle - centre, axis=1) <= radius)
    factor = float(np.exp(log))
    truth = {
        "point_m": centre.tolist(), "value": factor, "radius_m": radius,
        "parameters": {"E": factor},
    }  # fmt: skip
    return replace(article, assembly=with_bands(made, log * inside, softened), truth=truth)


FAMILY = Family(
    StiffnessPatch,
    conceal,
    candidates=candidates,
    cards=("MAT1", "MAT8", "PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="tap the sheet there and beside it with a small hammer, and gauge its thickness",
)
