"""Masses that the model lacks: at known grids, at the sensors, at an unknown place, on a spring."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..fem.assemble import structure
from ..fem.locate import Share
from ..geometry.facets import point_normals, tangents
from ..model.added_points import with_points
from ..model.assembly import Assembly, appended
from ..model.point_masses import with_masses
from .attachments import AtPoints, MovableMass, around, attachments, closer, strength
from .effect import Effect, Parameter, PointTerm, Traits, Weight
from .effect_context import EffectContext, ElementGrids
from .estimate import Estimate, Remarks
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places, valleys

SHARE = 0.03  # of the structure's mass: prior median of a point mass
TRIED = np.exp(np.linspace(-3.0, 1.5, 7))  # multiples of the median
RESONATOR_SHARE = 0.015  # of the structure's mass: prior median of a resonator's mass
TYPICAL = 3.0  # highest spectral line over the prior median of its frequency
LOWEST = 20.0  # highest spectral line over the lowest frequency tried
FREQUENCIES = 14  # tried, evenly spaced in their logarithm; broadened peaks smooth the gaps
PLACES = 60  # at which each is tried
LEAST_MASS = 0.05  # of the typical mass: the least mass accepted
IN_PLANE = 1e3  # times the spring: stiffness that holds the written mass in the plane of the sheet


@dataclass(frozen=True, eq=False)
class MassEffect(AtPoints):
    """Masses at grids: the rows are all three translations of each."""

    matrix = "M"

    def each(self, x: np.ndarray) -> np.ndarray:
        """Mass at every grid (n,) [kg]."""
        return self.parameters[0].value(x[0]) * np.broadcast_to(self.shares, len(self.grids))

    def weight(self, x: np.ndarray) -> Weight:
        """Total mass."""
        total = float(self.each(x).sum())
        return Weight(total, np.array([total]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CONM2 at each grid."""
        return with_masses(assembly, self.grids, self.each(x))


@dataclass(frozen=True, eq=False)
class SensorMass(AtPoints):
    """M + m Σ bᵀb over all sensors: mass of accelerometers and cables, removed before weighing."""

    name = "sensor-mass"
    claim = "the accelerometers' mass is missing from the model"
    matrix = "M"

    places: tuple[Share, ...] = ()  # (grid id, weight) pairs to which each sensor is attached

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write CONM2 at the grids, in proportion to their weights."""
        m = self.parameters[0].value(x[0])
        total: dict[int, float] = {}
        for grid, weight in (pair for share in self.places for pair in share):
            total[grid] = total.get(grid, 0.0) + weight * m
        return with_masses(assembly, tuple(total), np.array(list(total.values())))

    def weight(self, x: np.ndarray) -> Weight:
        """The sensors, without which the article is weighed."""
        return Weight(0.0, np.zeros(1), len(self.places) * self.parameters[0].value(x[0]))


def sensor_mass(where: EffectContext) -> list[SensorMass]:
    """One mass for every sensor; median 6 % of the structure's mass in total, 2 g each or more."""
    shares = tuple(sorted(set(where.setup.sensors)))
    if not shares:
        return []
    scale = max(2e-3, 0.06 * where.setup.weight / len(shares))
    m = strength("M", "kg", scale, 1.3, (-2.0, -1.0, 0.0))
    grids = tuple(sorted({max(share, key=lambda pair: pair[1])[0] for share in shares}))
    rows, text = where.at_shares(shares), f"at the {len(shares)} sensors"
    return [SensorMass((m,), text, grids=grids, rows=rows, places=shares)]


def _load_sensors(article: Article, rng: np.random.Generator) -> Article:
    """Add 0.25 to 0.6 % of the article's mass at every sensor, removed before weighing."""
    each = float(rng.uniform(0.0025, 0.006)) * article.weight
    loaded = with_masses(article.assembly, article.grids_at(article.outputs), each)
    hidden = article.with_hidden(loaded, {"M": each})
    return replace(hidden, off_scale=each * len(article.outputs))


