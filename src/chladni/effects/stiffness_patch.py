"""A region of a sheet that is softer than in the deck, with unchanged mass.

It covers causes without their own effect: a heat-affected zone, a creased or perforated sheet, a
delaminated layer. Only softer regions are searched. Coarse and fine elements of two codes differ
like a slightly stiffer region. A corner 11 % stiffer near the shaker gained 43 in -2 ln evidence
where nothing was missing.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from ..model.properties import Part
from .calibration_parameters import scaled
from .effect import Effect, Parameter
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family
from .property_bands import with_bands
from .search_context import Candidate, SearchContext
from .sheet_patch import RIMMED, SheetPatch, patches

MOST_LOSS = 0.9  # of the stiffness may be lost in the middle


@dataclass(frozen=True, eq=False)
class StiffnessPatch(SheetPatch):
    """E(x) = E0 (1 - β q(x)), β = 0.9 / (1 + e^-x), for membrane and bending; always positive."""

    name = "stiffness-patch"
    elastic = True
    claim = "the sheet is softer here than in the deck, with the same mass"
    quantity = "E"
    scanned = -1.0
    grows = (0.1, np.inf)  # a smaller loss, or a stiffening, is not accepted
    rim = RIMMED

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of β / 0.9, with a prior loss of a third of the stiffness (8 to 70 %)."""
        return Parameter(
            "E", "of the deck's", -0.5, 1.2, 1.0, "linear", 0.8, starts=(-0.5,), nominal=-40.0
        )

    def log(self, x: np.ndarray) -> np.ndarray:
        """ln(1 - β q) over the groups."""
        q = self.bump(x, self.centre, self.variance)
        return np.log1p(-lost(x[0]) * q) * self.inside

    @classmethod
    def begun(cls, amount: float) -> float:
        """Start of the logit, for losses from 5 to 75 %."""
        beta = np.clip(amount * lost(cls.scanned), 0.05, 0.75)
        return float(np.log(beta / (MOST_LOSS - beta)))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write new properties, in bands of equal ratio."""
        centre = assembly.points[assembly.shells.nodes].mean(axis=1)
        log = np.log1p(-lost(x[0]) * self.bump(x, centre) * self.shells)
        return with_bands(assembly, log, softened)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Remaining share of E where it is lowest, and the radius R."""
        rows = Effect.reported(self, x, sd)
        q = float(self.bump(x, self.deepest(x)[1][None])[0])
        here, high, low = (1 - q * lost(x[0] + s * 1.96 * self.widened(sd)[0]) for s in (0, -1, 1))
        return replace(rows[0], value=here, low=low, high=high), rows[1]


def lost(x: float) -> float:
    """β, from 0 to MOST."""
    return float(MOST_LOSS / (1 + np.exp(-x)))


def softened(part: Part, log: float) -> Part:
    """Multiply E of a part by e^log."""
    return scaled(part, "E", float(np.exp(log)))


def candidates(context: SearchContext) -> list[Candidate]:
    """The places where a softer patch explains most."""
    return patches(context, StiffnessPatch, each=1)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E by 0.35 to 0.6 on a disc of 60 to 110 mm round a grid of the first part."""
    made = article.assembly
    first = made.shells.part == 0
    centre = made.points[rng.choice(np.unique(made.shells.nodes[first]))]
    factor, radius = float(rng.uniform(0.35, 0.6)), float(rng.uniform(0.06, 0.11))
    middle = made.points[made.shells.nodes].mean(axis=1)
    inside = first & (np.linalg.norm(middle - centre, axis=1) <= radius)
    truth = {
        "point_m": centre.tolist(), "value": factor, "radius_m": radius,
        "parameters": {"E": factor},
    }  # fmt: skip
    changed = with_bands(made, np.log(factor) * inside, softened)
    return replace(article, assembly=changed, truth=truth)


FAMILY = Family(
    StiffnessPatch,
    conceal,
    candidates=candidates,
    cards=("MAT1", "MAT8", "PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="tap the sheet there and next to it with a small hammer, and measure its thickness",
    on_sheets=True,
)
