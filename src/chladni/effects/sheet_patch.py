"""A smooth patch of a sheet where one field differs from the deck, at an unknown place.

q(x) = exp(-(|x - c|² / 2R²)^p) about a centre c on a quadric that follows the sheet. It is a bell
with p = 1 and nearly a disc with p = 4 (a super-Gaussian). The exponent p is fitted too: a bell in
place of a disc gives too large a change over too small a region. Parts that share grids are one
sheet, because a change of a pressed panel does not end at a fold.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np

from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from ..model.properties import Part
from .effect import Effect, FieldChange, Parameter
from .element_groups import ElementGroups
from .estimate import Estimate, Location, in_mm
from .family import Article
from .search_context import Candidate, SearchContext, best_places, valleys

BANDS = 6  # properties between zero and the largest value of the field
BELL, RIMMED = (0.0, 0.3), (float(np.log(2.0)), 0.5)  # ln p and sd: pressed; cut or glued on
RADII = (0.1, 0.18, 0.3)  # of the square root of the part's area
REACH, EDGE = 2.0, 0.5  # of the radius: groups nearer than that are divided into such pieces
TRIED = 30  # groups that are evaluated one by one if only natural frequencies are known


def levels(value: np.ndarray) -> tuple[np.ndarray, float]:
    """Round a field to integer levels (m,) of equal steps; return levels and step."""
    step = float(np.abs(value).max(initial=0.0)) / BANDS
    return np.round(value / step).astype(int) if step else np.zeros(len(value), int), step


def with_bands(
    assembly: Assembly, value: np.ndarray, changed: Callable[[Part, float], Part]
) -> Assembly:
    """Put the shells into parts changed by ``value`` (m,), in equal steps.

    ``changed`` returns a part changed by a value; name and id are set here.
    """
    level, step = levels(value)
    return in_bands(assembly, level, lambda part, n: changed(part, n * step))


def in_bands(
    assembly: Assembly, level: np.ndarray, changed: Callable[[Part, int], Part]
) -> Assembly:
    """Put the shells into parts changed by their integer level (m,); 0 leaves them as they are."""
    old, parts = assembly.shells.part, list(assembly.parts)
    part = old.copy()
    pairs = set(zip(old.tolist(), level.tolist(), strict=True))
    for k, n in sorted((k, n) for k, n in pairs if n):
        part[(old == k) & (level == n)] = len(parts)
        new = changed(assembly.parts[k], n)
        name = f"{assembly.parts[k].name}, band {n}"
        parts.append(replace(new, id=1 + max(p.id for p in parts), name=name))
    return replace(assembly, parts=tuple(parts), shells=replace(assembly.shells, part=part))


SAG = 0.05  # of a shell: a centre as near to the chords of a curved sheet lies on it


@dataclass(frozen=True, eq=False)
class Quadric:
    """c(u) = c0 + u E + h(u) n, h the quadric a + b u + ... that follows a sheet about c0.

    ``axes`` (2, 3) and ``normal`` (3,) are of unit length. ``bend`` (6,) are the coefficients of 1,
    u, v, u², uv, v² in metres. Beyond ``reach`` h is constant.
    """

    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3)[:2])
    normal: np.ndarray = field(default_factory=lambda: np.eye(3)[2])
    bend: np.ndarray = field(default_factory=lambda: np.zeros(6))
    reach: float = np.inf

    def at(self, u: np.ndarray) -> np.ndarray:
        """The point (3,) [m] with the coordinates u (2,) [m]."""
        near = u * min(1.0, self.reach / max(float(np.linalg.norm(u)), 1e-300))
        h = float(_quadric(near[None])[0] @ self.bend)
        return self.origin + u @ self.axes + h * self.normal


def _quadric(u: np.ndarray) -> np.ndarray:
    """1, u, v, u², uv, v² (n, 6)."""
    x, y = u.T
    return np.stack([np.ones(len(u)), x, y, x * x, x * y, y * y], axis=1)


def surface(groups: ElementGroups, group: int, size: float) -> Quadric:
    """Fit the quadric to the corners of the part's shells, with larger weight on near ones."""
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


