"""A hem whose sheets do not slide along it, where the model has only soft sealant.

In a hem the outer sheet is folded round the inner one. A box section gains torsional stiffness
because the inner edge cannot slide along the fold. Echaniz Granado (2015, section 5.3.2) describes
an edge that cannot move into the fold, but the sliding is the motion that matters. Along the whole
hem, a far stiffer sealant changes all frequencies in the same way; along a stretch it does not.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..errors import ModelError
from ..model.assembly import Assembly, Average
from .attachments import NOTHING
from .contacts import SheetPairs
from .effect import Effect, Parameter, PointTerm
from .estimate import Estimate, Location, in_mm
from .family import Article, Family
from .joints import solid_parts
from .search_context import Candidate, SearchContext

SHORTEST = 8  # solids of a string
CLOSED = 6.0  # pitches between its ends, below which a line is closed
MEDIAN, SD = 1e9, 3.0  # [N/m²] stiffness against sliding per length, sd of its ln
STARTS = (-1.5, 0.5, 2.5)
HAT = 0.06  # [m] spacing of the loads whose responses the basis contains
STRETCH, STRETCH_SD = 0.15, 0.7  # of the line: half of a stretch, sd of its ln
PLACES = 10  # along a line, tried as the middle of a stretch
SQUARE = 4  # power of the distance in the edge of a stretch: even
END = 1e-3  # of the stiffness in the middle: less is not written


@dataclass(frozen=True, eq=False)
class HemLine(SheetPairs):
    """A line through the solids of a string, in order; ``along`` are its tangents."""

    name: str  # of the part
    sheets: tuple[str, ...]  # names of the sheets
    share: np.ndarray  # (k,) tributary length of each solid [m]
    s: np.ndarray  # (k,) arc length [m]
    length: float  # total, the gap between the ends of a closed line included [m]
    closed: bool

    def from_place(self, s0: float) -> np.ndarray:
        """Signed arc length (k,) from a place of the line, by the shorter way if closed [m]."""
        d = self.s - s0
        return d - self.length * np.round(d / self.length) if self.closed else d


def hem_lines(assembly: Assembly) -> list[HemLine]:
    """The lines of all parts of adhesive that form strings between two sheets."""
    out = []
    for group, rows in solid_parts(assembly, soft=True):
        chains = list(_chains(assembly.solids[group].nodes[rows]))
        if chains and all(len(chain) > 1 for chain in chains) and len(rows) >= SHORTEST:
            middle = assembly.points[assembly.solids[group].nodes[rows]].mean(axis=1)
            order = rows[_joined(middle, chains)]
            if (line := _line(assembly, group, order)) is not None:
                out.append(line)
    return out


def _chains(nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Rows of hexahedra from end to end of each string; none if they branch."""
    m = len(nodes)
    at, column = np.unique(nodes, return_inverse=True)
    where = (np.repeat(np.arange(m), nodes.shape[1]), column.ravel())
    touch = sp.csr_array((np.ones(nodes.size), where), shape=(m, len(at)))
    shared = sp.coo_array(touch @ touch.T)
    face = (shared.data >= 4) & (shared.row != shared.col)
    graph = sp.csr_array((np.ones(face.sum()), (shared.row[face], shared.col[face])), shape=(m, m))
    degree = np.diff(graph.indptr)
    if (degree > 2).any():
        return
    piece = connected_components(graph, directed=False)[1]
    for p in range(piece.max() + 1):
        mine = np.flatnonzero(piece == p)
        ends = mine[degree[mine] < 2]
        here, seen = int(ends[0] if len(ends) else mine[0]), [-1]
        while here >= 0:
            seen.append(here)
            next_ones = graph.indices[graph.indptr[here] : graph.indptr[here + 1]]
            here = next((int(j) for j in next_ones if j not in seen[-2:-1] and j != seen[1]), -1)
        yield np.array(seen[1:])


