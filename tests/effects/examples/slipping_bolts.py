"""Bolts that slip: their stiffness in shear is lower than in the deck, that along them is not."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.effects import (
    Article,
    EffectContext,
    Family,
    JointStiffness,
    Parameter,
    Traits,
    fasteners,
    joined,
    stiffness,
)
from chladni.fem.assemble import Structure, structure
from chladni.model.assembly import Assembly

SHEAR = np.array([0, 1, 1, 0, 0, 0])  # of a bush: across its first axis


@dataclass(frozen=True, eq=False)
class SlippingBolts(JointStiffness):
    """K + (f - 1) K_s, K_s the stiffness of all bushes across their first axis, f = e^x."""

    name = "slipping-bolts"
    claim = "bolts slip: their stiffness in shear is lower than in the deck"
    traits = Traits(rounds=1, own_loads=True)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Multiply the stiffness in shear of the bushes by f."""
        f = self.factor(x)[0]
        return with_factors(assembly, self.joint.elements, np.where(SHEAR, f, 1.0))


def with_factors(assembly: Assembly, rows: np.ndarray, factors: np.ndarray) -> Assembly:
    """Multiply the six stiffnesses of some bushes by factors (6,)."""
    k = assembly.bushes.stiffness.copy()
    k[rows] *= factors
    return replace(assembly, bushes=replace(assembly.bushes, stiffness=k))


def bolts(built: Structure) -> list:
    """All bushes of a structure between its parts as one joint; none without bushes."""
    found = [j for j in fasteners(built) if j.kind == "bushes" and not j.rigid]
    return [joined(found)] if found else []


def slips(where: EffectContext) -> list[SlippingBolts]:
    """All bolts together."""
    built, out = where.groups.structure, []
    f = Parameter("K", "of the deck's", 0.0, 2.0, starts=(-4.0, -2.0))
    for joint in bolts(built):
        sheared = with_factors(built.assembly, joint.elements, SHEAR)
        own = stiffness(replace(built, assembly=sheared), joint)
        text = f"all {len(joint.elements)} bolts"
        out.append(SlippingBolts.of(joint, (f,), text, 1, "", {}, "", own))
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Leave 1 to 4 % of the stiffness in shear of all bushes."""
    (joint,) = bolts(structure(article.assembly))
    f = float(rng.uniform(0.01, 0.04))
    made = with_factors(article.assembly, joint.elements, np.where(SHEAR, f, 1.0))
    return article.with_hidden(made, {"K": f})


FAMILY = Family(
    SlippingBolts,
    conceal,
    placed=slips,
    cards=("PBUSH",),
    settled_by="tighten the bolts, and measure again",
    needs="bushes between sheets",
)
