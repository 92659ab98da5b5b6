"""A contact with the ground the model does not know of."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..model.assembly import Assembly
from .family import Article, Family
from .movable_attachment import MovableAttachment, attachments, moved, patch, there
from .points import strength, with_springs
from .search_context import Candidate, SearchContext
from .surroundings import Surroundings

TRIED = np.exp(np.linspace(-4.5, 4.5, 9))  # multiples of the prior median


@dataclass(frozen=True, eq=False)
class ExtraSupport(MovableAttachment):
    """A spring to ground at an unknown place."""

    name = "extra-support"
    claim = "the structure touches something stiff that the model does not have"

    @classmethod
    def near(cls, where: Surroundings, k: int) -> Self:
        """A spring along the normal near the k-th grid."""
        K = strength("K", "N/m", where.setup.stiffness, 2.0, (-2.0, 0.0, 2.0))
        n = where.grids.normal[k]
        return cls(moved(K), patch=patch(where, k, n[None]), direction=n, **there(where, k))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """CELAS2 to ground shared by the grids round the place."""
        assert self.patch is not None
        k, at = self.parameters[0].value(x[0]), self.patch.size * x[1:3]
        for grid, part in self.shares(at):
            assembly = with_springs(assembly, (grid,), self.direction[None], k * part)
        return assembly

    def shares(self, at: np.ndarray) -> list[tuple[int, float]]:
        """The nearest grids and their shares of the spring, linear in the distance."""
        assert self.patch is not None
        d = np.linalg.norm(self.patch.flat - at, axis=1)
        near = np.argsort(d)[:3]
        if d[near[0]] < 0.15 * self.patch.size:
            return [(int(self.patch.grids[near[0]]), 1.0)]
        A = np.vstack([self.patch.flat[near].T, np.ones(3)])
        w = np.clip(np.linalg.lstsq(A, np.append(at, 1.0), rcond=None)[0], 0.0, None)
        return [
            (int(self.patch.grids[k]), float(v / w.sum())) for k, v in zip(near, w, strict=True)
        ]


def candidates(context: SearchContext) -> list[Candidate]:
    """Springs at the places where they explain most."""
    strengths = context.where.setup.stiffness * TRIED
    return attachments(context, ExtraSupport.near, "K", strengths)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A spring of 2 to 50 kN/m along z at a grid."""
    grid = article.shell_grid(rng)
    K = float(np.exp(rng.uniform(np.log(2e3), np.log(5e4))))
    at = article.grids_at(np.array([grid]))
    point = article.deck.points[article.deck.rows([grid])[0]].tolist()
    truth = {"point_m": point, "value": K, "parameters": {"K": K}}
    held = with_springs(article.assembly, at, np.eye(3)[2:], K)
    return replace(article, assembly=held, truth=truth)


FAMILY = Family(
    ExtraSupport,
    conceal,
    candidates=candidates,
    cards=("CELAS2",),
    settled_by="lift the structure off whatever touches it there, and measure again",
)
