"""Local thinning of a sheet."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .effect import Parameter
from .element_groups import ElementGroups
from .family import Article, Family
from .sheet_patch import SheetLoss, random_place


@dataclass(frozen=True, eq=False)
class ThicknessDistribution(SheetLoss):
    """t(x) = t0 (1 - α q(x)), α = 0.6 / (1 + e^-x): a smooth local thinning of one sheet."""

    name = "thickness-distribution"
    claim = "the sheet is thinner here than in the deck"
    quantity = "t"
    followed = 2
    scanned = -2.0
    grows = (0.05, np.inf)  # a smaller thinning, or a thickening, is not accepted
    most = 0.6
    begins = (0.02, 0.4)

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of α / 0.6."""
        return Parameter(
            "thinning", "-", -1.6, 1.2, 1.0, "linear", 0.8, starts=(-1.0,), nominal=-40.0
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the thickness at the corners of the sheet's shells."""
        shells = assembly.shells
        q = self.bump(x, assembly.points)[shells.nodes]
        factor = np.where(self.shells[:, None], 1 - self.lost(x[0]) * q, 1.0)
        return replace(assembly, shells=replace(shells, thickness=shells.thickness * factor))


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Thin the first part by 8 to 25 % round a grid, with R of 40 to 90 mm."""
    made, centre = article.assembly, random_place(article, rng)
    alpha, R = float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.04, 0.09))
    q = np.exp(-((made.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    t = made.shells.thickness * (1 - alpha * q)[made.shells.nodes]
    thinned = replace(made, shells=replace(made.shells, thickness=t))
    return article.with_hidden(thinned, {"thinning": alpha, "R": R}, centre, radius_m=R)


FAMILY = Family(
    ThicknessDistribution,
    conceal,
    candidates=ThicknessDistribution.candidates,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="measure the thickness of the sheet there",
    on_sheets=True,
)
