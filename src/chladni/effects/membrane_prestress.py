"""A sheet under a membrane force: assembled with strain, or warmer or colder than its frame.

The forces N [N/m] along and across a part are uniform. Each acts on its own family of modes (waves
along, waves across), so that the data determine both. Three forms with a single strength (along,
across, biaxial) lost to orthotropy and thinning on a plate and a panel whose truth was another.

|N| stays below 0.7 of the buckling force, in compression and tension, and so does the combination
of both. This is also the scale of the prior: an unbuckled sheet gives no other information on N.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..errors import ModelError
from ..fem.assemble import Structure, frames, structure
from ..fem.membrane_force import MembraneForce, geometric_stiffness, membrane_force, with_mean
from ..geometry.cells import edges_of
from ..geometry.facets import cell_areas, vector_areas
from ..geometry.sampling import farthest_point_sample
from ..model.added_points import next_id
from ..model.assembly import Assembly, appended, picked
from .effect import Effect, MatrixTerm, Parameter
from .estimate import Estimate
from .family import Article, Family
from .search_context import Candidate, SearchContext

# of buckling; with both forces 0.7 √2, where |N_1|/N_cr1 + |N_2|/N_cr2 = 1 is safe
MOST_OF_BUCKLING = 0.7
SD = 0.4  # of N / (0.7 N_cr) where that is small: mostly within a third of buckling
STARTS = (-0.35, 0.35)
LARGE = 0.05  # share of the shells' area below which a part is not tried
FOLLOWED = 2
WAYS = ("along", "across")
RIGID = 1e-6  # of the middle λ: below it a motion is rigid
ACROSS = 0.7  # cosine between a rim's edge and the force, above which the edge is not loaded
LEADS = 12  # grids at the rim whose mean rotation the forces there follow
MODES = 40  # from which the buckling force of an article is computed


@dataclass(frozen=True, eq=False)
class MembranePrestress(Effect):
    """K + Σ N_k K_k, N_k = 0.7 N_cr,k x_k / √(1 + |x|²); see :mod:`..fem.membrane_force`."""

    name = "membrane-prestress"
    claim = "a sheet has a membrane force, because it was strained, heated or cooled in place"

    part: int = 0
    tensors: np.ndarray = field(kw_only=True)  # (2, 3, 3) unit forces along and across
    critical: np.ndarray = field(kw_only=True)  # N_cr,k [N/m]
    operators: tuple[sp.csr_array, ...] = ()

    def force(self, x: np.ndarray) -> np.ndarray:
        """N (2,) [N/m], positive in tension."""
        return np.asarray(MOST_OF_BUCKLING * self.critical * x / np.sqrt(1 + x @ x))

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """N_k K_k."""
        s, most = 1 + x @ x, MOST_OF_BUCKLING * self.critical[:, None]
        slope = most * (np.eye(2) - np.outer(x, x) / s) / np.sqrt(s)
        every = zip(self.operators, self.force(x), slope, strict=True)
        return tuple(MatrixTerm("K", K, float(N), g, geometric=True) for K, N, g in every)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write CELAS2 between the grids of the part, and on the mean rotation of its rim."""
        own = len(assembly.springs)
        for tensor, N in zip(self.tensors, self.force(x), strict=True):
            assembly = prestressed(assembly, self.part, tensor, float(N))
        return with_summed_springs(assembly, own)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """N along and across, each interval with the other force fixed."""
        along = self.estimate(x, sd, lambda y: self.force(y)[0])
        return along, self.estimate(x, sd, lambda y: self.force(y)[1], k=1)


def axes_of(assembly: Assembly, part: int) -> np.ndarray:
    """Directions along and across a part (2, 3), in the plane of its sheets, the longest first.

    The direction between two facing flanges lies in neither sheet and is excluded.
    """
    cells = assembly.shells.nodes[assembly.shells.part == part]
    n = vector_areas(assembly.points, cells)
    n /= np.sqrt(np.linalg.norm(n, axis=1, keepdims=True))
    plane = np.linalg.eigh(n.T @ n)[1][:, :2]  # the two directions normal to the least area
    X = assembly.points[np.unique(cells)] @ plane
    return np.asarray(np.linalg.svd(X - X.mean(axis=0), full_matrices=False)[2] @ plane.T)


