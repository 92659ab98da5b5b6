"""A weld or a fastener of the deck that is missing from the structure."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .effect import Parameter
from .estimate import Estimate
from .family import Article, Family
from .joints import without_joint
from .search_context import Candidate, SearchContext
from .weld_compliance import NEEDS, NONE_LEFT, SOUND, WeldCompliance, drawn, proposed, with_all

GONE = -12.0  # ln of the remaining stiffness over that which carries half of the load: as good as 0


@dataclass(frozen=True, eq=False)
class WeldMissing(WeldCompliance):
    """The joint times e^-12 s, others of its kind times e^g; the rest is too small to estimate."""

    name = "weld-missing"
    claim = "a weld or a fastener of the deck is missing or carries no load"

    @staticmethod
    def strength(softness: float) -> Parameter:
        """ln of the remaining stiffness over that which carries half of the load: as good as 0."""
        return Parameter("K", "of the deck's", GONE, 1.0, softness, starts=(GONE,), nominal=SOUND)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Remove the elements of a missing joint, and write the others as fitted with it."""
        assert self.joint is not None
        if x[0] > NONE_LEFT:
            return super().apply(assembly, x)
        auxiliary_residual = x[1] if len(x) > 1 else 0.0
        return without_joint(
            with_all(assembly, self.joint.kind, np.exp(auxiliary_residual)), self.joint
        )

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Zero stiffness, with an upper limit that would carry a twentieth of the load."""
        return (Estimate("K", 0.0, "of the deck's", 0.0, self.left(NONE_LEFT)[0]),)

    def becomes(self, x: np.ndarray) -> str:
        """Return "", because there is no simpler effect."""
        return ""


def candidates(context: SearchContext) -> list[Candidate]:
    """Missing welds, screws and bushes."""
    return proposed(WeldMissing, context)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Remove a fastener."""
    joint, truth = drawn(article, rng)
    made = without_joint(article.assembly, joint)
    return replace(article, assembly=made, truth={**truth, "value": 0.0, "parameters": {"K": 0.0}})


FAMILY = Family(
    WeldMissing,
    conceal,
    candidates=candidates,
    cards=("MAT1", "CHEXA", "CPENTA", "CTETRA", "CBAR", "CBUSH", "PBUSH"),
    settled_by="inspect that joint, and test it by ultrasound or a chisel",
    needs=NEEDS,
)