@dataclass(frozen=True, eq=False)
class PointMass(MovableMass):
    """M + m Σ bᵀb over three translations b, at an unknown place."""

    name = "point-mass"
    claim = "the structure carries a mass that the model lacks"

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A mass near the k-th grid."""
        m = strength("M", "kg", SHARE * where.setup.weight, 1.2, (-1.5, -0.5, 0.5))
        return cls.at_grid(where, k, m, np.eye(3))

    @classmethod
    def of_lump(
        cls, where: EffectContext, point: np.ndarray, mass: float
    ) -> tuple[Self, np.ndarray]:
        """The mass at the nearest grid."""
        effect = cls.near(where, int(np.linalg.norm(where.grids.point - point, axis=1).argmin()))
        return effect, np.array([np.log(mass / effect.parameters[0].scale), 0.0, 0.0])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CONM2 at the nearest grid, offset to the place."""
        m, grid = self.parameters[0].value(x[0]), self.nearest(x)
        offset = self.written_at(assembly, x) - assembly.points[assembly.rows([grid])[0]]
        return with_masses(assembly, (grid,), m, offset)


def masses(context: SearchContext) -> list[Candidate]:
    """Masses at the places where they explain most, and the one that the weighing suggests.

    Calibration assigns additional weight of an article to density and thickness. From such a state
    a mass appears too small and at a wrong place.
    """
    strengths = SHARE * context.where.setup.weight * TRIED
    more = context.weighs_more
    known = (more,) if more > strengths.min() else ()
    return attachments(context, PointMass, strengths, known)


def _add_mass(article: Article, rng: np.random.Generator) -> Article:
    """Add 1.5 to 8 % of the article's mass at a grid."""
    weight, grid = article.weight, article.shell_grid(rng)
    m = float(rng.uniform(0.015, 0.08)) * weight
    loaded = with_masses(article.assembly, article.grids_at(np.array([grid])), m)
    return article.with_hidden(loaded, {"M": m}, article.place_of(grid))


@dataclass(frozen=True, eq=False)
class LocalResonator(MovableMass):
    """A mass on a spring, x = (ln mass, place along both axes of the patch, ln frequency).

    Across the sheet it responds with s² m ω²/(ω² + s²). Below its frequency it acts as a mass,
    above it nearly as nothing, and near it one mode becomes two. Its motion is a separate degree of
    freedom: no mass or spring at the grid can represent it over a band (den Hartog 1985, Mechanical
    Vibrations, 3.2). In the plane of the sheet the mass is carried rigidly. Its loss is left to the
    damping of the modes, which does not enter the comparison.
    """

    name = "local-resonator"
    claim = "a part on the structure vibrates on its own spring"
    # parallel resonators form a partial fraction: enough of them fit any response
    traits = Traits(lone=True, lump=True, own_dofs=1)

    nowhere: sp.csr_array = field(kw_only=True)  # (1, n) zero

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A resonator along the normal near the k-th grid."""
        n, rows = where.grids.normal[k], where.grids.rows
        m = strength("M", "kg", RESONATOR_SHARE * where.setup.weight, 1.0, (-0.7, 0.7))
        f = Parameter(
            "f", "Hz", 0.0, 0.6, where.setup.f_max / TYPICAL, step=0.15, nominal=4.0,
            starts=tuple(np.linspace(-np.log(LOWEST / TYPICAL), np.log(TYPICAL), 7)),
        )  # fmt: skip
        axes, nowhere = np.stack([n, *tangents(n)]), sp.csr_array((1, rows.shape[1]))
        return cls.at_grid(where, k, m, axes, (f,), direction=n, nowhere=nowhere)

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """K + k (b - e)(b - e)ᵀ, M + m (e eᵀ + t tᵀ): b across, t along the sheet, e the mass."""
        (m, k), (rows, moving), unit = self.values(x), self.placed(x), np.eye(4)
        across, along = ({p: d[at] for p, d in moving.items()} for at in (slice(1), slice(1, 3)))
        m_by_x, k_by_x, e = m * unit[:1], k * (unit[0] + 2 * unit[3])[None], np.ones((1, 1))
        return (
            PointTerm("K", rows[:1], np.array([k]), k_by_x, across, own=-e),
            PointTerm("M", self.nowhere, np.array([m]), m_by_x, own=e, carrier=rows[:1]),
            PointTerm("M", rows[1:], np.full(2, m), np.tile(m_by_x, (2, 1)), along),
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
        place = self.written_at(assembly, x)
        return with_oscillator(assembly, self.nearest(x), place, self.direction, m, k)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Mass and frequency; ``location`` holds the place."""
        return Effect.reported(self, x, sd)[::3]


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


