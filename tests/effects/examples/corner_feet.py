"""Feet at the corners of a structure that the model lacks: it stands on them, softly."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from chladni.effects import Article, EffectContext, Family, SpringEffect, strength
from chladni.model.assembly import Assembly
from chladni.model.ground_springs import with_springs


@dataclass(frozen=True, eq=False)
class CornerFeet(SpringEffect):
    """K Σ b_kᵀ b_k over the grids at the four corners, b the motion across the structure."""

    name = "corner-feet"
    claim = "the structure stands on feet at its corners that the model lacks"


def corners(assembly: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Ids of the grids at the four corners, and the direction across them all (4, 3)."""
    rows = np.unique(assembly.shells.nodes)
    X = assembly.points[rows]
    thin, *wide = np.argsort(np.ptp(X, axis=0))
    ends = product(*((X[:, k].min(), X[:, k].max()) for k in wide))
    nearest = [np.linalg.norm(X[:, wide] - end, axis=1).argmin() for end in ends]
    return assembly.ids[rows[nearest]], np.tile(np.eye(3)[thin], (4, 1))


def feet(where: EffectContext) -> list[CornerFeet]:
    """All four, of one stiffness."""
    built = where.groups.structure
    grids, across = corners(built.assembly)
    K = strength("K", "N/m", 0.1 * where.setup.stiffness, 1.5, (-2.0, 0.0, 2.0))
    rows = built.along(grids, across)
    return [
        CornerFeet(
            (K,), "at the four corners", grids=tuple(grids.tolist()), rows=rows, directions=across
        )
    ]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Feet of 1 to 4 kN/m each."""
    K = float(rng.uniform(1e3, 4e3))
    grids, across = corners(article.assembly)
    made = with_springs(article.assembly, grids.tolist(), across, K)
    return article.with_hidden(made, {"K": K})


FAMILY = Family(
    CornerFeet,
    conceal,
    placed=feet,
    cards=("CELAS2",),
    settled_by="lift the structure off its feet, and measure again",
)
