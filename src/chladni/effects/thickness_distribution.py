"""Thickness that is not what the deck says, here and there."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect import WIDER, Effect, FieldChange, Parameter
from .estimate import Estimate, Location
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places, distinct
from .shell_groups import ShellGroups


@dataclass(frozen=True, eq=False)
class ThicknessDistribution(Effect):
    """t(x) = t0 (1 - α q(x)), q = exp(-|x - c|² / 2R²): a smooth local thinning of one sheet.

    x = (logit of α / 0.6, ln R, u, v [length scale]); the centre c lies on the quadric that follows
    the sheet about where the search began. Parts that share grids are one sheet: the thinning of a
    pressed panel does not end at a fold.
    """

    name = "thickness-distribution"
    claim = "the sheet is thinner here than the deck says"

    shells: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))  # of the sheet (m,)
    inside: np.ndarray = field(default_factory=lambda: np.zeros(0))  # groups of the sheet
    centre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # of the groups
    surface: "Quadric" = field(default_factory=lambda: Quadric())
    size: float = 1.0
    variance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # spread of a group itself
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # grids of the sheet
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    def _bump(self, x: np.ndarray, X: np.ndarray, blur: np.ndarray | float = 0.0) -> np.ndarray:
        """q at points X (n,), averaged over a group of variance ``blur``."""
        d2 = ((X - self.at(x)) ** 2).sum(axis=1)
        R2 = (self.size * np.exp(x[1])) ** 2
        return np.asarray(R2 / (R2 + blur) * np.exp(-d2 / (2 * (R2 + blur))))

    def _log(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(
            np.log1p(-thinning(x[0]) * self._bump(x, self.centre, self.variance)) * self.inside
        )

    def fields(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """ln(1 - α q) over the groups; the slope by central differences of that scalar formula."""
        h = 1e-5
        slope = np.stack(
            [(self._log(x + h * e) - self._log(x - h * e)) / (2 * h) for e in np.eye(4)], 1
        )
        return (FieldChange("t", self._log(x), slope),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Thickness at the corners of the sheet's shells."""
        shells = assembly.shells
        q = self._bump(x, assembly.points)[shells.nodes]
        factor = np.where(self.shells[:, None], 1 - thinning(x[0]) * q, 1.0)
        return replace(assembly, shells=replace(shells, thickness=shells.thickness * factor))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The deepest thinning on the sheet and the radius R; the place stands in ``location``."""
        rows = super().reported(x, sd)
        there = float(self._bump(x, self._deepest(x)[1][None])[0])
        value, low, high = (there * thinning(x[0] + s * 1.96 * WIDER * sd[0]) for s in (0, -1, 1))
        return replace(rows[0], value=value, low=low, high=high), rows[1]

    def location(self, x: np.ndarray) -> Location:
        """The place a fit moved it to: where the sheet is thinnest."""
        grid, deepest = self._deepest(x)
        point = tuple(float(v) for v in deepest)
        text = f"on {self.parts[0]} round ({', '.join(f'{1e3 * v:.0f}' for v in point)} mm)"
        radius = float(self.size * np.exp(x[1]))
        return replace(self.where(), text=text, grids=(grid,), point_m=point, radius_m=radius)

    def _deepest(self, x: np.ndarray) -> tuple[int, np.ndarray]:
        """Grid and point where the sheet is thinnest: c, or the grid next to it if c is outside."""
        c = self.at(x)
        d2 = ((self.points - c) ** 2).sum(axis=1)
        k = int(np.argmin(d2))
        outside = d2[k] > (0.25 * self.size * np.exp(x[1])) ** 2
        return int(self.ids[k]), self.points[k] if outside else c

    def at(self, x: np.ndarray) -> np.ndarray:
        """The centre in the basic frame (3,) [m]."""
        return self.surface.at(self.size * x[2:4])


def thinning(x: float) -> float:
    """α = 0.6 / (1 + e^-x), from 0 to 0.6."""
    return float(0.6 / (1 + np.exp(-x)))


def thickness_distribution(
    groups: ShellGroups, group: int, trials_factor: int
) -> ThicknessDistribution:
    """A thinning of the sheet that one group of shells belongs to, searched from that group on.

    The unknown place is paid for by the spread of u and v; ``trials_factor`` counts the sheets.
    """
    part = int(groups.part[group])
    inside = groups.connected == groups.connected[group]
    assembly = groups.structure.assembly
    grids = np.unique(groups.nodes[inside[groups.group]])
    size = float(np.sqrt(groups.area[groups.part == part].sum()))
    name = assembly.parts[part].name
    unknown = (
        Parameter("thinning", "-", -1.6, 1.2, 1.0, "linear", 0.8, starts=(-1.0,), nominal=-40.0),
        Parameter("R", "m", np.log(0.15), 0.5, size, step=0.3, starts=(np.log(0.18),)),
        Parameter("along", "m", 0.0, 0.4, size, "linear", step=0.1, starts=(0.0,)),
        Parameter("across", "m", 0.0, 0.3, size, "linear", step=0.1, starts=(0.0,)),
    )
    return ThicknessDistribution(
        unknown, f"on {name}", (name,), trials_factor=trials_factor,
        shells=inside[groups.group], inside=inside.astype(float), centre=groups.centre,
        surface=surface(groups, group, size), size=size, variance=groups.area / 12,
        points=assembly.points[grids], ids=assembly.ids[grids],
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Quadric:
    """c(u) = c0 + u E + h(u) n, h the quadric a + b u + ... that follows a sheet about c0.

    ``axes`` (2, 3) and ``normal`` (3,) are of unit length; ``bend`` (6,) belongs to 1, u, v, u²,
    uv, v² in metres, and holds within ``reach``: further out h stays at what it is there.
    """

    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3)[:2])
    normal: np.ndarray = field(default_factory=lambda: np.eye(3)[2])
    bend: np.ndarray = field(default_factory=lambda: np.zeros(6))
    reach: float = np.inf

    def at(self, u: np.ndarray) -> np.ndarray:
        """The point (3,) [m] that has the coordinates u (2,) [m]."""
        near = u * min(1.0, self.reach / max(float(np.linalg.norm(u)), 1e-300))
        h = float(_quadric(near[None])[0] @ self.bend)
        return np.asarray(self.origin + u @ self.axes + h * self.normal)


def _quadric(u: np.ndarray) -> np.ndarray:
    """1, u, v, u², uv, v² (n, 6)."""
    x, y = u.T
    return np.stack([np.ones(len(u)), x, y, x * x, x * y, y * y], axis=1)


def surface(groups: ShellGroups, group: int, size: float) -> Quadric:
    """The quadric through the corners of the part's shells, near ones counting most."""
    assembly = groups.structure.assembly
    own = np.unique(groups.nodes[groups.part[groups.group] == groups.part[group]])
    X, c = assembly.points[own], groups.centre[group]
    w = np.exp(-((X - c) ** 2).sum(axis=1) / (2 * (0.25 * size) ** 2))
    middle = np.average(X, axis=0, weights=w)
    axes = np.linalg.svd((X - middle) * np.sqrt(w)[:, None], full_matrices=False)[2]
    u = (X - c) @ axes[:2].T
    A = _quadric(u) * np.sqrt(w)[:, None]
    ridge = 1e-10 * np.diag([0, 0, 0, 1, 1, 1]) * (A**2).sum()
    bend = np.linalg.solve(A.T @ A + ridge, A.T @ (np.sqrt(w) * ((X - c) @ axes[2])))
    return Quadric(c, axes[:2], axes[2], bend, 0.5 * size)


