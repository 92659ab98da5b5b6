"""A joint of adhesive or rubber that is far softer or stiffer than in the deck, or dissipates.

An error of about half the stiffness is a calibration parameter of every fit. Here the error may be
orders of magnitude: an uncured or torn bead, or another product. Between thin sheets the effect
saturates: a bead some thirty times stiffer than a sealant acts as a rigid joint.

A dissipative material is a mastic, a rubber bush, or a damping layer in place of an epoxy. For it
E(iω) = E_0 (iω/ω_0)^a is the only modulus with a constant loss factor. One number gives loss and
rise: η = tan(aπ/2), |E| ~ ω^a (Bagley and Torvik 1983, J. Rheology 27, 201). It is causal in the
sense of Kramers and Kronig. Real materials follow it over the decade of a test (Jones 2001,
Handbook of Viscoelastic Vibration Damping, ch. 2). Without loss it is an elastic joint.

Responses with equalised damping show only the rise. The loss shows in the modal damping ratios: η/2
times the joint's share of the strain energy of a mode (Ungar and Kerwin 1962, J. Acoust. Soc. Am.
34, 954-957). The hypothesis is compared with both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..model.assembly import Assembly
from ..model.properties import Isotropic, Part, SolidSection
from .effect import MatrixTerm, Parameter, Rise, Traits
from .estimate import Estimate, Location, Remarks
from .family import Article, Family
from .identified_damping import LEVEL_SD, IdentifiedDamping, paired_with
from .joint_stiffness import JointFamilies, JointStiffness, joint_families
from .joints import BUSHES, Connection, beads, joined, stiffness, with_factor_on
from .search_context import Candidate, SearchContext, best_places

SD = 3.0  # of ln of the factor on E
STARTS, STARTS_LOSSY = (-2.5, 2.0, 4.0), (-4.0, -2.0, 0.0, 2.0)
MOST_BEADS = 12  # beads tried, longest first
SEALANT = 80e6  # [Pa] upper limit of a soft hem sealant (Echaniz Granado 2015: 6 MPa)
LOSS, LOSS_SD = 0.3, 0.8  # η: mastics, rubbers and damping layers have 0.06 to 1.4 (Jones 2001)
NO_LOSS = -40.0  # ln of the loss over that, as good as zero
FAINT = 0.05  # η of a structural epoxy, below which the bead is a purely elastic one
FEWEST = 5  # modes below which their damping is not used
WORTH = 2.0  # least gain in -2 ln p for a fit: the cost of its one parameter (Akaike)
FOLLOWED = 2
RIGID = 0.02  # of the highest spectral line: below it a mode of the deck is rigid
CORDS = 0.7  # of the first flexible mode: lower modes are damped by the suspension
RANKING_ERROR = 0.03  # relative error of natural frequencies while joints are only ranked
AMOUNTS = np.geomspace(0.3, 100.0, 18)  # of the usual damping, in the mode that has most


@dataclass(frozen=True, eq=False)
class AdhesiveStiffness(JointStiffness):
    """E of a bead times e^x: one modulus for the bead, one for all others."""

    name = "adhesive-stiffness"
    claim = "a bead of adhesive is far softer or stiffer than in the deck"
    traits = Traits(rounds=2, own_loads=True)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """E of the bead."""
        return super().reported(x, sd)[:1]

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """A modulus that no sealant has is implausible, where the deck has a sealant."""
        E = self.parameters[0].value(x[0])
        if self.parameters[0].scale >= SEALANT or E <= SEALANT:
            return Remarks()
        return Remarks(
            implausible=f"E of {E / 1e6:.0f} MPa is too high for a sealant, which has less than "
            f"{SEALANT / 1e6:g}"
        )


@dataclass(frozen=True, eq=False)
class ViscoelasticJoint(JointStiffness):
    """K + e^x G(a) K_joint G(a) - K_joint, a = (2/π) arctan η; ζ_j + η/2 times its share."""

    name = "viscoelastic-joint"
    claim = "a joint is compliant and dissipates: its modulus is complex and rises with frequency"
    # the damping of the modes supports only one such effect
    traits = Traits(rounds=2, own_loads=True, lone=True, level=2)

    # from the first flexible mode of the deck to the highest spectral line [Hz]
    band: tuple[float, float] = (1.0, 1.0)

    @property
    def reference(self) -> float:
        """Reference frequency f_0 [Hz] of the modulus, the geometric middle of the band."""
        return float(np.sqrt(self.band[0] * self.band[1]))

    def exponent(self, x: np.ndarray) -> tuple[float, float, float]:
        """η, a and ∂a/∂x_1: a = (2/π) arctan η."""
        eta = self.parameters[1].value(x[1])
        return eta, float(2 / np.pi * np.arctan(eta)), float(2 / np.pi * eta / (1 + eta**2))

    def loss(self, x: np.ndarray) -> float:
        """η."""
        return self.exponent(x)[0]

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """Remove the deck's joint, add the viscoelastic one, and scale the others of its family."""
        e, (eta, a, slope) = np.eye(len(x)), self.exponent(x)
        rise = Rise(a / 2, slope / 2 * e[1], self.reference, self.band, eta, eta * e[1])
        factor, _ = self.factor(x)
        return (
            MatrixTerm("K", self.operator, -1.0, 0 * e[0], within=self.within),
            MatrixTerm("K", self.operator, factor, factor * e[0], rise),
            *self.of_family(x),
        )

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Modulus or stiffness at the reference, and the loss factor."""
        return super().reported(x, sd)[:2]

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The joint, and the frequency dependence of its stiffness, which MAT1 cannot represent."""
        name, (_, a, _) = self.parameters[0].name, self.exponent(x)
        rise = (
            f"{name} is valid at {self.reference:.3g} Hz and proportional to frequency to the "
            f"power {a:.2f}"
        )
        return replace(self.where(), text=f"{self.text}; {rise}")

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """An elastic bead, where the loss is below that of an epoxy; the modulus over frequency."""
        solid = self.joint is not None and self.joint.kind == "solids"
        elastic = "adhesive-stiffness" if solid and self.exponent(x)[0] < FAINT else ""
        return Remarks(becomes=elastic, comment=self.over_frequency(x))

    def over_frequency(self, x: np.ndarray) -> str:
        """Modulus over frequency in words, for a response with MATF1 or PBUSHT."""
        name, (eta, a, _) = self.parameters[0], self.exponent(x)
        f = np.geomspace(*self.band, 5)
        rows = [f"{k:.4g} Hz: {name.name} times {(k / self.reference) ** a:.4f}" for k in f]
        head = f"{self.text}: {name.name} in its card is valid at {self.reference:.4g} Hz"
        tail = (
            f"GE {eta:.4f} at all frequencies; tables of MATF1 (SOL 108, 111) or PBUSHT hold both"
        )
        return "\n".join([head, *rows, tail])


