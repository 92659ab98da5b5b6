"""Masses and springs at points: at known grids, or at an unknown place that a fit may move.

Between grids the motion of the sheet is interpolated by moving least squares with quadratic
polynomials (Lancaster and Salkauskas 1981, Math. Comp. 37, 141-158), so that a fit can use its
slope. On a line of beams the place moves along the line; the second parameter of the place is then
inactive and stays at its prior. The place stays within the grids: it is clipped to their range.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import cell_normals, tangents
from ..model.assembly import Assembly
from .effect import WIDER, Effect, Parameter, PointTerm, Traits, Weight
from .effect_context import EffectContext, ElementGrids, surface
from .estimate import Estimate, Location, in_mm
from .search_context import Candidate, SearchContext, best_places, valleys

NOTHING = -30.0  # ln of a strength over its median that is as good as zero
NEIGHBOURS = 14  # grids that take part in the interpolation
FACING = 0.85  # cosine between normals that still lie in one face
FAR = 0.75  # of a patch's size, beyond which the patch is centred again on the fitted place
_FLAT = 1e-6  # of a patch's size: grids with a smaller extent lie on a line
STEP = 1e-4  # of the local mesh size, for the slope of the interpolation weights
CLOSER = 60  # grids tried round each of the best places
TRIED = 40  # places that are evaluated one by one if only natural frequencies are known


def strength(name: str, unit: str, scale: float, sd: float, starts: tuple[float, ...]) -> Parameter:
    """A log-normal strength with median ``scale``."""
    return Parameter(name, unit, 0.0, sd, scale, step=1.0, starts=starts, nominal=NOTHING)


@dataclass(frozen=True, eq=False)
class AtPoints(Effect):
    """Σ_k c s_k b_kᵀ b_k at fixed rows b: one strength c = scale · e^x, in shares s."""

    matrix: ClassVar[Literal["K", "M"]] = "K"

    rows: sp.csr_array = field(kw_only=True)  # (k, n)
    # (m,) k/m rows one after another have one share
    shares: np.ndarray = field(default_factory=lambda: np.ones(1))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """The strength on every row."""
        each = np.repeat(self.shares, self.rows.shape[0] // len(self.shares))
        c = self.parameters[0].value(x[0]) * each
        return (PointTerm(self.matrix, self.rows, c, c[:, None]),)


@dataclass(frozen=True, eq=False)
class Patch:
    """Grids round a start, in the tangent plane, or on its line of beams."""

    grids: np.ndarray  # (k,) ids
    flat: np.ndarray  # (k, 2) places in the tangent plane, the start is the origin [m]
    plane: np.ndarray  # (2, 3) its axes; along a line of beams the second is zero
    origin: np.ndarray  # (3,) [m]
    rows: tuple[sp.csr_array, ...]  # of the structure at these grids, (k, n) for each direction
    size: float  # typical distance of neighbours [m]

    @classmethod
    def about(cls, where: EffectContext, k: int, directions: np.ndarray) -> Self:
        """The neighbours of the k-th grid in the same face of a sheet, or on its line of beams."""
        spots = where.grids
        d = spots.point - spots.point[k]
        if spots.line[k] < 0:
            mine = _in_face(where, spots.normal[k])
            plane, neighbours = np.stack(tangents(spots.normal[k])), NEIGHBOURS
        else:
            mine = np.zeros(len(spots), bool)
            mine[np.unique(spots.grids, return_index=True)[1]] = True
            mine &= np.isin(spots.grids, spots.grids[spots.line == spots.line[k]])
            plane, neighbours = np.stack([spots.along[k], np.zeros(3)]), NEIGHBOURS // 2
        distance = np.where(mine, np.linalg.norm(d, axis=1), np.inf)
        near = np.argsort(distance, kind="stable")[:neighbours]
        near = near[np.isfinite(distance[near])]
        size = float(distance[near][1 : 5 if spots.line[k] < 0 else 3].mean())
        rows = tuple(
            where.groups.structure.along(spots.grids[near], np.tile(axis, (len(near), 1)))
            for axis in directions
        )
        return cls(spots.grids[near], d[near] @ plane.T, plane, spots.point[k], rows, size)

    def inside(self, at: np.ndarray) -> np.ndarray:
        """A place of the plane, clipped to the range of the grids (2,)."""
        return np.asarray(np.clip(at, self.flat.min(axis=0), self.flat.max(axis=0)))

    def weights(self, at: np.ndarray) -> np.ndarray:
        """Interpolation weights of the grids at a place of the plane (k,)."""
        d = (self.flat - self.inside(at)) / self.size
        if not self.plane[1].any():
            d[:, 1] = 0.0
        w = np.exp(-(d**2).sum(axis=1) / 1.8)
        u, v = d.T
        P = np.stack([np.ones(len(d)), u, v, u**2, u * v, v**2], 1)
        A = (P.T * w) @ P + 1e-9 * np.eye(6)
        return np.asarray(np.linalg.solve(A, (P.T * w))[0])

    @cached_property
    def _blocks(self) -> tuple[np.ndarray, np.ndarray]:
        """Nonzero columns (m,) of the rows, and the rows in them (d, k, m)."""
        columns = np.unique(np.concatenate([rows.indices for rows in self.rows]))
        return columns, np.stack([rows[:, columns].toarray() for rows in self.rows])

    def _weighted(self, w: np.ndarray) -> sp.csr_array:
        """Weighted sum of the grids' rows with weights (k,), one per direction (d, n)."""
        columns, blocks = self._blocks
        (d, _, m), n = blocks.shape, self.rows[0].shape[1]
        ends = m * np.arange(d + 1)
        return sp.csr_array(((w @ blocks).ravel(), np.tile(columns, d), ends), shape=(d, n))

    def at(self, at: np.ndarray) -> sp.csr_array:
        """Rows at a place of the plane, one per direction (d, n)."""
        return self._weighted(self.weights(at))

    def slope(self, at: np.ndarray, axis: int) -> sp.csr_array:
        """Slope of these rows along an axis of the plane, one-sided at its end (d, n)."""
        e = STEP * self.size * np.eye(2)[axis]
        above, below = (self.inside(at + way * e) for way in (1, -1))
        apart = float(above[axis] - below[axis])
        change = self.weights(above) - self.weights(below)
        return self._weighted(change / apart if apart else 0.0 * change)


