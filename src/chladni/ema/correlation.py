"""Correlation of two sets of modes, or of the responses of a model and a recording.

Sources:
Allemang (2003), Sound and Vibration 37(8), 14-23 (MAC, COMAC, FRAC);
Hunt (1992), IMAC X, 66-71 (enhanced COMAC);
Echaniz Granado (2015), section 2.7.2.1 (the deviation δ and Q, eq. 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arguments import checked
from ..dynamics.frf import FRF
from ..errors import LabelError, ShapeError, named

_LN10 = np.log(10.0)


@checked
def mac(phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Modal assurance criterion |φᴴψ|² / (φᴴφ ψᴴψ), every mode of Φ against every mode of Ψ.

    Echaniz Granado (2015), eq. 7, prints the numerator without square and conjugate. That form
    depends on scale and sign of the shapes, so its published values must come from this one.

    Parameters
    ----------
    phi, psi : (n, r), (n, q)   shapes by column, real or complex, any scale

    Returns
    -------
    (r, q) in [0, 1]; 0 where a shape is zero everywhere

    Examples
    --------
    >>> mac(np.eye(2), np.array([[1.0, 1.0], [0.0, 1.0]]))
    array([[1. , 0.5], [0. , 0.5]])
    """
    phi, psi = np.asarray(phi), np.asarray(psi)
    if len(phi) != len(psi):
        raise ShapeError(f"shapes over {len(phi)} and {len(psi)} dofs cannot be compared")
    power = np.outer(_power(phi, 0), _power(psi, 0))
    return _ratio(np.abs(phi.conj().T @ psi) ** 2, power)


def auto_mac(phi: np.ndarray) -> np.ndarray:
    """MAC of a set with itself: off-diagonal entries show modes the sensors cannot separate."""
    return mac(phi, phi)


def _power(x: np.ndarray, axis: int) -> np.ndarray:
    return (np.abs(x) ** 2).sum(axis=axis)


