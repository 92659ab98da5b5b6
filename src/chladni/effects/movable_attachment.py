"""A mass or a spring at an unknown place, which a fit may move.

Between grids the motion of the sheet is interpolated by moving least squares with quadratic
polynomials (Lancaster and Salkauskas 1981, Math. Comp. 37, 141-158), so that a fit can use its
slope. On a line of beams the place moves along the line; the second parameter of the place is then
inactive and stays at its prior. The place stays within the grids: it is clipped to their range.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import cell_normals, tangents
from .effect import WIDER, Effect, Parameter, PointTerm, Traits, Weight
from .effect_context import EffectContext, ElementGrids
from .estimate import Estimate, Location, in_mm
from .search_context import Candidate, SearchContext, best_places, valleys

NEIGHBOURS = 14  # grids that take part in the interpolation
FACING = 0.85  # cosine between normals that still lie in one face
FAR = 0.75  # of a patch's size, beyond which the patch is centred again on the fitted place
_FLAT = 1e-6  # of a patch's size: grids with a smaller extent lie on a line
STEP = 1e-4  # of the local mesh size, for the slope of the interpolation weights


@dataclass(frozen=True, eq=False)
class Patch:
    """Grids round a start, in the tangent plane, or on its line of beams.

    Attributes
    ----------
    grids : (k,) int          ids
    flat : (k, 2)             places in the tangent plane, the start is the origin [m]
    plane : (2, 3)            its axes; along a line of beams the second is zero
    origin : (3,) [m]
    rows : d lists            rows of the structure at these grids, one (k, n) per direction
    size : float              typical distance of neighbours [m]
    """

    grids: np.ndarray
    flat: np.ndarray
    plane: np.ndarray
    origin: np.ndarray
    rows: tuple[sp.csr_array, ...]
    size: float

    def inside(self, at: np.ndarray) -> np.ndarray:
        """A place of the plane, clipped to the range of the grids (2,)."""
        return np.asarray(np.clip(at, self.flat.min(axis=0), self.flat.max(axis=0)))

    def weights(self, at: np.ndarray) -> np.ndarray:
        """Interpolation weights of the grids at a place of the plane (k,)."""
        d = (self.flat - self.inside(at)) / self.size
        if not self.plane[1].any():
            d[:, 1] = 0.0
        w = np.exp(-(d**2).sum(axis=1) / 1.8)
        P = np.stack(
            [np.ones(len(d)), d[:, 0], d[:, 1], d[:, 0] ** 2, d[:, 0] * d[:, 1], d[:, 1] ** 2], 1
        )
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


@dataclass(frozen=True, eq=False)
class MovableAttachment(Effect):
    """x = (ln strength, place along both axes of the patch in units of its size, others)."""

    patch: Patch | None = None
    direction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    matrix = "K"

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One strength in every direction, at the place."""
        assert self.patch is not None
        at = self.patch.size * x[1:3]
        rows = self.patch.at(at)
        c = np.full(rows.shape[0], self.parameters[0].value(x[0]))
        gradient = np.zeros((len(c), 3))
        gradient[:, 0] = c
        moving = {1 + k: self.patch.slope(at, k) * self.patch.size for k in range(2)}
        return (PointTerm("M" if self.matrix == "M" else "K", rows, c, gradient, moving),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows of the grids next to the start, so that the place may move."""
        assert self.patch is not None
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
        assert self.patch is not None
        return self.patch.origin + self.patch.inside(self.patch.size * x[1:3]) @ self.patch.plane

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The strength; ``location`` holds the place."""
        return super().reported(x, sd)[:1]

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, and its 95 % radius [m], at least the mesh size."""
        assert self.patch is not None
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
        assert self.patch is not None
        at, size = self.patch.size * x[1:3], self.patch.size
        moves = np.ptp(self.patch.flat, axis=0) > _FLAT * size
        times = np.sqrt(5.99) if moves.all() else 1.96
        known = moves & (self.patch.inside(at) == at)
        return float(times * WIDER * sd[1:3][known].max(initial=0.0))

    def nearest(self, x: np.ndarray) -> int:
        """Id of the grid nearest to the place."""
        assert self.patch is not None
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


def moved(strength: Parameter) -> tuple[Parameter, ...]:
    """Parameters of strength and place; one step of a fit moves the place by about a mesh size."""
    place = [Parameter(n, "m", 0.0, 1.5, kind="linear", step=0.7) for n in ("along", "across")]
    return (replace(strength), *place)


def there(where: EffectContext, k: int) -> dict[str, Any]:
    """Fields of an effect near the k-th of ``where.grids``."""
    grid, (x, y, z) = int(where.grids.grids[k]), where.grids.point[k]
    point = float(x), float(y), float(z)
    tried = len(where.places)
    return {"text": f"at grid {grid}", "grids": (grid,), "point": point, "trials_factor": tried}


def _in_face(where: EffectContext, normal: np.ndarray) -> np.ndarray:
    """Grids of shells that face a direction, or that border on a shell which does (k,) bool.

    The normal of a grid on a fold is that of neither face, yet both faces reach as far as the fold.
    """
    spots, assembly = where.grids, where.groups.structure.assembly
    cells = assembly.shells.nodes
    facing = np.abs(cell_normals(assembly.points, cells) @ normal) > FACING
    bordering = np.isin(spots.grids, assembly.ids[np.unique(cells[facing])])
    return ((np.abs(spots.normal @ normal) > FACING) | bordering) & (spots.line < 0)


def patch(where: EffectContext, k: int, directions: np.ndarray) -> Patch:
    """The neighbours of the k-th grid in the same face of the sheet, or on its line of beams."""
    spots = where.grids
    d = spots.point - spots.point[k]
    if spots.line[k] < 0:
        mine = _in_face(where, spots.normal[k])
        plane, neighbours = np.stack(tangents(spots.normal[k])), NEIGHBOURS
    else:
        mine = np.zeros(len(spots), bool)
        mine[np.unique(spots.grids, return_index=True)[1]] = True
        mine = np.isin(spots.grids, spots.grids[spots.line == spots.line[k]]) & mine
        plane, neighbours = np.stack([spots.along[k], np.zeros(3)]), NEIGHBOURS // 2
    distance = np.where(mine, np.linalg.norm(d, axis=1), np.inf)
    near = np.argsort(distance, kind="stable")[:neighbours]
    near = near[np.isfinite(distance[near])]
    next_ones = distance[near][1 : 5 if spots.line[k] < 0 else 3]
    size = float(next_ones.mean())
    rows = tuple(
        where.groups.structure.along(spots.grids[near], np.tile(axis, (len(near), 1)))
        for axis in directions
    )
    return Patch(spots.grids[near], d[near] @ plane.T, plane, spots.point[k], rows, size)


CLOSER = 60  # grids tried round each of the best places
TRIED = 40  # places that are evaluated one by one if only natural frequencies are known


def attachments(
    context: SearchContext, near: Callable[[EffectContext, int], MovableAttachment], matrix: str,
    strengths: np.ndarray, known: Sequence[float] = (),
) -> list[Candidate]:  # fmt: skip
    """The two best places about each baseline, by exact re-analysis at every place.

    Parameters
    ----------
    near : makes the effect at a grid
    strengths : [kg] for "M" or [N/m] for "K"
    known : strengths suggested by other evidence; the best place of each is followed too
    """
    where = context.where
    grids, places = where.grids, where.places
    if context.scan is None:
        some = places.spread(TRIED)
        effects = [near(where, grids.position(places.grids[k], places.normal[k])) for k in some]
        return best_places(context, effects)
    scan, out = context.scan, []

    def follow(about: int, levels: np.ndarray, k: int) -> None:
        """Add the best grid round a place, with the best strength there."""
        closer = around(grids, places, k)
        finer = scan.point_scores(about, matrix, levels, closer)
        best, level = np.unravel_index(np.argmin(finer), finer.shape)
        k_best = grids.position(closer.grids[best], closer.normal[best])
        effect, c = near(where, k_best), levels[level]
        start = np.array([p.mean for p in effect.parameters])
        start[0] = np.log(c / effect.parameters[0].scale)
        out.append(Candidate(effect, start, context.bases[about]))

    chosen: list[int] = []
    unknown = len(strengths)
    for about in range(len(context.bases)):
        score = scan.point_scores(about, matrix, np.append(strengths, known))
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
