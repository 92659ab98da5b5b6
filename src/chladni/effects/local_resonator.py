"""A mass on a spring that is missing from the model: a bracket, a plug or a cable that resonates.

Across the sheet it responds with s² m ω²/(ω² + s²). Below its frequency it acts as a mass, above it
nearly as nothing, and near it one mode becomes two. Its motion is a separate degree of freedom: no
mass or spring at the grid can represent it over a band (den Hartog 1985, Mechanical Vibrations,
3.2). In the plane of the sheet the mass is carried rigidly. Its loss is left to the damping of the
modes, which does not enter the comparison.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..fem.assemble import structure
from ..geometry.facets import point_normals, tangents
from ..model.added_points import with_points
from ..model.assembly import Assembly, appended
from .effect import Effect, Parameter, PointTerm, Traits
from .effect_context import EffectContext, ElementGrids
from .estimate import Estimate, Remarks
from .family import Article, Family
from .movable_attachment import MovableMass, around, closer, moved, patch, there
from .points import strength, with_masses
from .search_context import Candidate, SearchContext, best_places, valleys

SHARE = 0.015  # of the structure's mass: prior median of the resonator's mass
TYPICAL = 3.0  # highest spectral line over the prior median of its frequency
LOWEST = 20.0  # highest spectral line over the lowest frequency tried
TRIED = 14  # frequencies, evenly spaced in their logarithm; broadened peaks smooth the gaps
PLACES = 60  # at which each is tried
LEAST_MASS = 0.05  # of the typical mass: the least mass accepted
IN_PLANE = 1e3  # times the spring: stiffness that holds the written mass in the plane of the sheet


@dataclass(frozen=True, eq=False)
class LocalResonator(MovableMass):
    """x = (ln mass, place along both axes of the patch, ln frequency)."""

    name = "local-resonator"
    claim = "a part on the structure vibrates on its own spring"
    # parallel resonators form a partial fraction: enough of them fit any response
    traits = Traits(lone=True, lump=True, own_dofs=1)

    nowhere: sp.csr_array = field(default_factory=lambda: sp.csr_array((1, 0)))  # zero row

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A resonator along the normal near the k-th grid."""
        n = where.grids.normal[k]
        m = strength("M", "kg", SHARE * where.setup.weight, 1.0, (-0.7, 0.7))
        lowest = -np.log(LOWEST / TYPICAL)
        f = Parameter(
            "f", "Hz", 0.0, 0.6, where.setup.f_max / TYPICAL, step=0.15, nominal=4.0,
            starts=tuple(np.linspace(lowest, np.log(TYPICAL), 7)),
        )  # fmt: skip
        at = patch(where, k, np.stack([n, *tangents(n)]))
        nowhere = sp.csr_array((1, at.rows[0].shape[1]))
        return cls((*moved(m), f), patch=at, direction=n, nowhere=nowhere, **there(where, k))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """K + k (b - e)(b - e)ᵀ, M + m (e eᵀ + t tᵀ): b across, t along the sheet, e the mass."""
        assert self.patch is not None
        at, size = self.patch.size * x[1:3], self.patch.size
        m, k = self.values(x)
        rows, moving = self.patch.at(at), [self.patch.slope(at, axis) * size for axis in range(2)]
        unit = np.eye(4)
        across = {1 + axis: slope[:1] for axis, slope in enumerate(moving)}
        along = {1 + axis: slope[1:] for axis, slope in enumerate(moving)}
        by_k = (k * (unit[0] + 2 * unit[3]))[None]
        return (
            PointTerm("K", rows[:1], np.array([k]), by_k, across, own=np.array([[-1.0]])),
            PointTerm(
                "M",
                self.nowhere,
                np.array([m]),
                m * unit[:1],
                own=np.array([[1.0]]),
                carrier=rows[:1],
            ),
            PointTerm("M", rows[1:], np.full(2, m), np.tile(m * unit[0], (2, 1)), along),
        )

    def values(self, x: np.ndarray) -> tuple[float, float]:
        """Mass m [kg] and spring m (2πf)² [N/m]."""
        m = self.parameters[0].value(x[0])
        return m, m * (2 * np.pi * self.parameters[3].value(x[3])) ** 2

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """A point mass, where the tuning or its interval exceeds the highest spectral line."""
        f, wide = self.parameters[3], 0.0 if sd is None else 1.96 * self.widened(sd)[3]
        above = (f.value(v) > TYPICAL * f.scale for v in (x[3], x[3] + wide))
        return Remarks(*("point-mass" if high else "" for high in above))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a GRID with CONM2, on a CBUSH from the nearest grid."""
        m, k = self.values(x)
        return with_oscillator(assembly, self.nearest(x), self.at(x), self.direction, m, k)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Mass and frequency; ``location`` holds the place."""
        every = Effect.reported(self, x, sd)
        return every[0], every[3]