@dataclass(frozen=True, eq=False)
class SheetPatch(Effect):
    """A field of a sheet changed by a bump q, x = (strength, ln R, u, v [length scale], ln p).

    Subclasses define the ``quantity`` of the sheet, the factor from strength and q (:meth:`log`),
    the parameter (:meth:`strength`) and the start of a scan.
    """

    quantity: ClassVar[str] = "t"  # t, E or rho
    followed: ClassVar[int] = 1  # places for each baseline
    scanned: ClassVar[float] = 0.0  # strength x[0] at which a scan takes the slope
    grows: ClassVar[tuple[float, float]] = (0.0, np.inf)  # multiples of it that are accepted
    rim: ClassVar[tuple[float, float]] = BELL  # prior of ln p

    shells: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))  # of the sheet (m,)
    inside: np.ndarray = field(default_factory=lambda: np.zeros(0))  # groups of the sheet
    centre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # of the groups
    surface: Quadric = field(default_factory=Quadric)
    size: float = 1.0
    variance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # spread of a group itself
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # grids of the sheet
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    spacing: float = 0.0  # of these grids [m]
    of: np.ndarray | None = None  # (n_elements,) group of each, where they are its own

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The first parameter."""
        raise NotImplementedError

    def log(self, x: np.ndarray) -> np.ndarray:
        """Logarithm of the factor on the field, over the groups (n_groups,)."""
        raise NotImplementedError

    @classmethod
    def begun(cls, amount: float) -> float:
        """The strength x[0] at ``amount`` times that of the scan."""
        raise NotImplementedError

    @classmethod
    def on(cls, groups: ElementGroups, group: int, trials_factor: int) -> Self:
        """A patch on the sheet of one group of shells, with the search starting at that group.

        The prior spread of u and v accounts for the unknown place; ``trials_factor`` is the number
        of sheets.
        """
        part = int(groups.part[group])
        inside = (groups.connected == groups.connected[group]) & groups.sheet
        assembly = groups.structure.assembly
        grids = np.unique(groups.nodes[inside[groups.group]])
        size = float(np.sqrt(groups.area[groups.part == part].sum()))
        name = assembly.parts[part].name
        unknown = (
            cls.strength(groups),
            Parameter("R", "m", np.log(0.15), 0.5, size, step=0.3, starts=(np.log(0.18),)),
            Parameter("along", "m", 0.0, 0.4, size, "linear", step=0.1, starts=(0.0,)),
            Parameter("across", "m", 0.0, 0.3, size, "linear", step=0.1, starts=(0.0,)),
            Parameter("p", "-", *cls.rim, step=0.3, starts=(cls.rim[0],)),
        )
        return cls(
            unknown, f"on {name}", (name,), trials_factor=trials_factor,
            shells=inside[groups.group[: len(assembly.shells)]],
            inside=inside.astype(float), centre=groups.centre,
            surface=surface(groups, group, size), size=size, variance=groups.area / 12,
            points=assembly.points[grids], ids=assembly.ids[grids],
            spacing=float(np.sqrt(groups.area[inside].sum() / len(grids))), **cls.more(groups),
        )  # fmt: skip

    @classmethod
    def more(cls, groups: ElementGroups) -> dict[str, Any]:
        """Additional fields that a subclass fills from the groups."""
        return {}

    def bump(self, x: np.ndarray, X: np.ndarray, blur: np.ndarray | float = 0.0) -> np.ndarray:
        """q at points X (n,), averaged over a group of variance ``blur``."""
        d2 = ((X - self.at(x)) ** 2).sum(axis=1)
        R2 = self.radius_at(x) ** 2
        return R2 / (R2 + blur) * np.exp(-((d2 / (2 * (R2 + blur))) ** np.exp(x[4])))

    def terms(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """The logarithm over the groups, with its slope by central differences."""
        h = 1e-5
        slope = np.stack(
            [(self.log(x + h * e) - self.log(x - h * e)) / (2 * h) for e in np.eye(5)], 1
        )
        return (FieldChange(self.quantity, self.log(x), slope, self.of),)

    def resolved(self, groups: ElementGroups, x: np.ndarray) -> Self:
        """The patch at x over groups near it that are small for its radius."""
        R, edge = self.radius_at(x), np.sqrt(groups.area)
        far = np.linalg.norm(groups.centre - self.at(x), axis=1) - edge / 2
        fine = groups.finer((self.inside > 0) & (far < REACH * R), EDGE * R)
        return replace(
            self, of=fine.group, inside=self.inside[groups.group[fine.first]], centre=fine.centre,
            variance=fine.area / 12, **self.more(fine),
        )  # fmt: skip

    def at(self, x: np.ndarray) -> np.ndarray:
        """The centre in the basic frame (3,) [m]."""
        return self.surface.at(self.size * x[2:4])

    def radius_at(self, x: np.ndarray) -> float:
        """R [m]."""
        return float(self.size * np.exp(x[1]))

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, where the change of the sheet is largest, and its 95 % radius [m]."""
        grid, deepest = self.deepest(x)
        point = tuple(float(v) for v in deepest)
        text = f"on {self.parts[0]} near ({in_mm(point)} mm)"
        far = None if sd is None else 1.96 * self.size * float(self.widened(sd)[2:4].max())
        radius = None if far is None else max(far, self.spacing)
        return replace(self.where(), text=text, grids=(grid,), point_m=point, radius_m=radius)

    def deepest(self, x: np.ndarray) -> tuple[int, np.ndarray]:
        """Nearest grid, and point with the largest q: c, or near it a point of the sheet.

        The nearest grid stands for a centre that is far off the sheet.
        """
        c = self.at(x)
        d2 = ((self.points - c) ** 2).sum(axis=1)
        near = np.argsort(d2)[:4]
        if d2[near[0]] > max(0.25 * self.radius_at(x), self.spacing) ** 2:
            return int(self.ids[near[0]]), self.points[near[0]]
        on_sheet = nearest_mean(self.points[near], c)
        off = np.linalg.norm(on_sheet - c) > SAG * self.spacing
        return int(self.ids[near[0]]), on_sheet if off else c

    @classmethod
    def candidates(cls, context: SearchContext) -> list[Candidate]:
        """Scan patches at every group and radius; return the best places for each baseline."""
        groups = context.where.groups
        every = np.flatnonzero(groups.sheet)
        sheets = len(set(groups.connected[every].tolist()))
        if context.scan is None:
            some = farthest_point_sample(groups.centre[every], TRIED)
            tried = [cls.on(groups, int(g), sheets) for g in some]
            return best_places(context, tried, point=groups.centre[some])
        tried = [cls.on(groups, int(g), sheets) for g in every]
        effects = [e for e in tried for _ in RADII]
        starts = [
            np.array([cls.scanned, np.log(R), 0.0, 0.0, cls.rim[0]]) for _ in tried for R in RADII
        ]
        changes = np.stack([e.log(x) for e, x in zip(effects, starts, strict=True)], axis=1)
        centre = np.repeat(groups.centre[every], len(RADII), axis=0)
        least, most = cls.grows
        out: list[Candidate] = []
        taken: list[int] = []
        for about, base in enumerate(context.bases):
            amount, score = context.scan.field_scores(about, cls.quantity, changes)
            score = np.where((amount > least) & (amount < most), score, np.inf)
            for k in valleys(score, centre, taken, cls.followed):
                taken.append(k)
                start = np.array([cls.begun(float(amount[k])), *starts[k][1:]])
                out.append(Candidate(effects[k].resolved(groups, start), start, base))
        return out


