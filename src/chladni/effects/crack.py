"""A crack: bending stiffness lost along a line of shells, with mass and membrane unchanged.

It may be a crack, a bead ground off, an annealed bend or a score. All act as a hinge with a spring
(Adams, Cawley, Pye and Stone 1978, J. Mech. Eng. Sci. 20, 93-100). The deck holds it as the bending
ratio 12I/T3 = f of shells of width w. This ratio depends on the mesh. The hinge does not: it turns
as much as a length w (1/f - 1) of the sheet bends.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..fem.sparse_assembly import blocks, congruence
from ..geometry.facets import cell_areas, cell_normals, tangents, unit
from ..geometry.sampling import farthest_point_sample, nearest_points
from ..model.assembly import Assembly
from ..model.properties import ShellSection
from .effect import Effect, MatrixTerm, Parameter, Traits, Within
from .element_groups import ElementGroups, shear_matrices
from .estimate import Estimate, in_mm
from .family import Article, Family
from .joint_stiffness import within_shear
from .search_context import Candidate, ResponseScan, SearchContext, best_places, followed

LEAST_LEFT = 0.01  # of the bending stiffness always remains, so that K stays positive
SHELLS = 3  # in a line at least
REACH = 0.55  # of a shell's size times ``SHELLS``: half the least length
WIDE = 0.75  # of a shell's size: half the width of a line, so that no corner bridges an oblique one
LENGTH = 0.25  # of the square root of the part's area
LENGTHS = (1.0, 2.5)  # times that: tried all over the sheets
SHORTEST, LONGEST = 0.4, 4.0  # times that: limits of a moved line
ANGLES = 4
PLACES = 48  # middles of lines, all over the sheets
BEGUN = 12  # lines, far from each other, that are moved while they explain more
APART = 1 / 6  # of the size of all lines: least distance between those that are moved
TURNS = (-np.pi / 8, -np.pi / 16, np.pi / 16, np.pi / 8)
STRETCHED = (0.7, 1.4)  # times its length
NEIGHBOUR_DISTANCE = 1.7  # of a shell's size: distance of its neighbours
WORTH = 0.05  # least gain of a move in -2 ln posterior
FOLLOWED = 8  # lines whose own optima are found; a score about the null tells them apart badly


@dataclass(frozen=True, eq=False)
class Line:
    """Adjacent shells along a line on a part, as drawn by :meth:`LineFinder.through`."""

    shells: np.ndarray  # (k,) int
    centre: np.ndarray  # (3,) of these shells [m]
    part: int  # its part, and the shell whose middle it goes through
    through: int  # its part, and the shell whose middle it goes through
    direction: np.ndarray  # (3,) unit vector along it there
    times: float  # its length, in units of the usual one
    width: float  # [m]


@dataclass(frozen=True, eq=False)
class LineFinder:
    """Geometry of the shells of an assembly, from which lines of shells are drawn."""

    middle: np.ndarray  # (m, 3) [m], -
    normal: np.ndarray  # (m, 3) [m], -
    part: np.ndarray  # (m,) int
    width: np.ndarray  # (m,) square root of the area [m]
    size: dict[int, float]  # {part: square root of its area [m]}

    @classmethod
    def of(cls, assembly: Assembly) -> "LineFinder":
        """Collect the shells of an assembly."""
        shells, area = assembly.shells, cell_areas(assembly.points, assembly.shells.nodes)
        size = {int(p): float(np.sqrt(area[shells.part == p].sum())) for p in set(shells.part)}
        middle = assembly.points[shells.nodes].mean(axis=1)
        normal = cell_normals(assembly.points, shells.nodes)
        return cls(middle, normal, shells.part, np.sqrt(area), size)

    def through(self, shell: int, direction: np.ndarray, times: float) -> Line | None:
        """The line through a shell's middle along ``direction`` (3,), ``times`` the usual length.

        The line follows the sheet. On a coarse mesh it spans at least ``SHELLS`` shells. The result
        is None if there are fewer, or if ``direction`` leaves the sheet.
        """
        n = self.normal[shell]
        flat = direction - (direction @ n) * n
        if np.linalg.norm(flat) < 0.5:
            return None
        along = unit(flat)
        d, least = self.middle - self.middle[shell], REACH * SHELLS * self.width[shell]
        half = max(self.half(shell, times), least)
        inside = (np.abs(d @ along) <= half) & (np.abs(d @ n) <= half / 2)
        inside &= np.abs(d @ np.cross(n, along)) <= WIDE * self.width
        p = int(self.part[shell])
        shells = np.flatnonzero(inside & (self.part == p))
        if len(shells) < SHELLS or np.ptp(d[shells] @ along) < least:
            return None
        own, length = self.width[shells], np.ptp(d[shells] @ along)
        width = float((own**2).sum() / (length + own.mean()))
        return Line(shells, self.middle[shells].mean(axis=0), p, shell, along, times, width)

    def half(self, shell: int, times: float) -> float:
        """Half of ``times`` the usual length [m]."""
        return 0.5 * LENGTH * times * self.size[int(self.part[shell])]

    def drawn(self, shells: np.ndarray, lengths: Sequence[float]) -> list[Line]:
        """Lines through these shells at all angles, each set of shells once."""
        found = []
        for k in shells.tolist():
            u, v = tangents(self.normal[k])
            for angle in np.pi * np.arange(ANGLES) / ANGLES:
                direction = np.cos(angle) * u + np.sin(angle) * v
                found += [self.through(k, direction, times) for times in lengths]
        return _different(found)

    def moved(self, line: Line) -> list[Line]:
        """Neighbours of a line: shifted, and turned or stretched about its middle or an end."""
        k, x, n = line.through, self.middle[line.through], self.normal[line.through]
        mine = np.flatnonzero(self.part == line.part)
        d = np.linalg.norm(self.middle[mine] - x, axis=1)
        found = [
            self.through(int(j), line.direction, line.times)
            for j in mine[d <= NEIGHBOUR_DISTANCE * self.width[k]]
            if j != k
        ]
        across, half = np.cross(n, line.direction), self.half(k, line.times)
        turned = [(np.cos(a) * line.direction + np.sin(a) * across, line.times) for a in TURNS]
        stretched = [(line.direction, line.times * f) for f in STRETCHED]
        for direction, times in (*turned, *stretched):
            if SHORTEST <= times <= LONGEST:
                shift = self.half(k, times) * direction - half * line.direction
                middles = nearest_points(self.middle[mine], x + np.outer((-1, 0, 1), shift))
                found += [self.through(int(j), direction, times) for j in mine[middles]]
        return _different(found)


def _different(lines: Sequence[Line | None]) -> list[Line]:
    """Keep each set of shells once."""
    return list({line.shells.tobytes(): line for line in lines if line is not None}.values())


def far_apart(score: np.ndarray, centre: np.ndarray, wanted: int) -> list[int]:
    """The best lines at a minimum distance: far from a crack the scores have no valleys."""
    reach, out = APART * np.linalg.norm(np.ptp(centre, axis=0)), list[int]()
    for k in np.argsort(score):
        if all(np.linalg.norm(centre[k] - centre[j]) > reach for j in out):
            out.append(int(k))
    return out[:wanted]


@dataclass(frozen=True, eq=False)
class Crack(Effect):
    """K - (1 - f) Σ_line B_e, B_e the bending stiffness, f = 0.01 + 0.99 / (1 + e^x) the rest.

    A change of thickness, modulus or shear of the sheet multiplies B_e (:class:`.effect.Within`).
    """

    name = "crack"
    traits = Traits(elastic=True)
    claim = (
        "bending stiffness is reduced along a line, for example by a crack, a ground bead or an "
        "annealed bend"
    )

    line: Line = field(kw_only=True)
    bending: sp.csr_array = field(kw_only=True)
    shear: sp.csr_array = field(kw_only=True)
    within: tuple[Within, Within] = field(kw_only=True)  # of bending, and of shear

    @property
    def shells(self) -> np.ndarray:
        """Rows of the shells of the line."""
        return self.line.shells

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """(f - 1) B, bending and the shear that comes with it."""
        f = left(x[0])
        slope = -(f - LEAST_LEFT) * (1 - (f - LEAST_LEFT) / (1 - LEAST_LEFT))
        return tuple(
            MatrixTerm("K", A, f - 1, np.array([slope]), within=within)
            for A, within in zip((self.bending, self.shear), self.within, strict=True)
        )

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """B φ."""
        return sp.csr_array(((self.bending + self.shear) @ shapes).T)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Give the shells of the line their own property, with 12I/t³ times f."""
        return cracked(assembly, self.shells, left(x[0]))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Remaining 12I/t³, and the length of sheet that bends as much as the hinge turns."""
        width = self.line.width
        hinge = self.estimate(x, sd, lambda y: width * (1 / left(y[0]) - 1), "hinge", "m")
        return self.estimate(x, sd, lambda y: left(y[0])), hinge


def left(x: float) -> float:
    """Remaining share of the bending stiffness, from 1 down to LEAST."""
    return float(LEAST_LEFT + (1 - LEAST_LEFT) / (1 + np.exp(x)))


def crack(groups: ElementGroups, line: Line, tried: int) -> Crack:
    """A crack along one line, out of ``tried`` lines."""
    assembly, on = groups.structure.assembly, line.shells
    built, shear = groups.structure, shear_matrices(assembly, on)[1]
    bending, shear = (
        congruence(built.T, blocks(A, groups.nodes[on], len(assembly.points)))
        for A in (groups.cubic[on] - shear, shear)
    )
    pieces = frozenset(("bending", int(i)) for i in assembly.shells.ids[on])
    within = (
        Within(pieces, shells=on, bending=True),
        replace(within_shear(assembly.shells, on), bending=True),
    )
    name, (x, y, z) = assembly.parts[line.part].name, line.centre.tolist()
    starts = (-1.5, -0.5, 0.5, 1.5, 2.5)
    unknown = Parameter("12I/T3", "-", 0.0, 1.5, kind="linear", starts=starts, nominal=-40.0)
    reach = np.linalg.norm(np.ptp(assembly.points[groups.nodes[on].ravel()], axis=0)) / 2
    return Crack(
        (unknown,), f"on {name} through ({in_mm(line.centre)} mm)", (name,), point=(x, y, z),
        radius=float(reach), grids=tuple(assembly.ids[np.unique(groups.nodes[on])].tolist()),
        trials_factor=tried, bending=bending, shear=shear, within=within, line=line,
    )  # fmt: skip


def cracked(assembly: Assembly, shells: np.ndarray, f: float) -> Assembly:
    """Multiply the bending stiffness of some shells by f; these shells become new parts."""
    parts, part = list(assembly.parts), assembly.shells.part.copy()
    for k in np.unique(part[shells]):
        mine = shells[assembly.shells.part[shells] == k]
        part[mine] = len(parts)
        section, name = parts[k].section, f"crack in {parts[k].name}"
        assert isinstance(section, ShellSection)
        new = parts[k].with_section(bending_ratio=section.bending_ratio * f)
        parts.append(replace(new, id=1 + max(p.id for p in parts), name=name))
    return replace(assembly, parts=tuple(parts), shells=replace(assembly.shells, part=part))


def candidates(context: SearchContext) -> list[Candidate]:
    """The lines along which a crack explains most: drawn all over the sheets, then moved.

    The score of a line in this search is linearised; the final lines are evaluated exactly.
    """
    groups = context.where.groups
    lines = LineFinder.of(groups.structure.assembly)
    places = farthest_point_sample(lines.middle, PLACES)
    first = lines.drawn(places, LENGTHS[:1] if context.scan is None else LENGTHS)
    ends, tried = first[::ANGLES], len(first)
    if first and context.scan is not None:
        ends, tried = _at_rest(context.scan, len(context.bases) - 1, lines, first)
    effects = [crack(groups, line, tried) for line in ends]
    if context.scan is None:  # every candidate is fitted jointly
        return best_places(context, effects)
    return best_places(context, effects, FOLLOWED, anywhere=True)


def _at_rest(
    scan: ResponseScan, about: int, lines: LineFinder, first: Sequence[Line]
) -> tuple[list[Line], int]:
    """Move the best initial lines until no neighbour explains more.

    Return the final lines and the number of lines tried.
    """
    tried: set[bytes] = set()

    def scores(drawn: Sequence[Line]) -> np.ndarray:
        """Score of each line; a line that would gain stiffness explains nothing."""
        tried.update(line.shells.tobytes() for line in drawn)
        amount, score = scan.bending_scores(about, [line.shells for line in drawn])
        return np.where(amount < 0, score, np.inf)

    score = scores(first)
    begun = far_apart(score, np.array([line.centre for line in first]), BEGUN)
    ends = [first[k] for k in begun if np.isfinite(score[k])]
    moving = list(range(len(ends)))
    while moving:
        near = {k: [ends[k], *lines.moved(ends[k])] for k in moving}
        every = iter(scores([line for each in near.values() for line in each]))
        moving = []
        for k, each in near.items():
            own = [next(every) for _ in each]
            best = int(np.argmin(own))
            if own[best] < own[0] - WORTH:
                ends[k] = each[best]
                moving.append(k)
    return _different(ends), len(tried)


def closer(context: SearchContext, effect: Effect, x: np.ndarray) -> Candidate | None:
    """Move a fitted crack to neighbouring lines, each evaluated exactly."""
    if not isinstance(effect, Crack) or context.scan is None:
        return None
    groups, tried = context.where.groups, {effect.shells.tobytes()}
    lines = LineFinder.of(groups.structure.assembly)

    def around(line: Crack) -> list[Crack]:
        near = [each for each in lines.moved(line.line) if each.shells.tobytes() not in tried]
        tried.update(each.shells.tobytes() for each in near)
        return [crack(groups, each, effect.trials_factor) for each in near]

    moved, start = followed(context, effect, x, around)
    if moved is effect:
        return None
    more = effect.trials_factor + len(tried) - 1
    return Candidate(replace(moved, trials_factor=more), start, context.bases[-1])


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Remove 50 to 80 % of the bending stiffness of the finer shells along a line of the deck."""
    from scipy.spatial import cKDTree

    lines = LineFinder.of(article.deck)
    options = lines.drawn(farthest_point_sample(lines.middle, PLACES), (1.0, 1.7))
    line = options[int(rng.integers(len(options)))]
    f = float(rng.uniform(0.2, 0.5))
    here, there = (a.points[a.shells.nodes].mean(axis=1) for a in (article.assembly, article.deck))
    inside = np.flatnonzero(np.isin(cKDTree(there).query(here)[1], line.shells))
    made = cracked(article.assembly, inside, f)
    return article.with_hidden(made, {"12I/T3": f}, line.centre)


FAMILY = Family(
    Crack,
    conceal,
    candidates=candidates,
    closer=closer,
    cards=("PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="search for a crack there with dye or a magnifying glass, and tap on both sides",
    on_sheets=True,
)
