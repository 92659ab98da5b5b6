"""Springs to ground that the model lacks: of the suspension, of a support, of a shaker.

A stinger is stiff along its axis, where the force gauge measures its force. Across the axis and in
rotation it holds the drive point as a beam clamped at the armature, 12EI/L³ and 4EI/L; the gauge
does not measure this. The mass of the gauge beyond its crystal moves with the structure (Ewins
2000, Modal Testing, 3.3).
"""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure
from ..fem.locate import Share
from ..geometry.facets import tangents
from ..model.assembly import Assembly
from ..model.ground_springs import with_ground_bushes, with_springs
from ..model.point_masses import with_masses
from .attachments import (
    AtPoints,
    MovableAttachment,
    attachments,
    closer,
    strength,
)
from .effect import Effect, Parameter, PointTerm, Traits, Weight
from .effect_context import EffectContext
from .estimate import Location
from .family import Article, Family
from .search_context import Candidate, SearchContext

TILT = 0.5  # prior sd of the tangent of its tilt: folds of a sheet have normals up to 45 deg apart
FLATTEST = 0.2  # least cosine to a new normal for which the tilt is converted exactly
STRAIGHT = 0.97  # cosine to the normal from which the direction is not reported
TRIED = np.exp(np.linspace(-4.5, 4.5, 9))  # multiples of the prior median
RIGID = 1e-3  # of the highest line: rigid modes lie below
SMALLEST = 1e-6  # of the mobility of the whole mass: a place at rest
BEYOND = 2.0  # ln of a spring: step of its starts, and their reach beyond both ends
MOST_DRIVES = 3  # drive points of fixed shakers; more points mean a hammer or a roving shaker
ACROSS, TURNING, GAUGE = 1e4, 3.0, 0.01  # medians of their priors [N/m, N m/rad, kg]


@dataclass(frozen=True, eq=False)
class SpringEffect(AtPoints):
    """Springs to ground: one row at each of ``grids``, along each of ``directions`` (k, 3)."""

    directions: np.ndarray = field(kw_only=True)  # (k, 3)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a spring to ground at each grid: CELAS2, or CBUSH in an oblique direction."""
        k = self.parameters[0].value(x[0])
        return with_springs(assembly, self.grids, self.directions, k)


@dataclass(frozen=True, eq=False)
class Suspension(SpringEffect):
    """Springs to ground at the hangers, one stiffness for all."""

    name = "suspension"
    claim = "the suspension's stiffness is missing from the model"


def suspension(where: EffectContext) -> list[Suspension]:
    """Springs at the hangers, along the surface normal or along every direction.

    A tube has no normal. If a hanger is on a tube, springs in every direction come first, then each
    axis.
    """
    hangers = tuple(where.setup.hangers)
    if not hangers:
        return []
    on_shells = where.grids.line < 0
    known = dict(zip(where.grids.grids[on_shells], where.grids.normal[on_shells], strict=True))
    k = strength("K", "N/m", 0.1 * where.setup.stiffness, 2.0, (-3.0, -1.5, 0.0, 1.5))
    text = f"at hangers {', '.join(map(str, hangers))}"
    up = np.array([0.0, 0.0, 1.0])
    ways = [("", np.array([known.get(g, up) for g in hangers]))]
    if not known.keys() >= set(hangers):
        axes = zip("xyz", np.eye(3), strict=True)
        ways = [(f", along {a}", np.tile(e, (len(hangers), 1))) for a, e in axes]
    everywhere = Suspension(
        (k,), text + ", every direction", grids=tuple(np.repeat(hangers, 3)),
        trials_factor=len(ways) + 1, rows=where.translations(hangers),
        directions=np.tile(np.eye(3), (len(hangers), 1)),
    )  # fmt: skip
    one_way = [
        Suspension(
            (k,), text + how, grids=hangers, trials_factor=len(ways) + 1 if how else 1,
            rows=where.groups.structure.along(np.array(hangers), n), directions=n,
        )
        for how, n in ways
    ]  # fmt: skip
    return [*one_way, everywhere] if known.keys() >= set(hangers) else [everywhere, *one_way]


def _hang_on_cords(article: Article, rng: np.random.Generator) -> Article:
    """Add cords of 0.8 to 6 kN/m along z at the hangers."""
    K = float(np.exp(rng.uniform(np.log(800), np.log(6000))))
    at = article.grids_at(article.hangers)
    up = np.tile([0.0, 0.0, 1.0], (len(at), 1))
    return article.with_hidden(with_springs(article.assembly, at, up, K), {"K": K})


