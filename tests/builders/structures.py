"""Structures made of others: held, joined, of other stiffness."""

from dataclasses import replace

import numpy as np

from chladni.model.assembly import Assembly


def held_along_x0(free: Assembly, components: tuple[int, ...] = (1, 2, 3, 4, 5, 6)) -> Assembly:
    """The structure with components held at its points of x = 0."""
    edge = np.flatnonzero(free.points[:, 0] == 0)
    return replace(free, supports=np.array([(k, c) for k in edge for c in components]))


def joined(one: Assembly, other: Assembly) -> Assembly:
    """One structure of two of shells that share nothing; parts of the second come after."""
    s, t = one.shells, other.shells
    n, m = len(one.points), len(one.parts)
    shells = replace(
        s,
        ids=np.r_[s.ids, t.ids + s.ids.max()],
        nodes=np.r_[s.nodes, t.nodes + n],
        part=np.r_[s.part, t.part + m],
        **{k: np.r_[getattr(s, k), getattr(t, k)] for k in ("thickness", "axis", "offset")},
    )
    parts = tuple(replace(p, id=m + k, name=f"{p.name} {m + k}")
                  for k, p in enumerate(other.parts, start=1))  # fmt: skip
    return replace(
        one, ids=np.r_[one.ids, other.ids + one.ids.max()],
        points=np.r_[one.points, other.points], parts=(*one.parts, *parts), shells=shells,
    )  # fmt: skip


def stiffer(assembly: Assembly, factor: float) -> Assembly:
    """The structure with E of all its shells times a factor."""
    parts = tuple(
        p.with_section(**{
            side: replace(m, E=m.E * factor)
            for side in ("membrane", "bending", "shear")
            if (m := getattr(p.section, side)) is not None
        })
        for p in assembly.parts
    )  # fmt: skip
    return assembly.with_parts(parts)
