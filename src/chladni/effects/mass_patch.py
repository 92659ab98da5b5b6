"""A mass distributed over a region of a sheet: trim, mastic, a damping mat or a run of paint."""

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from ..geometry.facets import cell_areas
from ..model.assembly import Assembly
from ..model.properties import Part, ShellSection
from .effect import Effect, Parameter, Traits
from .effect_context import EffectContext
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family
from .points import strength
from .property_bands import levels, with_bands
from .sheet_patch import RADII, RIMMED, SheetPatch, disc, random_place

SHARE = 0.03  # of the structure's mass: prior median


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
        return effect, np.array([ln_m, np.log(RADII[0]), 0.0, 0.0, cls.rim[0]])

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


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add 2 to 8 % of the mass on a disc of 40 to 90 mm radius round a grid of the first part."""
    m = float(rng.uniform(0.02, 0.08)) * article.weight
    centre, radius = random_place(article, rng), float(rng.uniform(0.04, 0.09))
    made = spread_mass(article.assembly, disc(article, centre, radius).astype(float), m)
    return article.with_hidden(made, {"M": m}, centre, radius_m=radius)


FAMILY = Family(
    MassPatch,
    conceal,
    candidates=MassPatch.candidates,
    of_lump=MassPatch.of_lump,
    cards=("PSHELL", "CQUAD4", "CTRIA3"),
    settled_by="search for material on the sheet there, and weigh it",
    on_sheets=True,
)
