"""Poles and residues of a recording, with their spread, down to the noise floor.

Weighted common-pole fit on any frequency grid; see `fitting` and `selection`.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..dynamics.frf import FRF
from ..errors import FileError, ShapeError
from .pole_fitting import PoleData, PoleFit, PoleSystem, polish, solve
from .pole_selection import (
    ORDERS,
    Rule,
    Sweep,
    extended,
    merge_duplicate_poles,
    settled,
    start,
    swept,
    uncertainty,
)
from .response_variance import frf_variance, left_variance

UNSETTLED = 2.0  # times the noise that is left: the sweep may have begun badly
OTHERS = (5, 8, 12, 18, 26, 36, 48)  # orders that are tried then
ROUNDS = 4  # of weights from what is left
QUIET = 0.3  # times the noise assumed: so little is left that poles below it may be seen
ROUNDING = 1e-6  # times the noise assumed: nothing is left
STEADY = 0.05  # of the spread at the noise assumed: no FRF repeats itself to less than 0.05 %
DERIVATIVES = {"receptance": 0, "mobility": 1, "accelerance": 2, "transmissibility": 2}


@dataclass(frozen=True, eq=False)
class Identified:
    """H(s) = s^q [Σ_r R_r/(s-p_r) + R̄_r/(s-p̄_r) + L/s² + U], with the spread of the poles.

    Attributes
    ----------
    poles : (r,) complex             p_r [rad/s], by increasing |p|
    residues : (r, n_out, n_in)      R_r of the receptance
    lower, upper : (n_out, n_in)     L, U: modes below and above the band
    frequency_sd, damping_sd : (r,)  standard deviations [Hz], [-]
    relative_delta_chi2 : (r,)       rise of χ² without the pole, over what it must pay
    chi : float                      rms of the whitened residual (1: the noise is all that is left)
    outputs, inputs, quantity        as in the recording
    band : (low, high)               [Hz] that was fitted
    diagram : Sweep                  poles of every order, [rad/s]: the stabilisation diagram
    """

    poles: np.ndarray
    residues: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    frequency_sd: np.ndarray
    damping_sd: np.ndarray
    relative_delta_chi2: np.ndarray
    chi: float
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: str
    band: tuple[float, float]
    diagram: Sweep

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
        """True for poles within the band; those beside it stand for what rings next door (r,)."""
        return (self.band[0] <= self.frequency) & (self.frequency <= self.band[1])

    def sel(self, modes: np.ndarray | slice) -> Self:
        """Some of the modes; the residual terms stay."""
        names = ("poles", "residues", "frequency_sd", "damping_sd", "relative_delta_chi2")
        return replace(self, **{name: getattr(self, name)[modes] for name in names})


def identify(
    frf: FRF,
    band: tuple[float, float] | None = None,
    orders: tuple[int, ...] = ORDERS,
    largest_damping: float = 0.1,
    averages: int = 1,
    use: np.ndarray | None = None,
    tries: int = 12,
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

    Raises
    ------
    FileError
        If the band holds too few lines.
    """
    keep = frf.frequency > 0
    if band is not None:
        keep &= (band[0] <= frf.frequency) & (frf.frequency <= band[1])
    if use is not None:
        keep &= use
    if keep.sum() < 12:
        raise FileError(
            f"{int(keep.sum())} lines between {band} Hz are too few to identify from; the "
            f"recording holds {frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz"
        )
    data, omega_max = _data(frf, keep, averages)
    rule = Rule(data.y.shape[1], len(data.s), largest=largest_damping)
    fit, slope, sweep = _modes(data, orders, rule, tries)
    if _chi(data, fit) > UNSETTLED and orders == ORDERS:
        other = _modes(data, OTHERS, rule, tries)
        fit, slope, sweep = min((fit, slope, sweep), other, key=lambda one: one[0].chi2)
    solution = Solution(fit, uncertainty(fit.p, slope, max(1.0, _chi(data, fit) ** 2)))
    if frf.variance is None and frf.coherence is None and len(fit.p):
        solution = _reweighted(data, fit, slope, rule, tries)
    return _result(frf, keep, data, omega_max, solution, sweep, rule)


def _modes(
    data: PoleData, orders: tuple[int, ...], rule: Rule, tries: int
) -> tuple[PoleFit, PoleSystem, Sweep]:
    """A sweep over orders, then the poles that pay, polished."""
    sweep = swept(data, orders, rule.largest)
    fit, slope = settled(data, start(data, sweep, rule), rule)
    fit, slope = extended(data, fit, slope, rule, tries)
    fit, slope = merge_duplicate_poles(data, fit, slope, rule)
    return *polish(data, fit.p, rule.largest, tol=0.05), sweep


