"""The joints of a structure: welds and fasteners one by one, beads of adhesive.

A joint is what a deck has beside its sheets and beams to hold them together: a solid of a metal or
a short bar or a bush is a weld or a fastener, solids softer than ``SOFT`` that hang together are a
bead. What a joint has in K is kept as rows b with K_j = bᵀ b, so that its loss is a change of low
rank.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure, over_all_motions
from ..fem.energy import bare
from ..fem.sparse_assembly import congruence
from ..geometry.beam_lines import connected_rows, fastener_bars, member_beams
from ..model.assembly import Assembly, picked
from ..model.properties import BeamSection, Isotropic, Part, SolidSection
from .estimate import in_mm

SOFT = 20e9  # [Pa] below it a solid between sheets is adhesive, above it a weld
MOST_SOLIDS = 27  # of a weld: more of them in one piece are a casting
NEXT = 2.0  # median distances to the nearest: fasteners farther apart are not in one line
MOST_RUN = 8  # fasteners in a run that is tried as one
BUSHES = ("PBUSH", "CBUSH", "PWELD", "CWELD", "PFAST", "CFAST")  # cards read as bushes
FLAT = 1e-9  # of the stiffest direction of a joint: softer ones are rounding


@dataclass(frozen=True, eq=False)
class Connection:
    """Elements that hold sheets together in one place."""

    kind: str  # "solids", "beams" or "bushes" of the assembly
    group: int  # position among ``Assembly.solids``, 0 of others
    elements: np.ndarray  # (k,) int rows of that group
    ids: tuple[int, ...]  # ids of these elements
    point: np.ndarray  # (3,) [m] its middle
    parts: tuple[str, ...] = ()  # names of the sheets and beams it holds, largest first
    grids: tuple[int, ...] = ()  # ids of the grids of these it hangs on
    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    @property
    def rigid(self) -> bool:
        """True for a firm spring in a rigid tie (:mod:`.rigid_ties`), which no deck contains."""
        return self.ids[0] < 0

    @property
    def where(self) -> str:
        """Its parts and its place, in words."""
        return f"between {' and '.join(self.parts[:2])} at ({in_mm(self.point)} mm)"


def members(assembly: Assembly, kind: str, group: int) -> Any:
    """The group of elements a joint is of."""
    return assembly.solids[group] if kind == "solids" else getattr(assembly, kind)


def alone(assembly: Assembly, joint: Connection) -> Assembly:
    """The points with the elements of a joint and nothing else that is stiff or heavy."""
    some = picked(members(assembly, joint.kind, joint.group), joint.elements)
    return _with(bare(assembly), joint.kind, (some,) if joint.kind == "solids" else some)


def stiffness(built: Structure, joint: Connection) -> sp.csr_array:
    """What a joint has in K (n_free, n_free)."""
    return congruence(built.T, over_all_motions(alone(built.assembly, joint))[2])


def _with(assembly: Assembly, kind: str, new: Any) -> Assembly:
    changed: dict[str, Any] = {kind: new}
    return replace(assembly, **changed)


def stiffness_rows(built: Structure, joint: Connection) -> sp.csr_array:
    """Rows b (r, n) over the free dofs with bᵀ b what the joint has in K.

    Motions of the joint that cost nothing, and those of the elements alone that no sheet follows,
    have no row.
    """
    K = over_all_motions(alone(built.assembly, joint))[2]
    at = np.unique(K.indices)
    w, V = np.linalg.eigh(K[at][:, at].toarray())
    kept = w > FLAT * w[-1]
    B = sp.csr_array((V[:, kept] * np.sqrt(w[kept])).T @ built.T[at])
    B.eliminate_zeros()
    on = np.unique(B.indices)
    _, s, Vt = np.linalg.svd(B[:, on].toarray(), full_matrices=False)
    kept = s > np.sqrt(FLAT) * s[0] if len(s) else s > 0
    where = (np.repeat(np.arange(kept.sum()), len(on)), np.tile(on, kept.sum()))
    return sp.csr_array(((s[kept, None] * Vt[kept]).ravel(), where), shape=(kept.sum(), B.shape[1]))


def fasteners(built: Structure) -> list[Connection]:
    """Every weld, screw and bush between sheets or beams, with its rows."""
    a, columns = built.assembly, sp.csc_array(built.T)
    members = member_beams(a)
    if not len(a.shells) + len(members):
        return []
    found = [
        replace(joint, rows=stiffness_rows(built, joint))
        for joint in (*_weld_solids(a), *_bars(a), *_bushes(a))
    ]
    held = [_held(a, members, joint, _moved(columns, joint)) for joint in found]
    return [j for j in held if j.parts]


def beads(built: Structure) -> list[Connection]:
    """Solids of adhesive that hang together, and all of a part where these are several.

    Those of a part come before what they consist of. They have no rows: they are many elements.
    """
    assembly, none = built.assembly, np.zeros(0, int)
    out: list[Connection] = []
    for group, rows in solid_parts(assembly, soft=True):
        pieces = list(connected_rows(assembly.solids[group].nodes[rows]))
        whole = [rows] if len(pieces) > 1 else []
        for chosen in (*whole, *(rows[piece] for piece in pieces)):
            joint = _of_solids(assembly, group, chosen)
            out.append(_held(assembly, none, joint, _touched(built, joint)))
    return [j for j in out if j.parts]


def neighbours(joints: Sequence[Connection]) -> tuple[tuple[int, ...], ...]:
    """Positions of the fasteners next to each along its line, two at most.

    Fasteners of one kind between the same parts are linked, the nearest first. A line longer than
    ``MOST_RUN`` may close.
    """
    out: list[list[int]] = [[] for _ in joints]
    line = np.arange(len(joints))
    alike: dict[tuple[object, ...], list[int]] = {}
    for k, j in enumerate(joints):
        alike.setdefault((j.kind, j.group, j.rigid, frozenset(j.parts)), []).append(k)
    for at in (np.array(some) for some in alike.values() if len(some) > 1):
        points = np.array([joints[k].point for k in at])
        apart = np.linalg.norm(points[:, None] - points, axis=2)
        np.fill_diagonal(apart, np.inf)
        reach = NEXT * np.median(apart.min(axis=1))
        first, second = np.nonzero(np.triu(apart <= reach))
        for n in np.argsort(apart[first, second], kind="stable"):
            a, b = int(at[first[n]]), int(at[second[n]])
            closes = line[a] == line[b] and (line == line[a]).sum() <= MOST_RUN
            if closes or max(len(out[a]), len(out[b])) > 1:
                continue
            out[a].append(b)
            out[b].append(a)
            line[line == line[b]] = line[a]
    return tuple(map(tuple, out))


def lines(joints: Sequence[Connection]) -> list[tuple[int, ...]]:
    """Positions of all fasteners by the lines they stand in, each in its order.

    A line that closes is cut, and begun once more, so that every run of it is there.
    """
    next_to, seen, out = neighbours(joints), set[int](), list[tuple[int, ...]]()
    for k in sorted(range(len(joints)), key=lambda k: len(next_to[k])):  # the ends first
        at: int | None = k if k not in seen else None
        row: list[int] = []
        while at is not None:
            seen.add(at)
            row.append(at)
            at = next((n for n in next_to[at] if n not in seen), None)
        if len(row) > 2 and row[0] in next_to[row[-1]]:
            row += row[: MOST_RUN - 1]
        if row:
            out.append(tuple(row))
    return out


def joined(joints: Sequence[Connection]) -> Connection:
    """Several fasteners of one kind as one."""
    return replace(
        joints[0],
        elements=np.concatenate([j.elements for j in joints]),
        ids=tuple(i for j in joints for i in j.ids),
        point=np.mean([j.point for j in joints], axis=0),
        parts=tuple(dict.fromkeys(p for j in joints for p in j.parts)),
        grids=tuple(dict.fromkeys(g for j in joints for g in j.grids)),
        rows=sp.csr_array(sp.vstack([j.rows for j in joints])),
    )


def _moved(columns: sp.csc_array, joint: Connection) -> np.ndarray:
    """Rows of the points that move with the free dofs a joint couples; ``columns`` are those of T.

    Of a mean these are the grids it is taken over, of a rigid spider those that follow it.
    """
    return np.unique(columns[:, np.unique(joint.rows.indices)].indices // 6)


def _held(
    assembly: Assembly, members: np.ndarray, joint: Connection, points: np.ndarray
) -> Connection:
    """The joint with the sheets, and the beams among ``members``, that have some of these points.

    Parameters
    ----------
    members : (m,)   rows of beams
    points : (k,)    rows of points
    """
    shells, beams = assembly.shells, picked(assembly.beams, members)
    touching = [np.isin(group.nodes, points).any(axis=1) for group in (shells, beams)]
    part = np.concatenate([g.part[at] for g, at in zip((shells, beams), touching, strict=True)])
    nodes = [g.nodes[at].ravel() for g, at in zip((shells, beams), touching, strict=True)]
    parts, count = np.unique(part, return_counts=True)
    names = tuple(assembly.parts[int(p)].name for p in parts[np.argsort(-count, kind="stable")])
    on = np.intersect1d(points, np.concatenate(nodes))
    return replace(joint, parts=names, grids=tuple(assembly.ids[on].tolist()))


def _touched(built: Structure, joint: Connection) -> np.ndarray:
    """Rows of the points on which the nodes of a joint depend."""
    nodes = np.unique(members(built.assembly, joint.kind, joint.group).nodes[joint.elements])
    dofs = (6 * nodes[:, None] + np.arange(3)).ravel()
    return built.assembly.rows(built.system.dofs[np.unique(built.T[dofs].indices), 0])


def solid_parts(assembly: Assembly, soft: bool) -> Iterator[tuple[int, np.ndarray]]:
    """(group, rows) of every part of adhesive, or of metal."""
    for group, solids in enumerate(assembly.solids):
        for part in np.unique(solids.part):
            section = assembly.parts[int(part)].section
            if not isinstance(section, SolidSection):
                continue
            material = section.material
            if isinstance(material, Isotropic) and (material.E < SOFT) == soft:
                yield group, np.flatnonzero(solids.part == part)


def _of_solids(assembly: Assembly, group: int, rows: np.ndarray) -> Connection:
    solids = assembly.solids[group]
    middle = assembly.points[solids.nodes[rows]].mean(axis=(0, 1))
    return Connection("solids", group, rows, tuple(solids.ids[rows].tolist()), middle)


def _weld_solids(assembly: Assembly) -> Iterator[Connection]:
    for group, rows in solid_parts(assembly, soft=False):
        for piece in connected_rows(assembly.solids[group].nodes[rows]):
            if len(piece) <= MOST_SOLIDS:
                yield _of_solids(assembly, group, rows[piece])


def _bars(assembly: Assembly) -> Iterator[Connection]:
    """Bars by themselves whose ends are those of rigid spiders or means."""
    beams = assembly.beams
    for piece in fastener_bars(assembly):
        middle = assembly.points[np.unique(beams.nodes[piece])].mean(axis=0)
        yield Connection("beams", 0, piece, tuple(beams.ids[piece].tolist()), middle)


def _bushes(assembly: Assembly) -> Iterator[Connection]:
    for row in np.flatnonzero((assembly.bushes.nodes >= 0).all(axis=1)):
        ids = (int(assembly.bushes.ids[row]),)
        yield Connection("bushes", 0, np.array([row]), ids, assembly.bushes.place[row])


def with_factor_on(
    assembly: Assembly, joint: Connection, factor: float, loss: float | None = None
) -> Assembly:
    """The assembly with the stiffness of a joint times a factor; its mass stays.

    Solids and bars get a part of their own, unless all of their part is in the joint.

    Parameters
    ----------
    loss : loss factor it has as well; None: that of the deck
    """
    old = members(assembly, joint.kind, joint.group)
    if joint.kind == "bushes":
        stiffness, lost = old.stiffness.copy(), old.loss.copy()
        stiffness[joint.elements] *= factor
        if loss is not None:
            lost[joint.elements] = loss
        return replace(assembly, bushes=replace(old, stiffness=stiffness, loss=lost))
    parts, part = list(assembly.parts), old.part.copy()
    for p in np.unique(part[joint.elements]):
        mine = joint.elements[part[joint.elements] == p]
        new = _stiffer(parts[int(p)], factor, loss)
        if _only_here(assembly, int(p), len(mine)):
            parts[int(p)] = new
            continue
        name = f"{joint.ids[0]} of {new.name}"
        part[mine] = len(parts)
        parts.append(replace(new, id=1 + max(x.id for x in parts), name=name))
    changed = replace(old, part=part)
    return _with_members(replace(assembly, parts=tuple(parts)), joint, changed)


def with_family(assembly: Assembly, name: str, factor: float) -> Assembly:
    """Multiply the stiffness of all joints of a family: "adhesive", "welds" or "bushes".

    Firm springs in rigid ties (:mod:`.rigid_ties`) are not bushes of the deck and stay.
    """
    if factor == 1:
        return assembly
    if name == "bushes":
        old = assembly.bushes
        own = np.where(old.ids > 0, factor, 1.0)
        return replace(assembly, bushes=replace(old, stiffness=own[:, None] * old.stiffness))
    parts, soft = [], name == "adhesive"
    for part in assembly.parts:
        m = getattr(part.section, "material", None)
        if isinstance(part.section, SolidSection) and isinstance(m, Isotropic):
            part = _stiffer(part, factor) if (m.E < SOFT) == soft else part
        parts.append(part)
    return assembly.with_parts(tuple(parts))


def without_joint(assembly: Assembly, joint: Connection) -> Assembly:
    """The assembly with the elements of a joint taken out, and the mass of a CFAST with it."""
    old = members(assembly, joint.kind, joint.group)
    kept = np.setdiff1d(np.arange(len(old.ids)), joint.elements)
    assembly = _with_members(assembly, joint, picked(old, kept))
    if joint.kind != "bushes":
        return assembly
    m = assembly.masses
    own = [np.isin(m.ids, joint.ids), np.isin(m.node, old.nodes[joint.elements])]
    return replace(assembly, masses=picked(m, ~np.all(own, axis=0)))


def _with_members(assembly: Assembly, joint: Connection, new: Any) -> Assembly:
    if joint.kind != "solids":
        return _with(assembly, joint.kind, new)
    solids = list(assembly.solids)
    solids[joint.group] = new
    return replace(assembly, solids=tuple(solids))


def _only_here(assembly: Assembly, part: int, count: int) -> bool:
    groups: tuple[Any, ...] = (*assembly.solids, assembly.beams, assembly.shells)
    return sum(int((g.part == part).sum()) for g in groups) == count


def _stiffer(part: Part, factor: float, loss: float | None = None) -> Part:
    """The part with E (and G) times a factor, and a loss factor where one is given."""
    assert isinstance(part.section, SolidSection | BeamSection)
    m = part.section.material
    assert isinstance(m, Isotropic)
    G = None if m.G is None else m.G * factor
    damping = m.damping if loss is None else loss
    return part.with_section(material=replace(m, E=m.E * factor, G=G, damping=damping))