RADII = (0.1, 0.18, 0.3)  # of the square root of the part's area
TRIED = 30  # groups that are evaluated one by one where only natural frequencies are known
LEAST = 0.05  # of the scanned thinning: less of it, or a thickening, is no thinning


def candidates(context: SearchContext) -> list[Candidate]:
    """Local thinning: its slope at every group and radius, the two best places per baseline."""
    groups = context.where.groups
    sheets = len(set(groups.connected.tolist()))
    if context.scan is None:
        some = farthest_point_sample(groups.centre, TRIED)
        tried = [thickness_distribution(groups, int(g), sheets) for g in some]
        return best_places(context, tried, groups.centre[some])
    tried = [thickness_distribution(groups, g, sheets) for g in range(len(groups))]
    effects = [e for e in tried for _ in RADII]
    starts = [np.array([-2.0, np.log(radius), 0.0, 0.0]) for _ in tried for radius in RADII]
    bumps = np.stack([e.fields(x)[0].value for e, x in zip(effects, starts, strict=True)], axis=1)
    centre = np.repeat(groups.centre, len(RADII), axis=0)
    out: list[Candidate] = []
    taken: list[int] = []
    for about, base in enumerate(context.bases):
        amount, score = context.scan.field_scores(about, "t", bumps)
        score = np.where(amount > LEAST, score, np.inf)
        for k in distinct(score, centre, taken, 2):
            if np.isfinite(score[k]):
                taken.append(k)
                out.append(Candidate(effects[k], _scaled(starts[k], amount[k]), base))
    return out


def _scaled(start: np.ndarray, amount: float) -> np.ndarray:
    """A start whose depth is ``amount`` times that of the one scanned, from 2 to 40 %."""
    alpha = np.clip(amount * thinning(start[0]), 0.02, 0.4)
    return np.array([np.log(alpha / (0.6 - alpha)), *start[1:]])


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """8 to 25 % thinner round a grid of the first part, with R of 40 to 90 mm."""
    made = article.assembly
    first = made.shells.nodes[made.shells.part == 0]
    centre = made.points[rng.choice(np.unique(first))]
    alpha, R = float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.04, 0.09))
    q = np.exp(-((made.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    t = made.shells.thickness * (1 - alpha * q)[made.shells.nodes]
    truth = {
        "point_m": centre.tolist(), "value": alpha, "radius_m": R,
        "parameters": {"thinning": alpha, "R": R},
    }  # fmt: skip
    thinned = replace(made, shells=replace(made.shells, thickness=t))
    return replace(article, assembly=thinned, truth=truth)


FAMILY = Family(
    ThicknessDistribution,
    conceal,
    candidates=candidates,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="gauge the thickness of the sheet there",
)
