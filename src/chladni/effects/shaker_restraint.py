"""The restraint of a shaker in addition to its force: stinger stiffness and force gauge mass.

A stinger is stiff along its axis, where the force gauge measures its force. Across the axis and in
rotation it holds the drive point as a beam clamped at the armature, 12EI/L³ and 4EI/L; the gauge
does not measure this. The mass of the gauge beyond its crystal moves with the structure (Ewins
2000, Modal Testing, 3.3). The effect acts at the drive point only.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure
from ..fem.locate import Share
from ..geometry.facets import tangents
from ..model.assembly import Assembly
from ..model.ground_springs import with_ground_bushes
from .effect import Effect, PointTerm, Weight
from .effect_context import EffectContext
from .family import Article, Family
from .points import strength, with_masses

MOST_DRIVES = 3  # drive points of fixed shakers; more points mean a hammer or a roving shaker
ACROSS, TURNING, GAUGE = 1e4, 3.0, 0.01  # medians of their priors [N/m, N m/rad, kg]


@dataclass(frozen=True, eq=False)
class ShakerRestraint(Effect):
    """x = (ln k_lat, ln k_rot, ln m) at one drive point.

    ``across`` are its rows along two directions normal to the drive, ``turns`` the rotations about
    these, ``moves`` all three translations.
    """

    name = "shaker-restraint"
    claim = "the shaker's stinger adds stiffness, or its force gauge adds mass"

    shares: Share = ()
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    across: sp.csr_array | None = None
    turns: sp.csr_array | None = None
    moves: sp.csr_array | None = None

    def values(self, x: np.ndarray) -> np.ndarray:
        """k_lat [N/m], k_rot [N m/rad], m [kg]."""
        return np.array([p.value(v) for p, v in zip(self.parameters, x, strict=True)])

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """k_lat and k_rot across the drive in K, m in all directions in M."""
        assert self.across is not None
        assert self.turns is not None
        assert self.moves is not None
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
    return [_at(where, shares, direction, len(drives)) for shares, direction in drives]


def _at(
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
        across=_rows(built, shares, ways, False), turns=_rows(built, shares, ways, True),
        moves=_rows(built, shares, np.eye(3), False),
    )  # fmt: skip


def _rows(built: Structure, shares: Share, ways: np.ndarray, turning: bool) -> sp.csr_array:
    """Rows (j, n) of the possible motions of a place along, or about, each direction (k, 3)."""
    rows = sp.csr_array(
        sum(w * built.along(np.full(len(ways), grid), ways, turning) for grid, w in shares)
    )
    return rows[np.flatnonzero(np.diff(rows.indptr) > 0)]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add a stiff stinger and a heavy gauge at the drive point, the gauge not weighed."""
    k_lat = float(np.exp(rng.uniform(np.log(5e3), np.log(5e4))))
    k_rot = float(np.exp(rng.uniform(np.log(1.0), np.log(10.0))))
    m = float(rng.uniform(0.005, 0.02)) * article.weight
    grid, direction = article.drive or (article.shell_grid(rng), (0.0, 0.0, 1.0))
    (at,) = article.grids_at(np.array([grid]))
    made = restrained(article.assembly, ((at, 1.0),), direction, k_lat, k_rot, m)
    known = {"k_lat": k_lat, "k_rot": k_rot, "m": m}
    return replace(article.with_hidden(made, known, article.place_of(grid)), off_scale=m)


FAMILY = Family(
    ShakerRestraint,
    conceal,
    placed=shaker_restraint,
    cards=("CBUSH", "PBUSH", "CORD2R", "CONM2"),
    settled_by="measure again with a hammer, or with a longer and thinner stinger",
    needs="a shaker",
)