def _ratio(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Quotient above / below, 0 where both vanish; rounding kept inside [0, 1]."""
    safe = np.where(below > 0, below, 1.0)
    return np.clip(np.where(below > 0, above / safe, 0.0), 0.0, 1.0)


def subspace_mac(phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Share of each shape of Φ inside span Ψ, ‖QᴴΦ_r‖² / ‖Φ_r‖² with Ψ = QR (r,).

    Use it for close modes: the shapes of a cluster may mix, but the space that they span is kept.

    >>> subspace_mac(np.array([[1.0], [1.0]]), np.eye(2))
    array([1.])
    """
    if len(phi) != len(psi):
        raise ShapeError(f"shapes over {len(phi)} and {len(psi)} dofs cannot be compared")
    Q, _ = np.linalg.qr(psi)
    return _ratio(_power(Q.conj().T @ phi, 0), _power(phi, 0))


Convention = Literal["allemang", "enhanced"]


def comac(phi: np.ndarray, psi: np.ndarray, convention: Convention = "allemang") -> np.ndarray:
    """Coordinate MAC of every dof over paired modes (n,).

    - ``allemang``: (Σ_r |φ_ir ψ_ir*|)² / (Σ_r |φ_ir|² Σ_r |ψ_ir|²): 1 is perfect; blind to signs;
    - ``enhanced``: Σ_r |φ_ir - ψ_ir|² / (2 n_r) with shapes of largest entry 1 and aligned phase
      (Hunt): 0 is perfect; a wrong sign, gain or swapped channel stands out.

    Parameters
    ----------
    phi, psi : (n, r)   column r of one belongs to column r of the other
    """
    if phi.shape != psi.shape:
        raise ShapeError(f"paired shapes must agree: {phi.shape} against {psi.shape}")
    # the scale that makes ψ the least-squares image of φ, largest |φ| = 1
    phi = phi / np.abs(phi).max(axis=0)
    psi = psi * ((psi.conj() * phi).sum(0) / np.maximum(_power(psi, 0), 1e-300))
    if convention == "allemang":
        return _ratio(np.abs(phi * psi.conj()).sum(1) ** 2, _power(phi, 1) * _power(psi, 1))
    if convention == "enhanced":
        return _power(phi - psi, 1) / (2 * phi.shape[1])
    raise LabelError(f"no convention {convention!r}; there are allemang, enhanced")


def log10(H: np.ndarray) -> np.ndarray:
    """Complex log₁₀ with its phase in ±π / ln 10; numpy's takes six times as long.

    >>> log10(np.array([-100.0 + 0j])) - 1j * np.pi / np.log(10)
    array([2.+0.j])
    """
    out = np.empty(H.shape, complex)
    out.real = np.log(H.real**2 + H.imag**2) / (2 * _LN10)
    out.imag = np.arctan2(H.imag, H.real) / _LN10
    return out


def wrapped(delta: np.ndarray) -> np.ndarray:
    """A complex log₁₀ with its phase wrapped into ±π / ln 10.

    >>> wrapped(np.array([1 + 2j * np.pi / np.log(10)]))
    array([1.+0.j])
    """
    turn = 2 * np.pi / _LN10
    return delta.real + 1j * (delta.imag - turn * np.round(delta.imag / turn))


def deviation(model: FRF, test: FRF) -> np.ndarray:
    """δ = log₁₀(H_A / H_X), complex, phase wrapped (n_f, n_out, n_in); Echaniz Granado 2015, (4).

    Logarithmic, so an anti-resonance counts like a resonance.
    """
    names = [(frf.outputs, frf.inputs, frf.quantity) for frf in (model, test)]
    if names[0] != names[1] or model.values.shape != test.values.shape:
        raise ShapeError(
            f"model ({model.values.shape}, {model.quantity}) and test ({test.values.shape}, "
            f"{test.quantity}) differ in labels, lines or quantity; use FRF.sel and FRF.to first"
        )
    if not np.allclose(model.frequency, test.frequency, rtol=1e-6):
        raise ShapeError("model and test are on different frequencies")
    if not (test.values.all() and model.values.all()):
        alive = np.asarray(test.values.all(axis=(0, 2)) & model.values.all(axis=(0, 2)))
        zero = [test.outputs[k] for k in np.flatnonzero(~alive)]
        raise LabelError(f"a response of exactly zero has no logarithm: leave out {named(zero)}")
    return log10(model.values / test.values)


@dataclass(frozen=True, eq=False)
class Quality:
    """Q = mean |δ|² over channels and lines, and where it comes from."""

    Q: float  # mean |δ|²
    total: float  # Σ |δ|², unnormalised as in Echaniz Granado (2015)
    # magnitude, phase: the shares of Q from |H| (log₁₀) and from the angle
    magnitude: float
    phase: float
    channel: np.ndarray  # (n_out, n_in) mean over lines
    band: np.ndarray  # (n_bands,) mean over the lines of each band
    bands: tuple[tuple[float, float], ...]  # ((low, high), ...) [Hz]


def quality(
    delta: np.ndarray,
    frequency: np.ndarray,
    bands: Sequence[tuple[float, float]] = (),
    weight: np.ndarray | None = None,
) -> Quality:
    """Q = Σ w |δ|² / Σ w, with its decomposition.

    Parameters
    ----------
    delta : (n_f, n_out, n_in) complex
    frequency : (n_f,) Hz
    bands : default: the whole
    weight : (n_f, n_out, n_in), default: ones (zero leaves a line or channel out)
    """
    w = np.ones(delta.shape) if weight is None else np.broadcast_to(weight, delta.shape)
    square = w * np.abs(delta) ** 2
    total = max(float(w.sum()), 1e-300)
    ends = tuple(bands) or ((float(frequency[0]), float(frequency[-1])),)
    inside = [(low <= frequency) & (frequency <= high) for low, high in ends]
    per_band = [square[k].sum() / max(w[k].sum(), 1e-300) for k in inside]
    return Quality(
        Q=float(square.sum() / total),
        total=float(square.sum()),
        magnitude=float((w * delta.real**2).sum() / total),
        phase=float((w * delta.imag**2).sum() / total),
        channel=square.sum(0) / np.maximum(w.sum(0), 1e-300),
        band=np.array(per_band),
        bands=ends,
    )
