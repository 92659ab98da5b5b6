"""Two sheets that almost touch in the model and do touch in reality."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..geometry.clearance import all_gaps
from ..geometry.folds import smooth_points
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect_context import ElementGrids
from .family import Article, Family
from .points import AtPoints, strength
from .search_context import Candidate, SearchContext, best_places, valleys
from .sheet_pairs import SheetPairs

MEDIAN, SD = 2e4, 2.0  # [N/m], sd of ln
STARTS = (-2.0, 0.0, 2.0)
TRIED = MEDIAN * np.exp(np.linspace(-4.0, 6.0, 6))
CLOSE = 1e-3  # [m] of clearance, or less
MOST_PLACES, BY_POLES = 200, 16  # places, sampled from all that are close
FOLLOWED = 2


@dataclass(frozen=True, eq=False)
class ClosePlaces(SheetPairs):
    """Places where two sheets nearly touch, away from joints; ``along`` is across the gap.

    Attributes
    ----------
    grids : (k,) int               ids of their grids on the first sheet
    sheets : names of both sheets at each place
    """

    grids: np.ndarray
    sheets: tuple[tuple[str, str], ...]

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

    place: ClosePlaces | None = None

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH between two RBE3 at the place."""
        assert self.place is not None
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
        np.array([e.place.along[0] for e in effects if e.place is not None]),
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
