"""Poles and residues of a recording, with their spread, down to the noise floor.

Weighted common-pole fit on any frequency grid; see `pole_search` and `pole_fitting`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..dynamics.frf import FRF
from ..errors import FileError, ShapeError
from ..progress import Progress, silent
from ..results import ShownBriefly
from .modal_covariance import ModalCovariance, modal_covariance
from .pole_choice import by_subspace, edited
from .pole_fitting import PoleData, solve
from .pole_search import ROUNDING, STEADY, Solution, chi_of, searched, weights, with_noise_left
from .pole_search_by_parts import is_large, searched_by_parts
from .pole_selection import ORDERS, Rule
from .response_variance import frf_variance

DERIVATIVES = {"receptance": 0, "mobility": 1, "accelerance": 2, "transmissibility": 2}
LEAST_LINES = 12  # to identify from
AWAY = 3.0  # times the band, above or below: of a pole there damping moves H by ζ of a small part


@dataclass(frozen=True, eq=False, repr=False)
class Identified(ShownBriefly):
    """H(s) = s^q [Σ_r R_r/(s-p_r) + R̄_r/(s-p̄_r) + L/s² + U], with the spread of the poles."""

    poles: np.ndarray  # (r,) complex; p_r [rad/s], by increasing |p|
    residues: np.ndarray  # (r, n_out, n_in) R_r of the receptance
    # lower, upper: (n_out, n_in) L, U: modes below and above the band
    lower: np.ndarray
    upper: np.ndarray
    # frequency_sd, damping_sd: (r,) standard deviations [Hz], [-]
    frequency_sd: np.ndarray
    damping_sd: np.ndarray
    relative_delta_chi2: np.ndarray  # (r,) rise of χ² without the pole, over its cost
    chi: float  # rms of the whitened residual (1: the noise is all that is left)
    # outputs, inputs, quantity: as in the recording
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: str
    band: tuple[float, float]  # (low, high) [Hz] that was fitted
    # of poles and residues (None of modes made otherwise)
    covariance: ModalCovariance | None = None

    @property
    def frequency(self) -> np.ndarray:
        """|p| / 2π [Hz]."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping(self) -> np.ndarray:
        """ζ = -Re p / |p|."""
        return -self.poles.real / np.abs(self.poles)

    @property
    def order(self) -> int:
        """Number of poles."""
        return len(self.poles)

    @property
    def inside(self) -> np.ndarray:
        """True for poles within the band; the others represent modes outside it (r,)."""
        return (self.band[0] <= self.frequency) & (self.frequency <= self.band[1])

    @property
    def firm(self) -> np.ndarray:
        """True for poles known to 2 % in frequency and to half their damping (r,)."""
        known = self.frequency_sd < 0.02 * self.frequency
        return known & (self.damping_sd < 0.5 * self.damping)

    @property
    def by_channel(self) -> np.ndarray:
        """The residues, a column a channel (r, n_out n_in); of no poles too."""
        return self.residues.reshape(self.order, self.lower.size)

    @property
    def moved(self) -> np.ndarray:
        """True for poles that damping equalisation moves, near enough to the band (r,)."""
        low, high = self.band
        return (self.frequency > low / AWAY) & (self.frequency < high * AWAY)

    def sel(self, modes: np.ndarray | slice) -> Self:
        """Some of the modes; the residual terms stay."""
        names = ("poles", "residues", "frequency_sd", "damping_sd", "relative_delta_chi2")
        held = self.covariance and self.covariance.sel(modes)
        return replace(self, covariance=held, **{n: getattr(self, n)[modes] for n in names})


def identify(
    frf: FRF,
    band: tuple[float, float] | None = None,
    orders: tuple[int, ...] = ORDERS,
    largest_damping: float = 0.1,
    averages: int = 1,
    use: np.ndarray | None = None,
    tries: int = 12,
    states: int | None = None,
    drop: Sequence[float] = (),
    pick: Sequence[float] = (),
    progress: Progress = silent,
) -> Identified:
    """Modes of a recording.

    Parameters
    ----------
    frf : any quantity, one channel or many, frequencies spaced as they please
    band : Hz, default: all lines above zero
    orders : numbers of poles of the sweep
    largest_damping : poles beyond are no modes
    averages : of the estimate, where the spread comes from the coherence
    use : (n_f,) bool, lines that count (a gap, the cord's band left out)
    tries : attempts to add a pole where the residual stands out
    states : the other road: all poles of a state space of that order (``subspace``)
    drop, pick : [Hz] of poles taken out or put in by hand; the others are polished anew

    Raises
    ------
    FileError
        If the band holds too few lines.
    LabelError
        If there is no pole to drop at a frequency, or none stays where one was picked.
    """
    keep = kept_lines(frf, band, use)
    data, omega_max = pole_data(frf, keep, averages)
    rule = Rule(data.y.shape[1], len(data.s), largest=largest_damping)
    stated = frf.variance is not None or frf.coherence is not None
    if states is not None:
        solution = by_subspace(data, rule, stated, states)
    elif is_large(data):
        solution = searched_by_parts(data, rule, stated, orders, tries, progress)
    else:
        solution = searched(data, rule, stated, orders, tries)
    if len(drop) or len(pick):
        solution = edited(data, solution, rule, stated, omega_max / (2 * np.pi), drop, pick)
    found = _result(frf, keep, omega_max, solution, rule)
    return replace(found, covariance=_covariance(data, solution, stated, omega_max))