SUSPENSION = Family(
    Suspension,
    _hang_on_cords,
    placed=suspension,
    cards=("CELAS2", "CBUSH", "PBUSH", "CORD2R"),
    settled_by="measure again on softer cords",
)


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
        scale, n = where.setup.stiffness, where.grids.normal[k]
        K = strength("K", "N/m", scale, 2.0, free_to_fixed(where, k, scale))
        tilt = [Parameter(f"tilt {a}", "-", 0.0, TILT, kind="linear", step=0.2) for a in "uv"]
        return cls.at_grid(where, k, K, np.stack([n, *tangents(n)]), tilt, direction=n)

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One spring along the tilted direction."""
        (every, along), (d, slopes) = self.placed(x), _tilted(x[3:])
        moving = {p: sp.csr_array(d[None] @ slope) for p, slope in along.items()}
        moving |= {3 + k: sp.csr_array(slopes[k][None] @ every) for k in range(2)}
        rows, c = sp.csr_array(d[None] @ every), self.parameters[0].value(x[0])
        return (PointTerm("K", rows, np.array([c]), c * np.eye(5)[:1], moving),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows across the sheet at 7 grids near the start, and in its plane at the 3 nearest."""
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
        return with_ground_bushes(assembly, row, d[None], k, self.written_at(assembly, x)[None])

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, and the direction where it is not across the sheet."""
        found, d = super().location(x, sd), self.pushes(x)
        if abs(d @ self.direction) > STRAIGHT:
            return found
        return replace(found, text=f"{found.text}, along ({', '.join(f'{v:.2f}' for v in d)})")


def free_to_fixed(where: EffectContext, k: int, scale: float) -> tuple[float, ...]:
    """ln of springs over ``scale``: from 1/c, below which modes hardly notice one, to m ω².

    c = Σ φ²/ω² is the compliance of the k-th grid along its normal, 1/m = Σ φ² its mobility at the
    highest spectral line ω. Beyond m ω² the place is fixed. Modes pair differently on either end.
    """
    flexible = where.frequency > RIGID * where.setup.f_max
    if not flexible.any():
        return (-2.0, 0.0, 2.0)
    square = np.asarray(where.grids.rows[[k]] @ where.shapes)[0] ** 2
    square = square + SMALLEST / where.setup.weight
    omega = 2 * np.pi * where.frequency[flexible]
    c, mobility = float((square[flexible] / omega**2).sum()), float(square.sum())
    ends = 1 / c, (2 * np.pi * where.setup.f_max) ** 2 / mobility
    low, high = (float(np.log(end / scale)) for end in ends)
    return tuple(np.arange(low - BEYOND, high + BEYOND + 1, BEYOND).tolist())


def _tilted(tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unit vector (1, u, v)/√(1 + u² + v²) (3,), and its slopes along u and v (2, 3)."""
    raw = np.array([1.0, *tilt])
    size = float(np.linalg.norm(raw))
    d = raw / size
    return d, np.array([(e - d * d[k]) / size for k, e in zip((1, 2), np.eye(3)[1:], strict=True)])


def supports(context: SearchContext) -> list[Candidate]:
    """Springs at the places where they explain most."""
    strengths = context.where.setup.stiffness * TRIED
    return attachments(context, ExtraSupport, strengths)


def _add_support(article: Article, rng: np.random.Generator) -> Article:
    """Add a spring to ground of 2 to 50 kN/m along z at a grid."""
    grid = article.shell_grid(rng)
    K = float(np.exp(rng.uniform(np.log(2e3), np.log(5e4))))
    at = article.grids_at(np.array([grid]))
    held = with_springs(article.assembly, at, np.eye(3)[2:], K)
    return article.with_hidden(held, {"K": K}, article.place_of(grid))


SUPPORT = Family(
    ExtraSupport,
    _add_support,
    candidates=supports,
    closer=closer,
    cards=("CBUSH", "PBUSH", "CORD2R"),
    settled_by="remove every contact of the structure there, and measure again",
)


