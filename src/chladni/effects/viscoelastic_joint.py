"""A joint of a dissipative material: a mastic, a rubber bush, or a damping layer for an epoxy.

E(iω) = E_0 (iω/ω_0)^a is the only modulus with a constant loss factor. One number gives loss and
rise: η = tan(aπ/2), |E| ~ ω^a (Bagley and Torvik 1983, J. Rheology 27, 201). It is causal in the
sense of Kramers and Kronig. Real materials follow it over the decade of a test (Jones 2001,
Handbook of Viscoelastic Vibration Damping, ch. 2).

Responses with equalised damping show only the rise. The loss shows in the modal damping ratios: η/2
times the joint's share of the strain energy of a mode (Ungar and Kerwin 1962, J. Acoust. Soc. Am.
34, 954-957). The hypothesis is compared with both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure
from ..fem.derivative import of_lumps
from ..model.assembly import Assembly
from .adhesive_stiffness import MOST_BEADS, longest_beads, modulus_of, softened_bead
from .effect import AuxiliaryResidual, Effect, MatrixTerm, Parameter, Rise
from .estimate import Estimate, Location
from .family import Article, Family
from .identified_damping import LEVEL_SD, IdentifiedDamping, paired_with
from .joints import Connection, stiffness, with_factor_on, with_solids
from .model_families import joint_families, shared_factor
from .search_context import Candidate, SearchContext, best_places

SD = 3.0  # of ln of the factor on E, as of any bead
STARTS = (-4.0, -2.0, 0.0, 2.0)
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
class ViscoelasticJoint(Effect):
    """K + e^x G(a) K_joint G(a) - K_joint, a = (2/π) arctan η; ζ_j + η/2 times the joint's share.

    Attributes
    ----------
    operator, others : contribution to K of the joint, and of all others of its kind
    band : from the first flexible mode of the deck to the highest spectral line [Hz]
    damping : of the identified modes
    """

    name = "viscoelastic-joint"
    claim = "a joint is compliant and dissipates: its modulus is complex and rises with frequency"
    rounds = 2
    lone = True  # the damping of the modes supports only one such effect

    joint: Connection | None = None
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    others: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    band: tuple[float, float] = (1.0, 1.0)
    damping: IdentifiedDamping | None = None

    @property
    def reference(self) -> float:
        """Reference frequency f_0 [Hz] of the modulus, the geometric middle of the band."""
        return float(np.sqrt(self.band[0] * self.band[1]))

    def exponent(self, x: np.ndarray) -> tuple[float, float, float]:
        """η, a and ∂a/∂x_1: a = (2/π) arctan η."""
        eta = self.parameters[1].value(x[1])
        return eta, float(2 / np.pi * np.arctan(eta)), float(2 / np.pi * eta / (1 + eta**2))

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """Remove the deck's joint, add the viscoelastic one, and scale the others of its kind."""
        e, (eta, a, slope) = np.eye(len(x)), self.exponent(x)
        rise = Rise(a / 2, slope / 2 * e[1], self.reference, self.band, eta, eta * e[1])
        factor = float(np.exp(x[0]))
        out = (
            MatrixTerm("K", self.operator, -1.0, 0 * e[0]),
            MatrixTerm("K", self.operator, factor, factor * e[0], rise),
        )
        if len(x) < 4:
            return out
        p = self.parameters[3]
        return (*out, MatrixTerm("K", self.others, p.value(x[3]) - 1, p.slope(x[3]) * e[3]))

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the joint; the basis already represents all of its kind together."""
        return sp.csr_array((self.operator @ shapes).T)

    def reloads(self, static: np.ndarray, M: sp.csr_array) -> np.ndarray:
        """Loads A u of the joint, for any stiffness of it (as for ``adhesive-stiffness``)."""
        return self.operator @ static

    def auxiliary_residual(
        self, x: np.ndarray, lam: np.ndarray, dissipated: np.ndarray
    ) -> AuxiliaryResidual | None:
        """Residuals of the identified damping against a common level plus the joint's loss."""
        if self.damping is None:
            return None
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        w, steep = paired_with(self.damping.frequency, f)
        more = w @ dissipated
        r, slope = self.damping.misfit(x[2], more)
        own = self.damping.usual * np.exp(x[2])
        by_more = (slope / (own + more))[:, None]
        by_own = np.outer(slope * own / (own + more), np.eye(len(x))[2])
        moved = w * steep * (dissipated - more[:, None]) / (2 * np.maximum(lam, 1e-9 * lam[-1]))
        return AuxiliaryResidual(r, by_own, by_more * moved, by_more * w)

    @property
    def neg2_log_without(self) -> float:
        """-2 ln p of the identified damping with a common level only."""
        return 0.0 if self.damping is None else self.damping.neg2_log_evidence()

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write E and loss factor at the reference, and E of the others as fitted with it."""
        assert self.joint is not None
        others = self.parameters[3].value(x[3]) if len(x) > 3 else 1.0
        made = _with_all(assembly, self.joint, others)
        return with_factor_on(made, self.joint, float(np.exp(x[0])) / others, self.exponent(x)[0])

    def deck_comment(self, x: np.ndarray) -> str:
        """Modulus over frequency, for a frequency response with MATF1 or PBUSHT."""
        name, (eta, a, _) = self.parameters[0], self.exponent(x)
        f = np.geomspace(*self.band, 5)
        rows = [f"{k:.4g} Hz: {name.name} times {(k / self.reference) ** a:.4f}" for k in f]
        head = f"{self.text}: {name.name} in its card is valid at {self.reference:.4g} Hz"
        tail = (
            f"GE {eta:.4f} at all frequencies; tables of MATF1 (SOL 108, 111) or PBUSHT hold both"
        )
        return "\n".join([head, *rows, tail])

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Modulus or stiffness at the reference, and the loss factor."""
        return super().reported(x, sd)[:2]

    def location(self, x: np.ndarray) -> Location:
        """The joint, and the frequency dependence of its stiffness, which MAT1 cannot represent."""
        name, (_, a, _) = self.parameters[0].name, self.exponent(x)
        rise = (
            f"{name} is valid at {self.reference:.3g} Hz and proportional to frequency to the "
            f"power {a:.2f}"
        )
        return replace(self.where(), text=f"{self.text}; {rise}")

    def becomes(self, x: np.ndarray) -> str:
        """Return "adhesive-stiffness" for a bead whose loss is below that of an epoxy."""
        solid = self.joint is not None and self.joint.kind == "solids"
        return "adhesive-stiffness" if solid and self.exponent(x)[0] < FAINT else ""


