"""A line that stiffens a sheet: a rib, a bead or a stringer that the deck lacks.

It is a bar along a line of grids, of the material of the sheet. Its second moment of area about the
middle of the sheet and its area are two unknowns: a rib has both, a bead hardly any mass. It bends
out of the sheet only; it neither twists nor bends in the plane.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..fem.energy import only
from ..geometry.cells import edges_of
from ..geometry.facets import point_normals, unit
from ..geometry.sampling import farthest_point_sample, nearest_points
from ..model.added_beams import with_beam_line
from ..model.assembly import Assembly
from ..model.properties import BeamSection, Isotropic, ShellSection
from .attachments import strength
from .crack import LENGTHS, PLACES, Line, LineFinder, far_apart
from .effect import Effect, MatrixTerm, Traits, Weight
from .effect_context import EffectContext
from .estimate import Remarks, in_mm
from .family import Article, Family
from .search_context import Candidate, ResponseScan, SearchContext, best_places, followed

BENDING, AREA = 20.0, 4.0  # prior medians over t⁴ and t²: a rib of 2 t by 4 t, or a flat bead
STRAIGHT = 0.8  # least cosine of an edge to the line: no zigzag along diagonals
BEGUN = 6  # lines of shells whose grids are tried
FEW = 16  # middles of lines that are tried if only natural frequencies are known
FOLLOWED = 2  # lines that are fitted
MASSES = (0.003, 0.01, 0.03)  # of the article's, with which the place of a heavy rib is sought
SHORTEST = 3  # grids of a line
LONGER = (1, 3)  # edges by which a move lengthens a line


@dataclass(frozen=True, eq=False)
class Stiffener(Effect):
    """K + I K_I + A K_A and M + A M_A of bars along a line of grids, x = ln of I and A."""

    name = "stiffener"
    claim = "the sheet has a line that stiffens it, for example a rib, a bead or a stringer"
    traits = Traits(rounds=1)

    section: BeamSection = field(kw_only=True)  # at the prior medians
    up: np.ndarray = field(kw_only=True)  # (n, 3) normal of the sheet at each bar
    length: float = 0.0  # of the line [m]
    bending: sp.csr_array = field(kw_only=True)  # at the prior medians: K of I
    membrane: sp.csr_array = field(kw_only=True)  # K of A
    mass: sp.csr_array = field(kw_only=True)  # M of A

    @classmethod
    def along(cls, where: EffectContext, grids: Sequence[int], tried: int) -> Self | None:
        """Bars along a line of grids of a sheet; None if its material is not isotropic."""
        built = where.groups.structure
        assembly = built.assembly
        section = section_for(assembly, grids)
        if section is None:
            return None
        up = normals_along(assembly, grids)
        plain = BeamSection(section.material, section.area)

        def of(some: BeamSection) -> tuple[sp.csr_array, sp.csr_array]:
            made = with_beam_line(assembly, grids, some, up, cls.name)
            return built.contribution(only(made, len(assembly.parts)))

        (K, _), (K_A, M_A) = of(section), of(plain)
        X = assembly.points[assembly.rows(np.asarray(grids))]
        x, y, z = X.mean(axis=0).tolist()
        unknown = (
            strength("I", "m4", section.I1, 1.5, (-1.0, 0.5, 2.0)),
            strength("A", "m2", section.area, 1.0, (0.0,)),
        )
        return cls(
            unknown, f"from ({in_mm(X[0])}) to ({in_mm(X[-1])}) mm",
            grids=tuple(int(g) for g in grids), point=(x, y, z),
            radius=float(np.linalg.norm(np.ptp(X, axis=0)) / 2), trials_factor=tried,
            section=section, up=up, length=_length(X), bending=sp.csr_array(K - K_A),
            membrane=K_A, mass=M_A,
        )  # fmt: skip

    def sizes(self, x: np.ndarray) -> np.ndarray:
        """I and A over their prior medians."""
        return np.array([p.value(v) / p.scale for p, v in zip(self.parameters, x, strict=True)])

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The bars' bending grows with I, all else with A."""
        (i, a), (e, f) = self.sizes(x), np.eye(2)
        return (
            MatrixTerm("K", self.bending, i, i * e),
            MatrixTerm("K", self.membrane, a, a * f),
            MatrixTerm("M", self.mass, a, a * f),
        )

    def weight(self, x: np.ndarray) -> Weight:
        """ρ A L."""
        m = self.section.material.rho * self.parameters[1].value(x[1]) * self.length
        return Weight(m, m * np.eye(2)[1])

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """A mass, where a blade of this I and A is lower than the sheet is thick."""
        i, a = self.sizes(x)
        height2 = 3 * BENDING / AREA * i / a  # over t²: A = b h, I = b h³/3
        mass = "point-mass" if len(self.grids) == SHORTEST else "mass-patch"
        return Remarks(becomes=mass if height2 < 1 else "")

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write bars with a property of their own."""
        I, A = (p.value(v) for p, v in zip(self.parameters, x, strict=True))
        section = BeamSection(self.section.material, A, I1=I)
        return with_beam_line(assembly, self.grids, section, self.up, self.name)


def _length(X: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(X, axis=0), axis=1).sum())


def section_for(assembly: Assembly, grids: Sequence[int]) -> BeamSection | None:
    """A section at the prior medians for a line on a sheet; None if that is not isotropic."""
    shells, rows = assembly.shells, assembly.rows(np.asarray(grids))
    mine = np.flatnonzero(np.isin(shells.nodes, rows).sum(axis=1) > 1)
    section = assembly.parts[int(np.bincount(shells.part[mine]).argmax())].section
    if not (isinstance(section, ShellSection) and isinstance(section.membrane, Isotropic)):
        return None
    t = float(shells.thickness[mine].mean())
    return BeamSection(section.membrane, AREA * t**2, I1=BENDING * t**4)


def normals_along(assembly: Assembly, grids: Sequence[int]) -> np.ndarray:
    """Unit normal (n, 3) of the sheet at each bar along a line of grids."""
    rows = assembly.rows(np.asarray(grids))
    n = point_normals(assembly.points, assembly.shells.nodes)[rows]
    mean = unit(n[:-1] + np.sign(np.sum(n[:-1] * n[1:], axis=1))[:, None] * n[1:])
    along = unit(np.diff(assembly.points[rows], axis=0))
    return unit(mean - np.sum(mean * along, axis=1)[:, None] * along)


@dataclass(frozen=True, eq=False)
class GridLines:
    """Lines of grids along the edges of shells."""

    assembly: Assembly
    edges: np.ndarray  # (k, 2) rows of points, in both senses
    first: np.ndarray  # (n + 1,) where the edges of each point begin

    @classmethod
    def of(cls, assembly: Assembly) -> Self:
        """Collect the edges of all shells."""
        once = np.unique(edges_of(assembly.shells.nodes), axis=0)
        both = np.concatenate([once, once[:, ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable")]
        return cls(assembly, both, np.searchsorted(both[:, 0], np.arange(len(assembly.points) + 1)))

    def walk(self, start: int, direction: np.ndarray, far: float) -> list[int]:
        """Rows from a point along a direction, each nearest to it, for a distance ``far`` [m]."""
        rows, X = [start], self.assembly.points
        while np.linalg.norm(X[rows[-1]] - X[start]) < far:
            near = self.edges[self.first[rows[-1]] : self.first[rows[-1] + 1], 1]
            cosine = unit(X[near] - X[rows[-1]]) @ direction
            if not len(near) or cosine.max() < STRAIGHT:
                break
            rows.append(int(near[np.argmax(cosine)]))
        return rows

    def through(self, row: int, direction: np.ndarray, half: float) -> tuple[int, ...]:
        """Ids of the grids of a line through a point, ``half`` [m] to each side."""
        back, on = (self.walk(row, s * direction, half) for s in (-1, 1))
        return tuple(self.assembly.ids[[*back[:0:-1], *on]].tolist())

    def beside(self, line: Line, half: float) -> list[tuple[int, ...]]:
        """Lines of grids through the corners of the middle shell of a line of shells."""
        corners = np.unique(self.assembly.shells.nodes[line.through]).tolist()
        return distinct(self.through(row, line.direction, half) for row in corners)

    def moved(self, grids: tuple[int, ...]) -> list[tuple[int, ...]]:
        """Neighbours of a line: longer, shorter, or through a grid next to its middle."""
        rows, X = self.assembly.rows(np.array(grids)), self.assembly.points
        ahead = unit(X[rows[-1]] - X[rows[0]])
        size = float(np.linalg.norm(X[rows[1]] - X[rows[0]]))
        found = [grids[1:], grids[:-1]] if len(grids) > SHORTEST else []
        for end, d in ((-1, ahead), (0, -ahead)):
            for edges in LONGER:
                more = self.walk(int(rows[end]), d, (edges - 0.5) * size)[1:]
                more = self.assembly.ids[more].tolist()
                found.append((*grids, *more) if end else (*more[::-1], *grids))
        middle = int(rows[len(rows) // 2])
        half = 0.5 * float(np.linalg.norm(X[rows[-1]] - X[rows[0]])) - 0.4 * size
        for near in self.edges[self.first[middle] : self.first[middle + 1], 1].tolist():
            if near not in rows:
                found.append(self.through(near, ahead, half))
        return [line for line in distinct(found) if line != grids]


def distinct(lines: Iterator[tuple[int, ...]] | list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Each line of three grids or more once."""
    return list({frozenset(line): line for line in lines if len(line) >= SHORTEST}.values())