def tensors(assembly: Assembly, part: int) -> np.ndarray:
    """A unit force along the part and across it (2, 3, 3)."""
    return np.stack([np.outer(e, e) for e in axes_of(assembly, part)])


def field_of(assembly: Assembly, part: int, tensor: np.ndarray) -> MembraneForce:
    """The unit force over all shells of a part."""
    return membrane_force(assembly, np.flatnonzero(assembly.shells.part == part), tensor)


def unit_stiffness(built: Structure, part: int, tensor: np.ndarray) -> sp.csr_array:
    """K_g (n, n) of a unit force in a part."""
    rim = pulled_rim(built.assembly, part, tensor)
    return geometric_stiffness(built, field_of(built.assembly, part, tensor), rim)


def prestress(built: Structure, part: int, tried: int = 1) -> MembranePrestress:
    """Forces in a part whose buckling force is not yet known: N_cr = 1 / 0.7."""
    a = built.assembly
    both, name = tensors(a, part), a.parts[part].name
    unknown = tuple(
        Parameter(f"N {way}", "N/m", 0.0, SD, kind="linear", step=0.3, starts=STARTS)
        for way in WAYS
    )
    return MembranePrestress(
        unknown, f"in {name}", (name,), trials_factor=tried, part=part, tensors=both,
        critical=np.full(2, 1 / MOST_OF_BUCKLING),
        operators=tuple(unit_stiffness(built, part, tensor) for tensor in both),
    )  # fmt: skip


def buckling(lam: np.ndarray, K_g: np.ndarray) -> float:
    """Smallest |N| [N/m] at which K + N K_g loses its stiffness, over modes of λ (r,).

    Both signs of N count, because a tension of that size is a large change too.
    """
    flexible = lam > RIGID * np.median(lam)
    s = 1 / np.sqrt(lam[flexible])
    most = np.abs(sl.eigvalsh(s[:, None] * K_g[flexible][:, flexible] * s)).max(initial=0.0)
    return float(1 / most) if most > 0 else np.inf


def prestressed(assembly: Assembly, part: int, tensor: np.ndarray, N: float) -> Assembly:
    """Write a force N in a part as scalar springs, whose stiffness may be negative."""
    force = field_of(assembly, part, tensor)
    pairs, k = force.springs
    if assembly.axes is not None and np.ptp(assembly.axes[np.unique(pairs)], axis=0).max() > 1e-9:
        raise ModelError(
            f"the grids of {assembly.parts[part].name} have different displacement frames (CD), "
            "so scalar springs between them cannot represent a membrane force"
        )
    made, at = with_mean(assembly, pulled_rim(assembly, part, tensor))
    moments = sp.csr_array(frames(assembly).T @ force.moments)
    made = _with_springs(made, *_turns(at, N * force.turning, N * moments))
    three = np.repeat(np.arange(1, 4), len(k))
    ends = np.column_stack([three, three])
    return _with_springs(made, np.tile(pairs, (3, 1)), ends, np.tile(N * k, 3))


