"""Recordings made of modes: measured places, responses, noise."""

from typing import Any

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.fem.modelled import Modelled
from chladni.model.assembly import Assembly


def across(assembly: Assembly, grids: Any) -> MeasuredDofs:
    """Places at grids, across a sheet in the plane of x and y."""
    n = len(grids)
    return MeasuredDofs(
        tuple(f"{g}:+Z" for g in grids), np.asarray(grids), assembly.points[assembly.rows(grids)],
        np.tile([0.0, 0.0, 1.0], (n, 1)), np.zeros(n), np.zeros(n),
    )  # fmt: skip


def noisy(H: np.ndarray, share: float, seed: int) -> np.ndarray:
    """Values with normal errors of this share of each, of real and imaginary part together."""
    z = np.random.default_rng(seed).normal(size=(2, *H.shape))
    return H * (1 + share * (z[0] + 1j * z[1]) / np.sqrt(2))


def accelerances(
    model: Modelled, outputs: MeasuredDofs, inputs: MeasuredDofs, f: np.ndarray,
    zeta: float = 0.01, stretch: float = 1.0,
) -> FRF:  # fmt: skip
    """Σ s² φ_o φ_i / (s² + 2 ζ ω s + ω²) at f [Hz], all ω times ``stretch``."""
    a, b = (side.rows(model.structure) @ model.modes.shapes for side in (outputs, inputs))
    s, w = 2j * np.pi * f[:, None], 2 * np.pi * stretch * model.modes.frequency
    H = np.einsum("or,fr,ir->foi", a, s**2 / (s**2 + 2 * zeta * w * s + w**2), b)
    return FRF(H, f, outputs.labels, inputs.labels, "accelerance")