def resonators(context: SearchContext) -> list[Candidate]:
    """The best place and frequency about each baseline, by exact re-analysis."""
    where = context.where
    some = where.places.spread(PLACES)
    if context.scan is None:
        few = where.places.only(some[: PLACES // 3])
        at = [where.grids.position(*spot) for spot in zip(few.grids, few.normal, strict=True)]
        return best_places(context, [LocalResonator.near(where, k) for k in at])
    mass, f_max = RESONATOR_SHARE * where.setup.weight, where.setup.f_max
    hertz = np.geomspace(f_max / LOWEST, f_max, FREQUENCIES)
    places, taken = where.places.only(some), list[int]()
    out: list[Candidate] = []
    for about in range(len(context.bases)):
        score = _scores(context, about, mass, hertz, places)[1]
        for k in valleys(score.min(axis=1), places.point, taken):
            taken.append(k)
            step, best = hertz[1] / hertz[0], hertz[int(np.argmin(score[k]))]
            finer, closer = best * step ** np.linspace(-1, 1, 5), around(where.grids, places, k)
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
    amount, score = _scores(context, about, mass, hertz, places)
    k, level = np.unravel_index(int(np.argmin(score)), score.shape)
    at = context.where.grids.position(places.grids[k], places.normal[k])
    effect = LocalResonator.near(context.where, at)
    m, f = np.clip(amount[k, level], LEAST_MASS * mass, 10 * mass), hertz[level]
    ln_m, ln_f = (np.log(v / effect.parameters[p].scale) for v, p in ((m, 0), (f, 3)))
    return Candidate(effect, np.array([ln_m, 0.0, 0.0, ln_f]), context.bases[about])


def _add_resonator(article: Article, rng: np.random.Generator) -> Article:
    """Add a resonator of 1.5 to 5 % of the mass, tuned between the deck's first elastic modes."""
    grid, m = article.shell_grid(rng), float(rng.uniform(0.015, 0.05)) * article.weight
    elastic = normal_modes(structure(article.deck).system, 12).frequency[6:]
    f = float(np.exp(rng.uniform(np.log(elastic[0]), np.log(elastic[-1]))))
    (at,) = article.grids_at(np.array([grid]))
    made, row = article.assembly, article.assembly.rows([at])[0]
    normal = point_normals(made.points, made.shells.nodes)[row]
    made = with_oscillator(made, at, made.points[row], normal, m, m * (2 * np.pi * f) ** 2)
    return article.with_hidden(made, {"M": m, "f": f}, article.place_of(grid))


SENSORS = Family(
    SensorMass,
    _load_sensors,
    placed=sensor_mass,
    cards=("CONM2",),
    settled_by="measure again with half of the sensors removed",
)
POINT = Family(
    PointMass,
    _add_mass,
    candidates=masses,
    closer=closer,
    of_lump=PointMass.of_lump,
    cards=("CONM2",),
    settled_by="weigh the structure with all attached parts",
)
RESONATOR = Family(
    LocalResonator,
    _add_resonator,
    candidates=resonators,
    closer=closer,
    cards=("GRID", "CONM2", "PBUSH", "CBUSH", "CORD2R"),
    settled_by="hold or tap the parts that may vibrate there, and measure again",
)