def longest_beads(built: Structure) -> list[Connection]:
    """The ``MOST_BEADS`` longest beads, which are tried."""
    return sorted(beads(built), key=lambda bead: -len(bead.elements))[:MOST_BEADS]


def beads_of(built: Structure) -> list[AdhesiveStiffness]:
    """One effect for each of the longest beads, and for all beads of a part together."""
    found = longest_beads(built)
    families = joint_families(built) if found else {}
    out = []
    for bead in found:
        E = modulus_of(built.assembly, bead)
        unit, scale = ("of the deck's", 1.0) if E is None else ("Pa", E)
        unknown = Parameter("E", unit, 0.0, SD, scale, step=1.0, starts=STARTS)
        names = sorted({p.name for p in _parts(built.assembly, bead)})
        text = f"{' and '.join(names)}, {len(bead.elements)} solids {bead.where}"
        out.append(
            AdhesiveStiffness.of(
                bead, (unknown,), text, len(found), "adhesive", families, "E of other beads",
                stiffness(built, bead),
            )
        )  # fmt: skip
    return out


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


def softened_bead(
    assembly: Assembly, rng: np.random.Generator, ln_factor: tuple[float, float]
) -> tuple[Connection, float, float]:
    """Draw a bead to conceal, the factor on its E from a range of its logarithm, and E [Pa]."""
    found = beads(structure(assembly))
    if not found:
        raise ModelError("the structure has no bead of adhesive")
    bead = found[int(rng.integers(len(found)))]
    factor = float(np.exp(rng.uniform(*ln_factor)))
    return bead, factor, (modulus_of(assembly, bead) or 1.0) * factor


def suspects(built: Structure, bushes: Sequence[Connection]) -> list[Connection]:
    """Beads, longest first, and bushes, all together then each; at most ``MOST_BEADS`` each.

    Mounts of one product have the same rubber.
    """
    whole = [joined(bushes)] if len(bushes) > 1 else []
    return [*longest_beads(built), *[*whole, *bushes][:MOST_BEADS]]


def _of_one(
    context: SearchContext, joint: Connection, families: JointFamilies, tried: int
) -> ViscoelasticJoint:
    where, built = context.where, context.where.groups.structure
    low, high = _first(where.frequency, where.setup.f_max), where.setup.f_max
    solid = joint.kind == "solids"
    E = modulus_of(built.assembly, joint) if solid else None
    name, unit = ("E", "Pa") if E else ("K", "of the deck's")
    damping = _held_out(context)
    assert damping is not None
    unknown = (
        Parameter(name, unit, 0.0, SD, E or 1.0, step=1.0, starts=STARTS_LOSSY),
        Parameter("loss factor", "-", 0.0, LOSS_SD, LOSS, nominal=NO_LOSS),
        Parameter("other damping", "-", 0.0, LEVEL_SD, damping.usual),
    )
    return ViscoelasticJoint.of(
        joint, unknown, f"{len(joint.elements)} {joint.kind} {joint.where}", tried,
        "adhesive" if solid else "bushes", families, f"{name} of others",
        stiffness(built, joint), band=(low, high), damping=damping,
    )  # fmt: skip


