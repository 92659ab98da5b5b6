"""A weld or a fastener that the deck has and the structure has not."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .effect import Parameter
from .estimate import Estimate
from .family import Article, Family
from .joints import without_joint
from .search_context import Candidate, SearchContext
from .weld_compliance import NEEDS, NONE_LEFT, SOUND, WeldCompliance, drawn, proposed, with_all

GONE = -12.0  # ln of what is left over what carries half of the load: nothing


@dataclass(frozen=True, eq=False)
class WeldMissing(WeldCompliance):
    """The joint times e^-12 s, others of its kind times e^g: nothing tells how much it is gone."""

    name = "weld-missing"
    claim = "a weld or a fastener that the deck has is missing, or holds nothing"

    @staticmethod
    def strength(softness: float) -> Parameter:
        """ln of what is left over what carries half of the load: nothing."""
        return Parameter("K", "of the deck's", GONE, 1.0, softness, starts=(GONE,), nominal=SOUND)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The joint's elements taken out where it is gone; the others as fitted beside it."""
        assert self.joint is not None
        if x[0] > NONE_LEFT:
            return super().apply(assembly, x)
        beside = x[1] if len(x) > 1 else 0.0
        return without_joint(with_all(assembly, self.joint.kind, np.exp(beside)), self.joint)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Nothing is left, or less than would carry a twentieth of the load."""
        return (Estimate("K", 0.0, "of the deck's", 0.0, self.left(NONE_LEFT)[0]),)

    def becomes(self, x: np.ndarray) -> str:
        """It is the simplest."""
        return ""


def candidates(context: SearchContext) -> list[Candidate]:
    """Missing welds, screws and bushes."""
    return proposed(WeldMissing, context)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A fastener is taken out."""
    joint, truth = drawn(article, rng)
    made = without_joint(article.assembly, joint)
    return replace(article, assembly=made, truth={**truth, "value": 0.0, "parameters": {"K": 0.0}})


FAMILY = Family(
    WeldMissing,
    conceal,
    candidates=candidates,
    cards=("MAT1", "CHEXA", "CPENTA", "CTETRA", "CBAR", "CBUSH", "PBUSH"),
    settled_by="look at that joint, and test it by ultrasound or a chisel",
    needs=NEEDS,
)
