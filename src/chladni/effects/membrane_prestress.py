"""A sheet under a membrane force: assembled with strain, or warmer or colder than what holds it.

The force N [N/m] is even over a part: along it, across it, or the same all round.  Low modes tell
one strength well; how the two directions share it is told by which of their families moved, so that
it is asked as one of three forms, not as a second number: a free ratio is one more number that
mimics the sheet's own stiffness.

N stays within 0.8 of what would buckle the sheet (or, pulled, of as much), which is also the scale
of its prior: a sheet that has not buckled says no more of its N.
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
from ..geometry.facets import cell_areas
from ..geometry.sampling import farthest_point_sample
from ..model.added_points import next_id
from ..model.assembly import Assembly, Scalars
from .effect import WIDER, Effect, MatrixTerm, Parameter
from .estimate import Estimate
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places

MOST = 0.8  # of what buckles
SD = 0.4  # of artanh(N / (0.8 N_cr)): within a third of buckling, mostly
STARTS = (-0.5, 0.5)
LARGE = 0.05  # share of the shells' area below which a part is not asked
FOLLOWED = 2
FORMS = ("along", "across", "all round")
RIGID = 1e-6  # of the middle λ: below it a motion is rigid
ACROSS = 0.7  # cosine between a rim's edge and the force: more, and the edge does not pull
LEADS = 12  # grids at the rim with which the pulls there turn
MODES = 40  # that tell what buckles an article


@dataclass(frozen=True, eq=False)
class MembranePrestress(Effect):
    """K + N K_g, N = 0.8 N_cr tanh x; see :mod:`..fem.membrane_force`.

    ``critical`` is N_cr [N/m], ``tensor`` (3, 3) the direction of a unit force.
    """

    name = "membrane-prestress"
    claim = "a sheet stands under a membrane force: it was strained, warmed or cooled in its place"

    part: int = 0
    tensor: np.ndarray = field(default_factory=lambda: np.eye(3))
    critical: float = 1.0
    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    def force(self, x: float) -> float:
        """N [N/m], positive where it pulls."""
        return float(MOST * self.critical * np.tanh(x))

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """N K_g."""
        slope = MOST * self.critical / np.cosh(x[0]) ** 2
        return (MatrixTerm("K", self.operator, self.force(x[0]), np.array([slope])),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """CELAS2 between the grids of the part, and on the mean turn of its rim."""
        return prestressed(assembly, self.part, self.tensor, self.force(x[0]))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """N."""
        low, here, high = (self.force(x[0] + s * 1.96 * WIDER * sd[0]) for s in (-1, 0, 1))
        return (Estimate("N", here, "N/m", low, high),)


def axes_of(assembly: Assembly, part: int) -> np.ndarray:
    """Along and across a part (2, 3): where its points lie farthest apart, and next to that."""
    X = assembly.points[np.unique(assembly.shells.nodes[assembly.shells.part == part])]
    return np.asarray(np.linalg.svd(X - X.mean(axis=0), full_matrices=False)[2][:2])


def tensors(assembly: Assembly, part: int) -> tuple[np.ndarray, ...]:
    """A unit force along the part, across it, and all round (3, 3) each."""
    along, across = axes_of(assembly, part)
    return np.outer(along, along), np.outer(across, across), np.eye(3)


def field_of(assembly: Assembly, part: int, tensor: np.ndarray) -> MembraneForce:
    """The unit force over all shells of a part."""
    return membrane_force(assembly, np.flatnonzero(assembly.shells.part == part), tensor)


def unit_stiffness(built: Structure, part: int, tensor: np.ndarray) -> sp.csr_array:
    """K_g (n, n) of a unit force in a part."""
    rim = pulled_rim(built.assembly, part, tensor)
    return geometric_stiffness(built, field_of(built.assembly, part, tensor), rim)


def prestress(
    built: Structure, part: int, tensor: np.ndarray, form: str, tried: int = 1
) -> MembranePrestress:
    """A force of a form in a part, of which nothing is known yet: N_cr = 1 / 0.8."""
    a = built.assembly
    unknown = Parameter("N", "N/m", 0.0, SD, kind="linear", step=0.3, starts=STARTS)
    name = a.parts[part].name
    return MembranePrestress(
        (unknown,), f"{form} {name}", (name,), trials_factor=tried, part=part, tensor=tensor,
        critical=1 / MOST, operator=unit_stiffness(built, part, tensor),
    )  # fmt: skip


def buckling(lam: np.ndarray, K_g: np.ndarray) -> float:
    """The smaller |N| at which K + N K_g loses its stiffness, over modes of λ (r,): [N/m].

    Both ways count: of a sheet that is pulled N beyond that is no small thing either.
    """
    flexible = lam > RIGID * np.median(lam)
    s = 1 / np.sqrt(lam[flexible])
    most = np.abs(sl.eigvalsh(s[:, None] * K_g[flexible][:, flexible] * s)).max(initial=0.0)
    return float(1 / most) if most > 0 else np.inf


def prestressed(assembly: Assembly, part: int, tensor: np.ndarray, N: float) -> Assembly:
    """The assembly with a force N in a part, as scalar springs; their stiffness may be negative.

    Raises
    ------
    ModelError
        If grids of the part count their motion in different frames.
    """
    force = field_of(assembly, part, tensor)
    pairs, k = force.springs
    if assembly.axes is not None and np.ptp(assembly.axes[np.unique(pairs)], axis=0).max() > 1e-9:
        raise ModelError(
            f"the grids of {assembly.parts[part].name} count displacements in different frames "
            "(CD), so that scalar springs between them cannot hold a membrane force"
        )
    made, at = with_mean(assembly, pulled_rim(assembly, part, tensor))
    moments = sp.csr_array(frames(assembly).T @ force.moments)
    made = _with_springs(made, *_turns(at, N * force.turning, N * moments))
    three = np.repeat(np.arange(1, 4), len(k))
    ends = np.column_stack([three, three])
    return _with_springs(made, np.tile(pairs, (3, 1)), ends, np.tile(N * k, 3))


def pulled_rim(assembly: Assembly, part: int, tensor: np.ndarray) -> np.ndarray:
    """Some grids at the rim of a part where the force pulls, as rows; any where it has no rim."""
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
    """Springs that make θᵀ C θ - 2 uᵀ m θ of the turns θ of a point: nodes, components, values.

    A spring h couples two motions by -h and holds both by h, which springs to ground take back.
    """
    m = sp.coo_array(moments)
    a, b = np.triu_indices(3, 1)
    ground = np.full(m.nnz, -1)
    nodes = np.concatenate(
        [
            np.array([(row, -1)] * 3 + [(row, row)] * 3),
            np.column_stack([m.row // 6, np.full(m.nnz, row)]),
            np.column_stack([m.row // 6, ground]),
        ]
    )
    component = 1 + np.concatenate(
        [
            np.column_stack([np.r_[0, 1, 2, a], np.r_[0, 1, 2, b]]) + 3,
            np.column_stack([m.row % 6, m.col + 3]),
            np.column_stack([m.row % 6, m.row % 6]),
        ]
    )
    held = cost.sum(axis=1) - np.asarray(moments.sum(axis=0)).ravel()
    value = np.concatenate([held, -cost[a, b], m.data, -m.data])
    some = value != 0
    return nodes[some], component[some], value[some]


def _with_springs(
    assembly: Assembly, nodes: np.ndarray, component: np.ndarray, value: np.ndarray
) -> Assembly:
    old, ids = assembly.springs, next_id(assembly) + np.arange(len(value))
    new = Scalars(
        np.append(old.ids, ids), np.concatenate([old.nodes, nodes]),
        np.concatenate([old.component, component]), np.append(old.value, value),
        np.append(old.damping, np.zeros(len(value))),
    )  # fmt: skip
    return replace(assembly, springs=new)


def _sheets(assembly: Assembly) -> Iterator[int]:
    """Parts that are more than a scrap of the sheets."""
    shells = assembly.shells
    area = np.bincount(shells.part, cell_areas(assembly.points, shells.nodes), len(assembly.parts))
    yield from np.flatnonzero(area > LARGE * area.sum()).tolist()


def candidates(context: SearchContext) -> list[Candidate]:
    """The parts and forms that explain most, each within what would buckle its sheet."""
    built = context.where.groups.structure
    parts = list(_sheets(built.assembly))
    effects, centre = [], []
    for part in parts:
        for tensor, form in zip(tensors(built.assembly, part), FORMS, strict=True):
            bare = prestress(built, part, tensor, form, len(FORMS) * len(parts))
            critical = buckling(*context.stiffened(bare, np.zeros(1)))
            if np.isfinite(critical):
                effects.append(replace(bare, critical=critical))
                centre.append(built.assembly.points.mean(axis=0))
    return best_places(context, effects, np.array(centre), FOLLOWED, -1.0) if effects else []


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A force along, across or all round the first part, 0.3 to 0.7 of buckling, either sign."""
    made, form = article.assembly, int(rng.integers(len(FORMS)))
    N = float(rng.choice([-1, 1]) * rng.uniform(0.3, 0.7)) * critical_force(
        made, 0, tensor := tensors(made, 0)[form]
    )
    truth = {"value": N, "form": FORMS[form], "parameters": {"N": N}}
    return replace(article, assembly=prestressed(made, 0, tensor, N), truth=truth)


def critical_force(assembly: Assembly, part: int, tensor: np.ndarray) -> float:
    """N_cr of a part over the structure's lowest modes [N/m]."""
    built = structure(assembly)
    modes = normal_modes(built.system, min(MODES, len(built.system.dofs)))
    K, lam = unit_stiffness(built, part, tensor), (2 * np.pi * modes.frequency) ** 2
    return buckling(lam, modes.shapes.T @ (K @ modes.shapes))


FAMILY = Family(
    MembranePrestress,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE3", "CELAS2"),
    settled_by="test again at another temperature, or with what clamps the sheet let loose",
    on_sheets=True,
)
