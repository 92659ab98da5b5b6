"""Effect of the noise of a recording on the damping-equalised response identified from it.

The identified model is a weighted least-squares estimate. All channels share its poles; each has
its residues and residual terms. F = Q R are the weighted columns of a channel's linear unknowns; G
are those of the poles. S = Σ_c Gᵀ(I - QQᵀ)G is the information on the poles. A prediction with
slopes g_c, g_p has the variance |R⁻ᵀ g_c|² + hᴴ S⁻¹ h, h = g_p - GᵀQ R⁻ᵀ g_c (Seber and Wild 1989,
Nonlinear Regression, section 5.1; the linear unknowns are eliminated).
"""

import numpy as np
from scipy.linalg import solve_triangular

from ..dynamics.frf import FRF
from .condensed_lines import affordable
from .identification import DERIVATIVES, Identified
from .pole_fitting import basis, linear, residual_terms, stacked
from .response_variance import frf_variance

LN10 = np.log(10.0)


def equalised_error(
    identified: Identified, frf: FRF, s: np.ndarray, use: np.ndarray, averages: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Error of the equalised response: d ln H per standard deviation of each identified number.

    To first order it is the sum of all columns, each times an independent factor of unit variance.
    The first (k, n_s, n_out, n_in) are of a channel's own linear unknowns, independent between
    channels. The second (m, n_s, n_out, n_in) are of the poles, one factor for all channels.

    Parameters
    ----------
    identified : from ``frf``; its ``chi`` scales the noise that the recording states
    s : (n_s,) complex     where the equalised response is evaluated [rad/s]
    use : (n_f,) bool      lines of the recording that it was identified from
    averages : of the estimate, where the noise comes from the coherence
    """
    low, high = identified.band
    keep = use & (frf.frequency >= low) & (frf.frequency <= high) & (frf.frequency > 0)
    omega_max, q = 2 * np.pi * high, DERIVATIVES[identified.quantity]
    sigma = identified.chi * np.sqrt(frf_variance(frf, averages)[keep] / 2)
    w = omega_max**q / sigma.reshape(len(sigma), -1)
    p = identified.poles / omega_max
    R = identified.by_channel / omega_max
    line = 2j * np.pi * frf.frequency[keep] / omega_max
    line, w = affordable(line, w, p)
    F, second = linear(line, p, q), basis(line, p, q, 2)
    known = [_channel(w[:, c, None], F, _moved(second, R[:, c])) for c in range(w.shape[1])]
    information = np.linalg.pinv(sum(own for _, _, own in known), hermitian=True)
    value, vector = np.linalg.eigh(information)
    root = vector * np.sqrt(np.maximum(value, 0.0))
    columns = _equalised_columns(s / omega_max, p, q, identified.moved)
    own, common = [], []
    for c, (triangle, tied, _) in enumerate(known):
        x = np.concatenate([_pairs(R[:, c]), identified.lower.ravel()[c : c + 1] / omega_max**2,
                            identified.upper.ravel()[c : c + 1]])  # fmt: skip
        H = columns @ x
        own.append(solve_triangular(triangle, columns.T, trans="T") / H)
        slopes = _equalised_slopes(s / omega_max, p, R[:, c], q, identified.moved).T
        common.append(root.T @ (slopes / H - tied.T @ own[-1]))
    shape = len(s), *identified.lower.shape
    local, shared = (np.stack(z, axis=-1).reshape(-1, *shape) for z in (own, common))
    return local, shared


def equalised_noise(
    identified: Identified, frf: FRF, s: np.ndarray, use: np.ndarray, averages: int = 1
) -> np.ndarray:
    """E|Δ log10 H|² of the equalised response (n_s, n_out, n_in): all columns of its error."""
    columns = equalised_error(identified, frf, s, use, averages)
    variance = sum((np.abs(z) ** 2).sum(axis=0) for z in columns)
    return np.asarray(variance / LN10**2)


def sample_noise(identified: Identified, frf: FRF, s: np.ndarray) -> np.ndarray:
    """Standard deviation of log10 H(s), sample by sample, for a likelihood that sums them (n, ...).

    :func:`equalised_noise` is smaller, because it uses all lines of the modes for each sample. Its
    noise is correlated between neighbours, and a sum over samples would count it many times. Here
    a sample uses only the lines within the half-bandwidth of a mode, π ζ f / Δf of them.
    """
    sd = np.sqrt(frf_variance(frf) / np.maximum(np.abs(frf.values) ** 2, 1e-300))
    f, own = s.imag / (2 * np.pi), frf.frequency
    near = np.clip(np.searchsorted(own, f), 0, len(own) - 1)
    lines = np.pi * np.median(identified.damping) * f / np.median(np.diff(own))
    per_line = np.minimum(sd[near], 1.0) * max(identified.chi, 1.0)
    return per_line / np.sqrt(np.maximum(lines, 1.0))[:, None, None] / LN10


def _channel(
    w: np.ndarray, F: np.ndarray, G: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R of the weighted F, QᵀG, and the information in G beyond F: Gᵀ(I - QQᵀ)G."""
    Q, root = np.linalg.qr(stacked(w * F))
    G = stacked(w * G)
    tied = Q.T @ G
    rest = G - Q @ tied
    return root, tied, rest.T @ rest


def _pairs(z: np.ndarray) -> np.ndarray:
    """Real coefficients (2 r,) of complex z (r,) in the columns of :func:`basis`."""
    return np.stack([z.real, z.imag], axis=-1).ravel()


def _taken(columns: np.ndarray, z: np.ndarray) -> np.ndarray:
    """z_r times each pole's term and its conjugate, from the columns of :func:`basis` (n, r)."""
    return columns[:, 0::2] * z.real + columns[:, 1::2] * z.imag


def _moved(second: np.ndarray, R: np.ndarray) -> np.ndarray:
    """∂H/∂(Re p, Im p) of every pole (n_f, 2 r), R/(s-p)² and iR/(s-p)²."""
    return np.stack([_taken(second, R), _taken(second, 1j * R)], -1).reshape(len(second), -1)


def _equalised_columns(s: np.ndarray, p: np.ndarray, q: int, near: np.ndarray) -> np.ndarray:
    """The linear columns with near poles at i|p|, their residue times Im p/|p| (n_s, 2 r + 2)."""
    at, share = np.where(near, 1j * np.abs(p), p), np.where(near, p.imag / np.abs(p), 1.0)
    first = basis(s, at, q) * np.repeat(share, 2)
    return np.concatenate([first, residual_terms(s, q)], axis=1)


def _equalised_slopes(
    s: np.ndarray, p: np.ndarray, R: np.ndarray, q: int, near: np.ndarray
) -> np.ndarray:
    """∂H_X/∂(Re p, Im p) of every pole (n_s, 2 r): through m = |p| and through f = Im p/m.

    For a pole that is not moved, the slope is ∂H/∂p.
    """
    m, a, b = np.abs(p), p.real, p.imag
    by_f = _taken(basis(s, 1j * m, q), R)
    by_m = _taken(basis(s, 1j * m, q, 2), 1j * R * b / m)
    slopes = [by_m * (a / m) - by_f * (a * b / m**3), by_m * (b / m) + by_f * (a**2 / m**3)]
    there = np.stack(slopes, -1).reshape(len(s), -1)
    return np.where(np.repeat(near, 2), there, _moved(basis(s, p, q, 2), R))
