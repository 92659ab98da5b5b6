"""Two sheets that almost touch in the model and do touch in reality.

The motion of a spring between two sheets is that between two averages at one point. Each average is
the best rigid motion of the nearby grids of one sheet. Between two different points a rigid
rotation would load the spring.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..fem.average import average_rows
from ..geometry.clearance import all_gaps
from ..geometry.folds import smooth_points
from ..geometry.sampling import farthest_point_sample
from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, Average, appended
from .attachments import AtPoints, strength
from .effect_context import ElementGrids
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places, valleys

MEDIAN, SD = 2e4, 2.0  # [N/m], sd of ln
STARTS = (-2.0, 0.0, 2.0)
TRIED = MEDIAN * np.exp(np.linspace(-4.0, 6.0, 6))
CLOSE = 1e-3  # [m] of clearance, or less
MOST_PLACES, BY_POLES = 200, 16  # places, sampled from all that are close
FOLLOWED = 2


@dataclass(frozen=True, eq=False)
class SheetPairs:
    """Places at which two sheets face each other."""

    middle: np.ndarray  # (k, 3) places [m], unit vectors of the relative motion
    along: np.ndarray  # (k, 3) places [m], unit vectors of the relative motion
    # rows of the attached grids in either sheet for each place, three at least
    sides: tuple[tuple[np.ndarray, np.ndarray], ...]

    def __len__(self) -> int:
        return len(self.sides)

    def relative_rows(self, built: Structure) -> sp.csr_array:
        """Rows (k, n): motion of the second sheet relative to the first along the direction."""
        bare, ends = self.tied(replace(built.assembly, axes=None, rigid=()))
        means = average_rows(bare, np.arange(len(bare.rigid)))
        where = (means.dof[means.row], means.on)
        n = 6 * len(bare.points)
        G = sp.csr_array((means.factor, where), shape=(n, n))[:, : built.T.shape[0]]
        k = len(ends)
        first, second = (
            sp.csr_array(
                (
                    self.along.ravel(),
                    (np.repeat(np.arange(k), 3), (6 * end[:, None] + np.arange(3)).ravel()),
                ),
                shape=(k, n),
            )
            for end in ends.T
        )
        return sp.csr_array((second - first) @ G @ built.T)

    def tied(self, assembly: Assembly, on: np.ndarray | None = None) -> tuple[Assembly, np.ndarray]:
        """Add both ends of springs at some places (default all); return also their rows (k, 2)."""
        at = np.arange(len(self)) if on is None else on
        grown, rows = with_points(assembly, np.repeat(self.middle[at], 2, axis=0))
        first, T = next_id(assembly), (1, 2, 3)
        carriers = [grids for k in at for grids in self.sides[k]]
        means = tuple(
            Average(first + j, int(row), T, tuple((int(g), T, 1.0) for g in grids))
            for j, (row, grids) in enumerate(zip(rows, carriers, strict=True))
        )
        turns = np.array([(r, c) for r in rows for c in (4, 5, 6)], dtype=np.int64).reshape(-1, 2)
        supports = np.concatenate([grown.supports, turns])
        grown = replace(grown, rigid=(*grown.rigid, *means), supports=supports)
        return grown, rows.reshape(-1, 2)

    def gripped(self, assembly: Assembly, k: np.ndarray) -> Assembly:
        """Add springs k (k,) [N/m] along the directions, where k is positive."""
        on = np.flatnonzero(k > 0)
        grown, ends = self.tied(assembly, on)
        e = self.along[on]
        z = np.cross(e, np.eye(3)[np.abs(e).argmin(axis=1)])
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        stiffness = np.zeros((len(on), 6))
        stiffness[:, 0] = k[on]
        new = appended(
            grown.bushes, ids=next_id(grown) + np.arange(len(on)), nodes=ends,
            frame=np.stack([e, np.cross(z, e), z], axis=1), place=self.middle[on],
            stiffness=stiffness,
        )  # fmt: skip
        return replace(grown, bushes=new)


@dataclass(frozen=True, eq=False)
class ClosePlaces(SheetPairs):
    """Places where two sheets nearly touch, away from joints; ``along`` is across the gap."""

    grids: np.ndarray  # (k,) int ids of their grids on the first sheet
    sheets: tuple[tuple[str, str], ...]  # names of both sheets at each place

    def only(self, which: Sequence[int]) -> "ClosePlaces":
        """A selection of the places."""
        which = list(which)
        return ClosePlaces(
            self.middle[which], self.along[which], tuple(self.sides[k] for k in which),
            self.grids[which], tuple(self.sheets[k] for k in which),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ContactStiffness(AtPoints):
    """K + k bᵀ b, b the relative motion of two sheets across the gap."""

    name = "contact-stiffness"
    claim = "two sheets touch where the model has a gap"

    place: ClosePlaces = field(kw_only=True)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH between two RBE3 at the place."""
        return self.place.gripped(assembly, np.array([self.parameters[0].value(x[0])]))


