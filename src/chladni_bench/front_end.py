"""Front end for voltages: anti-aliasing filter, noise, range and steps of the converter."""

from dataclasses import dataclass

import numpy as np

from .pole_model import PoleFilter, one_of_pairs

PASS = 0.4  # of the rate: up to there the anti-alias filter is flat, as 1/2.56 of a front end's
RIPPLE, STOP, ORDER = 0.05, 100.0, 11  # [dB], [dB]; an odd order falls to nothing at infinity


@dataclass(frozen=True)
class FrontEnd:
    """One converter a channel."""

    # range ± [V]; the sensors' own limit in Echaniz Granado (2015), section 4.2.5
    volts: float = 5.0
    bits: int = 24  # of the converter over the whole range
    noise: float = 2e-7  # of converter and cable [V/√Hz]

    @property
    def step(self) -> float:
        """Volts between two numbers of the converter."""
        return 2 * self.volts / 2.0**self.bits


def sampling_rate(f_max: float) -> float:
    """The power of two from 2.56 f_max on [1/s]."""
    return float(2 ** np.ceil(np.log2(2.56 * f_max) - 1e-9))


def anti_alias(rate: float) -> PoleFilter:
    """Elliptic low-pass, flat to 0.4 of the rate, 100 dB down from half of it on.

    All channels share it, so that no FRF sees it.
    """
    from scipy.signal import ellip, residue

    edge = 2 * np.pi * PASS * rate
    b, a = ellip(ORDER, RIPPLE, STOP, 1.0, analog=True)  # per edge: numbers of order one
    r, p, _ = residue(b, a)
    keep, pair = one_of_pairs(p)
    return PoleFilter(edge * p[keep], edge * pair * r[keep])


def digitised(
    volts: np.ndarray, noise: np.ndarray, rate: float, front: FrontEnd, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Voltages (channels, n) as numbers of the converter, and which channels were overloaded.

    Parameters
    ----------
    noise : (channels,) of every sensor [V/√Hz]; the front end's is added
    """
    sd = np.hypot(noise, front.noise) * np.sqrt(rate / 2)
    x = volts + sd[:, None] * rng.normal(size=volts.shape)
    over = np.abs(x).max(axis=1) > front.volts
    x = np.clip(x, -front.volts, front.volts)
    return front.step * np.round(x / front.step), over
