"""FRFs as a front end averages them, with independent noise on every line, and no time data."""

from dataclasses import dataclass

import numpy as np

from chladni.dynamics.frf import FRF


@dataclass(frozen=True)
class MeasurementChain:
    """Measuring chain of an averaged FRF.

    ``noise``: standard deviation of each line relative to its own magnitude; ``floor``: relative
    to the rms of the channel over the band (electrical noise). Real and imaginary part share it.
    """

    noise: float = 0.01
    floor: float = 0.001


def recorded(
    H: np.ndarray,
    frequency: np.ndarray,
    chain: MeasurementChain,
    rng: np.random.Generator,
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
) -> FRF:
    """Accelerance H (n_f, n_out, n_in) as the front end gives it, with noise and its variance."""
    rms = np.sqrt((np.abs(H) ** 2).mean(axis=0, keepdims=True))
    variance = (chain.noise * np.abs(H)) ** 2 + (chain.floor * rms) ** 2
    e = (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    return FRF(
        H + np.sqrt(variance) * e, frequency, outputs, inputs, "accelerance", variance=variance
    )
