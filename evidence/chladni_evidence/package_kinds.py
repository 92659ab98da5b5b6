"""Hidden effects of installed packages, made by the ``conceal`` of their family."""

from functools import partial

import numpy as np

from chladni.effects import registry
from chladni.effects.family import Article, Family

from .hidden import Hidden, Site, near_outputs
from .hidden_kinds import Kind


def package_kinds(anywhere: bool = False) -> dict[str, Kind]:
    """Kinds by name, or those that act on any structure; our own effects have other code."""
    own = {family.name for family in registry.BUILT_IN}
    others = [f for f in registry.families() if f.name not in own and not (anywhere and f.needs)]
    return {family.name: partial(_concealed, family) for family in others}


def _concealed(family: Family, site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """The effect as the family draws it, regardless of ``size``."""
    a, outputs = site.article, near_outputs(site)
    distance = np.linalg.norm(a.points[:, None] - site.hangers, axis=2)
    hangers = a.ids[distance.argmin(axis=0)]
    made = family.conceal(Article(a, a, a.ids[outputs], hangers, np.ones(len(outputs))), rng)

    def spoil(values: np.ndarray) -> np.ndarray:
        return values * made.gains[:, None]

    return Hidden(made.assembly, made.truth, spoil=spoil, unweighed=made.off_scale)
