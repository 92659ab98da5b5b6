"""Welds, fasteners and rigid ties that are softer than in the deck, or missing.

A weld of a deck is a thousand times stiffer than the sheets around it. Its stiffness w hardly
affects the structure until it falls to that of the sheets, z. Hence prior and name depend on the
softness s = z/(w + z), which static responses give. With a share s of its stiffness the weld
carries half of its load; with e^-3 s it carries nearly none and is missing. With e^3 s it carries
nearly all. More than that is not a property of a weld, but another patch of sheet that it holds,
which the mesh determines.

An RBE2 is rigid; a clip, a screwed flange or a bearing is not. The search uses a model with a
spring k_0 in every tie, far stiffer than the sheets round it
(:func:`.rigid_ties.on_firm_springs`). A compliant tie has k in series with k_0 instead. The rest is
as for a weld of reduced stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from ..fem.assemble import structure
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect import MatrixTerm, Parameter, Traits
from .estimate import Estimate, Remarks
from .family import Article, Family
from .joint_stiffness import Fastener, JointFamilies, joint_families
from .joints import (
    BUSHES,
    MOST_RUN,
    Connection,
    fasteners,
    with_factor_on,
    with_family,
    without_joint,
)
from .rigid_ties import RigidTie, firmly_held, rigid_ties, sprung
from .search_context import Candidate, ResponseScan, SearchContext, best_places

NONE_LEFT = -3.0  # ln of what is left over s: below it the joint is missing
MOST_LN_LEFT = 3.0  # ln of what is left over s, at most
SD = 1.2  # of the same: from next to nothing of the load to nearly all
STARTS = (-1.5, 0.0, 1.5)
SOUND = 40.0  # x of the deck's own
GONE = -12.0  # x of a missing joint: as good as nothing left
SCORED = (GONE, *STARTS)  # x at which a joint is scored, once for both kinds
BY_POLES = 12  # fasteners tried where each costs eigenproblems
FOLLOWED = 2  # about the calibrated model, and one more about the deck's
SINGLE = 2  # half of the odds are those of one fastener, wherever it is ...
RUNS = 2 * (MOST_RUN - 1)  # ... the others those of a run, wherever it begins, however long it is
REFINED = 3  # runs whose ends are moved
RUNS_FOLLOWED = 2, 1  # about the deck's own model, where a gap is sharper, and the calibrated one
FAMILY_OF = {"solids": "welds", "bushes": "bushes"}  # the nuisance that scales all of a kind
NEEDS = "welds, screws or bushes between sheets or beams"
TIE_SD = 2.0  # of ln k about the stiffness of the sheets at the tie
TIE_STARTS = tuple(np.arange(-4.0, 4.0).tolist())  # a factor e² off, the right tie looks wrong
RIGID = 60.0  # ln of k over its median that is as good as rigid
TIES_BY_POLES, TIES_FOLLOWED = 12, 2


@dataclass(frozen=True, eq=False)
class WeldCompliance(Fastener):
    """The joint times f = s e^x, others of its family times g."""

    name = "weld-compliance"
    claim = "a weld or a fastener is softer than in the deck"
    traits = Traits(elastic=True, rounds=1)

    @staticmethod
    def strength(softness: float) -> Parameter:
        """Logarithm of the remaining share over s."""
        return Parameter("K", "of the deck's", 0.0, SD, softness, starts=STARTS, nominal=SOUND)

    def left(self, x: float) -> tuple[float, float]:
        """f(x) = s e^x, x > 0 bent towards ``MOST_LN_LEFT``, and its slope; 1 if sound."""
        if x >= SOUND:
            return 1.0, 0.0
        y = MOST_LN_LEFT * np.tanh(x / MOST_LN_LEFT) if x > 0 else x
        f = min(self.parameters[0].value(y), 1.0)
        return f, f * (1 - (y / MOST_LN_LEFT) ** 2 if x > 0 else 1.0)

    def factor(self, x: np.ndarray) -> tuple[float, float]:
        """The remaining share of the stiffness, and its slope."""
        return self.left(x[0])

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Remaining share of the joint's stiffness."""
        return (self.estimate(x, sd, lambda y: self.left(y[0])[0]),)

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """A missing weld, where the joint carries nearly no load."""
        return Remarks(becomes="weld-missing" if x[0] < NONE_LEFT else "")


