"""Regions of a sheet that differ from the deck: thinner, thicker, softer or heavier.

A softer region covers causes without their own effect: a heat-affected zone, a creased or
perforated sheet, a delaminated layer. A stiffer region without mass is not searched. Coarse and
fine elements of two codes differ like a slightly stiffer region. A corner 11 % stiffer near the
shaker gained 43 in -2 ln evidence where nothing was missing. A doubler is stiff and heavy as its
material is. A heavier region is trim, mastic, a damping mat or paint.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from ..geometry.facets import cell_areas
from ..model.assembly import Assembly
from ..model.properties import Part, ShellSection
from .attachments import strength
from .calibration_parameters import scaled
from .effect import Effect, Parameter, Traits
from .effect_context import EffectContext
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family
from .sheet_patch import (
    RADII,
    RIMMED,
    SheetLoss,
    SheetPatch,
    disc,
    levels,
    random_place,
    with_bands,
)

SHARE = 0.03  # of the structure's mass: prior median


@dataclass(frozen=True, eq=False)
class ThicknessDistribution(SheetLoss):
    """t(x) = t0 (1 - α q(x)), α = 0.6 / (1 + e^-x): a smooth local thinning of one sheet."""

    name = "thickness-distribution"
    claim = "the sheet is thinner here than in the deck"
    quantity = "t"
    followed = 2
    scanned = -2.0
    grows = (0.05, np.inf)  # a smaller thinning, or a thickening, is not accepted
    most = 0.6
    begins = (0.02, 0.4)

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of α / 0.6."""
        return Parameter(
            "thinning", "-", -1.6, 1.2, 1.0, "linear", 0.8, starts=(-1.0,), nominal=-40.0
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the thickness at the corners of the sheet's shells."""
        q = self.bump(x, assembly.points)
        return thickened(assembly, -self.lost(x[0]) * q, self.shells)


def _thin(article: Article, rng: np.random.Generator) -> Article:
    """Thin the first part by 8 to 25 % round a grid, with R of 40 to 90 mm."""
    made, centre = article.assembly, random_place(article, rng)
    alpha, R = float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.04, 0.09))
    q = np.exp(-((made.points - centre) ** 2).sum(axis=1) / (2 * R**2))
    thinned = thickened(made, -alpha * q, np.ones(len(made.shells), bool))
    return article.with_hidden(thinned, {"thinning": alpha, "R": R}, centre, radius_m=R)


THICKNESS = Family(
    ThicknessDistribution,
    _thin,
    candidates=ThicknessDistribution.candidates,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="measure the thickness of the sheet there",
    on_sheets=True,
)