def _in_face(where: EffectContext, normal: np.ndarray) -> np.ndarray:
    """Grids of shells that face a direction, or that border on a shell which does (k,) bool.

    The normal of a grid on a fold is that of neither face, yet both faces reach as far as the fold.
    """
    spots, assembly = where.grids, where.groups.structure.assembly
    cells = surface(assembly)
    facing = np.abs(cell_normals(assembly.points, cells) @ normal) > FACING
    bordering = np.isin(spots.grids, assembly.ids[np.unique(cells[facing])])
    return ((np.abs(spots.normal @ normal) > FACING) | bordering) & (spots.line < 0)


@dataclass(frozen=True, eq=False)
class MovableAttachment(Effect):
    """x = (ln strength, place along both axes of the patch in units of its size, others)."""

    matrix: ClassVar[Literal["K", "M"]] = "K"

    patch: Patch = field(kw_only=True)
    direction: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def at_grid(
        cls, where: EffectContext, k: int, unknown: Parameter, directions: np.ndarray,
        others: Sequence[Parameter] = (), **more: Any,
    ) -> Self:  # fmt: skip
        """The effect near the k-th of ``where.grids``: its strength, its place, other unknowns.

        One step of a fit moves the place by about a mesh size.
        """
        place = [Parameter(n, "m", 0.0, 1.5, kind="linear", step=0.7) for n in ("along", "across")]
        grid, (x, y, z) = int(where.grids.grids[k]), where.grids.point[k].tolist()
        return cls(
            (unknown, *place, *others), f"at grid {grid}", grids=(grid,), point=(x, y, z),
            trials_factor=len(where.places), patch=Patch.about(where, k, directions), **more,
        )  # fmt: skip

    def placed(self, x: np.ndarray) -> tuple[sp.csr_array, dict[int, sp.csr_array]]:
        """Rows at the place, one per direction (d, n), and their slopes by its two parameters."""
        at, size = self.patch.size * x[1:3], self.patch.size
        return self.patch.at(at), {1 + k: self.patch.slope(at, k) * size for k in range(2)}

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One strength in every direction, at the place."""
        rows, moving = self.placed(x)
        c = np.full(rows.shape[0], self.parameters[0].value(x[0]))
        return (PointTerm(self.matrix, rows, c, np.outer(c, np.eye(3)[0]), moving),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows of the grids next to the start, so that the place may move."""
        nearest = np.argsort((self.patch.flat**2).sum(axis=1))[:7]
        return sp.csr_array(sp.vstack([rows[nearest] for rows in self.patch.rows]))

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """The effect near the k-th of ``where.grids``."""
        raise NotImplementedError

    def recentred(self, x: np.ndarray, where: EffectContext) -> tuple[Self, np.ndarray] | None:
        """The effect centred on the grid it moved to, if beyond ``FAR`` of the patch's size."""
        if np.abs(x[1:3]).max() < FAR:
            return None
        k = where.grids.position(self.nearest(x), self.direction)
        return self.near(where, k), np.array([x[0], 0.0, 0.0, *x[3:]])

    def at(self, x: np.ndarray) -> np.ndarray:
        """The place in the basic frame (3,) [m]."""
        return self.patch.origin + self.patch.inside(self.patch.size * x[1:3]) @ self.patch.plane

    def written_at(self, assembly: Assembly, x: np.ndarray) -> np.ndarray:
        """The place (3,) in a deck: that of the nearest grid if no element turns it with an arm."""
        row = assembly.rows([self.nearest(x)])[0]
        turns = (row == assembly.shells.nodes).any() or (row == assembly.beams.nodes).any()
        return self.at(x) if turns else np.asarray(assembly.points[row])

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The strength; ``location`` holds the place."""
        return super().reported(x, sd)[:1]

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, and its 95 % radius [m], at least the mesh size."""
        point, grid = tuple(float(v) for v in self.at(x)), self.nearest(x)
        text = f"near grid {grid} ({in_mm(point)} mm)"
        far = 1.0 if sd is None else max(self._reach(x, sd), 1.0)
        radius = self.patch.size * far
        return replace(self.where(), text=text, grids=(grid,), point_m=point, radius_m=radius)

    def _reach(self, x: np.ndarray, sd: np.ndarray) -> float:
        """95 % radius in units of the patch's size, widened as the intervals are.

        In a plane the radius is at most √5.99 times the larger standard deviation. Along a line (of
        beams, or the edge of a fold) it is 1.96 times the standard deviation. An axis counts only
        if the fit ended within the grids, because beyond them the place is fixed.
        """
        at, size = self.patch.size * x[1:3], self.patch.size
        moves = np.ptp(self.patch.flat, axis=0) > _FLAT * size
        times = np.sqrt(5.99) if moves.all() else 1.96
        known = moves & (self.patch.inside(at) == at)
        return float(times * WIDER * sd[1:3][known].max(initial=0.0))

    def nearest(self, x: np.ndarray) -> int:
        """Id of the grid nearest to the place."""
        d = self.patch.flat - self.patch.size * x[1:3]
        return int(self.patch.grids[np.argmin((d**2).sum(axis=1))])


