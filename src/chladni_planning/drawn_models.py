"""Models with drawn thickness, for layouts that must serve articles that differ from the deck.

Every draw is a reduced model.  Its basis holds the deck's own modes far beyond the band and the
modes of a few drawn models solved in full.  Fifty draws cost little more than one.
"""

from dataclasses import dataclass

import numpy as np

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import rigid_modes
from chladni.dynamics.reduction import orthonormal
from chladni.effects.calibration_parameters import PartScale, calibration_parameter, thickness_of
from chladni.effects.element_groups import element_groups
from chladni.errors import ModelError
from chladni.fem.assemble import Structure, structure
from chladni.progress import Progress, silent
from chladni.reduced.reduced_model import Reduced, evaluate, reduce

REACH = 2.0  # the basis holds the deck's modes up to this many times the highest target
CLIP = 2.0  # standard deviations beyond which nothing is drawn
FULL = 2  # drawn models solved in full for the basis


@dataclass(frozen=True, eq=False)
class Ensemble:
    """A model whose parts' thickness may be drawn."""

    model: Reduced
    effects: tuple[PartScale, ...]  # thickness of each part
    rigid: int  # number of rigid modes, equal for every draw

    @property
    def basis(self) -> np.ndarray:
        """Vectors (n_free, k) in which :func:`drawn` gives shapes."""
        return self.model.basis


def ensemble(
    built: Structure, f_max: float, spread: float, progress: Progress = silent
) -> Ensemble:
    """Prepare a structure for draws of thickness.

    Parameters
    ----------
    f_max : highest target frequency [Hz]
    spread : standard deviation of the logarithm of each part's thickness
    """
    progress("models with random thickness", 0.0)
    modal = normal_modes(built.system, band=REACH * f_max)
    groups = element_groups(built, 1)
    parts = built.assembly.parts
    effects = tuple(
        calibration_parameter(groups, t, [p], spread)
        for p in np.unique(groups.part).tolist()
        if (t := thickness_of(parts[p]))
    )
    blocks = [modal.shapes]
    rng = np.random.default_rng(0)
    for k in range(FULL):
        progress(f"random model {k + 1} of {FULL} for the basis", (k + 1) / (FULL + 2))
        drawn = with_thickness(built, effects, random(rng, len(effects), spread))
        shapes = normal_modes(drawn.system, band=1.1 * f_max).shapes
        if len(shapes) != len(built.system.dofs):
            raise ModelError("a part's thickness changed which degrees of freedom are free")
        blocks.append(shapes)
    basis = orthonormal(built.system.M, blocks, kept=modal.shapes.shape[1])
    return Ensemble(reduce(groups, basis), effects, int(rigid_modes(modal).sum()))


def random(rng: np.random.Generator, n_parts: int, spread: float) -> np.ndarray:
    """Log factors of the parts' thickness, normal and clipped at two standard deviations."""
    return spread * rng.standard_normal(n_parts).clip(-CLIP, CLIP)


def with_thickness(built: Structure, effects: tuple[PartScale, ...], x: np.ndarray) -> Structure:
    """The structure assembled again with the thickness of each part times e^x."""
    made = built.assembly
    for effect, value in zip(effects, x, strict=True):
        made = effect.apply(made, np.array([value]))
    return structure(made)


def drawn(
    models: Ensemble, seen: np.ndarray, modes: int, count: int, spread: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (count, r) [Hz] and shapes (count, m, r) of models with drawn thickness.

    Parameters
    ----------
    seen : (m, k)   the basis at the candidates, along their directions
    modes : number r of flexible modes of each draw
    """
    rng, keep = np.random.default_rng(seed), slice(models.rigid, models.rigid + modes)
    frequency, shapes = [], []
    for _ in range(count):
        x = random(rng, len(models.effects), spread)
        state = evaluate(models.model, models.effects, x, gradient=False)
        frequency.append(np.sqrt(np.maximum(state.lam[keep], 0.0)) / (2 * np.pi))
        shapes.append(seen @ state.phi[:, keep])
    return np.stack(frequency), np.stack(shapes)
