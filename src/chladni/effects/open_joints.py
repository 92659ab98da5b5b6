"""An open joint of a beam: its end turns against the node on a rotational spring.

A spring k [N m/rad] about every axis, in series with the end of an element, leaves of its stiffness
K - Σ_j p_j p_jᵀ / (d_j + k): p_j = K v_j are the forces of its end turned about the principal axes
v_j of its rotational stiffness, and d_j their stiffnesses (static condensation; Monforton and Wu
1963, J. Struct. Div. ASCE 89, 13-31). A crack at a weld, a loose screw or a slit tube act so.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem import beam
from ..geometry.beam_lines import lines, member_beams
from ..geometry.facets import unit
from ..geometry.sampling import nearest_points
from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, RigidBody, appended, picked
from ..model.properties import BeamSection, Isotropic
from .attachments import strength
from .effect import Effect, MatrixTerm, Traits, Within
from .effect_context import EffectContext
from .estimate import in_mm
from .family import Article, Family
from .search_context import Candidate, SearchContext, best_places

FIRM = 30.0  # ln of a spring over its median that is as good as rigid
FOLLOWED = 2  # ends that are fitted
STRAIGHT = 0.85  # cosine from which two beams run on: their node is no joint
MOST = 60  # ends that are tried


@dataclass(frozen=True, eq=False)
class OpenJoint(Effect):
    """K - Σ_j A_j d_j / (d_j + k), A_j = p_j p_jᵀ / d_j, x = ln of k over its median."""

    name = "open-joint"
    claim = "a beam is joined to its node by a hinge with a spring"
    traits = Traits(elastic=True)

    beam: int = field(kw_only=True)  # id of the element
    end: int = field(kw_only=True)  # 0 or 1
    loads: sp.csr_array = field(kw_only=True)  # p_j over the dofs of the structure (j, n)
    stiff: np.ndarray = field(kw_only=True)  # d_j (j,) [N m/rad]
    operators: tuple[sp.csr_array, ...] = field(kw_only=True)  # A_j (n, n)
    within: tuple[Within, ...] = field(kw_only=True)  # of each

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """-d/(d + k) A about each principal axis."""
        k = self.parameters[0].value(x[0])
        every = zip(self.operators, self.stiff.tolist(), self.within, strict=True)
        return tuple(
            MatrixTerm("K", A, -d / (d + k), np.array([d * k / (d + k) ** 2]), within=within)
            for A, d, within in every
        )

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """p_j: loads of the end turned against its node."""
        return self.loads

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Join the beam by a GRID of its own, an RBE2 of translations and CELAS2 of rotations."""
        return hinged(assembly, self.beam, self.end, self.parameters[0].value(x[0]))


def hinged(assembly: Assembly, id: int, end: int, k: float) -> Assembly:
    """The assembly with an end of a beam on a spring k [N m/rad] about every axis of its node."""
    (at,) = np.flatnonzero(assembly.beams.ids == id)
    node = int(assembly.beams.nodes[at, end])
    made, (own,) = with_points(assembly, assembly.points[[node]])
    if made.axes is not None:
        made = replace(made, axes=np.concatenate([made.axes[:-1], made.axes[[node]]]))
    gone = picked(made.beams, np.delete(np.arange(len(made.beams)), at))
    same = picked(made.beams, np.array([at]))
    nodes = same.nodes.copy()
    nodes[0, end] = own
    again = {name: value for name, value in vars(same).items() if name not in ("ids", "nodes")}
    beams = appended(gone, ids=np.array([next_id(made)]), nodes=nodes, **again)
    made = replace(made, beams=beams)
    body = RigidBody(next_id(made), node, (int(own),), ((1, 2, 3),))
    made = replace(made, rigid=(*made.rigid, body))
    turns = np.column_stack([np.arange(4, 7)] * 2)
    springs = appended(
        made.springs, ids=next_id(made) + np.arange(3), nodes=np.tile([node, int(own)], (3, 1)),
        component=turns, value=np.full(3, k),
    )  # fmt: skip
    return replace(made, springs=springs)


