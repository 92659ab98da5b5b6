"""What sensors and force gauges show wrongly by themselves: gain, tilt and place of each.

No model need explain it, and no parameter should bend for it: the errors are small, independent
and of known size, and what they do to log10 H is linear in them. With e the relative error of the
gain, θ the tilt and x the error of the place, and u, v square to the direction n = u x v,

d(ln H) = e + (θ_u H_u + θ_v H_v + x_u ∂H/∂u + x_v ∂H/∂v) / H,

H_u the response along u, ∂H/∂u = -φ_v, ∂H/∂v = φ_u the slopes of the sheet from its rotations
(w(x + dx) = w + θ × dx · n). Their covariance V Vᵀ is whitened out of the residuals before anything
is fitted (C = I + V Vᵀ): channel by channel, for each has its own five, and then what the inputs
do to all channels.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.modal_sum import modal_sum
from ..ema.setup import SensorAccuracy
from ..fem.assemble import Structure
from ..fem.measured_dofs import MeasuredDofs
from .discrepancy import Lines
from .reduced_model import Reduced, State

WAYS = 4  # tilts about u and v, places along u and v
LN10 = np.log(10.0)


@dataclass(frozen=True, eq=False)
class Side:
    """Errors of the outputs, or of the inputs.

    Attributes
    ----------
    gain : relative standard deviation
    rows : four (k, n)     motions that tilts and wrong places mix in, times their deviations
    carried : (4, k, n_in) what a moving base carries along of them
    modal : (4, k, r)      the rows in a basis
    """

    gain: float
    rows: tuple[sp.csr_array, ...]
    carried: np.ndarray
    modal: np.ndarray

    def over(self, model: Reduced) -> Self:
        """The rows in the basis of this model."""
        return replace(self, modal=np.stack([model.rows(rows) for rows in self.rows]))


def side(dofs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy) -> Side:
    """Of all places of one side; what a place's own deviation is goes before the usual one."""
    u, v = dofs.across()
    place, turn = sp.diags_array(np.where(dofs.sd > 0, dofs.sd, known.position)), known.direction
    rows = (
        turn * u.rows(built), turn * v.rows(built),
        place @ v.rows(built, turning=True), place @ u.rows(built, turning=True),
    )  # fmt: skip
    still = np.zeros((len(dofs.labels), len(inputs.labels)))
    carried = np.stack([turn * u.carried_by(inputs), turn * v.carried_by(inputs), still, still])
    return Side(known.gain, tuple(map(sp.csr_array, rows)), carried, np.zeros((WAYS, 0, 0)))


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Errors of all sensors and of all force gauges."""

    outputs: Side
    inputs: Side

    def over(self, model: Reduced) -> Self:
        """The same in the basis of this model."""
        return replace(self, outputs=self.outputs.over(model), inputs=self.inputs.over(model))


def sensor_errors(
    outputs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy
) -> SensorErrors:
    """As they are to be expected of sensors and force gauges known so well."""
    return SensorErrors(side(outputs, inputs, built, known), side(inputs, inputs, built, known))


def columns(
    errors: SensorErrors, data: Lines, state: State, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """d ln H / scale per standard deviation: of each output (5, *H), of the inputs (k, *H)."""
    H = data.model(state)
    outputs = _of_outputs(errors.outputs, data, state, H, scale)
    return outputs, _of_inputs(errors.inputs, data, state, H, scale)


def variance(errors: SensorErrors, data: Lines, state: State) -> np.ndarray:
    """|d ln H|² that is to be expected of them (n_f, n_out, n_in)."""
    both = columns(errors, data, state, np.ones(data.values.shape))
    return np.asarray(sum((np.abs(z) ** 2).sum(axis=0) for z in both))


def _of_outputs(
    errors: Side, data: Lines, state: State, H: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """What one standard deviation of each error of an output does to its deviation (5, *H)."""
    _, phi_i, d = data.modal(state)
    out = [errors.gain / scale]
    for modal, carried in zip(errors.modal, errors.carried, strict=True):
        G = modal_sum(modal @ state.phi, d, phi_i)
        out.append((data.s[:, None, None] ** data.power * G + carried) / (H * scale))
    return np.stack(out)


def _of_inputs(
    errors: Side, data: Lines, state: State, H: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """The same of each input, zero where another drives; of a moving base its gain alone."""
    phi_o, phi_i, d = data.modal(state)
    out = []
    for i in range(len(phi_i)):
        one = np.arange(len(phi_i)) == i
        out.append(errors.gain / scale * one)
        for modal in errors.modal[:, i] if state.drive is None else ():
            G = modal_sum(phi_o, d, (modal @ state.phi)[None])
            z = data.s[:, None, None] ** data.power * G / (H * scale)
            out.append(z * one)
    return np.stack(out)
