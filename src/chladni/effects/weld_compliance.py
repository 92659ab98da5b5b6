"""A weld or a fastener that is softer than the deck has it.

A deck's weld is a thousand times stiffer than the sheets round it: what it does to the structure
hardly depends on its own stiffness w until that falls to the z of the sheets.  So its prior and its
name go by the softness s = z/(w + z) that static responses give: with s of its stiffness left it
carries half of its load, with e^-3 s next to none, and is missing.  With e^3 s it carries nearly
all: what data want of a weld beyond that is another patch of sheet that it holds, which a mesh sets
and no weld can be blamed for.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.assemble import structure
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect import Effect, MatrixTerm, Parameter
from .estimate import Estimate
from .family import Article, Family
from .joints import MOST_RUN, Connection, fasteners, with_factor_on, with_solids
from .model_families import joint_families
from .search_context import Candidate, ResponseScan, SearchContext, best_places

NONE_LEFT = -3.0  # ln of what is left over s: below it the joint is missing
MOST_LN_LEFT = 3.0  # ln of what is left over s, at most
SD = 1.2  # of the same: from next to nothing of the load to nearly all
STARTS = (-1.5, 0.0, 1.5)
SOUND = 40.0  # x of the deck's own
BY_POLES = 12  # fasteners tried where each costs eigenproblems
FOLLOWED = 2  # about the calibrated model, and one more about the deck's
SINGLE = 2  # half of the odds are those of one fastener, wherever it is ...
RUNS = 2 * (MOST_RUN - 1)  # ... the others those of a run, wherever it begins, however long it is
REFINED = 3  # runs whose ends are moved
RUNS_FOLLOWED = 2, 1  # about the deck's own model, where a gap is sharper, and the calibrated one
FAMILY_OF = {"solids": "welds", "bushes": "bushes"}  # the nuisance that scales all of a kind
NEEDS = "welds, screws or bushes between sheets or beams"

JointFamilies = dict[str, tuple[sp.csr_array, float]]


@dataclass(frozen=True, eq=False)
class WeldCompliance(Effect):
    """K + (f - 1) K_j + (e^g - 1) Σ_{i≠j} K_i: the joint times f = e^x, others of its kind e^g.

    The others' factor takes the place of the one that all of a kind share, so that none has more
    taken from it than it has and K stays positive.
    """

    name = "weld-compliance"
    elastic = True
    claim = "a weld or a fastener is softer than in the deck"
    rounds = 1  # a weld that is gone may free a mode of its own

    joint: Connection | None = None
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    others: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    @staticmethod
    def strength(softness: float) -> Parameter:
        """ln of what is left over s."""
        return Parameter("K", "of the deck's", 0.0, SD, softness, starts=STARTS, nominal=SOUND)

    def left(self, x: float) -> tuple[float, float]:
        """f(x) = s e^x, x > 0 bent towards ``MOST_LN_LEFT``, and its slope; 1 if sound."""
        if x >= SOUND:
            return 1.0, 0.0
        y = MOST_LN_LEFT * np.tanh(x / MOST_LN_LEFT) if x > 0 else x
        f = min(self.parameters[0].value(y), 1.0)
        return f, f * (1 - (y / MOST_LN_LEFT) ** 2 if x > 0 else 1.0)

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The joint's own and that of the others of its kind."""
        (f, slope), e = self.left(x[0]), np.eye(len(x))
        own = MatrixTerm("K", self.operator, f - 1, slope * e[0])
        if len(x) == 1:
            return (own,)
        g = float(np.exp(x[1]))
        return own, MatrixTerm("K", self.others, g - 1, g * e[1])

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """All relative motions that load the joint."""
        assert self.joint is not None
        return self.joint.rows

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """A property of its own for the joint, the others as they were fitted beside it."""
        assert self.joint is not None
        auxiliary_residual = x[1] if len(x) > 1 else 0.0
        made = with_all(assembly, self.joint.kind, float(np.exp(auxiliary_residual)))
        return with_factor_on(
            made, self.joint, self.left(x[0])[0] / float(np.exp(auxiliary_residual))
        )

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """What is left of the joint's stiffness."""
        low, here, high = (self.left(x[0] + k * 1.96 * self.widened(sd)[0])[0] for k in (-1, 0, 1))
        return (Estimate("K", here, "of the deck's", low, high),)

    def becomes(self, x: np.ndarray) -> str:
        """A missing weld, where next to no load is carried."""
        return "weld-missing" if x[0] < NONE_LEFT else ""


