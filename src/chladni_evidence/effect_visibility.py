"""How far a concealed effect moves the responses of an article, against the scatter of articles."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.effects.family import Article, Family

from .article_modes import article_modes
from .bench_of_structure import ZETA
from .effect_ground import EffectGround
from .made_case import COARSE, FULL, TWICE
from .part_scatter import scattered
from .response_of_article import accelerance, decades_apart

DRAWS = 3  # of the effect
LOWEST = 0.1  # of the highest frequency of interest: lowest line


@dataclass(frozen=True)
class Visibility:
    """Change of the responses by draws of a concealed effect and by the scatter of E and t.

    Attributes
    ----------
    moved : by each draw [rms decades]
    scatter : by another article of the same drawing [rms decades]
    due : change from which a case of the blind evidence counts the effect as recognisable
    """

    moved: tuple[float, ...]
    scatter: float
    due: float

    @property
    def seen(self) -> int:
        """Number of draws that a diagnosis could see."""
        return sum(moved >= self.due for moved in self.moved)


def visibility(family: Family, ground: EffectGround) -> Visibility:
    """Compare articles with the effect, as ``conceal`` draws it, with one without.

    The change is the root mean square of |Δ log10 H| over lines and sensors, at the damping of an
    article. The scatter is that of E and t by 1 % in every part. A change is seen from twice the
    scatter on, or from twice ``FULL`` where that is less (:func:`chladni_evidence.made_case`).
    """
    plain = ground.article
    base = _responses(ground, plain)
    other, _ = scattered(plain.assembly, np.random.default_rng(1))
    scatter = decades_apart(_responses(ground, replace(plain, assembly=other)), base)
    concealed = [family.conceal(plain, np.random.default_rng(seed)) for seed in range(DRAWS)]
    moved = [decades_apart(_responses(ground, article), base) for article in concealed]
    return Visibility(tuple(moved), scatter, TWICE * min(scatter, FULL))


def _responses(ground: EffectGround, article: Article) -> np.ndarray:
    """Accelerance of an article at the sensors, with its gains (n_f, n_out, 1)."""
    plain, made, known = ground.article, article.assembly, ground.reduced.grids
    assert plain.drive is not None
    at = [known.position(int(grid)) for grid in plain.outputs]
    out = made.rows(plain.grids_at(plain.outputs))
    drive = made.rows(plain.grids_at(np.array([plain.drive[0]])))
    top = ground.reduced.f_max
    modes = article_modes(made, out, drive, top)
    phi_out = np.einsum("kir,ki->kr", modes.at(out), known.normal[at])
    phi_in = np.einsum("kir,i->kr", modes.at(drive), np.array(plain.drive[1]))
    zeta = np.full(len(modes.frequency), ZETA)
    lines = np.linspace(LOWEST * top, top, COARSE)
    return accelerance(modes, phi_out, phi_in, zeta, lines) * article.gains[:, None]
