"""A crack: bending stiffness lost along a line of shells. An effect from outside of chladni.

All of it is in this file: physics, candidates, concealment on the bench, change of the deck. Its
package tells chladni by one entry point, ``crack = "crack:FAMILY"`` in the group
``chladni.effects``.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from chladni.effects.effect import WIDER, Effect, MatrixTerm, Parameter
from chladni.effects.estimate import Estimate
from chladni.effects.family import Article, Family
from chladni.effects.search_context import Candidate, SearchContext, best_places
from chladni.effects.shell_groups import ShellGroups
from chladni.fem.sparse_assembly import blocks, congruence
from chladni.model.assembly import Assembly
from chladni.model.properties import ShellSection

LEAST = 0.1  # of the bending stiffness is always left: K stays positive
SHELLS = 3  # fewer of them are no line
TINY = 1e-6  # m
FOLLOWED = 8  # lines that are worth a fit


@dataclass(frozen=True, eq=False)
class Line:
    """Shells side by side across a part.

    ``shells`` (m,) bool of all shells; ``centre`` (3,) [m]; ``part`` its position.
    """

    shells: np.ndarray
    centre: np.ndarray
    part: int


def lines(assembly: Assembly) -> list[Line]:
    """Every line of shells across every part, along both its principal directions."""
    shells, out = assembly.shells, []
    X = assembly.points[shells.nodes]
    for part in np.unique(shells.part):
        mine = shells.part == part
        centre = X[mine].mean(axis=1)
        for d in np.linalg.svd(centre - centre.mean(axis=0), full_matrices=False)[2][:2]:
            width, along = np.median(np.ptp(X[mine] @ d, axis=1)), centre @ d
            if width < TINY or np.ptp(along) < width:
                continue  # shells on edge, or a strip one shell wide
            row = np.full(len(shells), -1)
            row[mine] = np.round((along - along.min()) / width)
            chosen = [row == k for k in range(row.max() + 1)]
            out += [Line(c, X[c].mean(axis=(0, 1)), int(part)) for c in chosen if c.sum() >= SHELLS]
    return out


@dataclass(frozen=True, eq=False)
class Crack(Effect):
    """K - (1 - f) Σ_line B_e, B_e the bending stiffness; f = 0.1 + 0.9 / (1 + e^x) is what is left.

    With f > 0 the sum is positive: no more than B is taken from A + B.
    """

    name = "crack"
    claim = "bending stiffness is lost along a line: a crack, a bead ground off, a bend annealed"

    shells: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    part: int = 0

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """(f - 1) B."""
        f = left(x[0])
        slope = -(f - LEAST) * (1 - (f - LEAST) / (1 - LEAST))
        return (MatrixTerm("K", self.operator, f - 1, np.array([slope])),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The shells of the line with a property of their own, 12I/t³ times f."""
        return cracked(assembly, self.shells, left(x[0]))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """What is left of 12I/t³."""
        value, high, low = (left(x[0] + s * 1.96 * WIDER * sd[0]) for s in (0, -1, 1))
        return (Estimate("12I/T3", value, "-", low, high),)


def left(x: float) -> float:
    """What is left of the bending stiffness, from 1 to LEAST."""
    return float(LEAST + (1 - LEAST) / (1 + np.exp(x)))


def crack(groups: ShellGroups, line: Line, tried: int) -> Crack:
    """A crack along one line of as many as were tried."""
    assembly = groups.structure.assembly
    on = line.shells
    K = blocks(groups.cubic[on], groups.nodes[on], len(assembly.points))
    name, (x, y, z) = assembly.parts[line.part].name, line.centre.tolist()
    at = ", ".join(f"{1e3 * v:.0f}" for v in (x, y, z))
    starts = (-1.0, 0.5, 2.0)
    unknown = Parameter("12I/T3", "-", 0.0, 1.5, kind="linear", starts=starts, nominal=-40.0)
    return Crack(
        (unknown,), f"across {name} through ({at} mm)", (name,), point=(x, y, z),
        grids=tuple(assembly.ids[np.unique(groups.nodes[on])].tolist()), trials_factor=tried,
        shells=on, operator=congruence(groups.structure.T, K), part=line.part,
    )  # fmt: skip


def cracked(assembly: Assembly, shells: np.ndarray, f: float) -> Assembly:
    """The assembly with f times the bending stiffness in some shells, which become parts."""
    parts, part = list(assembly.parts), assembly.shells.part.copy()
    for k in np.unique(part[shells]):
        old = parts[k]
        assert isinstance(old.section, ShellSection)
        new = old.with_section(bending_ratio=old.section.bending_ratio * f)
        part[shells & (assembly.shells.part == k)] = len(parts)
        parts.append(replace(new, id=1 + max(p.id for p in parts), name=f"crack in {old.name}"))
    return replace(assembly, parts=tuple(parts), shells=replace(assembly.shells, part=part))


def candidates(context: SearchContext) -> list[Candidate]:
    """The lines along which a crack explains most; mirrored ones are hard to tell apart."""
    groups = context.where.groups
    tried = lines(groups.structure.assembly)
    effects = [crack(groups, line, len(tried)) for line in tried]
    return best_places(context, effects, np.array([line.centre for line in tried]), FOLLOWED, -1)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A line of the deck loses 50 to 80 % of its bending stiffness, the finer shells in it."""
    options = lines(article.deck)
    line = options[int(rng.integers(len(options)))]
    f = float(rng.uniform(0.2, 0.5))
    here, there = (a.points[a.shells.nodes].mean(axis=1) for a in (article.assembly, article.deck))
    inside = line.shells[cKDTree(there).query(here)[1]]
    truth = {"point_m": line.centre.tolist(), "value": f, "parameters": {"12I/T3": f}}
    return replace(article, assembly=cracked(article.assembly, inside, f), truth=truth)


FAMILY = Family(Crack, conceal, candidates=candidates, cards=("PSHELL", "CQUAD4", "CTRIA3"))
