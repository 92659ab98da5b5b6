"""A crack: bending stiffness lost along a line of shells, mass and membrane as they were.

It may be a crack, a bead ground off, a bend annealed, a score: all are a hinge with a spring
(Adams, Cawley, Pye and Stone 1978, J. Mech. Eng. Sci. 20, 93-100). How much is lost depends on the
width of the shells it is put into, so that it is told in units of these: 12I/T3.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ..fem.sparse_assembly import blocks, congruence
from ..geometry.facets import cell_areas, cell_normals, tangents
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from ..model.properties import Part, ShellSection
from .effect import WIDER, Effect, MatrixTerm, Parameter
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places, distinct

LEAST = 0.1  # of the bending stiffness is always left: K stays positive
SHELLS = 3  # fewer of them are no line
WIDE = 0.55  # of a shell's size: half the width of a line
LENGTH = 0.25  # of the square root of the part's area: the length that is tried first
LENGTHS = (0.6, 1.0, 1.7, 3.0)  # times that: tried at the best places
ANGLES = 4
PLACES, CLOSER = 48, 12  # middles of lines: all over the sheets, and round each of the best
FOLLOWED = 2  # lines that are worth a fit


@dataclass(frozen=True, eq=False)
class Line:
    """Shells side by side along a line on a part: ``shells`` (k,) int, ``centre`` (3,) [m]."""

    shells: np.ndarray
    centre: np.ndarray
    part: int


@dataclass(frozen=True, eq=False)
class LineFinder:
    """Where the shells of an assembly are, so that lines of them can be drawn.

    Attributes
    ----------
    middle, normal : (m, 3)   [m], -
    part : (m,) int
    width : (m,)              square root of the area [m]
    size : {part: square root of its area [m]}
    """

    middle: np.ndarray
    normal: np.ndarray
    part: np.ndarray
    width: np.ndarray
    size: dict[int, float]

    @classmethod
    def of(cls, assembly: Assembly) -> "LineFinder":
        """Those of an assembly."""
        shells, area = assembly.shells, cell_areas(assembly.points, assembly.shells.nodes)
        size = {int(p): float(np.sqrt(area[shells.part == p].sum())) for p in set(shells.part)}
        middle = assembly.points[shells.nodes].mean(axis=1)
        normal = cell_normals(assembly.points, shells.nodes)
        return cls(middle, normal, shells.part, np.sqrt(area), size)

    def through(self, shell: int, angle: float, times: float) -> Line | None:
        """The line through a shell's middle at an angle, ``times`` the usual length.

        On a coarse mesh it is as long as ``SHELLS`` shells at least.
        """
        p, n = int(self.part[shell]), self.normal[shell]
        u, v = tangents(n)
        along = np.cos(angle) * u + np.sin(angle) * v
        d, least = self.middle - self.middle[shell], WIDE * SHELLS * self.width[shell]
        half = max(0.5 * LENGTH * times * self.size[p], least)
        inside = (np.abs(d @ along) <= half) & (np.abs(d @ n) <= half / 2)
        inside &= np.abs(d @ np.cross(n, along)) <= WIDE * self.width
        shells = np.flatnonzero(inside & (self.part == p))
        return Line(shells, self.middle[shells].mean(axis=0), p) if len(shells) >= SHELLS else None

    def drawn(self, shells: np.ndarray, lengths: Sequence[float]) -> list[Line]:
        """Lines through these shells at all angles, each set of shells once."""
        angles = np.pi * np.arange(ANGLES) / ANGLES
        found = {
            line.shells.tobytes(): line
            for k in shells
            for angle in angles
            for times in lengths
            if (line := self.through(int(k), float(angle), times)) is not None
        }
        return list(found.values())


@dataclass(frozen=True, eq=False)
class Crack(Effect):
    """K - (1 - f) Σ_line B_e, B_e the bending stiffness; f = 0.1 + 0.9 / (1 + e^x) is what is left.

    With f > 0 the sum is positive: no more than B is taken from A + B.
    """

    name = "crack"
    elastic = True
    claim = "bending stiffness is lost along a line: a crack, a bead ground off, a bend annealed"

    shells: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """(f - 1) B."""
        f = left(x[0])
        slope = -(f - LEAST) * (1 - (f - LEAST) / (1 - LEAST))
        return (MatrixTerm("K", self.operator, f - 1, np.array([slope])),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The shells of the line with a property of their own, 12I/t³ times f."""
        return cracked(assembly, self.shells, left(x[0]))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """What is left of 12I/t³."""
        value, high, low = (left(x[0] + s * 1.96 * WIDER * sd[0]) for s in (0, -1, 1))
        return (Estimate("12I/T3", value, "-", low, high),)


def left(x: float) -> float:
    """What is left of the bending stiffness, from 1 to LEAST."""
    return float(LEAST + (1 - LEAST) / (1 + np.exp(x)))


