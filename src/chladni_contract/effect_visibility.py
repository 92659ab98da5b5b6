"""How far a concealed effect moves the responses of an article, against the scatter of articles."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from chladni.dynamics.coupled import coupled_receptance
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.residual import with_residual_vectors
from chladni.effects.family import Article, Family
from chladni.fem.assemble import structure
from chladni_bench import decades_apart, dissipated, fitted, recognisable, scattered_parts

from .effect_ground import EffectGround

DRAWS = 3  # of the effect
LOWEST = 0.1  # of the highest frequency of interest: lowest line
LINES = 250
ABOVE = 1.6  # modes reach up to this many times the highest line


@dataclass(frozen=True)
class Visibility:
    """Change of the responses by draws of a concealed effect and by the scatter of E and t."""

    moved: tuple[float, ...]  # by each draw [rms decades]
    scatter: float  # by another article of the same drawing [rms decades]
    due: float  # change from which the effect can be recognised

    @property
    def seen(self) -> int:
        """Number of draws that a diagnosis could see."""
        return sum(moved >= self.due for moved in self.moved)


def visibility(family: Family, ground: EffectGround) -> Visibility:
    """Compare articles with the effect, as ``conceal`` draws it, with one without.

    The change is the root mean square of |Δ log10 H| over lines and sensors, at the damping of an
    article. The scatter is that of E and t by 1 % in every part. A change is seen where it is
    :func:`chladni_bench.recognisable`.
    """
    plain = ground.article
    base = _responses(ground, plain)
    other, _ = scattered_parts(plain.assembly, np.random.default_rng(1))
    scatter = decades_apart(_responses(ground, replace(plain, assembly=other)), base)
    concealed = [family.conceal(plain, np.random.default_rng(seed)) for seed in range(DRAWS)]
    moved = [decades_apart(_responses(ground, article), base) for article in concealed]
    return Visibility(tuple(moved), scatter, recognisable(scatter))


def _responses(ground: EffectGround, article: Article) -> np.ndarray:
    """Accelerance of an article at the sensors, with its gains (n_f, n_out, 1)."""
    plain, known, built = ground.article, ground.reduced.grids, structure(article.assembly)
    assert plain.drive is not None
    grid, direction = plain.drive
    at = [known.position(int(g)) for g in plain.outputs]
    felt = built.along(np.array(plain.grids_at(plain.outputs)), known.normal[at])
    driven = built.along(np.array(plain.grids_at(np.array([grid]))), np.array([direction]))
    top = ground.reduced.f_max
    modes = normal_modes(built.system, band=ABOVE * top)
    modes = with_residual_vectors(built.system, modes, driven.T.toarray())
    lost = dissipated(built, modes.shapes, modes.frequency)
    modes = replace(modes, damping=fitted().damping + lost)
    f, V = np.linspace(LOWEST * top, top, LINES), built.system.V
    spun = sp.csr_array((V - V.T) / 2)  # of spinning parts; dashpots are in the damping of modes
    H = coupled_receptance(modes, felt @ modes.shapes, driven @ modes.shapes, f, V=spun)
    return np.asarray(H * (2j * np.pi * f[:, None, None]) ** 2 * article.gains[:, None])