@dataclass(frozen=True, eq=False)
class Doubler(SheetPatch):
    """t(x) = t0 (1 + γ q(x)), γ = scale eˣ: more of the sheet's own material over a region."""

    name = "doubler"
    claim = "the sheet is thicker here than in the deck, for example by a doubler"
    quantity = "t"
    scanned = -1.0
    grows = (0.3, np.inf)  # of the thickening scanned: range accepted
    rim = RIMMED

    area: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the groups [m²]

    @classmethod
    def more(cls, groups: ElementGroups) -> dict[str, Any]:
        """Areas of the groups."""
        return {"area": groups.area}

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """γ, with a prior median of half of the thickness."""
        return strength("thickening", "-", 0.5, 0.8, (-0.7, 0.3))

    @classmethod
    def begun(cls, amount: float) -> float:
        """Start of ln γ, at most ten times the thickening scanned."""
        return cls.scanned + float(np.log(np.clip(amount, 0.3, 10.0)))

    def log(self, x: np.ndarray) -> np.ndarray:
        """ln(1 + γ q) over the groups."""
        q = self.bump(x, self.centre, self.variance)
        return np.log1p(self.parameters[0].value(x[0]) * q) * self.inside

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the thickness at the corners of the sheet's shells, ∫ q dA as over the groups."""
        q = self.bump(x, assembly.points)
        due = self.bump(x, self.centre, self.variance) @ (self.inside * self.area)
        written = (q[assembly.shells.nodes].mean(axis=1) * self.shells) @ _areas(assembly)
        gamma = self.parameters[0].value(x[0]) * float(due) / max(float(written), 1e-300)
        return thickened(assembly, gamma * q, self.shells)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The thickening and the radius R; ``location`` holds the place."""
        return Effect.reported(self, x, sd)[:2]


def thickened(assembly: Assembly, more: np.ndarray, on: np.ndarray) -> Assembly:
    """Multiply the thickness at the corners of some shells (m,) bool by 1 + ``more`` (n,)."""
    shells = assembly.shells
    factor = np.where(on[:, None], 1 + more[shells.nodes], 1.0)
    return replace(assembly, shells=replace(shells, thickness=shells.thickness * factor))


def _double(article: Article, rng: np.random.Generator) -> Article:
    """Thicken the first part by 30 to 100 % on a disc of 60 to 110 mm round a grid."""
    centre = random_place(article, rng)
    gamma, radius = float(rng.uniform(0.3, 1.0)), float(rng.uniform(0.06, 0.11))
    on, everywhere = disc(article, centre, radius), np.ones(len(article.assembly.points))
    made = thickened(article.assembly, gamma * everywhere, on)
    return article.with_hidden(made, {"thickening": gamma}, centre, radius_m=radius)


DOUBLER = Family(
    Doubler,
    _double,
    candidates=Doubler.candidates,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="measure the thickness of the sheet there",
    on_sheets=True,
)


@dataclass(frozen=True, eq=False)
class StiffnessPatch(SheetLoss):
    """E(x) = E0 (1 - β q(x)), β = 0.9 / (1 + e^-x), for membrane and bending; always positive."""

    name = "stiffness-patch"
    traits = Traits(elastic=True)
    claim = "the sheet is softer here than in the deck, with the same mass"
    quantity = "E"
    scanned = -1.0
    grows = (0.1, np.inf)  # a smaller loss, or a stiffening, is not accepted
    rim = RIMMED
    most = 0.9
    begins = (0.05, 0.75)

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The logit of β / 0.9, with a prior loss of a third of the stiffness (8 to 70 %)."""
        return Parameter(
            "E", "of the deck's", -0.5, 1.2, 1.0, "linear", 0.8, starts=(-0.5,), nominal=-40.0
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write new properties, in bands of equal ratio."""
        centre = assembly.points[assembly.shells.nodes].mean(axis=1)
        log = np.log1p(-self.lost(x[0]) * self.bump(x, centre) * self.shells)
        return with_bands(assembly, log, softened)

    @staticmethod
    def value_of(loss: float) -> float:
        """Remaining share of E."""
        return 1 - loss


def softened(part: Part, log: float) -> Part:
    """Multiply E of a part by e^log."""
    return scaled(part, "E", float(np.exp(log)))


def _weaken(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E by 0.35 to 0.6 on a disc of 60 to 110 mm round a grid of the first part."""
    centre = random_place(article, rng)
    factor, radius = float(rng.uniform(0.35, 0.6)), float(rng.uniform(0.06, 0.11))
    inside = disc(article, centre, radius)
    changed = with_bands(article.assembly, np.log(factor) * inside, softened)
    return article.with_hidden(changed, {"E": factor}, centre, radius_m=radius)


STIFFNESS = Family(
    StiffnessPatch,
    _weaken,
    candidates=StiffnessPatch.candidates,
    cards=("MAT1", "MAT8", "PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="tap the sheet there and next to it with a small hammer, and measure its thickness",
    on_sheets=True,
)


@dataclass(frozen=True, eq=False)
class MassPatch(SheetPatch):
    """Additional mass per area M q(x) / ∫ q dA, M in total; it does not stiffen the sheet."""

    name = "mass-patch"
    claim = "the sheet has a distributed mass that the model lacks"
    traits = Traits(lump=True)
    quantity = "rho"
    scanned = -1.0
    grows = (0.05, np.inf)  # of the mass scanned: range accepted
    rim = RIMMED

    area: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the groups [m²]
    weight_of: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the groups [kg]

    @classmethod
    def strength(cls, groups: ElementGroups) -> Parameter:
        """The mass, with a prior of a few per cent of that of the shells."""
        return strength("M", "kg", SHARE * float(groups.weight.sum()), 1.2, (-1.0, 0.3))

    @classmethod
    def more(cls, groups: ElementGroups) -> dict[str, Any]:
        """Areas and weights of the groups."""
        return {"area": groups.area, "weight_of": groups.weight}

    def log(self, x: np.ndarray) -> np.ndarray:
        """ln(1 + M q A / (w Σ q A)) over the groups; zero for sheets without mass."""
        share = self.bump(x, self.centre, self.variance) * self.inside * self.area
        m = self.parameters[0].value(x[0]) * share / max(float(share.sum()), 1e-300)
        heavy = self.weight_of > 0
        return np.log1p(np.divide(m, self.weight_of, out=np.zeros_like(m), where=heavy))

    @classmethod
    def begun(cls, amount: float) -> float:
        """Start of ln mass, at most ten times the mass scanned."""
        return cls.scanned + float(np.log(np.clip(amount, 0.05, 10.0)))

    @classmethod
    def of_lump(
        cls, where: EffectContext, point: np.ndarray, mass: float
    ) -> tuple[Self, np.ndarray] | None:
        """The mass with the smallest scanned radius, round the nearest group of shells."""
        groups = where.groups
        sheet = np.flatnonzero(groups.sheet)
        if not len(sheet):
            return None
        g = int(sheet[np.linalg.norm(groups.centre[sheet] - point, axis=1).argmin()])
        effect = cls.on(groups, g, len(set(groups.connected[sheet].tolist())))
        ln_m = np.log(mass / effect.parameters[0].scale)
        x = np.array([ln_m, np.log(RADII[0]), 0.0, 0.0, cls.rim[0]])
        return effect.resolved(groups, x), x

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write new properties with more mass per area, in bands."""
        centre = assembly.points[assembly.shells.nodes].mean(axis=1)
        q = self.bump(x, centre) * self.shells
        return spread_mass(assembly, q, self.parameters[0].value(x[0]))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The mass and the radius R; ``location`` holds the place."""
        return Effect.reported(self, x, sd)[:2]


def spread_mass(assembly: Assembly, q: np.ndarray, m: float) -> Assembly:
    """Distribute a mass [kg] over the shells in proportion to q (m,), in bands, sum preserved."""
    share = levels(q)[0]
    return with_bands(assembly, m * share / float(share @ _areas(assembly)), heavier)


def _areas(assembly: Assembly) -> np.ndarray:
    return cell_areas(assembly.points, assembly.shells.nodes)


def heavier(part: Part, load: float) -> Part:
    """Add mass per area [kg/m²] to a part."""
    section = part.section
    assert isinstance(section, ShellSection)
    return part.with_section(nonstructural=section.nonstructural + load)


def _load(article: Article, rng: np.random.Generator) -> Article:
    """Add 2 to 8 % of the mass on a disc of 40 to 90 mm radius round a grid of the first part."""
    m = float(rng.uniform(0.02, 0.08)) * article.weight
    centre, radius = random_place(article, rng), float(rng.uniform(0.04, 0.09))
    made = spread_mass(article.assembly, disc(article, centre, radius).astype(float), m)
    return article.with_hidden(made, {"M": m}, centre, radius_m=radius)


MASS = Family(
    MassPatch,
    _load,
    candidates=MassPatch.candidates,
    of_lump=MassPatch.of_lump,
    cards=("PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="search for material on the sheet there, and weigh it",
    on_sheets=True,
)