def _first(frequency: np.ndarray, f_max: float) -> float:
    """First flexible mode of the deck below the highest spectral line, or that line [Hz]."""
    flexible = frequency[frequency > RIGID * f_max]
    return float(flexible.min(initial=f_max))


def _held_out(context: SearchContext) -> IdentifiedDamping | None:
    """Damping of the flexible modes, or None if there are too few."""
    damping, where = context.where.setup.damping, context.where
    if damping is None:
        return None
    own = damping.above(CORDS * _first(where.frequency, where.setup.f_max))
    return own if len(own.ratio) >= FEWEST else None


def speaks_for(
    damping: IdentifiedDamping,
    frequency: np.ndarray,
    share: np.ndarray,
    same: float = RANKING_ERROR,
) -> float:
    """Gain in 2 ln p of damping proportional to a modal energy share (m,) over uniform damping.

    Parameters
    ----------
    frequency : (m,) [Hz]   of the modes with these shares
    """
    even = damping.neg2_log_likely(np.zeros_like(damping.ratio))
    w, _ = paired_with(damping.frequency, frequency, same)
    follows = w @ share / max(float(share.max(initial=0.0)), 1e-300)
    return even - min(damping.neg2_log_likely(a * damping.usual * follows) for a in AMOUNTS)


def _spoken_for(context: SearchContext, effect: ViscoelasticJoint) -> float:
    """Gain of :func:`speaks_for` for a joint, at the best of its trial stiffnesses."""
    lam, operators = context.modal_operators(effect, effect.starts()[0])
    out, damping = [], effect.damping
    assert damping is not None
    for x in STARTS_LOSSY:
        w, V = np.linalg.eigh(np.diag(lam) + np.expm1(x) * operators[0])
        f = np.sqrt(np.maximum(w, 0)) / (2 * np.pi)
        kept = (f > RIGID * context.where.setup.f_max) & (f < 2 * context.where.setup.f_max)
        energy = np.einsum("ir,ij,jr->r", V, operators[0], V, optimize=True)
        out.append(speaks_for(damping, f[kept], np.exp(x) * energy[kept] / w[kept]))
    return max(out)


def softer_beads(context: SearchContext) -> list[Candidate]:
    """The beads whose change of stiffness explains most."""
    effects = beads_of(context.where.groups.structure)
    return best_places(context, effects, FOLLOWED, anywhere=True, extended=True)


def candidates(context: SearchContext) -> list[Candidate]:
    """The joints that the modal damping supports most, if it supports any."""
    if _held_out(context) is None:
        return []
    built = context.where.groups.structure
    bushes = [j for j, _ in context.fasteners if j.kind == "bushes" and not j.rigid]
    tried = suspects(built, bushes)
    families = joint_families(built) if tried else {}
    effects = [_of_one(context, joint, families, len(tried)) for joint in tried]
    gain = np.array([_spoken_for(context, e) for e in effects])
    best = [effects[k] for k in np.argsort(-gain)[:FOLLOWED] if gain[k] > WORTH]
    return best_places(context, best, FOLLOWED, anywhere=True, extended=True)


def soften(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E of a bead by e^-2 to e^-3."""
    bead, factor, E = softened_bead(article.assembly, rng, (-3.0, -2.0))
    made = with_factor_on(article.assembly, bead, factor)
    return article.with_hidden(made, {"E": E}, bead.point)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E of a bead by e^-3.5 to e^-2.5, with a constant loss factor of 0.3 to 0.8."""
    bead, factor, E = softened_bead(article.assembly, rng, (-3.5, -2.5))
    eta = float(rng.uniform(0.3, 0.8))
    made = with_factor_on(article.assembly, bead, factor, eta)
    return article.with_hidden(made, {"E": E, "loss factor": eta}, bead.point)


ADHESIVE = Family(
    AdhesiveStiffness,
    soften,
    candidates=softer_beads,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA"),
    settled_by="test a coupon of the adhesive, or cut through the joint and inspect it",
    needs="adhesive (solids) between sheets",
    on_sheets=True,
)
FAMILY = Family(
    ViscoelasticJoint,
    conceal,
    candidates=candidates,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA", *BUSHES),
    settled_by=(
        "repeat the test at another temperature, which changes only a viscoelastic joint, and at "
        "another level of excitation, which changes only a slipping joint"
    ),
    needs="adhesive (solids) or bushes between sheets or beams",
)
