"""An adhesive bead far softer or stiffer than in the deck, beyond the scatter of coupons.

An error of about half the stiffness is a calibration parameter of every fit. Here the error may be
orders of magnitude: an uncured or torn bead, or another product. Between thin sheets the effect
saturates: a bead some thirty times stiffer than a sealant acts as a rigid joint.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..model.assembly import Assembly
from ..model.properties import Isotropic, Part, SolidSection
from .effect import Effect, MatrixTerm, Parameter
from .estimate import Estimate
from .family import Article, Family
from .joints import Connection, beads, stiffness, with_factor_on, with_solids
from .model_families import joint_families, shared_factor
from .search_context import Candidate, SearchContext, best_places

SD = 3.0  # of ln of the factor
STARTS = (-2.5, 2.0, 4.0)
MOST_BEADS = 12  # beads tried, longest first
FOLLOWED = 2
SEALANT = 80e6  # [Pa] upper limit of a soft hem sealant (Echaniz Granado 2015: 6 MPa)


@dataclass(frozen=True, eq=False)
class AdhesiveStiffness(Effect):
    """K + (e^x - 1) K_bead + (e^g - 1) K_others: one modulus for the bead, one for all others."""

    name = "adhesive-stiffness"
    claim = "a bead of adhesive is far softer or stiffer than in the deck"
    rounds = 2

    joint: Connection | None = None
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    others: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The terms of the bead and of the other beads."""
        each = zip((self.operator, self.others), self.parameters, x, np.eye(len(x)), strict=False)
        return tuple(
            MatrixTerm("K", A, p.value(v) / p.scale - 1, p.slope(v) / p.scale * e)
            for A, p, v, e in each
        )

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the bead; the basis already represents all adhesive together."""
        return sp.csr_array((self.operator @ shapes).T)

    def reloads(self, static: np.ndarray, M: sp.csr_array) -> np.ndarray:
        """Loads A u of the bead: (P⁻¹ A)ᵏ φ spans the mode change for any stiffness of the bead."""
        return self.operator @ static

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write E of the bead, and E of the other beads as fitted with it."""
        assert self.joint is not None
        auxiliary_residual = self.parameters[1].value(x[1]) if len(x) > 1 else 1.0
        made = with_solids(assembly, auxiliary_residual, soft=True)
        return with_factor_on(made, self.joint, float(np.exp(x[0])) / auxiliary_residual)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """E of the bead."""
        return super().reported(x, sd)[:1]

    def implausible(self, x: np.ndarray) -> str:
        """Report a modulus that no sealant has, where the deck has a sealant."""
        E = self.parameters[0].value(x[0])
        if self.parameters[0].scale >= SEALANT or E <= SEALANT:
            return ""
        return (
            f"E of {E / 1e6:.0f} MPa is too high for a sealant, which has less than "
            f"{SEALANT / 1e6:g}"
        )


def longest_beads(built: Structure) -> list[Connection]:
    """The ``MOST_BEADS`` longest beads, which are tried."""
    return sorted(beads(built), key=lambda bead: -len(bead.elements))[:MOST_BEADS]


def beads_of(built: Structure) -> list[AdhesiveStiffness]:
    """One effect for each of the longest beads, and for all beads of a part together."""
    found = longest_beads(built)
    families = {text: (K, sd) for text, K, sd in joint_families(built)} if found else {}
    return [_of_one(built, bead, families["adhesive"], len(found)) for bead in found]


def _of_one(
    built: Structure, bead: Connection, family: tuple[sp.csr_array, float], tried: int
) -> AdhesiveStiffness:
    K, sd = family
    own = stiffness(built, bead)
    others = sp.csr_array(K - own)
    E = modulus_of(built.assembly, bead)
    unit, scale = ("of the deck's", 1.0) if E is None else ("Pa", E)
    unknown: tuple[Parameter, ...] = (
        Parameter("E", unit, 0.0, SD, scale, step=1.0, starts=STARTS),
    )
    if abs(others).max() > 1e-9 * abs(K).max():
        unknown = (*unknown, shared_factor("E of other beads", "adhesive", sd))
    x, y, z = bead.point.tolist()
    names = sorted({p.name for p in _parts(built.assembly, bead)})
    text = f"{' and '.join(names)}, {len(bead.elements)} solids {bead.where}"
    return AdhesiveStiffness(
        unknown, text, bead.parts, bead.grids, point=(x, y, z), trials_factor=tried,
        replaces=("adhesive",), joint=bead, operator=own, others=others,
    )  # fmt: skip


def _parts(assembly: Assembly, bead: Connection) -> list[Part]:
    group = assembly.solids[bead.group]
    return [assembly.parts[int(p)] for p in np.unique(group.part[bead.elements])]


def modulus_of(assembly: Assembly, bead: Connection) -> float | None:
    """E [Pa] of a bead of one isotropic modulus, else None."""
    values = {
        p.section.material.E
        for p in _parts(assembly, bead)
        if isinstance(p.section, SolidSection) and isinstance(p.section.material, Isotropic)
    }
    return float(values.pop()) if len(values) == 1 else None


def candidates(context: SearchContext) -> list[Candidate]:
    """The beads whose change of stiffness explains most."""
    effects = beads_of(context.where.groups.structure)
    if not effects:
        return []
    points = np.array([e.point for e in effects])
    return best_places(context, effects, points, FOLLOWED, -1.0, extended=True)


def softened_bead(
    assembly: Assembly, rng: np.random.Generator, ln_factor: tuple[float, float]
) -> tuple[Connection, float, float]:
    """Draw a bead to conceal, the factor on its E from a range of its logarithm, and E [Pa].

    Raises
    ------
    ModelError
        If there is no bead.
    """
    found = beads(structure(assembly))
    if not found:
        raise ModelError("the structure has no bead of adhesive")
    bead = found[int(rng.integers(len(found)))]
    factor = float(np.exp(rng.uniform(*ln_factor)))
    return bead, factor, (modulus_of(assembly, bead) or 1.0) * factor


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E of a bead by e^-2 to e^-3."""
    bead, factor, E = softened_bead(article.assembly, rng, (-3.0, -2.0))
    truth = {"point_m": bead.point.tolist(), "value": E, "parameters": {"E": E}}
    made = with_factor_on(article.assembly, bead, factor)
    return replace(article, assembly=made, truth=truth)


FAMILY = Family(
    AdhesiveStiffness,
    conceal,
    candidates=candidates,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA"),
    settled_by="test a coupon of the adhesive, or cut through the joint and inspect it",
    needs="adhesive (solids) between sheets",
    on_sheets=True,
)