def candidates(context: SearchContext) -> list[Candidate]:
    """The lines of grids that explain most, next to the lines of shells that want more bending.

    A rib is heavy as well as stiff: lines through the shell that wants more mass are tried, too.
    Scores of lines of shells are linearised, lines of grids have their own optima. The best of them
    is moved while it explains more.
    """
    where = context.where
    assembly = where.groups.structure.assembly
    shells, grids = LineFinder.of(assembly), GridLines.of(assembly)
    alone = context.scan is None
    places = farthest_point_sample(shells.middle, FEW if alone else PLACES)
    drawn = shells.drawn(places, LENGTHS[:1] if alone else LENGTHS)
    tried = len(drawn)
    if not drawn:
        return []
    if context.scan is not None:
        sets = [line.shells for line in drawn]
        amount, score = context.scan.bending_scores(len(context.bases) - 1, sets)
        score = np.where(amount > 0, score, np.inf)
        chosen = far_apart(score, np.array([line.centre for line in drawn]), BEGUN)
        drawn = [drawn[k] for k in chosen if np.isfinite(score[k])]
        drawn += shells.drawn(_heaviest(context, context.scan, shells), LENGTHS)
    every = distinct([
        path for line in drawn for path in grids.beside(line, shells.half(line.through, line.times))
    ])  # fmt: skip
    effects = [e for path in every if (e := Stiffener.along(where, path, tried)) is not None]
    if alone:
        leading = best_places(context, effects, BEGUN, anywhere=True)
        effects = [c.effect for c in leading if isinstance(c.effect, Stiffener)]
    best = best_places(context, effects, FOLLOWED, extended=True, optimised=not alone)
    return [closer(context, best[0].effect, best[0].start) or best[0], *best[1:]] if best else []


