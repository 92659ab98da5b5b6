"""Measured mode shapes as data of a fit, with the variance that sensors and identification leave.

Noise that a file does not state is learned: the shapes are most probable with it, whatever the
deck's modes mix by. Noise lies in all directions of the sensors, an error of the model in those of
its modes.
"""

from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from ..ema.correlation import mac
from ..ema.shapes import turned
from ..fem.modelled import Modelled
from ..inference.pole_data import MIXED
from ..inference.sensor_errors import side
from ..inference.shape_data import ShapeData
from .question import Question

NOISE, NOISE_SD = 0.02, 0.7  # prior median of the noise over the rms of a shape, and sd of its ln
NOISES, SPREADS = np.geomspace(0.001, 0.3, 24), np.geomspace(0.005, 0.2, 8)
RIGID = 0.02  # of the lowest measured frequency: modes below are rigid motions


def shape_data(
    question: Question, listed: np.ndarray, nominal: Modelled
) -> tuple[ShapeData | None, tuple[str, ...]]:
    """Shapes of the listed poles, and a sentence on their noise; None where none were measured.

    A complex shape is turned to be as real as it can be; the imaginary part left counts as noise.
    """
    if question.shapes is None or question.frequency is None:
        return None, ()
    psi = turned(question.shapes[:, listed].T)
    norm = np.linalg.norm(psi.real, axis=1, keepdims=True)
    n = psi.shape[1]
    found, f = ShapeData(psi.real / norm, np.zeros(psi.shape)), question.frequency[listed]
    modes = nominal.up_to(min(MIXED * float(f[-1]), nominal.band))
    phi = question.outputs.rows(nominal.structure) @ modes.shapes
    flexible = modes.frequency > RIGID * f[0]
    partner = np.where(flexible[:, None], mac(phi, found.values.T), -1.0).argmax(axis=0)
    wrong = side(question.outputs, question.outputs, nominal.structure, question.accuracy)
    moved = sum((rows @ modes.shapes[:, partner]) ** 2 for rows in wrong.rows)
    size = np.maximum((phi[:, partner] ** 2).sum(axis=0), 1e-300)
    known = (moved / size).T + (wrong.gain * found.values) ** 2
    known = known + ((psi.imag / norm) ** 2).mean(axis=1, keepdims=True)

    def noisy(share: np.ndarray | float) -> ShapeData:
        return replace(found, variance=known + np.asarray(share) ** 2 / n)

    if question.shape_sd is not None:
        stated = question.shape_sd[:, listed].T / norm * np.sqrt(n)
        usual = np.nan_to_num(np.sqrt(np.nanmean(stated**2)), nan=NOISE)
        least = np.maximum(np.nan_to_num(stated, nan=usual), NOISES[0])
        return noisy(least), (_said(len(f), n, f"stated as {usual:.2g} of their rms"),)
    lam = (2 * np.pi * modes.frequency) ** 2
    every = np.arange(len(f))

    def unlikely(share: float) -> float:
        data = noisy(share)
        fixed = (1 - 1 / n) * np.log(data.variance).sum()
        each = [data.costs(phi, lam, s, every, partner).sum() for s in SPREADS]
        prior = (np.log(share / NOISE) / NOISE_SD) ** 2
        return float(fixed - 2 * logsumexp(-np.array(each) / 2) + prior)

    share = float(min(NOISES, key=unlikely))
    return noisy(share), (_said(len(f), n, f"{share:.2g} of their rms, learned"),)


def _said(modes: int, sensors: int, noise: str) -> str:
    return (
        f"frequencies and shapes of {modes} modes at {sensors} sensors were compared, each shape "
        "up to its factor; an error of the model mixes close modes most; the noise of the shapes "
        f"is {noise}"
    )
