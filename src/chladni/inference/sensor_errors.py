"""Errors of sensors and force gauges themselves: gain, tilt and place of each.

A model need not explain these errors, and parameters should not adapt to them. They are small,
independent and of known size. Let e be the relative error of the gain, θ the tilt, x the error of
the place, and u, v normal to the direction n = u x v:

d(ln H) = e + (θ_u H_u + θ_v H_v + x_u ∂H/∂u + x_v ∂H/∂v) / H.

H_u is the response along u.  The slopes of the sheet ∂H/∂u = -φ_v, ∂H/∂v = φ_u follow from its
rotations (w(x + dx) = w + θ × dx · n). V Vᵀ is the covariance of the errors of the outputs and of
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
from ..reduced.reduced_model import Reduced

WAYS = ("tilt about u", "tilt about v", "place along u", "place along v")


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Errors of measured dofs."""

    gain: float  # relative standard deviation
    # four (k, n), motions added by tilts and wrong places, times standard deviations
    rows: tuple[sp.csr_array, ...]
    with_base: np.ndarray  # (4, k, n_in) rigid-body share of these motions under a moving base
    modal: np.ndarray  # (4, k, r) the rows in a basis

    def rebased(self, model: Reduced) -> Self:
        """The rows in the basis of this model."""
        return replace(self, modal=np.stack([model.rows(rows) for rows in self.rows]))


def sensor_errors(
    dofs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy
) -> SensorErrors:
    """Errors of all outputs, or of all inputs; a place's own sd, if any, replaces the usual one."""
    u, v = dofs.across()
    place, turn = sp.diags_array(np.where(dofs.sd > 0, dofs.sd, known.position)), known.direction
    rows = (
        turn * u.rows(built), turn * v.rows(built),
        place @ v.rows(built, turning=True), place @ u.rows(built, turning=True),
    )  # fmt: skip
    still = np.zeros((len(dofs.labels), len(inputs.labels)))
    with_base = np.stack(
        [turn * u.moved_with_base(inputs), turn * v.moved_with_base(inputs), still, still]
    )
    modal = np.zeros((len(WAYS), 0, 0))
    return SensorErrors(known.gain, tuple(map(sp.csr_array, rows)), with_base, modal)


def gauge_errors(
    outputs: MeasuredDofs, inputs: MeasuredDofs, built: Structure, known: SensorAccuracy
) -> list[GaugeErrors]:
    """Tilt and place of every force gauge; a moving base has none."""
    n, found = len(outputs.labels), list[GaugeErrors]()
    unknown = tuple(Parameter(way, "-", 0.0, 1.0, kind="linear", step=0.5) for way in WAYS)
    rows = sensor_errors(inputs, inputs, built, known).rows
    for k in np.flatnonzero(~inputs.base).tolist():
        at = np.eye(n + len(inputs.labels))[:, [n + k]]
        own = tuple(sp.csr_array(row[[k]]) for row in rows)
        found.append(GaugeErrors(unknown, f"gauge {inputs.labels[k]}", rows=own, shapes=at))
    return found
