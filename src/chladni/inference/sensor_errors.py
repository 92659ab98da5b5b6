"""Errors of sensors and force gauges themselves: gain, tilt and place of each.

A model need not explain these errors, and parameters should not adapt to them. They are small,
independent and of known size. Let e be the relative error of the gain, θ the tilt, x the error of
the place, and u, v normal to the direction n = u x v:

d(ln H) = e + (θ_u H_u + θ_v H_v + x_u ∂H/∂u + x_v ∂H/∂v) / H.

H_u is the response along u.  The slopes of the sheet ∂H/∂u = -φ_v, ∂H/∂v = φ_u follow from its
rotations (w(x + dx) = w + θ × dx · n); solids have no rotations, and the slopes are those of their
faces. V Vᵀ is the covariance of the errors of the outputs and of
the gains of the gauges. It is whitened out of the residuals before anything is fitted
(C = I + V Vᵀ). Tilt and place of a gauge act on all channels: they are unknowns of every fit
(:class:`..effects.channels.GaugeErrors`).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..effects.channels import GaugeErrors
from ..effects.effect import Parameter
from ..ema.setup import SensorAccuracy
from ..fem.assemble import Structure
from ..fem.measured_dofs import MeasuredDofs
from ..reduced.reduced_model import Reduced, State
from .discrepancy import Lines

WAYS = ("tilt about u", "tilt about v", "place along u", "place along v")
LN10 = np.log(10.0)


@dataclass(frozen=True, eq=False)
class Side:
    """Errors of measured dofs.

    Attributes
    ----------
    gain : relative standard deviation
    rows : four (k, n)     motions added by tilts and wrong places, times standard deviations
    with_base : (4, k, n_in) rigid-body share of these motions under a moving base
    modal : (4, k, r)      the rows in a basis
    """

    gain: float
    rows: tuple[sp.csr_array, ...]
    with_base: np.ndarray
    modal: np.ndarray

    def rebased(self, model: Reduced) -> Self:
        """The rows in the basis of this model."""
        return replace(self, modal=np.stack([model.rows(rows) for rows in self.rows]))


def side(dofs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy) -> Side:
    """Errors of all outputs, or of all inputs; a place's own sd, if any, replaces the usual one."""
    u, v = dofs.across()
    place, turn = np.where(dofs.sd > 0, dofs.sd, known.position), known.direction
    rows = (turn * u.rows(built), turn * v.rows(built), *dofs.moved(built, place))
    still = np.zeros((len(dofs.labels), len(inputs.labels)))
    with_base = np.stack(
        [turn * u.moved_with_base(inputs), turn * v.moved_with_base(inputs), still, still]
    )
    return Side(known.gain, tuple(map(sp.csr_array, rows)), with_base, np.zeros((len(WAYS), 0, 0)))


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Errors of all sensors, and the relative standard deviation of the gain of a force gauge."""

    outputs: Side
    gain: float

    def rebased(self, model: Reduced) -> Self:
        """The errors with their rows in the basis of this model."""
        return replace(self, outputs=self.outputs.rebased(model))


def sensor_errors(
    outputs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy
) -> SensorErrors:
    """Expected errors of sensors of this accuracy, and of the gains of force gauges."""
    return SensorErrors(side(outputs, inputs, built, known), known.gain)


def gauge_errors(
    outputs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy
) -> list[GaugeErrors]:
    """Tilt and place of every force gauge; a moving base has none."""
    n, found = len(outputs.labels), list[GaugeErrors]()
    unknown = tuple(Parameter(way, "-", 0.0, 1.0, kind="linear", step=0.5) for way in WAYS)
    rows = side(inputs, inputs, built, known).rows
    for k in np.flatnonzero(~inputs.base).tolist():
        at = np.eye(n + len(inputs.labels))[:, [n + k]]
        own = tuple(sp.csr_array(row[[k]]) for row in rows)
        found.append(GaugeErrors(unknown, f"gauge {inputs.labels[k]}", rows=own, shapes=at))
    return found


def columns(
    errors: SensorErrors, data: Lines, state: State, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Columns d ln H / scale per sd: of each output (5, *H), of the gain of each input (k, *H)."""
    outputs = _of_outputs(errors.outputs, data, state, data.model(state), scale)
    return outputs, errors.gain / scale * np.eye(scale.shape[-1])[:, None, None]


def variance(errors: SensorErrors, data: Lines, state: State) -> np.ndarray:
    """Expected |d ln H|² from the sensor errors (n_f, n_out, n_in)."""
    both = columns(errors, data, state, np.ones(data.values.shape))
    return np.asarray(sum((np.abs(z) ** 2).sum(axis=0) for z in both))


def _of_outputs(
    errors: Side, data: Lines, state: State, H: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Change of the deviation of each output by one sd of each of its errors (5, *H)."""
    _, phi_i, d = data.modal(state)
    out = [errors.gain / scale]
    for modal, with_base in zip(errors.modal, errors.with_base, strict=True):
        G = state.between(data.s, d, modal @ state.phi, phi_i)
        out.append((data.s[:, None, None] ** data.power * G + with_base) / (H * scale))
    return np.stack(out)
