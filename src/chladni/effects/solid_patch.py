"""A region of a body of solids where the material differs: an insert, a casting fault, a filler.

Its solids take a material of their own. E and rho are two unknowns; K and M are linear in them. The
regions are balls of solids that hang together, and a search moves them from solid to solid.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self

import numpy as np
import scipy.sparse as sp

from ..arrays import alike
from ..errors import ModelError
from ..fem.energy import bare, mass_properties
from ..geometry.beam_lines import connected_rows
from ..geometry.facets import cell_areas
from ..geometry.sampling import farthest_point_sample
from ..geometry.solid_faces import skin
from ..geometry.solid_shapes import CORNERS
from ..model.assembly import Assembly, picked
from .calibration_parameters import scaled
from .effect import Effect, MatrixTerm, Parameter, Traits, Weight
from .effect_context import EffectContext
from .element_groups import group_of_shells
from .estimate import in_mm
from .family import Article, Family
from .joint_stiffness import within_joints
from .joints import MOST_SOLIDS, solid_parts
from .search_context import Candidate, SearchContext, best_places, valleys

SD = 0.6  # prior of ln of both factors: from half to twice the deck's
STARTS = (-0.7, 0.0, 0.7)
RADII = (0.1, 0.18, 0.3)  # of the root of half of the surface of the part, as on a sheet
PLACES, FEW = 80, 16  # middles that are tried with responses, and with natural frequencies alone
PIECES = 64  # of all bodies, in whose E and rho the responses are linearised
WAYS = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])  # E, rho or both are scanned
FOLLOWED = 2  # regions that are fitted, for each baseline
MOST = 1.0  # largest ln of a factor from which a fit starts
STEPS = 6  # moves of a region while it explains more
BETTER = 0.5  # least gain of a move in -2 ln posterior
FARTHER, LARGER = 0.5, 1.3  # a move in radii, and the factor on the radius


@dataclass(frozen=True, eq=False)
class Bodies:
    """The solids of a structure that are no joints between sheets, of all kinds in one order."""

    ids: np.ndarray  # (m,)
    part: np.ndarray  # (m,)
    nodes: np.ndarray  # (m, 8) rows of their corners, the last one repeated
    centre: np.ndarray  # (m, 3) [m]
    size: np.ndarray  # (parts,) root of half of the surface of each part [m]

    @classmethod
    def of(cls, assembly: Assembly) -> Self:
        """Collect all solids; next to sheets and beams, metal in pieces larger than welds."""
        corners, part, ids = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
        size = np.zeros(len(assembly.parts))
        for k, rows in _rows(assembly):
            some = picked(assembly.solids[k], rows)
            faces, owner, _ = skin(some.nodes, some.part)
            size += np.bincount(owner, cell_areas(assembly.points, faces), len(size)) / 2
            own = some.nodes[:, : CORNERS[some.nodes.shape[1]]]
            corners.append(own[:, np.minimum(np.arange(8), own.shape[1] - 1)])
            part.append(some.part)
            ids.append(some.ids)
        nodes, none = np.concatenate([np.zeros((0, 8), int), *corners]), np.zeros(0, int)
        every, parts = (np.concatenate([none, *rows]) for rows in (ids, part))
        return cls(every, parts, nodes, assembly.points[nodes].mean(axis=1), np.sqrt(size))

    def __len__(self) -> int:
        return len(self.ids)

    def ball(self, middle: int, radius: float) -> np.ndarray:
        """Solids of one part within a radius [m] of a solid that hang together with it (k,)."""
        d = np.linalg.norm(self.centre - self.centre[middle], axis=1)
        near = np.flatnonzero((d <= radius) & (self.part == self.part[middle]))
        pieces = (near[rows] for rows in connected_rows(self.nodes[near]))
        return next(rows for rows in pieces if middle in rows)

    def balls(self, most: int, radii: Sequence[float]) -> list["Ball"]:
        """Balls about middles far from each other, with radii in shares of the size."""
        middles = farthest_point_sample(self.centre, most).tolist()
        return self._regions(
            (k, share * float(self.size[self.part[k]])) for k in middles for share in radii
        )

    def moved(self, middle: int, radius: float) -> list["Ball"]:
        """Neighbours of a ball: smaller, larger, or about a solid next to its middle."""
        mine = np.flatnonzero(self.part == self.part[middle])
        step = FARTHER * radius * np.concatenate([np.eye(3), -np.eye(3)])
        at = self.centre[middle] + step
        d = np.linalg.norm(self.centre[mine] - at[:, None], axis=2)
        near = np.setdiff1d(mine[d.argmin(axis=1)], middle).tolist()
        sizes = (middle, radius / LARGER), (middle, radius * LARGER)
        return self._regions([*sizes, *((k, radius) for k in near)])

    def _regions(self, every: Iterable[tuple[int, float]]) -> list["Ball"]:
        """Balls that leave half of their part or more: the rest are the part itself."""
        most = np.bincount(self.part) / 2
        found = (Ball(k, radius, self.ball(k, radius)) for k, radius in every)
        return [b for b in found if len(b.rows) <= most[self.part[b.middle]]]


class Ball(NamedTuple):
    """Solids about one of them: its position, the radius [m], and the positions of all (k,)."""

    middle: int
    radius: float
    rows: np.ndarray


def _rows(assembly: Assembly) -> Iterator[tuple[int, np.ndarray]]:
    """(group of solids, rows) of the bodies."""
    if not len(assembly.shells) and not len(assembly.beams):
        yield from ((k, np.arange(len(s))) for k, s in enumerate(assembly.solids) if len(s))
        return
    for k, rows in solid_parts(assembly, soft=False):
        pieces = connected_rows(assembly.solids[k].nodes[rows])
        large = [rows[piece] for piece in pieces if len(piece) > MOST_SOLIDS]
        if large:
            yield k, np.concatenate(large)


@dataclass(frozen=True, eq=False)
class SolidPatch(Effect):
    """K + (e - 1) K_r and M + (r - 1) M_r of a region, x = ln of e = E/E_0 and of r = ρ/ρ_0."""

    name = "solid-patch"
    claim = "over a region of a solid the material is not that of the deck"
    traits = Traits(rounds=1)

    ids: np.ndarray = field(kw_only=True)  # of the solids (k,)
    middle: int = field(kw_only=True)  # position among the bodies
    stiffness: sp.csr_array = field(kw_only=True)  # K_r
    inertia: sp.csr_array = field(kw_only=True)  # M_r
    mass: float = field(kw_only=True)  # of the region [kg]

    @classmethod
    def on(cls, where: EffectContext, bodies: Bodies, ball: Ball, tried: int) -> Self:
        """A patch on some of the bodies."""
        built, ids, middle = where.groups.structure, bodies.ids[ball.rows], ball.middle
        made = built.assembly
        alone = replace(
            bare(made), solids=tuple(picked(s, np.isin(s.ids, ids)) for s in made.solids)
        )
        K, M = built.contribution(alone)
        x, y, z = bodies.centre[middle].tolist()
        name = made.parts[int(bodies.part[middle])].name
        unknown = tuple(
            Parameter(q, "of the deck's", 0.0, SD, step=0.5, starts=STARTS) for q in ("E", "rho")
        )
        return cls(
            unknown, f"in {name} near ({in_mm((x, y, z))} mm), {len(ids)} solids", (name,),
            point=(x, y, z), radius=ball.radius, trials_factor=tried, ids=ids, middle=middle,
            stiffness=K, inertia=M, mass=mass_properties(alone)[0],
        )  # fmt: skip

    def factors(self, x: np.ndarray) -> dict[str, float]:
        """E and rho over those of the deck."""
        return {p.name: p.value(v) for p, v in zip(self.parameters, x, strict=True)}

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The change of E on K_r, that of rho on M_r."""
        (e, r), (first, second) = self.factors(x).values(), np.eye(2)
        return (
            MatrixTerm("K", self.stiffness, e - 1, e * first, within=within_joints(self.ids)),
            MatrixTerm("M", self.inertia, r - 1, r * second),
        )

    def weight(self, x: np.ndarray) -> Weight:
        """(r - 1) m."""
        r = self.factors(x)["rho"]
        return Weight((r - 1) * self.mass, r * self.mass * np.eye(2)[1])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Give the region a property and a material of its own."""
        return with_region(assembly, self.ids, self.factors(x))


def with_region(assembly: Assembly, ids: np.ndarray, factors: dict[str, float]) -> Assembly:
    """Some solids of one part in a part of their own, whose E and rho are multiplied."""
    inside = [np.isin(s.ids, ids) for s in assembly.solids]
    own = next(
        s.part[mine][0] for s, mine in zip(assembly.solids, inside, strict=True) if any(mine)
    )
    part = assembly.parts[own]
    new = replace(
        part, id=1 + max(p.id for p in assembly.parts), name=f"{part.name}, from solid {ids[0]} on"
    )
    for quantity, factor in factors.items():
        new = scaled(new, quantity, factor)
    solids = tuple(
        replace(s, part=np.where(mine, len(assembly.parts), s.part))
        for s, mine in zip(assembly.solids, inside, strict=True)
    )
    return replace(assembly, parts=(*assembly.parts, new), solids=solids)


@dataclass(frozen=True, eq=False)
class _Pieces(Effect):
    """All patches of the bodies at once."""

    patches: tuple[SolidPatch, ...] = ()
    rows: tuple[np.ndarray, ...] = ()  # positions of the solids of each among the bodies

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """Those of each patch."""
        every = np.eye(len(x))
        return tuple(
            replace(term, gradient=term.gradient @ every[2 * k : 2 * k + 2])
            for k, patch in enumerate(self.patches)
            for term in patch.terms(x[2 * k : 2 * k + 2])
        )

    def weight(self, x: np.ndarray) -> Weight:
        """That of each patch."""
        each = [p.weight(v) for p, v in zip(self.patches, x.reshape(-1, 2), strict=True)]
        return Weight(sum(w.mass for w in each), np.concatenate([w.gradient for w in each]))


def candidates(context: SearchContext) -> list[Candidate]:
    """The balls of solids whose E, rho or both explain most, for each baseline.

    The responses are linearised in the E and rho of pieces of the bodies.
    """
    bodies = Bodies.of(context.where.groups.structure.assembly)
    if not len(bodies):
        return []
    alone = context.scan is None
    tried = bodies.balls(FEW, RADII[1:2]) if alone else bodies.balls(PLACES, RADII)
    if context.scan is None or not tried:
        return best_places(
            context, [SolidPatch.on(context.where, bodies, ball, len(tried)) for ball in tried]
        )
    pieces = _pieces(context, bodies)
    share = np.array([
        [np.isin(rows, ball.rows).mean() for rows in pieces.rows] for ball in tried
    ])  # fmt: skip
    change = np.einsum("kp,wq->pqkw", share, WAYS).reshape(2 * len(pieces.rows), -1)
    centre = np.repeat(bodies.centre[[ball.middle for ball in tried]], len(WAYS), axis=0)
    out, taken = list[Candidate](), list[int]()
    for about, base in enumerate(context.bases):
        amount, score = context.scan.effect_scores(about, pieces, change)
        for k in valleys(score, centre, taken, FOLLOWED):
            taken.append(k)
            ball, way = tried[k // len(WAYS)], WAYS[k % len(WAYS)]
            effect = SolidPatch.on(context.where, bodies, ball, len(tried))
            out.append(Candidate(effect, float(np.clip(amount[k], -MOST, MOST)) * way, base))
    return out


def _pieces(context: SearchContext, bodies: Bodies) -> _Pieces:
    """All bodies in pieces of about as many solids."""
    piece = group_of_shells(bodies.centre, bodies.part, np.ones(len(bodies)), PIECES)
    rows = tuple(alike(piece))
    every = (Ball(int(own[0]), 0.0, own) for own in rows)
    patches = tuple(SolidPatch.on(context.where, bodies, ball, 1) for ball in every)
    return _Pieces(tuple(p for e in patches for p in e.parameters), patches=patches, rows=rows)


def closer(context: SearchContext, effect: Effect, x: np.ndarray) -> Candidate | None:
    """Move a patch at x to neighbouring balls while it explains more."""
    assert isinstance(effect, SolidPatch)
    assert effect.radius is not None
    bodies = Bodies.of(context.where.groups.structure.assembly)
    first, least = effect, float(context.scores(effect, [x]).min())
    for _ in range(STEPS):
        near = [
            SolidPatch.on(context.where, bodies, ball, effect.trials_factor)
            for ball in bodies.moved(effect.middle, effect.radius)
        ]
        scores = [float(context.scores(e, [x]).min()) for e in near]
        if not scores or min(scores) > least - BETTER:
            break
        least, effect = min(scores), near[int(np.argmin(scores))]
    return None if effect is first else Candidate(effect, x, context.bases[-1])


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E by 0.4 to 0.7 or 1.4 to 2.2 and rho by 0.7 to 1.4 in a ball of solids."""
    bodies = Bodies.of(article.assembly)
    balls = bodies.balls(PLACES, [float(rng.uniform(0.15, 0.25))]) if len(bodies) else []
    if not balls:
        raise ModelError("the structure has no body of several solids, so no region of one differs")
    ball = balls[int(rng.integers(len(balls)))]
    soft = rng.uniform(np.log(0.4), np.log(0.7)), rng.uniform(np.log(1.4), np.log(2.2))
    known = {"E": float(np.exp(rng.choice(soft))),
             "rho": float(np.exp(rng.uniform(np.log(0.7), np.log(1.4))))}  # fmt: skip
    made = with_region(article.assembly, bodies.ids[ball.rows], known)
    return article.with_hidden(made, known, bodies.centre[ball.middle], radius_m=ball.radius)


FAMILY = Family(
    SolidPatch,
    conceal,
    candidates=candidates,
    closer=closer,
    cards=("MAT1", "MAT9", "PSOLID", "CHEXA", "CPENTA", "CPYRAM", "CTETRA"),
    settled_by="tap the solid there and next to it, and look into it by ultrasound or X-ray",
    needs="solids",
)