def with_summed_springs(assembly: Assembly, own: int) -> Assembly:
    """Merge springs that couple the same two motions, from row ``own`` on.

    Springs without stiffness are left out. The springs must be elastic, as here.
    """
    s = assembly.springs
    motions = np.sort(8 * s.nodes[own:] + s.component[own:], axis=1)[:, ::-1]  # ground is last
    key, back = np.unique(motions, axis=0, return_inverse=True)
    value = np.bincount(back.reshape(-1), s.value[own:], len(key))
    key, value = key[value != 0], value[value != 0]
    kept = replace(assembly, springs=picked(s, slice(own)))
    return _with_springs(kept, key // 8, key % 8, value)


def pulled_rim(assembly: Assembly, part: int, tensor: np.ndarray) -> np.ndarray:
    """Rows of some grids at the rim of a part that the force loads; any grids without a rim."""
    shells = assembly.shells
    nodes = shells.nodes[shells.part == part]
    sides, count = np.unique(edges_of(nodes), axis=0, return_counts=True)
    rim = sides[count == 1]
    t = np.diff(assembly.points[rim], axis=1)[:, 0]
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    one_way = np.trace(tensor) < 1.5
    pulls = np.einsum("ka,ab,kb->k", t, tensor, t) < ACROSS**2 if one_way else len(rim) > 0
    found = np.unique(rim[np.broadcast_to(pulls, len(rim))])
    found = found if len(found) > 2 else np.unique(nodes)
    return np.asarray(found[farthest_point_sample(assembly.points[found], LEADS)])


def _turns(
    row: int, cost: np.ndarray, moments: sp.csr_array
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Springs that give θᵀ C θ - 2 uᵀ m θ for the rotations θ of a point.

    A spring h between two motions adds -h off the diagonal and h on it; springs to ground cancel
    the diagonal. Returns nodes, components and values.
    """
    m = sp.coo_array(moments)
    a, b = np.triu_indices(3, 1)
    ground = np.full(m.nnz, -1)
    own, turned = np.array([(row, -1)] * 3 + [(row, row)] * 3), np.full(m.nnz, row)
    others = (np.column_stack([m.row // 6, end]) for end in (turned, ground))
    nodes = np.concatenate([own, *others])
    own = np.column_stack([np.r_[0, 1, 2, a], np.r_[0, 1, 2, b]]) + 3
    others = (np.column_stack([m.row % 6, end]) for end in (m.col + 3, m.row % 6))
    component = 1 + np.concatenate([own, *others])
    held = cost.sum(axis=1) - np.asarray(moments.sum(axis=0)).ravel()
    value = np.concatenate([held, -cost[a, b], m.data, -m.data])
    some = value != 0
    return nodes[some], component[some], value[some]


def _with_springs(
    assembly: Assembly, nodes: np.ndarray, component: np.ndarray, value: np.ndarray
) -> Assembly:
    ids = next_id(assembly) + np.arange(len(value))
    new = appended(assembly.springs, ids=ids, nodes=nodes, component=component, value=value)
    return replace(assembly, springs=new)


def _sheets(assembly: Assembly) -> Iterator[int]:
    """Parts with a share of at least ``LARGE`` of the shells' area."""
    shells = assembly.shells
    area = np.bincount(shells.part, cell_areas(assembly.points, shells.nodes), len(assembly.parts))
    yield from np.flatnonzero(area > LARGE * area.sum()).tolist()


def candidates(context: SearchContext) -> list[Candidate]:
    """The parts whose forces explain most, each below its buckling force."""
    built = context.where.groups.structure
    parts = list(_sheets(built.assembly))
    effects = []
    for part in parts:
        bare = prestress(built, part, len(parts))
        lam, K = context.modal_operators(bare, np.zeros(2))
        critical = np.array([buckling(lam, each) for each in K])
        if np.isfinite(critical).all():
            effects.append(replace(bare, critical=critical))
    out = []
    for about, base in enumerate(context.bases):  # calibration alone may be far from the truth
        found = [context.scores(e, e.starts(), about=about)[0] for e in effects]
        for k in sorted(range(len(effects)), key=lambda j: found[j].min())[:FOLLOWED]:
            start = effects[k].starts()[int(np.argmin(found[k]))]
            out.append(Candidate(effects[k], start, base))
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Load the first part along and across, with 0.25 to 0.5 and up to 0.15 of buckling."""
    made = article.assembly
    share = rng.choice([-1, 1], 2) * np.array([rng.uniform(0.25, 0.5), rng.uniform(0, 0.15)])
    truth = {}
    for k, part_of in zip(rng.permutation(2), share, strict=True):
        tensor = tensors(article.assembly, 0)[k]
        N = float(part_of) * critical_force(article.assembly, 0, tensor)
        made, truth[f"N {WAYS[k]}"] = prestressed(made, 0, tensor, N), N
    largest = max(truth.values(), key=abs)
    return replace(article, assembly=made, truth={"value": largest, "parameters": truth})


def critical_force(assembly: Assembly, part: int, tensor: np.ndarray) -> float:
    """N_cr [N/m] of a part, computed over the structure's lowest modes."""
    built = structure(assembly)
    modes = normal_modes(built.system, min(MODES, len(built.system.dofs)))
    K, lam = unit_stiffness(built, part, tensor), (2 * np.pi * modes.frequency) ** 2
    return buckling(lam, modes.shapes.T @ (K @ modes.shapes))


FAMILY = Family(
    MembranePrestress,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE3", "CELAS2"),
    settled_by="test again at another temperature, or with the clamps of the sheet released",
    on_sheets=True,
)
