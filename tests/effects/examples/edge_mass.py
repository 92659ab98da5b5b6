"""A mass along the edge of a part: a seal, a trim, paint. An effect from outside of chladni.

All of it is in this file: physics, candidates, concealment on the bench, change of the deck. Its
package tells chladni by one entry point, ``edge-mass = "edge_mass:FAMILY"`` in the group
``chladni.effects``.
"""

from dataclasses import dataclass

import numpy as np

from chladni.effects import Article, EffectContext, Family, MassEffect, strength
from chladni.model.assembly import Assembly
from chladni.model.point_masses import with_masses

SHARE = 0.03  # of the structure's mass: prior median


@dataclass(frozen=True, eq=False)
class EdgeMass(MassEffect):
    """M Σ_k s_k b_kᵀ b_k over the grids of the edge, s_k their shares of its length."""

    name = "edge-mass"
    claim = "something heavy runs along an edge that the model does not have"


def edge(assembly: Assembly, part: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the grids on the free edges of a part, and their shares of the edges' length."""
    nodes = assembly.shells.nodes[assembly.shells.part == part]
    sides = np.sort(np.concatenate([nodes[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))]))
    sides, count = np.unique(sides[sides[:, 0] != sides[:, 1]], axis=0, return_counts=True)
    free = sides[count == 1]
    length = np.linalg.norm(np.diff(assembly.points[free], axis=1)[:, 0], axis=1)
    each = np.bincount(free.ravel(), np.repeat(length / 2, 2), len(assembly.points))
    rows = np.flatnonzero(each)
    return rows, each[rows] / each.sum()


def edge_masses(where: EffectContext) -> list[EdgeMass]:
    """One of every part of shells."""
    assembly, out = where.groups.structure.assembly, []
    parts = np.unique(assembly.shells.part)
    m = strength("M", "kg", SHARE * where.setup.weight, 1.2, (-1.5, -0.5, 0.5))
    for part in parts:
        rows, shares = edge(assembly, int(part))
        grids, name = tuple(assembly.ids[rows].tolist()), assembly.parts[part].name
        out.append(
            EdgeMass(
                (m,), f"along the edge of {name}", (name,), grids, trials_factor=len(parts),
                rows=where.translations(grids), shares=shares,
            )
        )  # fmt: skip
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """2 to 8 % of the mass along the edge of the first part."""
    made, m = article.assembly, float(rng.uniform(0.02, 0.08)) * article.weight
    rows, shares = edge(made, 0)
    loaded = with_masses(made, tuple(made.ids[rows].tolist()), m * shares)
    return article.with_hidden(loaded, {"M": m})


FAMILY = Family(
    EdgeMass,
    conceal,
    placed=edge_masses,
    cards=("CONM2",),
    settled_by="take off what runs along the edge, and weigh it",
)
