"""A region of a sheet that is softer than in the deck, with unchanged mass.

It covers causes without their own effect: a heat-affected zone, a creased or perforated sheet, a
delaminated layer. Only softer regions are searched. Coarse and fine elements of two codes differ
like a slightly stiffer region. A corner 11 % stiffer near the shaker gained 43 in -2 ln evidence
where nothing was missing.
"""

from dataclasses import dataclass

import numpy as np

from ..model.assembly import Assembly
from ..model.properties import Part
from .calibration_parameters import scaled
from .effect import Parameter, Traits
from .element_groups import ElementGroups
from .family import Article, Family
from .property_bands import with_bands
from .sheet_patch import RIMMED, SheetLoss, disc, random_place


@dataclass(frozen=True, eq=False)
class StiffnessPatch(SheetLoss):
    """E(x) = E0 (1 - β q(x)), β = 0.9 / (1 + e^-x), for membrane and bending; always positive."""

    name = "stiffness-patch"
    traits = Traits(elastic=True)
    claim = "the sheet is softer here than in the deck, with the same mass"
    quantity = "E"
    scanned = -1.0
    grows = (0.1, np.inf)  # a smaller loss, or a stiffening, is not accepted
    rim = RIMMED
    most = 0.9
    begins = (0.05, 0.75)

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of β / 0.9, with a prior loss of a third of the stiffness (8 to 70 %)."""
        return Parameter(
            "E", "of the deck's", -0.5, 1.2, 1.0, "linear", 0.8, starts=(-0.5,), nominal=-40.0
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write new properties, in bands of equal ratio."""
        centre = assembly.points[assembly.shells.nodes].mean(axis=1)
        log = np.log1p(-self.lost(x[0]) * self.bump(x, centre) * self.shells)
        return with_bands(assembly, log, softened)

    @staticmethod
    def value_of(loss: float) -> float:
        """Remaining share of E."""
        return 1 - loss


def softened(part: Part, log: float) -> Part:
    """Multiply E of a part by e^log."""
    return scaled(part, "E", float(np.exp(log)))


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E by 0.35 to 0.6 on a disc of 60 to 110 mm round a grid of the first part."""
    centre = random_place(article, rng)
    factor, radius = float(rng.uniform(0.35, 0.6)), float(rng.uniform(0.06, 0.11))
    inside = disc(article, centre, radius)
    changed = with_bands(article.assembly, np.log(factor) * inside, softened)
    return article.with_hidden(changed, {"E": factor}, centre, radius_m=radius)


FAMILY = Family(
    StiffnessPatch,
    conceal,
    candidates=StiffnessPatch.candidates,
    cards=("MAT1", "MAT8", "PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="tap the sheet there and next to it with a small hammer, and measure its thickness",
    on_sheets=True,
)