@dataclass(frozen=True, eq=False)
class WeldMissing(WeldCompliance):
    """The joint times e^-12 s, others of its kind times e^g; the rest is too small to estimate."""

    name = "weld-missing"
    claim = "a weld or a fastener of the deck is missing or carries no load"

    @staticmethod
    def strength(softness: float) -> Parameter:
        """Nothing left, as good as."""
        return Parameter("K", "of the deck's", GONE, 1.0, softness, starts=(GONE,), nominal=SOUND)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Remove the elements of a missing joint, and write the others as fitted with it."""
        assert self.joint is not None
        if x[0] > NONE_LEFT:
            return super().apply(assembly, x)
        made = with_family(assembly, self.family, self.shared(x)[0])
        return without_joint(made, self.joint)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Zero stiffness, with an upper limit that would carry a twentieth of the load."""
        return (Estimate("K", 0.0, "of the deck's", 0.0, self.left(NONE_LEFT)[0]),)

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """None, because there is no simpler effect."""
        return Remarks()


def of_one(
    kind: type[WeldCompliance],
    joint: Connection,
    share: np.ndarray,
    families: JointFamilies,
    tried: int,
    count: int = 1,
) -> WeldCompliance:
    """The effect of one of as many fasteners, or runs of ``count`` of them, as were tried.

    Parameters
    ----------
    share : (r,)   z/(w + z) of the joint's rows
    """
    word = "weld" if joint.kind == "solids" else "fastener"
    named = f"{word} {joint.ids[0]}"
    if count > 1:
        named = f"{count} {word}s in a row, elements {joint.ids[0]} to {joint.ids[-1]},"
    return kind.of(
        joint, (kind.strength(float(share.min())),), f"{named} {joint.where}", tried,
        FAMILY_OF.get(joint.kind, ""), families, "K of the others",
    )  # fmt: skip


def proposed(kind: type[WeldCompliance], context: SearchContext) -> list[Candidate]:
    """The fasteners, and runs of them, that explain most, by exact re-analysis from each base."""
    tried = context.fasteners
    own = [k for k, (joint, _) in enumerate(tried) if not joint.rigid]
    if not own:
        return []
    built = context.where.groups.structure
    families = joint_families(built)

    def effect(k: int) -> WeldCompliance:
        return of_one(kind, *tried[k], families, SINGLE * len(own))

    if context.scan is None:
        some = farthest_point_sample(np.array([tried[k][0].point for k in own]), BY_POLES)
        chosen = [effect(own[k]) for k in some]
        return best_places(context, chosen, FOLLOWED, anywhere=True, extended=True)
    left, mine = np.array([_left(share) for _, share in tried]), _own_starts(kind)
    out: dict[int, Candidate] = {}
    for about, base in reversed(tuple(enumerate(context.bases))):
        score = context.scan.fastener_scores(about, left)[:, mine]
        wanted = FOLLOWED if not out else FOLLOWED + 1
        for k in sorted(own, key=score.min(axis=1).__getitem__):
            if len(out) >= wanted:
                break
            if k not in out:
                found = effect(k)
                out[k] = Candidate(found, found.starts()[int(np.argmin(score[k]))], base)
    followed: set[tuple[int, ...]] = set()
    for about, (base, count) in enumerate(zip(context.bases, RUNS_FOLLOWED, strict=False)):
        for run in best_runs(kind, context.scan, about, count):
            if run.joint.ids not in followed:
                followed.add(run.joint.ids)
                found = of_one(kind, run.joint, run.share, families, len(own) * RUNS, run.count)
                out[-len(followed)] = Candidate(found, found.starts()[run.start], base)
    return list(out.values())


@dataclass(frozen=True, eq=False)
class FastenerRun:
    """Adjacent fasteners as one joint, its shares (r,), the best of the starts and its score."""

    score: float
    count: int
    joint: Connection
    share: np.ndarray
    start: int


