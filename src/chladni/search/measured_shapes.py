"""Measured mode shapes as data of a fit, with the variance that sensors and identification leave.

Noise that a file does not state is learned: the shapes are most probable with it, whatever the
deck's modes mix by. Noise lies in all directions of the sensors, an error of the model in those of
its modes. Every mode has a noise of its own about a common one: peaks of one test differ in height,
and a weak one gives a poor shape.
"""

from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from ..ema.correlation import mac
from ..ema.shapes import turned
from ..fem.modelled import Modelled
from ..inference.pole_data import MIXED
from ..inference.sensor_errors import sensor_errors
from ..inference.shape_data import ShapeData
from .question import Question

NOISE, NOISE_SD = 0.02, 0.7  # prior median of the noise over the rms of a shape, and sd of its ln
OF_MODES = 0.7  # sd of ln of the noise between modes of one test
NOISES, SPREADS = np.geomspace(0.001, 1.0, 31), np.geomspace(0.005, 0.2, 8)
NEAR = 0.2  # |ln f| to a partner that costs as much as a whole MAC
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
    flexible = (modes.frequency > RIGID * f[0])[:, None]
    away = np.log(np.maximum(modes.frequency, RIGID * f[0])[:, None] / f) / NEAR
    partner = np.where(flexible, mac(phi, found.values.T) - away**2, -np.inf).argmax(axis=0)
    wrong = sensor_errors(question.outputs, question.outputs, nominal.structure, question.accuracy)
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

    def unlikely(share: float, scale: float) -> np.ndarray:
        data = noisy(share)
        fixed = (1 - 1 / n) * np.log(data.variance).sum(axis=1)
        return fixed + data.costs(phi, lam, scale, every, partner)

    common, own = learned_noise(np.array([[unlikely(x, s) for s in SPREADS] for x in NOISES]))
    words = f"{common:.2g} of their rms, learned; by mode {own.min():.2g} to {own.max():.2g}"
    return noisy(own[:, None]), (_said(len(f), n, words),)


def learned_noise(unlikely: np.ndarray) -> tuple[float, np.ndarray]:
    """Most probable common noise of the shapes, and the noise of each mode (r,).

    ln of the noise of a mode is N(ln of the common one, ``OF_MODES``²). ``unlikely`` is -2 ln
    density of each shape (noises, spreads, r).
    """
    away = np.log(NOISES) - np.log(NOISES)[:, None]
    prior = -0.5 * (away / OF_MODES) ** 2
    prior -= logsumexp(prior, axis=1, keepdims=True)  # (common, own)
    joint = prior[:, :, None, None] - unlikely / 2
    of_mode = logsumexp(joint, axis=1)  # (common, spreads, r)
    whole = logsumexp(of_mode.sum(axis=2), axis=1) - (np.log(NOISES / NOISE) / NOISE_SD) ** 2 / 2
    k = int(whole.argmax())
    of_spread = of_mode[k].sum(axis=1)
    weight = np.exp(of_spread - logsumexp(of_spread))
    share = np.exp(joint[k] - of_mode[k])  # of each noise, by spread and mode
    return float(NOISES[k]), np.exp(np.einsum("k,ksr,s->r", np.log(NOISES), share, weight))


def _said(modes: int, sensors: int, noise: str) -> str:
    return (
        f"frequencies and shapes of {modes} modes at {sensors} sensors were compared, each shape "
        "up to its factor; an error of the model mixes close modes most; the noise of the shapes "
        f"is {noise}"
    )