@dataclass(frozen=True, eq=False)
class Solution:
    """A fit, the spread of |p| and ζ (r,) each; ``chi`` where the fit's own weights say another."""

    fit: PoleFit
    spread: tuple[np.ndarray, np.ndarray]
    chi: float | None = None


def _reweighted(
    data: PoleData, fit: PoleFit, slope: PoleSystem, rule: Rule, tries: int
) -> Solution:
    """The poles with the noise that they leave, where nobody states it.

    A wrong noise costs accuracy, seldom poles. Where far less is left than was assumed, though,
    modes that it would have hidden are sought again.
    """
    own = data
    for _ in range(ROUNDS):
        used = own.w > 0
        rest = np.where(used, fit.e / np.where(used, own.w, 1.0), 0)
        chi = _chi(data, replace(fit, e=rest * data.w))
        if chi < ROUNDING:
            fit, slope = polish(data, fit.p, rule.largest, tol=0.0)
            break
        own = replace(data, w=_weights(left_variance(rest, data.y - rest, used), used))
        fit, slope = polish(own, fit.p, rule.largest, tol=0.05)
        if chi > QUIET:
            break
        count = len(fit.p)
        fit, slope = merge_duplicate_poles(own, *extended(own, fit, slope, rule, tries), rule)
        if len(fit.p) == count:
            break
    plain, its_slope = solve(data, fit.p, slope=True)
    assert its_slope is not None
    known = uncertainty(fit.p, slope, _chi(own, fit) ** 2)
    least = uncertainty(fit.p, its_slope, STEADY**2)
    spread = (np.maximum(known[0], least[0]), np.maximum(known[1], least[1]))
    chi = _chi(data, plain)
    kept = fit if chi < QUIET else replace(fit, delta_chi2=plain.delta_chi2)
    return Solution(kept, spread, chi)


def _weights(variance: np.ndarray, used: np.ndarray) -> np.ndarray:
    """√2 / σ, zero where a sample does not count."""
    used = used & (variance > 0)
    return np.where(used, np.sqrt(2 / np.where(used, variance, 1.0)), 0.0)


def _chi(data: PoleData, fit: PoleFit) -> float:
    """Rms of the whitened residual over its degrees of freedom."""
    return float(np.sqrt(fit.chi2 / max(data.samples - fit.x.size - 2 * len(fit.p), 1)))


def _data(frf: FRF, keep: np.ndarray, averages: int) -> tuple[PoleData, float]:
    """Scaled, weighted samples, and the scale of s."""
    variance = frf_variance(frf, averages)
    s = 2j * np.pi * frf.frequency[keep]
    omega_max = float(np.abs(s).max())
    y = frf.values[keep].reshape(len(s), -1)
    v = variance[keep].reshape(len(s), -1)
    fine = np.isfinite(y) & np.isfinite(v) & (v > 0)
    w = _weights(v, fine)
    if not w.any():
        raise ShapeError("no sample of the recording is a finite number other than zero")
    q = DERIVATIVES[frf.quantity]
    y = np.where(fine, y, 0)
    return PoleData(s / omega_max, y / omega_max**q, w * omega_max**q, q), omega_max


def _result(
    frf: FRF,
    keep: np.ndarray,
    data: PoleData,
    omega_max: float,
    solution: Solution,
    sweep: Sweep,
    rule: Rule,
) -> Identified:
    """Back to rad/s and labels, poles in order."""
    n_out, n_in = len(frf.outputs), len(frf.inputs)
    fit, (sd_f, sd_z) = solution.fit, solution.spread
    chi = _chi(data, fit) if solution.chi is None else solution.chi
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
        chi=float(chi),
        outputs=frf.outputs,
        inputs=frf.inputs,
        quantity=frf.quantity,
        band=(float(f[0]), float(f[-1])),
        diagram=replace(sweep, poles=omega_max * sweep.poles),
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

    Abrahamsson and Kammer (2015), IMAC XXXIII, eqs. 26.14-26.28 (damping equalisation).
    """
    p = identified.poles
    R = identified.residues * (p.imag / np.abs(p))[:, None, None]
    return evaluate(identified, s, 1j * np.abs(p), R)