@dataclass(frozen=True, eq=False)
class ShakerRestraint(Effect):
    """k_lat and k_rot across the drive, and m, x their logarithms, at one drive point only."""

    name = "shaker-restraint"
    claim = "the shaker's stinger adds stiffness, or its force gauge adds mass"

    shares: Share = field(kw_only=True)  # (grid id, weight) pairs of the place
    direction: tuple[float, float, float] = field(kw_only=True)  # of the force
    across: sp.csr_array = field(kw_only=True)  # rows along two directions normal to the drive
    turns: sp.csr_array = field(kw_only=True)  # rows of the rotations about these
    moves: sp.csr_array = field(kw_only=True)  # rows of all three translations

    def values(self, x: np.ndarray) -> np.ndarray:
        """k_lat [N/m], k_rot [N m/rad], m [kg]."""
        return np.array([p.value(v) for p, v in zip(self.parameters, x, strict=True)])

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """k_lat and k_rot across the drive in K, m in all directions in M."""
        held = (("K", self.across), ("K", self.turns), ("M", self.moves))
        return tuple(
            PointTerm(matrix, rows, np.full(n, c), np.tile(c * e, (n, 1)))  # type: ignore[arg-type]
            for (matrix, rows), c, e in zip(held, self.values(x), np.eye(3), strict=True)
            if (n := rows.shape[0])
        )

    def weight(self, x: np.ndarray) -> Weight:
        """The gauge, without which the article is weighed."""
        return Weight(0.0, np.zeros(3), float(self.values(x)[2]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH to ground in a frame of the drive, and a CONM2."""
        return restrained(assembly, self.shares, self.direction, *self.values(x))


def restrained(
    assembly: Assembly, shares: Share, direction: Any, k_lat: float, k_rot: float, m: float
) -> Assembly:
    """Add the springs of a stinger [N/m, N m/rad] and a gauge [kg] at one place."""
    grids, weights = [g for g, _ in shares], np.array([w for _, w in shares])
    rows = assembly.rows(grids)
    place = weights @ assembly.points[rows]
    nearest = rows[[int(np.argmax(weights))]]
    d = np.asarray(direction, float)[None]
    k = np.array([[0.0, k_lat, k_lat, 0.0, k_rot, k_rot]])
    held = with_ground_bushes(assembly, nearest, d, k, place[None])
    return with_masses(held, grids, m * weights)


def shaker_restraint(where: EffectContext) -> list[ShakerRestraint]:
    """One effect at each drive point, if there are few enough for shakers."""
    drives = tuple(dict.fromkeys(where.setup.drives))
    if len(drives) > MOST_DRIVES:
        return []
    return [_restraint_at(where, shares, direction, len(drives)) for shares, direction in drives]


def _restraint_at(
    where: EffectContext, shares: Share, direction: tuple[float, float, float], tried: int
) -> ShakerRestraint:
    built = where.groups.structure
    grid = max(shares, key=lambda pair: pair[1])[0]
    place = sum(w * built.assembly.points[built.assembly.rows([g])[0]] for g, w in shares)
    x, y, z = np.asarray(place).tolist()
    ways = np.stack(tangents(np.array(direction)))
    unknown = (
        strength("k_lat", "N/m", ACROSS, 2.0, (-2.0, 1.0)),
        strength("k_rot", "N m/rad", TURNING, 1.5, (-2.0, 1.0)),
        strength("m", "kg", GAUGE, 1.0, (-1.0, 0.5)),
    )
    return ShakerRestraint(
        unknown, f"at the drive point, grid {grid}", grids=(grid,), point=(x, y, z),
        trials_factor=tried, shares=shares, direction=direction,
        across=_motions(built, shares, ways, False), turns=_motions(built, shares, ways, True),
        moves=_motions(built, shares, np.eye(3), False),
    )  # fmt: skip


def _motions(built: Structure, shares: Share, ways: np.ndarray, turning: bool) -> sp.csr_array:
    """Rows (j, n) of the possible motions of a place along, or about, each direction (k, 3)."""
    rows = sp.csr_array(
        sum(w * built.along(np.full(len(ways), grid), ways, turning) for grid, w in shares)
    )
    return rows[np.flatnonzero(np.diff(rows.indptr) > 0)]


def _restrain(article: Article, rng: np.random.Generator) -> Article:
    """Add a stiff stinger and a heavy gauge at the drive point, the gauge not weighed."""
    k_lat = float(np.exp(rng.uniform(np.log(5e3), np.log(5e4))))
    k_rot = float(np.exp(rng.uniform(np.log(1.0), np.log(10.0))))
    m = float(rng.uniform(0.005, 0.02)) * article.weight
    grid, direction = article.drive or (article.shell_grid(rng), (0.0, 0.0, 1.0))
    (at,) = article.grids_at(np.array([grid]))
    made = restrained(article.assembly, ((at, 1.0),), direction, k_lat, k_rot, m)
    known = {"k_lat": k_lat, "k_rot": k_rot, "m": m}
    return replace(article.with_hidden(made, known, article.place_of(grid)), off_scale=m)


SHAKER = Family(
    ShakerRestraint,
    _restrain,
    placed=shaker_restraint,
    cards=("CBUSH", "PBUSH", "CORD2R", "CONM2"),
    settled_by="measure again with a hammer, or with a longer and thinner stinger",
    needs="a shaker",
)