def with_oscillator(
    assembly: Assembly, grid: int, place: np.ndarray, normal: np.ndarray, m: float, k: float
) -> Assembly:
    """Add a mass m [kg] on a spring k [N/m] along the normal, its foot rigidly tied to a grid.

    In the plane of the sheet the mass follows its foot; it does not rotate.
    """
    grown, (row,) = with_points(assembly, np.asarray(place)[None])
    frame = np.stack([normal, *tangents(normal)])
    if np.isclose(np.abs(normal).max(), 1.0, rtol=0, atol=1e-6):
        frame = np.eye(3)
    stiffness = np.where(np.abs(frame @ normal) > 0.5, k, IN_PLANE * k)
    grown = with_masses(grown, grown.ids[[row]].tolist(), m)
    bush = appended(
        grown.bushes, ids=[int(grown.bushes.ids.max(initial=0)) + 1],
        nodes=[[assembly.rows([grid])[0], row]], frame=[frame], place=[place],
        stiffness=[[*stiffness, 0, 0, 0]],
    )  # fmt: skip
    held = np.concatenate([assembly.supports, [[row, c] for c in (4, 5, 6)]])
    return replace(grown, bushes=bush, supports=held)


def candidates(context: SearchContext) -> list[Candidate]:
    """The best place and frequency about each baseline, by exact re-analysis."""
    where = context.where
    some = where.places.spread(PLACES)
    if context.scan is None:
        few = where.places.only(some[: PLACES // 3])
        at = [where.grids.position(*spot) for spot in zip(few.grids, few.normal, strict=True)]
        effects = [LocalResonator.near(where, k) for k in at]
        return best_places(context, effects)
    mass, f_max = SHARE * where.setup.weight, where.setup.f_max
    hertz = np.geomspace(f_max / LOWEST, f_max, TRIED)
    places, taken = where.places.only(some), list[int]()
    out: list[Candidate] = []
    for about in range(len(context.bases)):
        score = _scores(context, about, mass, hertz, places)[1]
        for k in valleys(score.min(axis=1), places.point, taken):
            taken.append(k)
            step, best = hertz[1] / hertz[0], hertz[int(np.argmin(score[k]))]
            closer = around(where.grids, places, k)
            finer = best * step ** np.linspace(-1, 1, 5)
            out.append(_best(context, about, mass, finer, closer))
    return out


def _scores(
    context: SearchContext, about: int, mass: float, hertz: np.ndarray, places: ElementGrids
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and score (n_places, n_hertz); the score is inf where the mass is too small."""
    assert context.scan is not None
    amount, score = context.scan.oscillator_scores(about, mass, hertz, places)
    return amount, np.where(amount > LEAST_MASS * mass, score, np.inf)


def _best(
    context: SearchContext, about: int, mass: float, hertz: np.ndarray, places: ElementGrids
) -> Candidate:
    """The resonator at the best of some places and frequencies."""
    where = context.where
    amount, score = _scores(context, about, mass, hertz, places)
    k, level = np.unravel_index(int(np.argmin(score)), score.shape)
    at = where.grids.position(places.grids[k], places.normal[k])
    effect = LocalResonator.near(where, at)
    m, f = np.clip(amount[k, level], LEAST_MASS * mass, 10 * mass), hertz[level]
    ln_m, ln_f = (np.log(v / effect.parameters[p].scale) for v, p in ((m, 0), (f, 3)))
    return Candidate(effect, np.array([ln_m, 0.0, 0.0, ln_f]), context.bases[about])


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add a resonator of 1.5 to 5 % of the mass, tuned between the deck's first elastic modes."""
    grid, m = article.shell_grid(rng), float(rng.uniform(0.015, 0.05)) * article.weight
    elastic = normal_modes(structure(article.deck).system, 12).frequency[6:]
    f = float(np.exp(rng.uniform(np.log(elastic[0]), np.log(elastic[-1]))))
    (at,) = article.grids_at(np.array([grid]))
    made, row = article.assembly, article.assembly.rows([at])[0]
    normal = point_normals(made.points, made.shells.nodes)[row]
    made = with_oscillator(made, at, made.points[row], normal, m, m * (2 * np.pi * f) ** 2)
    return article.with_hidden(made, {"M": m, "f": f}, article.place_of(grid))


FAMILY = Family(
    LocalResonator,
    conceal,
    candidates=candidates,
    closer=closer,
    cards=("GRID", "CONM2", "PBUSH", "CBUSH", "CORD2R"),
    settled_by="hold or tap the parts that may vibrate there, and measure again",
)
