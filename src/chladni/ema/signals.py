"""From time histories to FRFs: windows, averages, H1, H2, Hv, coherence and variance.

Bendat and Piersol (2010), Random Data, chapters 7 and 9; Rocklin, Crowley and Vold (1985), IMAC
III (Hv). Spectra are averaged over blocks: hits, bursts, or overlapping stretches of one record.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..dynamics.frf import FRF, Quantity
from ..errors import LabelError, ShapeError

Estimator = Literal["H1", "H2", "Hv"]


def window(name: str, n: int, decay: float = 0.01) -> np.ndarray:
    """Window of n samples: "rectangular", "hann" or "exponential" (falls to ``decay``).

    An exponential window adds the same damping to every mode, Δσ = -ln(decay) / T [1/s]; it is
    taken off identified poles again by p + Δσ.
    """
    t = np.arange(n) / n
    shapes = {
        "rectangular": np.ones(n),
        "hann": 0.5 - 0.5 * np.cos(2 * np.pi * t),
        "exponential": decay**t,
    }
    if name not in shapes:
        raise LabelError(f"no window {name!r}; there are {', '.join(shapes)}")
    return shapes[name]


@dataclass(frozen=True, eq=False)
class Spectra:
    """Averaged auto and cross spectra, up to one common factor."""

    frequency: np.ndarray  # (n_f,) Hz
    ff: np.ndarray  # (n_f, n_in, n_in) Σ F Fᴴ / n
    yf: np.ndarray  # (n_f, n_out, n_in) Σ Y Fᴴ / n
    yy: np.ndarray  # (n_f, n_out) Σ |Y|² / n
    averages: float  # independent averages


def spectra(
    force: np.ndarray,
    response: np.ndarray,
    rate: float,
    shape: str | np.ndarray = "rectangular",
    overlap: float = 0.0,
) -> Spectra:
    """Spectra over blocks.

    Parameters
    ----------
    force : (blocks, n_in, n)
    response : (blocks, n_out, n)
    rate : samples per second
    shape : window, by name or as samples
    overlap : of the blocks, for the count of independent averages (Welch 1967)
    """
    if force.ndim != 3 or response.ndim != 3 or force.shape[::2] != response.shape[::2]:
        raise ShapeError(
            f"force {force.shape} and response {response.shape} are (blocks, channels, samples) "
            "with the same blocks and samples"
        )
    b, _, n = force.shape
    w = window(shape, n) if isinstance(shape, str) else np.asarray(shape)
    F, Y = np.fft.rfft(w * force), np.fft.rfft(w * response)
    return Spectra(
        np.fft.rfftfreq(n, 1 / rate),
        np.einsum("bif,bjf->fij", F, F.conj()) / b,
        np.einsum("bof,bjf->foj", Y, F.conj()) / b,
        (np.abs(Y) ** 2).mean(axis=0).T,
        _independent(b, w, overlap),
    )


def _independent(b: int, w: np.ndarray, overlap: float) -> float:
    """Worth b / (1 + 2 Σ_k (1 - k/b) ρ_k²), ρ_k the correlation of windows k steps apart."""
    n, step = len(w), max(1, round(len(w) * (1 - overlap)))
    total = 1.0
    for k in range(1, b):
        if k * step >= n:
            break
        rho = float(w[k * step :] @ w[: n - k * step]) / float(w @ w)
        total += 2 * (1 - k / b) * rho**2
    return b / total


def estimated(
    s: Spectra,
    outputs: Sequence[str],
    inputs: Sequence[str],
    quantity: Quantity = "accelerance",
    estimator: Estimator = "H1",
) -> FRF:
    """FRF with coherence and, from two averages more than inputs on, variance.

    - H1 = S_yf S_ff⁻¹: noise at the response averages out;
    - H2 = S_yy / S_fy (one input): noise at the force averages out;
    - Hv: total least squares, noise at both (inputs and outputs on one scale).

    The coherence is the multiple one, γ² = S_yf S_ff⁻¹ S_fy / S_yy. The variance is
    E|ΔH|² = (1-γ²) S_yy [S_ff⁻¹]_jj / (n - n_in) (Bendat and Piersol 2010, eq. 9.90).
    """
    n_in = s.ff.shape[1]
    inverse = np.linalg.pinv(s.ff, hermitian=True)
    H1 = s.yf @ inverse
    explained = np.einsum("foj,foj->fo", H1, s.yf.conj()).real
    gamma = np.clip(explained / np.maximum(s.yy, 1e-300), 0.0, 1.0)
    H = {"H1": lambda: H1, "H2": lambda: _H2(s), "Hv": lambda: _Hv(s)}[estimator]()
    freedom = s.averages - n_in
    diagonal = np.einsum("fjj->fj", inverse).real
    variance = None
    if freedom >= 0.5:
        variance = ((1 - gamma) * s.yy)[:, :, None] * diagonal[:, None, :] / freedom
    coherence = np.repeat(gamma[:, :, None], n_in, axis=2)
    return FRF(
        H, s.frequency, tuple(outputs), tuple(inputs), quantity, variance=variance,
        coherence=coherence if s.averages > n_in else None,
    )  # fmt: skip


def _H2(s: Spectra) -> np.ndarray:
    """S_yy / S_fy, one input."""
    if s.ff.shape[1] != 1:
        raise ShapeError(f"H2 needs one input, there are {s.ff.shape[1]}; use H1 or Hv")
    return s.yy[:, :, None] / s.yf.conj()


def _Hv(s: Spectra) -> np.ndarray:
    """Smallest eigenvector of the joint spectrum of inputs and each output, both scaled to one."""
    n_f, n_out, n_in = s.yf.shape
    H = np.empty((n_f, n_out, n_in), complex)
    force = np.sqrt(np.einsum("fjj->fj", s.ff).real.mean(axis=0))
    for o in range(n_out):
        scale = np.append(1 / force, 1 / np.sqrt(s.yy[:, o].mean()))
        G = np.zeros((n_f, n_in + 1, n_in + 1), complex)
        G[:, :n_in, :n_in] = s.ff
        G[:, n_in, :n_in], G[:, :n_in, n_in] = s.yf[:, o], s.yf[:, o].conj()
        G[:, n_in, n_in] = s.yy[:, o]
        _, V = np.linalg.eigh(scale[:, None] * G * scale)
        v = V[:, :, 0] * scale
        H[:, o] = -(v[:, :n_in] / v[:, n_in:]).conj()
    return H