@dataclass(frozen=True, eq=False)
class MovableMass(MovableAttachment):
    """A mass at an unknown place, whose first parameter is its logarithm."""

    matrix = "M"
    traits = Traits(lump=True)

    def weight(self, x: np.ndarray) -> Weight:
        """The mass itself."""
        m = self.parameters[0].value(x[0])
        return Weight(m, m * np.eye(len(x))[0])


def closer(context: SearchContext, effect: Effect, x: np.ndarray) -> Candidate | None:
    """The effect centred on the place it moved to, from the base of its fit."""
    assert isinstance(effect, MovableAttachment)
    again = effect.recentred(x, context.where)
    return None if again is None else Candidate(*again, context.bases[-1])


def attachments(
    context: SearchContext, kind: type[MovableAttachment], strengths: np.ndarray,
    known: Sequence[float] = (),
) -> list[Candidate]:  # fmt: skip
    """The two best places about each baseline, by exact re-analysis at every place.

    Parameters
    ----------
    strengths : [kg] of masses or [N/m] of springs
    known : strengths suggested by other evidence; the best place of each is followed too
    """
    where = context.where
    grids, places = where.grids, where.places
    if context.scan is None:
        some = np.arange(len(places)) if context.tells_places else places.spread(TRIED)
        at = [grids.position(places.grids[k], places.normal[k]) for k in some]
        return best_places(context, [kind.near(where, k) for k in at])
    scan, out = context.scan, []

    def follow(about: int, levels: np.ndarray, k: int) -> None:
        """Add the best grid round a place, with the best strength there."""
        closer = around(grids, places, k)
        finer = scan.point_scores(about, kind.matrix, levels, closer)
        best, level = np.unravel_index(np.argmin(finer), finer.shape)
        k_best = grids.position(closer.grids[best], closer.normal[best])
        effect, c = kind.near(where, k_best), levels[level]
        start = np.array([p.mean for p in effect.parameters])
        start[0] = np.log(c / effect.parameters[0].scale)
        out.append(Candidate(effect, start, context.bases[about]))

    chosen: list[int] = []
    unknown = len(strengths)
    for about in range(len(context.bases)):
        score = scan.point_scores(about, kind.matrix, np.append(strengths, known))
        for k in valleys(score[:, :unknown].min(axis=1), places.point, chosen, 2):
            chosen.append(k)
            follow(about, strengths, k)
        for c, at in zip(known, score[:, unknown:].argmin(axis=0), strict=True):
            follow(about, np.array([c]), int(at))
    return out


def around(grids: ElementGrids, places: ElementGrids, k: int) -> ElementGrids:
    """A denser sample of the grids round one of the places, up to half-way to the others."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(places.point).query(grids.point)[0]
    own = np.linalg.norm(grids.point - places.point[k], axis=1)
    near = np.flatnonzero(own <= nearest * (1 + 1e-9))
    return grids.only(near[grids.only(near).spread(CLOSER)])
