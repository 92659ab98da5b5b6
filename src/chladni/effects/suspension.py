"""Stiffness of the suspension, such as bungee cords."""

from dataclasses import dataclass

import numpy as np

from .effect_context import EffectContext
from .family import Article, Family
from .points import SpringEffect, strength, with_springs


@dataclass(frozen=True, eq=False)
class Suspension(SpringEffect):
    """Springs to ground at the hangers, one stiffness for all."""

    name = "suspension"
    claim = "the suspension's stiffness is missing from the model"


def suspension(where: EffectContext) -> list[Suspension]:
    """Springs at the hangers, along the surface normal or along every direction.

    A tube has no normal. If a hanger is on a tube, springs in every direction come first, then each
    axis.
    """
    hangers = tuple(where.setup.hangers)
    if not hangers:
        return []
    on_shells = where.grids.line < 0
    known = dict(zip(where.grids.grids[on_shells], where.grids.normal[on_shells], strict=True))
    k = strength("K", "N/m", 0.1 * where.setup.stiffness, 2.0, (-3.0, -1.5, 0.0, 1.5))
    text = f"at hangers {', '.join(map(str, hangers))}"
    up = np.array([0.0, 0.0, 1.0])
    ways = [("", np.array([known.get(g, up) for g in hangers]))]
    if not known.keys() >= set(hangers):
        axes = zip("xyz", np.eye(3), strict=True)
        ways = [(f", along {a}", np.tile(e, (len(hangers), 1))) for a, e in axes]
    everywhere = Suspension(
        (k,), text + ", every direction", grids=tuple(np.repeat(hangers, 3)),
        trials_factor=len(ways) + 1, rows=where.translations(hangers),
        directions=np.tile(np.eye(3), (len(hangers), 1)),
    )  # fmt: skip
    one_way = [
        Suspension(
            (k,), text + how, grids=hangers, trials_factor=len(ways) + 1 if how else 1,
            rows=where.groups.structure.along(np.array(hangers), n), directions=n,
        )
        for how, n in ways
    ]  # fmt: skip
    return [*one_way, everywhere] if known.keys() >= set(hangers) else [everywhere, *one_way]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Add cords of 0.8 to 6 kN/m along z at the hangers."""
    K = float(np.exp(rng.uniform(np.log(800), np.log(6000))))
    at = article.grids_at(article.hangers)
    up = np.tile([0.0, 0.0, 1.0], (len(at), 1))
    return article.with_hidden(with_springs(article.assembly, at, up, K), {"K": K})


FAMILY = Family(
    Suspension,
    conceal,
    placed=suspension,
    cards=("CELAS2", "CBUSH", "PBUSH", "CORD2R"),
    settled_by="measure again on softer cords",
)
