"""Errors of sensors and force gauges themselves: gain, tilt and place of each.

A model need not explain these errors, and parameters should not adapt to them. They are small,
independent and of known size. Let e be the relative error of the gain, θ the tilt, x the error of
the place, and u, v normal to the direction n = u x v:

d(ln H) = e + (θ_u H_u + θ_v H_v + x_u ∂H/∂u + x_v ∂H/∂v) / H.

H_u is the response along u.  The slopes of the sheet ∂H/∂u = -φ_v, ∂H/∂v = φ_u follow from its
rotations (w(x + dx) = w + θ × dx · n); solids have no rotations, and the slopes are those of their
faces. V Vᵀ is the covariance of the errors of the outputs and of
the gains of the gauges. It is whitened out of the residuals before anything is fitted
(C = I + V Vᵀ): first the columns of one output, then those that all outputs share. Tilt and place
of a gauge act on all channels: they are unknowns of every fit
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
    place, turn = np.where(dofs.sd > 0, dofs.sd, known.position), known.direction
    rows = (turn * u.rows(built), turn * v.rows(built), *dofs.moved(built, place))
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


@dataclass(frozen=True, eq=False)
class Whitening:
    """C^-½ of C = I + V Vᵀ."""

    own: sp.csc_array  # (n, k) columns that live on one output each, orthonormal
    own_less: np.ndarray  # (k,) 1 - 1/√(1 + s)
    common: np.ndarray  # (n, m), orthonormal
    common_less: np.ndarray  # (m,)

    def whitened(self, r: np.ndarray) -> np.ndarray:
        """Residuals or columns of slopes (n, ...)."""
        return _less(self.common, self.common_less, _less(self.own, self.own_less, r))


def whitening(output: np.ndarray, own: np.ndarray, common: np.ndarray) -> Whitening:
    """Whitening of errors along columns over the spread of each sample.

    Parameters
    ----------
    output : (n,)       of each row
    own : (n, k)        errors of one output each
    common : (n, m)     errors that all outputs share
    """
    blocks, less = [sp.csc_array((len(own), 0))], [np.zeros(0)]
    for k in np.unique(output):
        at = np.flatnonzero(output == k)
        U, share = _orthonormal(own[at])
        rows, columns = np.repeat(at, U.shape[1]), np.tile(np.arange(U.shape[1]), len(at))
        blocks.append(sp.coo_array((U.ravel(), (rows, columns)), shape=(len(own), U.shape[1])))
        less.append(share)
    U, own_less = sp.csc_array(sp.hstack(blocks)), np.concatenate(less)
    return Whitening(U, own_less, *_orthonormal(_less(U, own_less, common)))


def _less(U: np.ndarray | sp.csc_array, less: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Remove from r its share along each column."""
    along = U.T @ r
    return r - U @ (less[:, None] * along if along.ndim > 1 else less * along)


def _orthonormal(V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U (n, k) of V Vᵀ = U diag(s) Uᵀ, and 1 - 1/√(1 + s)."""
    s, Q = np.linalg.eigh(V.T @ V)
    kept = s > 1e-9 * max(float(s.max(initial=0.0)), 1e-9)
    return V @ (Q[:, kept] / np.sqrt(s[kept])), 1 - 1 / np.sqrt(1 + s[kept])