def best_runs(
    kind: type[WeldCompliance], scan: ResponseScan, about: int, count: int
) -> list[FastenerRun]:
    """The runs that explain most, wherever they begin and however long they are, best first.

    Runs of 2, 4 and 8 fasteners are tried at every half of their length, for neighbours share their
    load and the loss of one may be felt nowhere. The best ``REFINED`` are moved, lengthened and
    shortened by one fastener while that explains more.
    """
    found: dict[tuple[int, int, int], FastenerRun] = {}

    def score(at: tuple[int, int, int]) -> float:
        if at not in found:
            found[at] = _run(kind, scan, about, *at)
        return found[at].score

    for n, row in enumerate(scan.fastener_rows):
        if row.run(0, 0).joint.rigid:
            continue
        for length in (2, 4, MOST_RUN):
            for first in range(0, len(row) - length + 1, length // 2):
                score((n, first, first + length - 1))
    for n, first, last in sorted(found, key=score)[:REFINED]:
        best = (n, first, last)
        while (better := min(_next_to(best, len(scan.fastener_rows[n])), key=score)) != best:
            if score(better) >= score(best):
                break
            best = better
    return sorted(found.values(), key=lambda run: run.score)[:count]


def _next_to(at: tuple[int, int, int], length: int) -> list[tuple[int, int, int]]:
    """Runs whose ends lie one fastener away, and the run itself."""
    n, first, last = at
    ends = [(first + a, last + b) for a in (0, -1, 1) for b in (0, -1, 1)]
    inside = [(a, b) for a, b in ends if 0 <= a < b < length and b - a < MOST_RUN]
    return [(n, a, b) for a, b in inside]


def _run(
    kind: type[WeldCompliance], scan: ResponseScan, about: int, n: int, first: int, last: int
) -> FastenerRun:
    loose = scan.fastener_rows[n].run(first, last)
    score = scan.run_scores(about, n, first, last, _left(loose.share))[_own_starts(kind)]
    k = int(np.argmin(score))
    return FastenerRun(float(score[k]), last - first + 1, loose.joint, loose.share, k)


def _left(share: np.ndarray) -> np.ndarray:
    """Remaining share of the stiffness of a joint at ``SCORED`` (4,)."""
    joint = WeldCompliance((WeldCompliance.strength(float(share.min())),))
    return np.array([joint.left(x)[0] for x in SCORED])


def _own_starts(kind: type[WeldCompliance]) -> list[int]:
    """Positions of the starts of a kind in ``SCORED``."""
    return [SCORED.index(x) for x in kind.strength(1.0).starts]


def softer(context: SearchContext) -> list[Candidate]:
    """Softer welds, screws and bushes."""
    return proposed(WeldCompliance, context)


def missing(context: SearchContext) -> list[Candidate]:
    """Missing welds, screws and bushes."""
    return proposed(WeldMissing, context)


def drawn(article: Article, rng: np.random.Generator) -> Connection:
    """A random fastener of the article."""
    found = fasteners(structure(article.assembly))
    if not found:
        raise ModelError("the structure has no weld, screw or bush")
    return found[int(rng.integers(len(found)))]


def _loosen(article: Article, rng: np.random.Generator) -> Article:
    """Leave 1e-5 to 1e-4 of the stiffness of a fastener: it carries about half of its load."""
    joint = drawn(article, rng)
    f = float(10 ** rng.uniform(-5, -4))
    made = with_factor_on(article.assembly, joint, f)
    return article.with_hidden(made, {"K": f}, joint.point)


def _remove(article: Article, rng: np.random.Generator) -> Article:
    """Remove a fastener."""
    joint = drawn(article, rng)
    return article.with_hidden(without_joint(article.assembly, joint), {"K": 0.0}, joint.point)


COMPLIANCE = Family(
    WeldCompliance,
    _loosen,
    candidates=softer,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA", "PBAR", "CBAR", *BUSHES),
    settled_by="tap on both sides of the joint with a small hammer, and test a coupon of it",
    needs=NEEDS,
)
MISSING = Family(
    WeldMissing,
    _remove,
    candidates=missing,
    cards=("MAT1", "CHEXA", "CPENTA", "CTETRA", "CBAR", *BUSHES),
    settled_by="inspect that joint, and test it by ultrasound or a chisel",
    needs=NEEDS,
)


@dataclass(frozen=True, eq=False)
class OverConstraint(Fastener):
    """K - K_j / (1 + k/k_0), K_j = k_0 bᵀb the firm spring in the tie: k and k_0 in series."""

    name = "over-constraint"
    claim = "a joint is compliant where the model has a rigid tie"
    traits = Traits(rounds=1)

    tie: RigidTie | None = None
    firm: float = 1.0

    def left(self, x: float) -> float:
        """Remaining share of the firm spring, k / (k + k_0)."""
        return 1.0 / (1.0 + self.firm / self.parameters[0].value(x))

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """(f - 1) K_j, without a difference of nearly equal numbers."""
        k = self.parameters[0].value(x[0])
        lost = 1.0 / (1.0 + k / self.firm)
        slope = np.array([lost * (1 - lost)])
        return (MatrixTerm("K", self.operator, -lost, slope, within=self.within),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH between the tie's independent grid and a new one that leads the others."""
        assert self.tie is not None
        return sprung(assembly, self.tie, self.parameters[0].value(x[0]))


def over_constraint(
    assembly: Assembly, joint: Connection, share: np.ndarray, tried: int
) -> OverConstraint:
    """The effect of the tie with a given firm spring, one of ``tried`` ties.

    Parameters
    ----------
    share : (r,)   z/(k_0 + z) of the spring's rows, z the stiffness of the sheets in series
    """
    tie, firm = firmly_held(assembly, int(joint.elements[0]))
    z = firm * float(np.exp(np.log(share / (1 - np.minimum(share, 0.999))).mean()))
    unknown = Parameter("K", "N/m", 0.0, TIE_SD, z, step=1.0, starts=TIE_STARTS, nominal=RIGID)
    effect = OverConstraint.of(
        joint, (unknown,), f"rigid tie {joint.where}", tried, "", {}, "", tie=tie, firm=firm
    )
    return replace(effect, point=tuple(assembly.points[tie.lead].tolist()))


def ties(context: SearchContext) -> list[Candidate]:
    """The rigid ties whose compliance explains most, by exact re-analysis from each base."""
    every = context.fasteners
    at = [k for k, (joint, _) in enumerate(every) if joint.rigid]
    if not at:
        return []
    built = context.where.groups.structure
    effects = [over_constraint(built.assembly, *every[k], len(at)) for k in at]
    if context.scan is None:
        some = farthest_point_sample(np.array([e.point for e in effects]), TIES_BY_POLES)
        chosen = [effects[k] for k in some]
        return best_places(context, chosen, TIES_FOLLOWED, anywhere=True, extended=True)
    left = np.ones((len(every), len(TIE_STARTS)))
    left[at] = [[e.left(x) for x in TIE_STARTS] for e in effects]
    out: dict[int, Candidate] = {}
    for about, base in reversed(tuple(enumerate(context.bases))):
        score = context.scan.fastener_scores(about, left)[at]
        best = np.argsort(score.min(axis=1)).tolist()
        for k in [k for k in best if k not in out][:TIES_FOLLOWED]:
            out[k] = Candidate(effects[k], np.array([TIE_STARTS[int(np.argmin(score[k]))]]), base)
    return list(out.values())


def _release(article: Article, rng: np.random.Generator) -> Article:
    """Give a rigid tie of the article a stiffness of 30 to 1000 N/mm."""
    ties = rigid_ties(article.assembly)
    if not ties:
        raise ModelError("the structure has no rigid elements except those of its fasteners")
    tie = ties[int(rng.integers(len(ties)))]
    k = float(10 ** rng.uniform(4.5, 6.0))
    made = sprung(article.assembly, tie, k)
    return article.with_hidden(made, {"K": k}, article.assembly.points[tie.lead])


TIE = Family(
    OverConstraint,
    _release,
    candidates=ties,
    cards=("GRID", "RBE2", "CBUSH", "PBUSH"),
    settled_by="tap on both sides of the tie with a small hammer, and compare their motion",
    needs="rigid elements (RBE2, RBAR) except those at fasteners",
)