def _heaviest(context: SearchContext, scan: ResponseScan, shells: LineFinder) -> np.ndarray:
    """Row of the shell (1,) where a mass explains most."""
    where = context.where
    masses = np.array(MASSES) * where.setup.weight
    score = scan.point_scores(len(context.bases) - 1, "M", masses).min(axis=1)
    return nearest_points(shells.middle, where.places.point[[int(np.argmin(score))]])


def closer(context: SearchContext, effect: Effect, x: np.ndarray) -> Candidate | None:
    """Move a stiffener at x to neighbouring lines of grids while it explains more."""
    assert isinstance(effect, Stiffener)
    grids = GridLines.of(context.where.groups.structure.assembly)

    def around(line: Stiffener) -> list[Stiffener]:
        every = (Stiffener.along(context.where, path, line.trials_factor)
                 for path in grids.moved(line.grids))  # fmt: skip
        return [e for e in every if e is not None]

    moved, start = followed(context, effect, x, around)
    return None if moved is effect else Candidate(moved, start, context.bases[-1])


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A rib of the thickness of the sheet, 3 to 6 times as high, along a line of its grids."""
    made = article.assembly
    shells, grids = LineFinder.of(made), GridLines.of(made)
    drawn = shells.drawn(farthest_point_sample(shells.middle, PLACES), LENGTHS)
    options = distinct([
        path for line in drawn for path in grids.beside(line, shells.half(line.through, line.times))
        if section_for(made, path) is not None
    ])  # fmt: skip
    path = options[int(rng.integers(len(options)))]
    sheet = section_for(made, path)
    assert sheet is not None
    t = float(np.sqrt(sheet.area / AREA))
    h = float(rng.uniform(3, 6)) * t
    section = BeamSection(sheet.material, t * h, I1=t * h**3 / 3)
    ribbed = with_beam_line(made, path, section, normals_along(made, path), Stiffener.name)
    middle = made.points[made.rows(np.array(path))].mean(axis=0)
    return article.with_hidden(ribbed, {"I": section.I1, "A": section.area}, middle)


FAMILY = Family(
    Stiffener,
    conceal,
    candidates=candidates,
    closer=closer,
    cards=("CBAR", "PBAR", "MAT1"),
    settled_by="look at the sheet from both sides, and weigh what is fixed to it",
    on_sheets=True,
)
