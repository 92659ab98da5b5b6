"""Local thinning of a sheet."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .effect import Effect, Parameter
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family
from .search_context import Candidate, SearchContext
from .sheet_patch import SheetPatch, patches


@dataclass(frozen=True, eq=False)
class ThicknessDistribution(SheetPatch):
    """t(x) = t0 (1 - α q(x)), α = 0.6 / (1 + e^-x): a smooth local thinning of one sheet."""

    name = "thickness-distribution"
    claim = "the sheet is thinner here than in the deck"
    quantity = "t"
    scanned = -2.0
    grows = (0.05, np.inf)  # a smaller thinning, or a thickening, is not accepted

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of α / 0.6."""
        return Parameter(
            "thinning", "-", -1.6, 1.2, 1.0, "linear", 0.8, starts=(-1.0,), nominal=-40.0
        )

    def log(self, x: np.ndarray) -> np.ndarray:
        """ln(1 - α q) over the groups."""
        q = self.bump(x, self.centre, self.variance)
        return np.log1p(-thinning(x[0]) * q) * self.inside

    @classmethod
    def begun(cls, amount: float) -> float:
        """Start of the logit, for depths from 2 to 40 %."""
        alpha = np.clip(amount * thinning(cls.scanned), 0.02, 0.4)
        return float(np.log(alpha / (0.6 - alpha)))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the thickness at the corners of the sheet's shells."""
        shells = assembly.shells
        q = self.bump(x, assembly.points)[shells.nodes]
        factor = np.where(self.shells[:, None], 1 - thinning(x[0]) * q, 1.0)
        return replace(assembly, shells=replace(shells, thickness=shells.thickness * factor))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The deepest thinning on the sheet and the radius R; ``location`` holds the place."""
        rows = Effect.reported(self, x, sd)
        there = float(self.bump(x, self.deepest(x)[1][None])[0])
        value, low, high = (
            there * thinning(x[0] + s * 1.96 * self.widened(sd)[0]) for s in (0, -1, 1)
        )
        return replace(rows[0], value=value, low=low, high=high), rows[1]


def thinning(x: float) -> float:
    """α = 0.6 / (1 + e^-x), from 0 to 0.6."""
    return float(0.6 / (1 + np.exp(-x)))


def candidates(context: SearchContext) -> list[Candidate]:
    """The places where a thinning explains most."""
    return patches(context, ThicknessDistribution)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Thin the first part by 8 to 25 % round a grid, with R of 40 to 90 mm."""
    made = article.assembly
    first = made.shells.nodes[made.shells.part == 0]
    centre = made.points[rng.choice(np.unique(first))]
    alpha, R = float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.04, 0.09))
    q = np.exp(-((made.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    t = made.shells.thickness * (1 - alpha * q)[made.shells.nodes]
    truth = {
        "point_m": centre.tolist(), "value": alpha, "radius_m": R,
        "parameters": {"thinning": alpha, "R": R},
    }  # fmt: skip
    thinned = replace(made, shells=replace(made.shells, thickness=t))
    return replace(article, assembly=thinned, truth=truth)


FAMILY = Family(
    ThicknessDistribution,
    conceal,
    candidates=candidates,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="measure the thickness of the sheet there",
    on_sheets=True,
)