def close_places(assembly: Assembly) -> ClosePlaces:
    """Places of all pairs of sheets that are close, away from joints, shared grids and folds.

    Two codes disagree on the stiffness of a fold (one ties the thickness of its shells there). A
    spring next to a fold would compensate for that difference: on a bolted bracket it gained odds
    of e^50 in this way.
    """
    nodes, found = assembly.shells.nodes, []
    smooth = smooth_points(assembly)
    cell = np.full(len(assembly.points), -1)
    for gap in all_gaps(assembly):
        part = assembly.part(gap.parts[0])
        mine = np.flatnonzero(assembly.shells.part == part)
        cell[nodes[mine].ravel()] = np.repeat(mine, 4)
        for k in np.flatnonzero(gap.free & (gap.clearance < CLOSE)):
            sides = np.unique(nodes[cell[gap.rows[k]]]), np.unique(gap.opposite[k])
            if smooth[np.concatenate(sides)].all():
                found.append((gap.rows[k], gap.normal[k], sides, gap.parts))
    rows = np.array([f[0] for f in found], dtype=np.int64)
    return ClosePlaces(
        assembly.points[rows], np.array([f[1] for f in found]).reshape(-1, 3),
        tuple(f[2] for f in found), assembly.ids[rows], tuple(f[3] for f in found),
    )  # fmt: skip


def contacts(built: Structure) -> list[ContactStiffness]:
    """One spring at each of a sample of the places where sheets are close."""
    every = close_places(built.assembly)
    if not len(every):
        return []
    places = every.only(farthest_point_sample(every.middle, MOST_PLACES).tolist())
    rows, K = places.relative_rows(built), strength("K", "N/m", MEDIAN, SD, STARTS)
    out = []
    for k, sheets in enumerate(places.sheets):
        grid, (x, y, z) = int(places.grids[k]), places.middle[k].tolist()
        text = f"between {sheets[0]} and {sheets[1]} at grid {grid}"
        out.append(
            ContactStiffness(
                (K,), text, sheets, (grid,), point=(x, y, z), trials_factor=len(places),
                place=places.only([k]), rows=rows[[k]],
            )
        )  # fmt: skip
    return out


def candidates(context: SearchContext) -> list[Candidate]:
    """The places at which a contact explains most, by exact re-analysis at each place."""
    effects = contacts(context.where.groups.structure)
    if not effects:
        return []
    points = np.array([e.point for e in effects])
    if context.scan is None:
        some = farthest_point_sample(points, BY_POLES)
        chosen = [effects[k] for k in some]
        return best_places(context, chosen, FOLLOWED, extended=True)
    places = ElementGrids(
        np.array([e.grids[0] for e in effects]),
        np.array([e.place.along[0] for e in effects]),
        points,
        sp.csr_array(sp.vstack([e.rows for e in effects])),
        np.full(len(effects), -1),
        np.zeros((len(effects), 3)),
    )
    base = context.bases[-1]
    scores = context.scan.point_scores(len(context.bases) - 1, "K", TRIED, places)
    return [
        Candidate(effects[k], np.array([np.log(TRIED[int(scores[k].argmin())] / MEDIAN)]), base)
        for k in valleys(scores.min(axis=1), points, wanted=FOLLOWED)
    ]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add a spring of 20 to 200 kN/m between two sheets that almost touch."""
    effects = contacts(structure(article.assembly))
    if not effects:
        raise ModelError("the structure has no two sheets that almost touch")
    effect = effects[int(rng.integers(len(effects)))]
    K = float(np.exp(rng.uniform(np.log(2e4), np.log(2e5))))
    made = effect.apply(article.assembly, np.array([np.log(K / MEDIAN)]))
    return article.with_hidden(made, {"K": K}, effect.point or ())


FAMILY = Family(
    ContactStiffness,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE3", "CBUSH", "PBUSH", "CORD2R"),
    settled_by="push a feeler gauge between the sheets there, and measure at two levels",
    needs="sheets that almost touch, away from joints",
    on_sheets=True,
)