def ends_at_joints(assembly: Assembly) -> Iterator[tuple[int, int, float]]:
    """Row of a beam, its end at a joint, and the length [m] of its line, for every member.

    At a joint beams of different directions meet.
    """
    members = member_beams(assembly)
    nodes, X = assembly.beams.nodes[members], assembly.points
    along = np.diff(X[nodes], axis=1)[:, 0]
    length, direction = np.linalg.norm(along, axis=1), unit(along)
    line = lines(X, nodes)
    whole = np.bincount(line, length)
    for k, pair in enumerate(nodes):
        for end, node in enumerate(pair.tolist()):
            others = np.flatnonzero((nodes == node).any(axis=1))
            if (np.abs(direction[others] @ direction[k]) < STRAIGHT).any():
                yield int(members[k]), end, float(whole[line[k]])


def _bending(assembly: Assembly, row: int) -> float:
    """The larger E I [N m²] of a beam."""
    section = assembly.parts[int(assembly.beams.part[row])].section
    assert isinstance(section, BeamSection)
    assert isinstance(section.material, Isotropic)
    return float(section.material.E * max(section.I1, section.I2))


def effects(where: EffectContext) -> list[OpenJoint]:
    """A hinge at every end of a member at a joint."""
    groups = where.groups
    built = groups.structure
    assembly, members = built.assembly, member_beams(built.assembly)
    ends = list(ends_at_joints(assembly))
    ends = ends[:: -(-len(ends) // MOST) or 1]
    return [
        e for row, end, length in ends
        if (e := _effect(where, row, end, length, len(ends), members)) is not None
    ]  # fmt: skip


def _effect(
    where: EffectContext, row: int, end: int, length: float, tried: int, members: np.ndarray
) -> OpenJoint | None:
    built = where.groups.structure
    assembly = built.assembly
    alone = replace(assembly, beams=picked(assembly.beams, np.array([row])))
    (nodes,), (K,), _ = beam.stiffness_and_mass(alone)
    turns = K[:, 6 * end + 3 : 6 * end + 6]
    d, v = np.linalg.eigh(turns[6 * end + 3 : 6 * end + 6])
    some = d > 1e-9 * max(float(d[-1]), 1e-300)
    EI = _bending(assembly, row)
    if not some.any() or not EI > 0:
        return None
    d, p = d[some], turns @ v[:, some]
    T = built.T[(6 * nodes[:, None] + np.arange(6)).ravel()]
    loads = sp.csr_array(sp.csr_array(p.T) @ T)
    id, node = int(assembly.beams.ids[row]), int(nodes[end])
    shells = np.array([len(assembly.shells) + int(np.flatnonzero(members == row)[0])])
    within = tuple(
        Within(frozenset([("hinge", 6 * id + 3 * end + j)]), shells=shells) for j in range(len(d))
    )
    every = (sp.csr_array(loads[[j]]) for j in range(len(d)))
    operators = tuple(sp.csr_array(f.T @ f) / dj for f, dj in zip(every, d, strict=True))
    grid, (x, y, z) = int(assembly.ids[node]), assembly.points[node].tolist()
    part = assembly.parts[int(assembly.beams.part[row])].name
    k = strength("k", "N m/rad", 4 * EI / length, 2.0, (-2.0, 0.0, 2.0))
    return OpenJoint(
        (replace(k, nominal=FIRM),),
        f"at grid {grid} ({in_mm((x, y, z))} mm), the end of beam {id} of {part}", (part,),
        grids=(grid,), point=(x, y, z), trials_factor=tried, beam=id, end=end, loads=loads,
        stiff=d, operators=operators, within=within,
    )  # fmt: skip


def candidates(context: SearchContext) -> list[Candidate]:
    """The ends whose hinges explain most."""
    found = effects(context.where)
    return best_places(context, found, FOLLOWED, anywhere=True, extended=True)


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Leave one end of a member 0.1 to 1 times the bending stiffness of the member."""
    made = article.assembly
    ends = list(ends_at_joints(made))
    if not ends:
        raise ModelError("the structure has no beams that meet, so none of them has a joint")
    row, end, length = ends[int(rng.integers(len(ends)))]
    k = 4 * _bending(made, row) / length * float(np.exp(rng.uniform(np.log(0.1), 0.0)))
    node = int(made.beams.nodes[row, end])
    deck = article.deck
    at = nearest_points(deck.points, made.points[[node]])
    loose = hinged(made, int(made.beams.ids[row]), end, k)
    return article.with_hidden(loose, {"k": k}, deck.points[at][0])


FAMILY = Family(
    OpenJoint,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE2", "CELAS2", "CBAR", "CBEAM", "PBAR", "PBEAM", "MAT1"),
    settled_by="look at the joint for a crack or a loose screw, and tap on both sides of it",
    needs="beams that meet",
)
