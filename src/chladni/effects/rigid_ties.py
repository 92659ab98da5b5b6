"""The rigid ties of a structure, and the structure with some of them released.

A tie is the set of dependent points of one rigid element on one sheet. After release a new point
leads them, at the place of the element's independent point. It moves by δ (6,), three translations
and three rotations, relative to that point.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..geometry.beam_lines import fastener_bars
from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, RigidBody, appended
from ..model.properties import ShellSection

FIRM = 100.0  # times E t: stiffer than any sheet, but its modes do not mask all others
LEAST_REACH = 0.005  # [m] lever arm of rotations where a tie holds one grid only


@dataclass(frozen=True, eq=False)
class RigidTie:
    """Some dependent points of a rigid element."""

    rows: tuple[int, ...]  # rows of their points
    lead: int  # row of the element's independent point
    reach: float  # root mean square distance of the followers from their middle [m]

    def within(self, assembly: Assembly) -> tuple[int, RigidBody]:
        """Position of the rigid element that contains the tie, and the element."""
        return next(
            (k, body)
            for k, body in enumerate(assembly.rigid)
            if isinstance(body, RigidBody)
            and body.independent == self.lead
            and set(self.rows) <= set(body.dependent)
        )


def rigid_ties(assembly: Assembly) -> list[RigidTie]:
    """Every tie between two components.

    Ties between a fastener or a bush and its sheet are left out, because the compliance of the
    fastener is in series. If two sheets follow a point with no other attachment, one tie is enough.
    """
    sheet, used = np.full(len(assembly.points), -1), _used(assembly)
    groups: tuple[Any, ...] = (*assembly.solids, assembly.beams, assembly.shells)
    for group in groups:  # part of the elements at each point, that of shells before others
        sheet[group.nodes.ravel()] = np.repeat(group.part, group.nodes.shape[1])
    bars = [assembly.beams.nodes[piece].ravel() for piece in fastener_bars(assembly)]
    bushes = assembly.bushes.nodes[(assembly.bushes.nodes >= 0).all(axis=1)].ravel()
    led = set(np.concatenate([bushes, *bars]).astype(int).tolist())  # ends of fasteners
    out: list[RigidTie] = []
    for body in assembly.rigid:
        if not isinstance(body, RigidBody) or body.independent in led:
            continue
        on = sheet[list(body.dependent)]
        legs = [np.flatnonzero(on == s).tolist() for s in np.unique(on)]
        if body.independent not in used:
            legs = sorted(legs, key=len)[: len(legs) if len(legs) > 2 else len(legs) - 1]
        out += [_tie(assembly, body, some) for some in legs]
    return out


def _tie(assembly: Assembly, body: RigidBody, legs: list[int]) -> RigidTie:
    rows = tuple(body.dependent[k] for k in legs)
    X = assembly.points[list(rows)]
    reach = float(np.sqrt(((X - X.mean(axis=0)) ** 2).sum(axis=1).mean()))
    return RigidTie(rows, body.independent, max(reach, LEAST_REACH))


def _used(assembly: Assembly) -> set[int]:
    """Rows of points with an attachment other than one rigid element that they lead."""
    a = assembly
    nodes = [a.shells.nodes, a.beams.nodes, *(s.nodes for s in a.solids), a.springs.nodes,
             a.bushes.nodes, a.scalar_masses.nodes, a.masses.node, a.supports[:, 0]]  # fmt: skip
    lead = [b.independent for b in a.rigid if isinstance(b, RigidBody)]
    follow = [r for b in a.rigid for r in _others(b)]
    twice = [r for r in set(lead) if lead.count(r) > 1]
    return {int(r) for rows in nodes for r in rows.ravel()} | set(follow) | set(twice)


def _others(body: object) -> Iterator[int]:
    """Points of a rigid element other than its independent point."""
    if isinstance(body, RigidBody):
        yield from body.dependent
    else:
        yield from (int(r) for r in getattr(body, "nodes", ()))
        yield from (int(t[0]) for t in getattr(body, "terms", ()))
        yield from [int(body.reference)] if hasattr(body, "reference") else []


def loosened(assembly: Assembly, tie: RigidTie) -> tuple[Assembly, int]:
    """Release a tie: its followers are led by a new point; return the assembly and its row."""
    grown, at = with_points(assembly, assembly.points[[tie.lead]])
    (position, body), lead = tie.within(assembly), int(at[0])
    legs, bodies = np.isin(body.dependent, tie.rows), list(assembly.rigid)
    if legs.all():
        bodies[position] = replace(body, independent=lead)
        return replace(grown, rigid=tuple(bodies)), lead
    bodies[position] = _with_legs(body, ~legs)
    new = replace(_with_legs(body, legs), id=next_id(assembly), independent=lead)
    return replace(grown, rigid=(*bodies, new)), lead


def _with_legs(body: RigidBody, legs: np.ndarray) -> RigidBody:
    at = np.flatnonzero(legs)
    rows, motions = tuple(body.dependent[k] for k in at), tuple(body.components[k] for k in at)
    return replace(body, dependent=rows, components=motions)


def sprung(assembly: Assembly, tie: RigidTie, k: float, id: int | None = None) -> Assembly:
    """Replace the tie by springs: k [N/m] in translation and k reach² in rotation."""
    made, lead = loosened(assembly, tie)
    new = appended(
        made.bushes, ids=[next_id(made) if id is None else id], nodes=[[tie.lead, lead]],
        frame=[np.eye(3)], place=made.points[[lead]],
        stiffness=[k * np.r_[1, 1, 1, [tie.reach**2] * 3]],
    )  # fmt: skip
    return replace(made, bushes=new)


def on_firm_springs(assembly: Assembly) -> Assembly:
    """Put a spring into every tie, so stiff that it is practically rigid.

    A rigid constraint cannot be softened, a spring can. Therefore the search uses this model. The
    new elements have negative ids, which no deck has.
    """
    ties, firm = rigid_ties(assembly), _firm(assembly)
    for k, tie in enumerate(ties):
        assembly = sprung(assembly, tie, firm, -1 - k)
    return assembly


def firmly_held(assembly: Assembly, row: int) -> tuple[RigidTie, float]:
    """The tie of a spring from :func:`on_firm_springs`, and the stiffness [N/m] of that spring."""
    b = assembly.bushes
    lead, own = b.nodes[row].tolist()
    body = next(x for x in assembly.rigid if isinstance(x, RigidBody) and x.independent == own)
    k, turns = b.stiffness[row, [0, 3]].tolist()
    return RigidTie(body.dependent, lead, float(np.sqrt(turns / k))), k


def _firm(assembly: Assembly) -> float:
    """FIRM times the largest plane stiffness E t [N/m] of any sheet."""
    t = [
        (p.section.membrane or p.section.bending, p.section.thickness)
        for p in assembly.parts
        if isinstance(p.section, ShellSection)
    ]
    return FIRM * max([m.plane_stress()[0, 0] * h for m, h in t if m is not None], default=2e8)