def crack(groups: ElementGroups, line: Line, tried: int) -> Crack:
    """A crack along one line of as many as were tried."""
    assembly, on = groups.structure.assembly, line.shells
    K = blocks(groups.cubic[on], groups.nodes[on], len(assembly.points))
    name, (x, y, z) = assembly.parts[line.part].name, line.centre.tolist()
    at = ", ".join(f"{1e3 * v:.0f}" for v in (x, y, z))
    starts = (-1.0, 0.5, 2.0)
    unknown = Parameter("12I/T3", "-", 0.0, 1.5, kind="linear", starts=starts, nominal=-40.0)
    reach = np.linalg.norm(np.ptp(assembly.points[groups.nodes[on].ravel()], axis=0)) / 2
    return Crack(
        (unknown,), f"on {name} through ({at} mm)", (name,), point=(x, y, z), radius=float(reach),
        grids=tuple(assembly.ids[np.unique(groups.nodes[on])].tolist()), trials_factor=tried,
        shells=on, operator=congruence(groups.structure.T, K),
    )  # fmt: skip


def cracked(assembly: Assembly, shells: np.ndarray, f: float) -> Assembly:
    """The assembly with f times the bending stiffness in some shells, which become parts."""
    parts, part = list(assembly.parts), assembly.shells.part.copy()
    for k in np.unique(part[shells]):
        mine = shells[assembly.shells.part[shells] == k]
        part[mine] = len(parts)
        new, name = weakened(parts[k], f), f"crack in {parts[k].name}"
        parts.append(replace(new, id=1 + max(p.id for p in parts), name=name))
    return replace(assembly, parts=tuple(parts), shells=replace(assembly.shells, part=part))


def weakened(part: Part, f: float) -> Part:
    """The part with f times the bending stiffness."""
    assert isinstance(part.section, ShellSection)
    return part.with_section(bending_ratio=part.section.bending_ratio * f)


def candidates(context: SearchContext) -> list[Candidate]:
    """The lines along which a crack explains most: all over the sheets, then closer and longer.

    Each costs a slope; only the best are fitted.
    """
    groups = context.where.groups
    lines = LineFinder.of(groups.structure.assembly)
    first = lines.drawn(farthest_point_sample(lines.middle, PLACES), (1.0,))
    if not first:
        return []
    if context.scan is None:
        effects = [crack(groups, line, len(first)) for line in first[::ANGLES]]
        return best_places(context, effects, np.array([e.point for e in effects]))
    about, base = len(context.bases) - 1, context.bases[-1]
    found = _scored(context, about, first)
    closer = [k for line, _, _ in found for k in _round(lines, line)]
    second = lines.drawn(np.unique(closer).astype(int), LENGTHS)
    tried = len(first) + len(second)
    return [
        Candidate(crack(groups, line, tried), np.array([_start(amount)]), base)
        for line, amount, _ in _scored(context, about, [*(f[0] for f in found), *second])
    ]


def _scored(
    context: SearchContext, about: int, lines: Sequence[Line]
) -> list[tuple[Line, float, float]]:
    """The best lines, how much they gain, and their scores; one that gained explains nothing."""
    assert context.scan is not None
    amount, score = context.scan.bending_scores(about, [line.shells for line in lines])
    score = np.where(amount < 0, score, score.max() + 1)
    centre = np.array([line.centre for line in lines])
    best = distinct(score, centre, [], FOLLOWED)
    return [(lines[k], float(amount[k]), float(score[k])) for k in best]


def _round(lines: LineFinder, line: Line) -> np.ndarray:
    """Shells round the middle of a line, as far as others that were tried."""
    mine = np.flatnonzero(lines.part == line.part)
    d = np.linalg.norm(lines.middle[mine] - line.centre, axis=1)
    reach = lines.size[line.part] * np.sqrt(len(lines.size) / PLACES)
    near = mine[d <= max(reach, float(np.sort(d)[min(CLOSER, len(d)) - 1]))]
    return np.asarray(near[farthest_point_sample(lines.middle[near], CLOSER)])


def _start(amount: float) -> float:
    """From the slope, which is that of the flexibility: 1/f - 1 = -amount."""
    f = np.clip(1 / (1 - min(amount, 0.0)), 0.15, 0.95)
    return float(np.log((1 - LEAST) / (f - LEAST) - 1))


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A line of the deck loses 50 to 80 % of its bending stiffness, the finer shells in it."""
    lines = LineFinder.of(article.deck)
    options = lines.drawn(farthest_point_sample(lines.middle, PLACES), (1.0, 1.7))
    line = options[int(rng.integers(len(options)))]
    f = float(rng.uniform(0.2, 0.5))
    here, there = (a.points[a.shells.nodes].mean(axis=1) for a in (article.assembly, article.deck))
    inside = np.flatnonzero(np.isin(cKDTree(there).query(here)[1], line.shells))
    truth = {"point_m": line.centre.tolist(), "value": f, "parameters": {"12I/T3": f}}
    return replace(article, assembly=cracked(article.assembly, inside, f), truth=truth)


FAMILY = Family(
    Crack,
    conceal,
    candidates=candidates,
    cards=("PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="look for a crack there with dye or a magnifying glass, and tap on both its sides",
    on_sheets=True,
)