@dataclass(frozen=True, eq=False)
class SheetLoss(SheetPatch):
    """A field times 1 - β q(x), β = ``most`` / (1 + e^-x), so that it stays positive."""

    most: ClassVar[float] = 1.0  # share that may be lost in the middle
    begins: ClassVar[tuple[float, float]] = (0.0, 1.0)  # shares from which a fit may start

    @classmethod
    def lost(cls, x: float) -> float:
        """β, from 0 to ``most``."""
        return float(cls.most / (1 + np.exp(-x)))

    def log(self, x: np.ndarray) -> np.ndarray:
        """ln(1 - β q) over the groups."""
        q = self.bump(x, self.centre, self.variance)
        return np.log1p(-self.lost(x[0]) * q) * self.inside

    @classmethod
    def begun(cls, amount: float) -> float:
        """Start of the logit of β / ``most``."""
        beta = np.clip(amount * cls.lost(cls.scanned), *cls.begins)
        return float(np.log(beta / (cls.most - beta)))

    @staticmethod
    def value_of(loss: float) -> float:
        """The reported value at a loss."""
        return loss

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Value where the loss is largest, and the radius R; ``location`` holds the place."""
        rows, reach = super().reported(x, sd), 1.96 * self.widened(sd)[0]
        q = float(self.bump(x, self.deepest(x)[1][None])[0])
        here, *ends = (self.value_of(q * self.lost(x[0] + s * reach)) for s in (0, -1, 1))
        return replace(rows[0], value=here, low=min(ends), high=max(ends)), rows[1]


def nearest_mean(points: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The point Σ w_i p_i nearest to c, with w_i >= 0 and Σ w_i = 1.

    >>> nearest_mean(np.eye(3)[:2], np.array([0.0, 2.0, 1.0])).round(6)
    array([0., 1., 0.])
    """
    from scipy.optimize import nnls

    heavy = 1e4 * np.ptp(points, axis=0).max(initial=0.0)
    local = (points - points.mean(axis=0)).T
    w, _ = nnls(np.vstack([local, np.full(len(points), heavy)]),
                np.append(c - points.mean(axis=0), heavy))  # fmt: skip
    return np.asarray((w / w.sum()) @ points)


def random_place(article: Article, rng: np.random.Generator) -> np.ndarray:
    """Place (3,) [m] of a random grid of the article's first part."""
    made = article.assembly
    return np.asarray(made.points[rng.choice(np.unique(made.shells.nodes[made.shells.part == 0]))])


def disc(article: Article, centre: np.ndarray, radius: float) -> np.ndarray:
    """Shells (m,) of the article's first part within a radius [m] of a place [m]."""
    made = article.assembly
    middle = made.points[made.shells.nodes].mean(axis=1)
    return np.asarray((made.shells.part == 0) & (np.linalg.norm(middle - centre, axis=1) <= radius))