def _with_all(assembly: Assembly, joint: Connection, factor: float) -> Assembly:
    """Multiply the stiffness of all joints of a kind by a factor."""
    if joint.kind == "solids":
        return with_solids(assembly, factor, soft=True)
    stiff = np.where(assembly.bushes.ids[:, None] > 0, factor, 1.0) * assembly.bushes.stiffness
    return replace(assembly, bushes=replace(assembly.bushes, stiffness=stiff))


@dataclass(frozen=True, eq=False)
class _Suspect:
    """A joint that may dissipate, its contribution to K and the name of its family."""

    joint: Connection
    operator: sp.csr_array
    family: str


def _suspects(built: Structure, bushes: Sequence[Connection]) -> list[_Suspect]:
    """Beads, longest first, and bushes, all together then each; at most ``MOST_BEADS`` each."""
    out = [_Suspect(b, stiffness(built, b), "adhesive") for b in longest_beads(built)]
    whole = [_together(bushes)] if len(bushes) > 1 else []
    for joint in [*whole, *bushes][:MOST_BEADS]:
        rows = joint.elements.tolist()
        out.append(_Suspect(joint, of_lumps(built, "bushes", rows).K, "bushes"))
    return out


def _together(bushes: Sequence[Connection]) -> Connection:
    """All bushes as one joint, because mounts of one product have the same rubber."""
    return replace(
        bushes[0],
        elements=np.concatenate([b.elements for b in bushes]),
        ids=tuple(i for b in bushes for i in b.ids),
        point=np.mean([b.point for b in bushes], axis=0),
        parts=tuple(dict.fromkeys(p for b in bushes for p in b.parts)),
        grids=tuple(dict.fromkeys(g for b in bushes for g in b.grids)),
    )


