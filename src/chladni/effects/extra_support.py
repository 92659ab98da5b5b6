"""A contact with the ground that is missing from the model."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import tangents
from ..model.assembly import Assembly
from ..model.ground_springs import with_ground_bushes
from .effect import Parameter, PointTerm, Traits
from .effect_context import EffectContext
from .estimate import Location
from .family import Article, Family
from .movable_attachment import MovableAttachment, attachments, closer, moved, patch, there
from .points import strength, with_springs
from .search_context import Candidate, SearchContext

TILT = 0.5  # prior sd of the tangent of its tilt: folds of a sheet have normals up to 45 deg apart
FLATTEST = 0.2  # least cosine to a new normal for which the tilt is converted exactly
ACROSS = 0.97  # cosine to the normal from which the direction is not reported
TRIED = np.exp(np.linspace(-4.5, 4.5, 9))  # multiples of the prior median


@dataclass(frozen=True, eq=False)
class ExtraSupport(MovableAttachment):
    """A spring to ground at an unknown place, roughly along the normal.

    x = (ln strength, place along both axes of the patch, tilt towards each of them). The tilt is
    needed because a contact at an edge or a fold seldom acts along the normal.
    """

    name = "extra-support"
    claim = "the structure touches a stiff object that the model lacks"
    traits = Traits(elastic=True)

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A spring along the normal near the k-th grid."""
        K = strength("K", "N/m", where.setup.stiffness, 2.0, (-2.0, 0.0, 2.0))
        n = where.grids.normal[k]
        tilt = [Parameter(f"tilt {a}", "-", 0.0, TILT, kind="linear", step=0.2) for a in "uv"]
        axes = np.stack([n, *tangents(n)])
        return cls((*moved(K), *tilt), patch=patch(where, k, axes), direction=n, **there(where, k))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One spring along the tilted direction."""
        assert self.patch is not None
        at, (d, slopes) = self.patch.size * x[1:3], _tilted(x[3:])
        every = self.patch.at(at)
        c = self.parameters[0].value(x[0])
        moving = {
            1 + k: sp.csr_array(d[None] @ self.patch.slope(at, k)) * self.patch.size
            for k in range(2)
        } | {3 + k: sp.csr_array(slopes[k][None] @ every) for k in range(2)}
        rows = sp.csr_array(d[None] @ every)
        return (PointTerm("K", rows, np.array([c]), c * np.eye(5)[:1], moving),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows across the sheet at 7 grids near the start, and in its plane at the 3 nearest."""
        assert self.patch is not None
        near = np.argsort((self.patch.flat**2).sum(axis=1))
        across, *within = self.patch.rows
        return sp.csr_array(sp.vstack([across[near[:7]], *(rows[near[:3]] for rows in within)]))

    def pushes(self, x: np.ndarray) -> np.ndarray:
        """Direction of the spring in the basic frame (3,)."""
        return _tilted(x[3:])[0] @ np.stack([self.direction, *tangents(self.direction)])

    def recentred(self, x: np.ndarray, where: EffectContext) -> tuple[Self, np.ndarray] | None:
        """The effect centred on the grid it moved to, with the same direction of force."""
        again = super().recentred(x, where)
        if again is None:
            return None
        effect, start = again
        d, n = self.pushes(x), effect.direction
        d = d * np.copysign(1.0, d @ n)
        tilt = np.stack(tangents(n)) @ d / max(float(d @ n), FLATTEST)
        return effect, np.append(start[:3], tilt)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH to ground at the place, attached to the nearest grid."""
        row = assembly.rows([self.nearest(x)])
        k, d = self.parameters[0].value(x[0]), self.pushes(x)
        return with_ground_bushes(assembly, row, d[None], k, self.at(x)[None])

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, and the direction where it is not across the sheet."""
        found, d = super().location(x, sd), self.pushes(x)
        if abs(d @ self.direction) > ACROSS:
            return found
        return replace(found, text=f"{found.text}, along ({', '.join(f'{v:.2f}' for v in d)})")


def _tilted(tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unit vector (1, u, v)/√(1 + u² + v²) (3,), and its slopes along u and v (2, 3)."""
    raw = np.array([1.0, *tilt])
    size = float(np.linalg.norm(raw))
    d = raw / size
    return d, np.array([(e - d * d[k]) / size for k, e in zip((1, 2), np.eye(3)[1:], strict=True)])


def candidates(context: SearchContext) -> list[Candidate]:
    """Springs at the places where they explain most."""
    strengths = context.where.setup.stiffness * TRIED
    return attachments(context, ExtraSupport.near, "K", strengths)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add a spring to ground of 2 to 50 kN/m along z at a grid."""
    grid = article.shell_grid(rng)
    K = float(np.exp(rng.uniform(np.log(2e3), np.log(5e4))))
    at = article.grids_at(np.array([grid]))
    held = with_springs(article.assembly, at, np.eye(3)[2:], K)
    return article.with_hidden(held, {"K": K}, article.place_of(grid))


FAMILY = Family(
    ExtraSupport,
    conceal,
    candidates=candidates,
    closer=closer,
    cards=("CBUSH", "PBUSH", "CORD2R"),
    settled_by="remove every contact of the structure there, and measure again",
)