def with_all(assembly: Assembly, kind: str, factor: float) -> Assembly:
    """The assembly with all welds of solids, or all bushes, times a factor."""
    if kind != "bushes":
        return with_solids(assembly, factor, soft=False)
    bushes = replace(assembly.bushes, stiffness=factor * assembly.bushes.stiffness)
    return replace(assembly, bushes=bushes)


def of_one(
    kind: type[WeldCompliance],
    joint: Connection,
    share: np.ndarray,
    families: JointFamilies,
    tried: int,
    count: int = 1,
) -> WeldCompliance:
    """The effect of one of as many fasteners, or runs of them, as were tried.

    Parameters
    ----------
    count : of fasteners in the run
    share : (r,)   z/(w + z) of the joint's rows, see :func:`.joints.softness`
    families : {name: what all joints of a kind have in K, prior sd of ln of their factor}
    """
    own = sp.csr_array(joint.rows.T @ joint.rows)
    unknown: tuple[Parameter, ...] = (kind.strength(float(share.min())),)
    others, text = own, FAMILY_OF.get(joint.kind, "")
    if text in families:
        K, sd = families[text]
        others = sp.csr_array(K - own)
        unknown = (*unknown, Parameter("K of the others", "-", 0.0, sd, step=0.5))
    word = "weld" if joint.kind == "solids" else "fastener"
    x, y, z = joint.point.tolist()
    named = f"{word} {joint.ids[0]}"
    if count > 1:
        named = f"{count} {word}s in a row, elements {joint.ids[0]} to {joint.ids[-1]},"
    return kind(
        unknown, f"{named} {joint.where}", joint.parts, joint.grids,
        point=(x, y, z), trials_factor=tried, replaces=(text,) if text in families else (),
        joint=joint, operator=own, others=others,
    )  # fmt: skip


def proposed(kind: type[WeldCompliance], context: SearchContext) -> list[Candidate]:
    """The fasteners that explain most, by exact re-analysis about the calibrated model and both."""
    tried = context.fasteners
    own = [k for k, (joint, _) in enumerate(tried) if not joint.rigid]
    if not own:
        return []
    built = context.where.groups.structure
    families = {text: (K, sd) for text, K, sd in joint_families(built)}

    def effect(k: int) -> WeldCompliance:
        return of_one(kind, *tried[k], families, SINGLE * len(own))

    if context.scan is None:
        points = np.array([tried[k][0].point for k in own])
        some = farthest_point_sample(points, BY_POLES)
        chosen = [effect(own[k]) for k in some]
        return best_places(context, chosen, points[some], FOLLOWED, -1.0, extended=True)
    alone = [kind((kind.strength(float(share.min())),)) for _, share in tried]
    left = np.array([[e.left(x[0])[0] for x in e.starts()] for e in alone])
    out: dict[int, Candidate] = {}
    for about, base in reversed(tuple(enumerate(context.bases))):
        score = context.scan.fastener_scores(about, left)
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
    alone = kind((kind.strength(float(loose.share.min())),))
    left = np.array([alone.left(x[0])[0] for x in alone.starts()])
    score = scan.run_scores(about, n, first, last, left)
    k = int(np.argmin(score))
    return FastenerRun(float(score[k]), last - first + 1, loose.joint, loose.share, k)


def candidates(context: SearchContext) -> list[Candidate]:
    """Softer welds, screws and bushes."""
    return proposed(WeldCompliance, context)


def drawn(article: Article, rng: np.random.Generator) -> tuple[Connection, dict[str, object]]:
    """A fastener of the article, and where it is."""
    found = fasteners(structure(article.assembly))
    if not found:
        raise ModelError("the structure has no weld, screw or bush")
    joint = found[int(rng.integers(len(found)))]
    return joint, {"point_m": joint.point.tolist()}


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A fastener keeps 1e-5 to 1e-4 of its stiffness: it carries about half of its load."""
    joint, truth = drawn(article, rng)
    f = float(10 ** rng.uniform(-5, -4))
    made = with_factor_on(article.assembly, joint, f)
    return replace(article, assembly=made, truth={**truth, "value": f, "parameters": {"K": f}})


FAMILY = Family(
    WeldCompliance,
    conceal,
    candidates=candidates,
    cards=("MAT1", "PSOLID", "CHEXA", "CPENTA", "CTETRA", "PBAR", "CBAR", "PBUSH", "CBUSH"),
    settled_by="tap on both sides of the joint with a small hammer, and test a coupon of it",
    needs=NEEDS,
)