def _of_one(
    context: SearchContext, one: _Suspect, family: tuple[sp.csr_array, float], tried: int
) -> ViscoelasticJoint:
    where, (K, sd) = context.where, family
    built = where.groups.structure
    others = sp.csr_array(K - one.operator)
    low, high = _first(where.frequency, where.setup.f_max), where.setup.f_max
    E = modulus_of(built.assembly, one.joint) if one.joint.kind == "solids" else None
    name, unit = ("E", "Pa") if E else ("K", "of the deck's")
    damping = _held_out(context)
    assert damping is not None
    unknown: tuple[Parameter, ...] = (
        Parameter(name, unit, 0.0, SD, E or 1.0, step=1.0, starts=STARTS),
        Parameter("loss factor", "-", 0.0, LOSS_SD, LOSS, nominal=NO_LOSS),
        Parameter("other damping", "-", 0.0, LEVEL_SD, damping.usual),
    )
    if abs(others).max() > 1e-9 * abs(K).max():
        unknown = (*unknown, shared_factor(f"{name} of others", one.family, sd))
    x, y, z = one.joint.point.tolist()
    what = "solids" if one.family == "adhesive" else "bushes"
    return ViscoelasticJoint(
        unknown, f"{len(one.joint.elements)} {what} {one.joint.where}", one.joint.parts,
        one.joint.grids, point=(x, y, z), trials_factor=tried, replaces=(one.family,),
        joint=one.joint, operator=one.operator, others=others, band=(low, high), damping=damping,
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
    for x in STARTS:
        w, V = np.linalg.eigh(np.diag(lam) + np.expm1(x) * operators[0])
        f = np.sqrt(np.maximum(w, 0)) / (2 * np.pi)
        kept = (f > RIGID * context.where.setup.f_max) & (f < 2 * context.where.setup.f_max)
        energy = np.einsum("ir,ij,jr->r", V, operators[0], V, optimize=True)
        out.append(speaks_for(damping, f[kept], np.exp(x) * energy[kept] / w[kept]))
    return max(out)


def candidates(context: SearchContext) -> list[Candidate]:
    """The joints that the modal damping supports most, if it supports any."""
    if _held_out(context) is None:
        return []
    built = context.where.groups.structure
    bushes = [j for j, _ in context.fasteners if j.kind == "bushes" and not j.rigid]
    suspects = _suspects(built, bushes)
    families = {text: (K, sd) for text, K, sd in joint_families(built)} if suspects else {}
    effects = [_of_one(context, s, families[s.family], len(suspects)) for s in suspects]
    gain = np.array([_spoken_for(context, e) for e in effects])
    best = [effects[k] for k in np.argsort(-gain)[:FOLLOWED] if gain[k] > WORTH]
    if not best:
        return []
    points = np.array([e.point for e in best])
    return best_places(context, best, points, FOLLOWED, -1.0, extended=True)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Multiply E of a bead by e^-3.5 to e^-2.5, with a constant loss factor of 0.3 to 0.8."""
    bead, factor, E = softened_bead(article.assembly, rng, (-3.5, -2.5))
    eta = float(rng.uniform(0.3, 0.8))
    truth = {
        "point_m": bead.point.tolist(), "value": E, "parameters": {"E": E, "loss factor": eta},
    }  # fmt: skip
    made = with_factor_on(article.assembly, bead, factor, eta)
    return replace(article, assembly=made, truth=truth)


FAMILY = Family(
    ViscoelasticJoint,
    conceal,
    candidates=candidates,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA", "PBUSH", "CBUSH"),
    settled_by=(
        "repeat the test at another temperature, which changes only a viscoelastic joint, and at "
        "another level of excitation, which changes only a slipping joint"
    ),
    needs="adhesive (solids) or bushes between sheets or beams",
)
