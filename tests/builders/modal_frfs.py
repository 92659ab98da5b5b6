"""FRFs of modes that are known, with noise that is."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from chladni.dynamics.frf import FRF

POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}


def modal_sum(
    s: np.ndarray, hertz: Any, shapes: Any, drives: Any, damping: Any = 0.01, power: int = 2
) -> np.ndarray:
    """H = s^q Σ φ φ_dᵀ / (s² + 2 ζ ω s + ω²) (n_s, outputs, inputs) of shapes (outputs, modes)."""
    s, w = np.asarray(s)[:, None], 2 * np.pi * np.asarray(hertz)
    h = s**power / (s**2 + 2 * np.asarray(damping) * w * s + w**2)
    return np.einsum("or,fr,ir->foi", shapes, h, drives)


def modal_frf(
    f: np.ndarray,
    hertz: Any,
    shapes: Any,
    damping: Any = 0.01,
    quantity: str = "accelerance",
    drives: Sequence[int] = (0,),
) -> FRF:
    """FRF of outputs 1:+Z, 2:+Z, ..., of which some are driven."""
    labels = tuple(f"{k}:+Z" for k in range(1, len(shapes) + 1))
    phi = np.asarray(shapes)
    H = modal_sum(2j * np.pi * f, hertz, phi, phi[list(drives)], damping, POWERS[quantity])
    return FRF(H, f, labels, tuple(labels[k] for k in drives), quantity)  # type: ignore[arg-type]


def noisy(frf: FRF, share: float, floor: float = 0.0, seed: Any = 0, stated: bool = True) -> FRF:
    """The FRF with noise of a share of |H| and one of the rms of each channel, stated or not."""
    H, rng = frf.values, np.random.default_rng(seed)
    sd = share * np.abs(H) + floor * np.sqrt((np.abs(H) ** 2).mean(axis=0))
    drawn = (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    variance = sd**2 if stated else None
    return FRF(H + sd * drawn, frf.frequency, frf.outputs, frf.inputs, frf.quantity, variance)