def _joined(middle: np.ndarray, chains: list[np.ndarray]) -> np.ndarray:
    """Join chains: each starts at the end nearest to the end of the previous one."""
    left = sorted(chains, key=len)
    line = list(left.pop())
    while left:
        gaps = [
            (float(np.linalg.norm(middle[chain[end]] - middle[line[-1]])), k, end)
            for k, chain in enumerate(left)
            for end in (0, -1)
        ]
        _, k, end = min(gaps)
        chain = left.pop(k)
        line += list(chain if end == 0 else chain[::-1])
    return np.array(line)


def _line(assembly: Assembly, group: int, rows: np.ndarray) -> HemLine | None:
    """The line through ordered solids, or None unless each is attached to two sheets."""
    solids = assembly.solids[group]
    middle = assembly.points[solids.nodes[rows]].mean(axis=1)
    step = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    pitch, gap = float(np.median(step)), float(np.linalg.norm(middle[-1] - middle[0]))
    closed = gap < CLOSED * pitch
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    carriers = {
        mean.reference: np.array([row for row, _, _ in mean.terms])
        for mean in assembly.rigid
        if isinstance(mean, Average)
    }
    part = np.full(len(assembly.points), -1)  # of shells at each point
    part[assembly.shells.nodes.ravel()] = np.repeat(assembly.shells.part, 4)
    sides = tuple(_sides(part, carriers, nodes) for nodes in solids.nodes[rows])
    if any(len(a) < 3 or len(b) < 3 for a, b in sides):
        return None
    s = np.concatenate([[0.0], np.cumsum(step)])
    name = assembly.parts[int(solids.part[rows[0]])].name
    parts = np.unique(np.concatenate([part[np.concatenate(side)] for side in sides]))
    sheets = tuple(assembly.parts[int(p)].name for p in parts)
    share = np.minimum(np.gradient(s), 2 * pitch)
    length = float(s[-1]) + gap * closed
    return HemLine(middle, along, sides, name, sheets, share, s, length, closed)