def _covariance(
    data: PoleData, solution: Solution, stated: bool, omega_max: float
) -> ModalCovariance:
    """Covariance of poles and residues, sorted, in rad/s, with the noise used for their spread."""
    fit, chi = solution.fit, solution.chi
    own, noise = data, max(1.0, chi) if stated else STEADY
    if not stated and chi > ROUNDING and len(fit.p):
        own = with_noise_left(data, data, solve(data, fit.p)[0])
        noise = chi_of(own, fit := solve(own, fit.p)[0]) * max(1.0, STEADY / chi)
    found = modal_covariance(own, fit.p, fit.x, noise**2).sel(np.argsort(np.abs(fit.p)))
    return replace(
        found, pole=omega_max * found.pole, shared=omega_max * found.shared,
        local=omega_max**2 * found.local,
    )  # fmt: skip


def kept_lines(
    frf: FRF, band: tuple[float, float] | None = None, use: np.ndarray | None = None
) -> np.ndarray:
    """Select the spectral lines for the identification (n_f,) bool."""
    keep = frf.frequency > 0
    if band is not None:
        keep &= (band[0] <= frf.frequency) & (frf.frequency <= band[1])
    if use is not None:
        keep &= use
    if keep.sum() < LEAST_LINES:
        in_band = "" if band is None else " between {:g} and {:g} Hz".format(*band)
        raise FileError(
            f"{int(keep.sum())} lines{in_band} are too few for identification; the recording "
            f"covers {frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz"
        )
    return keep


def pole_data(frf: FRF, keep: np.ndarray, averages: int = 1) -> tuple[PoleData, float]:
    """Scaled, weighted samples, and the scale of s [rad/s]."""
    variance = frf_variance(frf, averages)
    s = 2j * np.pi * frf.frequency[keep]
    omega_max = float(np.abs(s).max())
    y = frf.values[keep].reshape(len(s), -1)
    v = variance[keep].reshape(len(s), -1)
    fine = np.isfinite(y) & np.isfinite(v) & (v > 0)
    w = weights(v, fine)
    if not w.any():
        raise ShapeError("no sample of the recording is a finite number other than zero")
    q = DERIVATIVES[frf.quantity]
    y = np.where(fine, y, 0)
    return PoleData(s / omega_max, y / omega_max**q, w * omega_max**q, q), omega_max


def _result(
    frf: FRF,
    keep: np.ndarray,
    omega_max: float,
    solution: Solution,
    rule: Rule,
) -> Identified:
    """Convert a solution to rad/s and labels, with sorted poles."""
    n_out, n_in = len(frf.outputs), len(frf.inputs)
    fit, (sd_f, sd_z) = solution.fit, solution.spread
    order = np.argsort(np.abs(fit.p))
    shape = (n_out, n_in)
    f = frf.frequency[keep]
    return Identified(
        poles=omega_max * fit.p[order],
        residues=omega_max * fit.residues[order].reshape(-1, *shape),
        lower=omega_max**2 * fit.x[-2].reshape(shape),
        upper=fit.x[-1].reshape(shape),
        frequency_sd=omega_max * sd_f[order] / (2 * np.pi),
        damping_sd=sd_z[order],
        relative_delta_chi2=fit.delta_chi2[order] / rule.price,
        chi=solution.chi,
        outputs=frf.outputs,
        inputs=frf.inputs,
        quantity=frf.quantity,
        band=(float(f[0]), float(f[-1])),
    )


def evaluate(
    identified: Identified,
    s: np.ndarray,
    poles: np.ndarray | None = None,
    residues: np.ndarray | None = None,
) -> np.ndarray:
    """H(s) of the identified model (n_s, n_out, n_in), s complex [rad/s]."""
    s = np.asarray(s, complex)[:, None]
    p = identified.poles if poles is None else poles
    R = identified.residues if residues is None else residues
    shape = identified.lower.shape
    r = R.reshape(len(p), shape[0] * shape[1])
    H = (1 / (s - p)) @ r + (1 / (s - p.conj())) @ r.conj()
    H = H + identified.lower.ravel() / s**2 + identified.upper.ravel()
    return (s ** DERIVATIVES[identified.quantity] * H).reshape(-1, *shape)


def equalised(identified: Identified, s: np.ndarray) -> np.ndarray:
    """H_X(s) with every pole moved to the imaginary axis, p -> i|p| (n_s, n_out, n_in).

    Evaluated on s = ω(ζ_e + i) it meets the undamped model Σ φ φᵀ / (ω_r² + s²) on the same
    line, with no pairing of modes. The residue φφᵀ / 2i Im p becomes φφᵀ / 2i |p|.

    Poles beyond ``AWAY`` of the band are not moved, because their damping hardly changes H there.
    Several of them may represent one smooth residual with large terms that cancel only in place.

    Abrahamsson and Kammer (2015), IMAC XXXIII, eqs. 26.14-26.28 (damping equalisation).
    """
    p, near = identified.poles, identified.moved
    R = identified.residues * np.where(near, p.imag / np.abs(p), 1.0)[:, None, None]
    return evaluate(identified, s, np.where(near, 1j * np.abs(p), p), R)
