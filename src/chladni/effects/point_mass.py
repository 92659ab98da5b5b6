"""A point mass that is missing from the model."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..model.assembly import Assembly
from .effect_context import EffectContext
from .family import Article, Family
from .movable_attachment import MovableMass, attachments, closer, moved, patch, there
from .points import strength, with_masses
from .search_context import Candidate, SearchContext

SHARE = 0.03  # of the structure's mass: prior median
TRIED = np.exp(np.linspace(-3.0, 1.5, 7))  # multiples of the median


@dataclass(frozen=True, eq=False)
class PointMass(MovableMass):
    """M + m Σ bᵀb over three translations b, at an unknown place."""

    name = "point-mass"
    claim = "the structure carries a mass that the model lacks"

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A mass near the k-th grid."""
        m = strength("M", "kg", SHARE * where.setup.weight, 1.2, (-1.5, -0.5, 0.5))
        return cls(moved(m), patch=patch(where, k, np.eye(3)), **there(where, k))

    @classmethod
    def of_lump(
        cls, where: EffectContext, point: np.ndarray, mass: float
    ) -> tuple[Self, np.ndarray]:
        """The mass at the nearest grid."""
        k = int(np.linalg.norm(where.grids.point - point, axis=1).argmin())
        effect = cls.near(where, k)
        return effect, np.array([np.log(mass / effect.parameters[0].scale), 0.0, 0.0])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CONM2 at the nearest grid, offset to the place."""
        m, grid = self.parameters[0].value(x[0]), self.nearest(x)
        offset = self.at(x) - assembly.points[assembly.rows([grid])[0]]
        return with_masses(assembly, (grid,), m, offset)


def candidates(context: SearchContext) -> list[Candidate]:
    """Masses at the places where they explain most, and the one that the weighing suggests.

    Calibration assigns additional weight of an article to density and thickness. From such a state
    a mass appears too small and at a wrong place.
    """
    strengths = SHARE * context.where.setup.weight * TRIED
    more = context.weighs_more
    known = (more,) if more > strengths.min() else ()
    return attachments(context, PointMass.near, "M", strengths, known)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add 1.5 to 8 % of the article's mass at a grid."""
    weight, grid = article.weight, article.shell_grid(rng)
    m = float(rng.uniform(0.015, 0.08)) * weight
    at = article.grids_at(np.array([grid]))
    loaded = with_masses(article.assembly, at, m)
    return article.with_hidden(loaded, {"M": m}, article.place_of(grid))


FAMILY = Family(
    PointMass,
    conceal,
    candidates=candidates,
    closer=closer,
    of_lump=PointMass.of_lump,
    cards=("CONM2",),
    settled_by="weigh the structure with all attached parts",
)