def _sides(
    part: np.ndarray, carriers: dict[int, np.ndarray], nodes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the grids to which a solid is attached, in its first and in its second part."""
    rows = np.unique(np.concatenate([carriers.get(int(n), np.array([n])) for n in nodes]))
    mine = part[rows]
    known = np.unique(mine[mine >= 0])
    none = np.zeros(0, int)
    if len(known) != 2:
        return none, none
    return rows[mine == known[0]], rows[mine == known[1]]


@dataclass(frozen=True, eq=False)
class HemContact(Effect):
    """K + Σ_i k L_i w_i b_iᵀ b_i, b_i the sliding and L_i the length of solid i along the line.

    Along the whole line w = 1 and x = (ln k,). On a stretch of length 2ℓ w = exp(-(d/ℓ)⁴) at the
    distance d from its middle. Then x = (ln k, middle over half the line's length, ln ℓ).
    """

    name = "hem-contact"
    claim = "the sheets of a hem cannot slide along it as they would with soft sealant alone"

    line: HemLine = field(kw_only=True)
    rows: sp.csr_array = field(kw_only=True)  # b (k, n)

    @property
    def local(self) -> bool:
        """True for a contact along a stretch."""
        return len(self.parameters) > 1

    def weights(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """w (k,) and ∂ln w/∂x of the middle and of ln ℓ (k, 2)."""
        if not self.local:
            return np.ones(len(self.line)), np.zeros((len(self.line), 0))
        _, middle, reach = self.parameters
        ell = reach.value(x[2])
        d = self.line.from_place(middle.value(x[1])) / ell
        slopes = np.stack([SQUARE * d ** (SQUARE - 1) * middle.scale / ell, SQUARE * d**SQUARE], 1)
        return np.exp(-(d**SQUARE)), slopes

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """The springs along the line."""
        w, slopes = self.weights(x)
        c = self.parameters[0].value(x[0]) * self.line.share * w
        gradient = c[:, None] * np.column_stack([np.ones(len(c)), slopes])
        return (PointTerm("K", self.rows, c, gradient),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Hat functions along the line, as weights on the loads of the springs."""
        count = min(len(self.line), max(2, round(self.line.length / HAT)))
        at = np.arange(count) * self.line.length / (count - (not self.line.closed))
        hats = [np.maximum(1 - np.abs(self.line.from_place(a)) / (at[1] - at[0]), 0) for a in at]
        return sp.csr_array(sp.csr_array(np.array(hats)) @ self.rows)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write a CBUSH between two RBE3 at each place where the hem holds."""
        k = self.terms(x)[0].coefficient
        return self.line.gripped(assembly, np.where(k > END * k.max(), k, 0.0))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Sliding stiffness per length, and the length of a stretch."""
        k = super().reported(x, sd)[0]
        if not self.local:
            return (k,)
        length = self.estimate(x, sd, lambda y: 2 * self.parameters[2].value(y[2]), k=2)
        return k, length

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The stretch, from one end to the other."""
        if not self.local:
            return self.where()
        _, middle, reach = self.parameters
        s0, ell = middle.value(x[1]), reach.value(x[2])
        point, *ends = (self._at(s) for s in (s0, s0 - ell, s0 + ell))
        begin, end = map(in_mm, ends)
        text = f"along {self.line.name} from ({begin} mm) to ({end} mm)"
        return replace(self.where(), text=text, point_m=point, radius_m=ell)

    def _at(self, s: float) -> tuple[float, ...]:
        """The place (3,) of the line nearest to an arc length."""
        k = int(np.abs(self.line.from_place(s)).argmin())
        return tuple(float(v) for v in self.line.middle[k])


def everywhere(line: HemLine, rows: sp.csr_array, tried: int) -> HemContact:
    """The contact along a whole line."""
    k = Parameter("K", "N/m2", 0.0, SD, MEDIAN, step=1.0, starts=STARTS, nominal=NOTHING)
    return HemContact(
        (k,), f"along all of {line.name}", line.sheets, trials_factor=tried, line=line, rows=rows
    )


def along_stretch(line: HemLine, rows: sp.csr_array, tried: int) -> HemContact:
    """The contact along a stretch of a line, at an unknown place."""
    whole, half = everywhere(line, rows, tried), line.length / 2
    middle = Parameter("s", "m", 1.0, 3**-0.5, half, "linear", step=0.1)
    reach = Parameter("L", "m", 0.0, STRETCH_SD, STRETCH * line.length, step=0.3)
    return replace(
        whole, parameters=(*whole.parameters, middle, reach), text=f"along a part of {line.name}"
    )


def candidates(context: SearchContext) -> list[Candidate]:
    """Every string of adhesive, as a whole and with the stretch that explains most."""
    built = context.where.groups.structure
    lines = hem_lines(built.assembly)
    out = []
    for line in lines:
        rows = line.relative_rows(built)
        whole, some = (f(line, rows, len(lines)) for f in (everywhere, along_stretch))
        middles = (2 * np.arange(PLACES) + 1) / PLACES
        starts = [np.array([k, s, 0.0]) for s in middles for k in STARTS[::2]]
        for effect, tried in ((whole, whole.starts()), (some, starts)):
            scores = context.scores(effect, tried, extended=True)[0]
            out.append(Candidate(effect, tried[int(np.argmin(scores))], context.bases[-1]))
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Block the sliding along a whole string, with 1e9 to 1e10 N/m²."""
    lines = hem_lines(article.assembly)
    if not lines:
        raise ModelError("the structure has no line of adhesive and so no hem")
    line = lines[int(rng.integers(len(lines)))]
    k = float(10 ** rng.uniform(9.0, 10.0))
    made = line.gripped(article.assembly, k * line.share)
    return article.with_hidden(made, {"K": k})


FAMILY = Family(
    HemContact,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE3", "CBUSH", "PBUSH", "CORD2R"),
    settled_by="cut through the hem and check if its sheets touch or the sealant is hard",
    needs="lines of adhesive between two sheets",
    on_sheets=True,
)
