"""A rigid tie of the model that is compliant in reality.

An RBE2 is rigid; a clip, a screwed flange or a bearing is not. The search uses a model with a
spring k_0 in every tie, far stiffer than the sheets round it
(:func:`.rigid_ties.on_firm_springs`). A compliant tie has k in series with k_0 instead. The rest is
as for a weld of reduced stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect import MatrixTerm, Parameter, Traits
from .family import Article, Family
from .joint_stiffness import Fastener
from .joints import Connection
from .rigid_ties import RigidTie, firmly_held, rigid_ties, sprung
from .search_context import Candidate, SearchContext, best_places

SD = 2.0  # of ln k about the stiffness of the sheets at the tie
STARTS = tuple(np.arange(-4.0, 4.0).tolist())  # a factor e² off, the right tie looks wrong
RIGID = 60.0  # ln of k over its median that is as good as rigid
BY_POLES, FOLLOWED = 12, 2


@dataclass(frozen=True, eq=False)
class OverConstraint(Fastener):
    """K - K_j / (1 + k/k_0), K_j = k_0 bᵀb the firm spring in the tie: k and k_0 in series."""

    name = "over-constraint"
    claim = "a joint is compliant where the model has a rigid tie"
    traits = Traits(rounds=1)

    tie: RigidTie | None = None
    firm: float = 1.0

    def left(self, x: float) -> float:
        """Remaining share of the firm spring, k / (k + k_0)."""
        return 1.0 / (1.0 + self.firm / self.parameters[0].value(x))

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """(f - 1) K_j, without a difference of nearly equal numbers."""
        k = self.parameters[0].value(x[0])
        lost = 1.0 / (1.0 + k / self.firm)
        slope = np.array([lost * (1 - lost)])
        return (MatrixTerm("K", self.operator, -lost, slope, within=self.within),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH between the tie's independent grid and a new one that leads the others."""
        assert self.tie is not None
        return sprung(assembly, self.tie, self.parameters[0].value(x[0]))


def over_constraint(
    assembly: Assembly, joint: Connection, share: np.ndarray, tried: int
) -> OverConstraint:
    """The effect of the tie with a given firm spring, one of ``tried`` ties.

    Parameters
    ----------
    share : (r,)   z/(k_0 + z) of the spring's rows, z the stiffness of the sheets in series
    """
    tie, firm = firmly_held(assembly, int(joint.elements[0]))
    z = firm * float(np.exp(np.log(share / (1 - np.minimum(share, 0.999))).mean()))
    unknown = Parameter("K", "N/m", 0.0, SD, z, step=1.0, starts=STARTS, nominal=RIGID)
    effect = OverConstraint.of(
        joint, (unknown,), f"rigid tie {joint.where}", tried, "", {}, "", tie=tie, firm=firm
    )
    return replace(effect, point=tuple(assembly.points[tie.lead].tolist()))


def candidates(context: SearchContext) -> list[Candidate]:
    """The rigid ties whose compliance explains most, by exact re-analysis from each base."""
    every = context.fasteners
    at = [k for k, (joint, _) in enumerate(every) if joint.rigid]
    if not at:
        return []
    built = context.where.groups.structure
    effects = [over_constraint(built.assembly, *every[k], len(at)) for k in at]
    if context.scan is None:
        some = farthest_point_sample(np.array([e.point for e in effects]), BY_POLES)
        chosen = [effects[k] for k in some]
        return best_places(context, chosen, FOLLOWED, anywhere=True, extended=True)
    left = np.ones((len(every), len(STARTS)))
    left[at] = [[e.left(x) for x in STARTS] for e in effects]
    out: dict[int, Candidate] = {}
    for about, base in reversed(tuple(enumerate(context.bases))):
        score = context.scan.fastener_scores(about, left)[at]
        best = np.argsort(score.min(axis=1)).tolist()
        for k in [k for k in best if k not in out][:FOLLOWED]:
            out[k] = Candidate(effects[k], np.array([STARTS[int(np.argmin(score[k]))]]), base)
    return list(out.values())


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Give a rigid tie of the article a stiffness of 30 to 1000 N/mm."""
    ties = rigid_ties(article.assembly)
    if not ties:
        raise ModelError("the structure has no rigid elements except those of its fasteners")
    tie = ties[int(rng.integers(len(ties)))]
    k = float(10 ** rng.uniform(4.5, 6.0))
    made = sprung(article.assembly, tie, k)
    return article.with_hidden(made, {"K": k}, article.assembly.points[tie.lead])


FAMILY = Family(
    OverConstraint,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE2", "CBUSH", "PBUSH"),
    settled_by="tap on both sides of the tie with a small hammer, and compare their motion",
    needs="rigid elements (RBE2, RBAR) except those at fasteners",
)
